// A slice: where the others cross it, what lies under the pointer, and a click that moves them.
const SVG = "http://www.w3.org/2000/svg";
const NEAR = 0.03;  // of the picture's width: how close to a contour its distance is told

const raw = (view) => view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength);

function within(x, y, t, i) {
  const side = (a, b) => (t[b] - t[a]) * (y - t[a + 1]) - (t[b + 1] - t[a + 1]) * (x - t[a]);
  const s = [side(i, i + 2), side(i + 2, i + 4), side(i + 4, i)];
  return s.every((v) => v >= 0) || s.every((v) => v <= 0);
}

function away(x, y, o, i) {
  const dx = o[i + 2] - o[i], dy = o[i + 3] - o[i + 1], n = dx * dx + dy * dy || 1;
  const share = Math.max(0, Math.min(1, ((x - o[i]) * dx + (y - o[i + 1]) * dy) / n));
  return Math.hypot(x - o[i] - share * dx, y - o[i + 1] - share * dy);
}

function render({ model, el }) {
  const image = document.createElement("img");
  const over = document.createElementNS(SVG, "svg");
  const told = document.createElement("div");
  const box = document.createElement("div");
  box.className = "hg-slice-picture";
  told.className = "hg-readout";
  over.setAttribute("class", "hg-over");
  over.setAttribute("preserveAspectRatio", "none");
  over.setAttribute("aria-hidden", "true");
  box.append(image, over, told);
  el.append(box);
  let address = "";

  function draw() {
    URL.revokeObjectURL(address);
    address = URL.createObjectURL(new Blob([raw(model.get("picture"))], { type: "image/png" }));
    image.src = address;
    image.alt = model.get("about");
  }
  function cross() {
    over.replaceChildren();
    const [x0, x1, y0, y1] = model.get("extent"), at = model.get("cross");
    over.setAttribute("viewBox", `0 0 ${x1 - x0} ${y1 - y0}`);
    if (!at.length) return;
    const x = at[0] - x0, y = y1 - at[1];
    for (const [a, b, c, d] of [[x, 0, x, y1 - y0], [0, y, x1 - x0, y]]) {
      const line = document.createElementNS(SVG, "line");
      Object.entries({ x1: a, y1: b, x2: c, y2: d, class: "hg-cross" }).forEach(([k, v]) => line.setAttribute(k, v));
      over.append(line);
    }
  }
  function place(event) {
    const [x0, x1, y0, y1] = model.get("extent"), seen = image.getBoundingClientRect();
    return [x0 + ((event.clientX - seen.left) / seen.width) * (x1 - x0),
            y1 - ((event.clientY - seen.top) / seen.height) * (y1 - y0)];
  }
  function under(x, y) {
    const parts = [], [x0, x1] = model.get("extent");
    const t = new Float32Array(raw(model.get("triangles"))), o = new Float32Array(raw(model.get("outline")));
    for (let i = 0; i < t.length; i += 6) {
      if (!within(x, y, t, i)) continue;
      parts.push(`element ${new Uint32Array(raw(model.get("element")))[i / 6] + 1}`);
      break;
    }
    let best = NEAR * (x1 - x0), nearest = -1;
    for (let i = 0; i < o.length; i += 4) {
      const d = away(x, y, o, i);
      if (d < best) { best = d; nearest = i / 4; }
    }
    if (nearest >= 0) parts.push(`${new Float32Array(raw(model.get("error")))[nearest].toFixed(2)} mm from the mask`);
    return parts.join(" · ");
  }
  box.addEventListener("pointermove", (event) => { told.textContent = under(...place(event)); });
  box.addEventListener("pointerleave", () => { told.textContent = ""; });
  box.addEventListener("click", (event) => {
    model.set("pointed", place(event));
    model.save_changes();
  });
  const listeners = { "change:picture": draw, "change:about": draw, "change:cross": cross, "change:extent": cross };
  for (const [name, act] of Object.entries(listeners)) model.on(name, act);
  draw();
  cross();
  return () => {
    URL.revokeObjectURL(address);
    for (const [name, act] of Object.entries(listeners)) model.off(name, act);
  };
}
export default { render };
