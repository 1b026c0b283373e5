// A drop zone that sends a file in pieces, each when the last one has arrived.
function render({ model, el }) {
  const zone = document.createElement("label");
  zone.className = model.get("zone");
  zone.innerHTML =
    '<input type="file"><span class="hg-drop-text"></span><progress max="1" hidden></progress>';
  const [input, text, bar] = zone.children;
  input.setAttribute("aria-label", model.get("name"));
  el.appendChild(zone);
  let file = null;

  const idle = () => {
    bar.hidden = true;
    input.disabled = false;
    text.innerHTML = `<b>${model.get("title")}</b> or drop it here`;
  };
  const megabytes = (n) => (n / 1048576).toFixed(n < 1048576 ? 2 : n < 10485760 ? 1 : 0) + " MB";
  const begin = (chosen) => {
    if (!chosen || input.disabled) return;
    file = chosen;
    if (file.size > model.get("limit")) {
      model.send({ kind: "refused", name: file.name, size: file.size });
      return;
    }
    input.disabled = true;
    bar.hidden = false;
    bar.value = 0;
    text.textContent = `Sending ${file.name}, ${megabytes(file.size)}`;
    model.send({ kind: "begin", name: file.name, size: file.size });
  };
  const next = async (offset) => {
    const piece = await file.slice(offset, offset + model.get("piece")).arrayBuffer();
    bar.value = file.size ? offset / file.size : 1;
    model.send({ kind: "piece", offset }, undefined, [piece]);
  };

  input.addEventListener("change", () => { begin(input.files[0]); input.value = ""; });
  for (const name of ["dragenter", "dragover"])
    zone.addEventListener(name, (e) => { e.preventDefault(); zone.classList.add("hg-over"); });
  for (const name of ["dragleave", "drop"])
    zone.addEventListener(name, (e) => { e.preventDefault(); zone.classList.remove("hg-over"); });
  zone.addEventListener("drop", (e) => begin(e.dataTransfer.files[0]));
  const hear = (message) => {
    if (message.kind === "next") next(message.offset);
    if (message.kind === "end") idle();
  };
  model.on("msg:custom", hear);
  idle();
  model.send({ kind: "shown" });
  return () => model.off("msg:custom", hear);
}
export default { render };
