// A button that has a file made, and saves it when it arrives.
function render({ model, el }) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "hg-download";
  el.appendChild(button);
  const draw = () => {
    button.textContent = model.get("busy") ? "Preparing …" : model.get("title");
    button.disabled = model.get("busy") || model.get("disabled");
    button.title = model.get("hint");
  };
  button.addEventListener("click", () => model.send({ kind: "make" }));
  const hear = (message, buffers) => {
    if (message.kind !== "file") return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob(buffers, { type: "application/zip" }));
    link.download = message.name;
    document.body.appendChild(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  };
  model.on("msg:custom", hear);
  model.on("change", draw);
  draw();
  return () => { model.off("msg:custom", hear); model.off("change", draw); };
}
export default { render };
