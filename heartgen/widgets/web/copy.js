// A button that copies a text; without https the clipboard is reached through a selection.
async function copy(text) {
  if (navigator.clipboard && window.isSecureContext) return navigator.clipboard.writeText(text);
  const area = document.createElement("textarea");
  area.value = text;
  area.style.position = "fixed";
  area.style.opacity = "0";
  document.body.appendChild(area);
  area.select();
  const done = document.execCommand("copy");
  area.remove();
  if (!done) throw new Error("refused");
}

function render({ model, el }) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "jupyter-button hg-copy";
  button.title = "Copy these lines";
  el.appendChild(button);
  const draw = () => {
    button.textContent = "Copy";
    button.disabled = !model.get("text");
  };
  button.addEventListener("click", async () => {
    try {
      await copy(model.get("text"));
      button.textContent = "Copied";
    } catch {
      button.textContent = "Select the lines and press Ctrl-C";
    }
    setTimeout(draw, 2000);
  });
  model.on("change", draw);
  draw();
  return () => model.off("change", draw);
}
export default { render };
