// A drop zone that sends files, one after another, in pieces, each when the last one has arrived.
function render({ model, el }) {
  const zone = document.createElement("label");
  zone.className = model.get("zone");
  zone.innerHTML =
    '<input type="file"><span class="hg-drop-text"></span><progress max="1" hidden></progress>';
  const [input, text, bar] = zone.children;
  input.setAttribute("aria-label", model.get("name"));
  el.appendChild(zone);
  let file = null;
  let files = [];
  let first = true;

  const idle = () => {
    files = [];
    bar.hidden = true;
    input.disabled = false;
    text.innerHTML = `<b>${model.get("title")}</b> or drop ${several() ? "them" : "it"} here`;
  };
  const megabytes = (n) => (n / 1048576).toFixed(n < 1048576 ? 2 : n < 10485760 ? 1 : 0) + " MB";
  const several = () => model.get("several");
  const begin = (chosen) => {
    if (!chosen.length || input.disabled) return;
    files = [...chosen].slice(0, several() ? undefined : 1);
    first = true;
    send();
  };
  const send = () => {
    file = files.shift();
    if (file.size > model.get("limit")) {
      files = [];
      model.send({ kind: "refused", name: file.name, size: file.size });
      return;
    }
    input.disabled = true;
    bar.hidden = false;
    bar.value = 0;
    text.textContent = `Sending ${file.name}, ${megabytes(file.size)}`;
    model.send({ kind: "begin", name: file.name, size: file.size, first, left: files.length });
    first = false;
  };
  const next = async (offset) => {
    let piece;
    try {
      piece = await file.slice(offset, offset + model.get("piece")).arrayBuffer();
    } catch {  // a folder, or a file that went meanwhile
      files = [];
      model.send({ kind: "unread", name: file.name });
      return;
    }
    bar.value = file.size ? offset / file.size : 1;
    model.send({ kind: "piece", offset }, undefined, [piece]);
  };

  input.addEventListener("change", () => { begin([...input.files]); input.value = ""; });
  for (const name of ["dragenter", "dragover"])
    zone.addEventListener(name, (e) => { e.preventDefault(); zone.classList.add("hg-over"); });
  for (const name of ["dragleave", "drop"])
    zone.addEventListener(name, (e) => { e.preventDefault(); zone.classList.remove("hg-over"); });
  zone.addEventListener("drop", (e) => begin([...e.dataTransfer.files]));
  const hear = (message) => {
    if (message.kind === "next") next(message.offset);
    if (message.kind === "more") send();
    if (message.kind === "end") idle();
  };
  model.on("msg:custom", hear);
  input.multiple = several();
  idle();
  model.send({ kind: "shown" });
  return () => model.off("msg:custom", hear);
}
export default { render };
