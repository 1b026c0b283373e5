// Accuracy against quality: curves of points that can be clicked or reached by keyboard.
const NS = "http://www.w3.org/2000/svg";
const W = 560, H = 330, LEFT = 62, RIGHT = 20, TOP = 18, BOTTOM = 50;

function add(parent, tag, attributes, text) {
  const node = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  parent.appendChild(node);
  return node;
}

function steps(low, high) {
  const raw = (high - low) / 4;
  const ten = 10 ** Math.floor(Math.log10(raw));
  const size = [1, 2, 5, 10].map((k) => k * ten).find((s) => s >= raw);
  const ticks = [];
  for (let t = Math.ceil(low / size) * size; t <= high + 1e-9; t += size) ticks.push(t);
  return [ticks, Math.max(0, -Math.floor(Math.log10(size) + 1e-9))];
}

function render({ model, el }) {
  const draw = () => {
    el.replaceChildren();
    const points = model.get("points");
    if (!points.length) return;
    const threshold = model.get("threshold");
    const svg = add(el, "svg", {
      viewBox: `0 0 ${W} ${H}`, class: "hg-tradeoff", role: "group",
      "aria-label": "Fitting error against element quality",
    });
    const errors = points.map((p) => p.error);
    const room = Math.max(0.15 * (Math.max(...errors) - Math.min(...errors)), 0.2 * Math.max(...errors));
    const x0 = Math.max(0, Math.min(...errors) - room), x1 = Math.max(...errors) + room;
    const y0 = Math.min(threshold - 0.05, ...points.map((p) => p.quality - 0.05));
    const y1 = Math.max(...points.map((p) => p.quality)) + 0.06;
    const X = (v) => LEFT + ((v - x0) / (x1 - x0)) * (W - LEFT - RIGHT);
    const Y = (v) => H - BOTTOM - ((v - y0) / (y1 - y0)) * (H - TOP - BOTTOM);
    const [xs, xd] = steps(x0, x1), [ys, yd] = steps(y0, y1);
    for (const t of xs) {
      add(svg, "line", { x1: X(t), x2: X(t), y1: TOP, y2: H - BOTTOM, class: "hg-grid" });
      add(svg, "text", { x: X(t), y: H - BOTTOM + 17, class: "hg-tick", "text-anchor": "middle" }, t.toFixed(xd));
    }
    for (const t of ys) {
      add(svg, "line", { x1: LEFT, x2: W - RIGHT, y1: Y(t), y2: Y(t), class: "hg-grid" });
      add(svg, "text", { x: LEFT - 8, y: Y(t) + 4, class: "hg-tick", "text-anchor": "end" }, t.toFixed(yd));
    }
    add(svg, "text", { x: (LEFT + W - RIGHT) / 2, y: H - 10, class: "hg-axis", "text-anchor": "middle" }, "mean fitting error (mm)");
    add(svg, "text", { transform: `translate(15 ${(TOP + H - BOTTOM) / 2}) rotate(-90)`, class: "hg-axis", "text-anchor": "middle" }, "mean quality Q");
    add(svg, "line", { x1: LEFT, x2: W - RIGHT, y1: Y(threshold), y2: Y(threshold), class: "hg-threshold" });
    add(svg, "text", { x: W - RIGHT - 4, y: Y(threshold) - 6, class: "hg-limit", "text-anchor": "end" }, `least quality of a success, ${threshold}`);
    const curves = model.get("curves");
    const colors = curves.map((c) => c.color);
    curves.forEach((curve, n) => {
      const own = points.filter((p) => p.curve === n);
      const line = add(svg, "polyline", { points: own.map((p) => `${X(p.error)},${Y(p.quality)}`).join(" "), class: "hg-line" });
      if (curves.length > 1) line.style.stroke = curve.color;
    });
    for (const p of points) {
      const chosen = p.id === model.get("selected");
      const group = add(svg, "g", {
        class: `hg-point${chosen ? " hg-chosen" : ""}`, tabindex: 0, role: "button", "aria-pressed": chosen,
        "aria-label": `${p.about}: error ${p.error.toFixed(3)} mm, quality ${p.quality.toFixed(3)}. Show this mesh.`,
      });
      add(group, "title", {}, `${p.about}: error ${p.error.toFixed(3)} mm, Q ${p.quality.toFixed(3)}; click to show`);
      const circle = add(group, "circle", { cx: X(p.error), cy: Y(p.quality), r: 11 });
      if (curves.length > 1) {
        circle.style.stroke = colors[p.curve];
        if (chosen) circle.style.fill = colors[p.curve];
      }
      add(group, "text", { x: X(p.error), y: Y(p.quality) + 4.5, "text-anchor": "middle" }, p.label);
      const choose = () => { model.set("selected", p.id); model.save_changes(); };
      group.addEventListener("click", choose);
      group.addEventListener("keydown", (e) => {
        if (e.key === "Enter" || e.key === " ") { e.preventDefault(); choose(); }
      });
    }
    if (curves.length > 1) {
      const key = document.createElement("ul");
      key.className = "hg-curves";
      for (const curve of curves) {
        const item = document.createElement("li");
        const mark = document.createElement("i");
        mark.style.background = curve.color;
        item.append(mark, curve.name);
        key.appendChild(item);
      }
      el.appendChild(key);
    }
  };
  model.on("change", draw);
  draw();
  return () => model.off("change", draw);
}
export default { render };
