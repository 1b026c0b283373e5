// What lies over the 3-D view: buttons, what is under the pointer, a ruler, and the body's axes.
const SVG = "http://www.w3.org/2000/svg";
const ARM = 26, BEAT = 1400;  // pixels of an axis; ms from one state to the next

function drawn(parent, tag, attributes, text) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  parent.append(node);
  return node;
}

function element(tag, attributes, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

// A point of the heart in words: what was measured there.
function told(hit, model) {
  const { made, corners, weights, point } = hit, parts = [];
  const mixed = (values) => corners.reduce((sum, c, k) => sum + weights[k] * values[c], 0);
  if (hit.part === "mask") parts.push("mask");
  if (made.element) {
    const number = made.element[corners[0]];
    parts.push(`element ${number + 1}`);
    const quality = model.get("quality")[number];
    if (quality !== undefined) parts.push(`Q ${quality.toFixed(2)}`);
  }
  for (const [name, [title, unit]] of Object.entries(model.get("measures"))) {
    const value = made.values[name] && mixed(made.values[name]);
    if (Number.isFinite(value)) parts.push(`${title} ${value.toFixed(value < 1 ? 2 : 1)} ${unit}`.trim());
  }
  const frame = model.get("frame");
  if (frame.length) {
    const world = [0, 1, 2].map((i) => dot(frame[i], point) + frame[i][3]);
    parts.push(`L ${world[0].toFixed(1)} P ${world[1].toFixed(1)} S ${world[2].toFixed(1)} mm`);
  }
  return parts.join(" · ");
}

class Tools {
  constructor(model, heart, bar, over, readout) {
    Object.assign(this, { model, heart, bar, over, readout, ruled: [], measuring: false });
    heart.onCamera = () => this.schedule();
    heart.onHover = (hit) => { readout.textContent = hit ? told(hit, model) : this.rest; };
    heart.onClick = (hit) => this.clicked(hit);
    this.build();
  }

  wait = "the heart is being drawn …";
  rest = "drag: turn · wheel: zoom · shift + drag: move";

  build() {
    const { model, heart } = this;
    const from = element("select", { "aria-label": "Look from", title: "Look from a named side" });
    this.views = () => from.replaceChildren(
      element("option", { value: "" }, "Look from …"),
      ...Object.keys(model.get("views")).map((name) => element("option", { value: name }, name)));
    from.addEventListener("change", () => {
      const view = model.get("views")[from.value];
      if (view) { heart.look(...view); heart.render(); }
      from.value = "";
    });
    this.views();
    const parts = [["mesh", "Mesh"], ["edges", "Lines"], ["mask", "Mask"]].map(([name, title]) =>
      this.toggle(title, `Show or hide: ${title.toLowerCase()}`, true, (on) => heart.show(name, on)));
    this.ruler = this.toggle("Ruler", "Measure: click two points of the heart", false, (on) => {
      this.measuring = on;
      this.ruled = [];
      this.schedule();
    });
    this.play = this.toggle("Play", "Move the mesh through its stages or states", false, (on) => this.moving(on));
    const reset = this.button("Reset view", "Look from the usual place, all in sight", () => {
      const { direction, up } = model.get("camera");
      heart.look(direction, up);
      heart.render();
    });
    this.facing = this.button("Cut here", "Cut the heart open across the line of sight", () => {
      model.send({ kind: "facing", direction: heart.eye.back });
    });
    const save = this.button("Save picture", "Save what you see as PNG", async () => {
      const link = element("a", { download: "heartgen.png", href: await heart.picture() });
      link.click();
    });
    const full = this.button("Full screen", "Fill the screen with the view; Esc ends it", () => {
      document.fullscreenElement ? document.exitFullscreen() : heart.stage.parentElement.requestFullscreen();
    });
    this.bar.append(from, ...parts, this.ruler, this.facing, this.play, reset, full, save);
    this.readout.textContent = this.wait;
    heart.onDrawn = () => {
      if (this.readout.textContent === this.wait) this.readout.textContent = this.rest;
      this.schedule();
    };
    this.offer();
  }

  // Only what is of use is offered.
  offer() {
    this.play.hidden = !this.model.get("can_play");
    this.facing.hidden = !this.model.get("can_cut");
  }

  button(title, hint, act) {
    const made = element("button", { type: "button", title: hint }, title);
    made.addEventListener("click", act);
    return made;
  }

  toggle(title, hint, on, act) {
    const made = this.button(title, hint, () => this.press(made, made.getAttribute("aria-pressed") !== "true"));
    made.setAttribute("aria-pressed", on);
    made.act = act;
    return made;
  }

  press(toggle, on) {
    toggle.setAttribute("aria-pressed", on);
    toggle.act(on);
  }

  clicked(hit) {
    if (!hit) return;
    if (this.measuring) {
      this.ruled = this.ruled.length === 2 ? [hit.point] : [...this.ruled, hit.point];
      this.schedule();
      return;
    }
    this.model.set("cursor", hit.point);
    this.model.save_changes();
    this.schedule();
  }

  schedule() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.overlay(); });
  }

  // Lines over the picture, where the camera sees them now.
  overlay() {
    const { over, heart } = this;
    over.replaceChildren();
    if (!heart.scene || heart.shown < 0) return;
    this.axes();
    const cursor = this.model.get("cursor");
    const at = cursor.length && heart.place(cursor);
    if (at) {
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
        drawn(over, "line", { x1: at[0] + 4 * dx, y1: at[1] + 4 * dy, x2: at[0] + 11 * dx, y2: at[1] + 11 * dy, class: "hg-mark" });
      }
    }
    const ends = this.ruled.map((point) => heart.place(point)).filter(Boolean);
    ends.forEach(([cx, cy]) => drawn(over, "circle", { cx, cy, r: 4, class: "hg-end" }));
    if (ends.length === 2) {
      const [[x1, y1], [x2, y2]] = ends;
      drawn(over, "line", { x1, y1, x2, y2, class: "hg-ruler" });
      const text = `${distance(...this.ruled).toFixed(1)} mm`;
      drawn(over, "text", { x: (x1 + x2) / 2 + 8, y: (y1 + y2) / 2 - 6, class: "hg-length" }, text);
    }
  }

  // Towards left, posterior and superior of the body.
  axes() {
    const frame = this.model.get("frame");
    if (!frame.length) return;
    const [, height] = this.heart.size, eye = this.heart.eye, x0 = ARM + 16, y0 = height - ARM - 16;
    const arms = ["L", "P", "S"].map((name, i) => {
      const towards = frame[i].slice(0, 3);  // a row of the rotation: the world's axis in the scene
      return { name, x: dot(towards, eye.right), y: -dot(towards, eye.up), z: dot(towards, eye.back) };
    }).sort((a, b) => a.z - b.z);
    for (const { name, x, y, z } of arms) {
      const style = `opacity: ${z < 0 ? 0.45 : 1}`;
      drawn(this.over, "line", { x1: x0, y1: y0, x2: x0 + ARM * x, y2: y0 + ARM * y, class: `hg-axis-${name}`, style });
      drawn(this.over, "text", { x: x0 + (ARM + 9) * x, y: y0 + (ARM + 9) * y + 4, class: "hg-letter", style }, name);
    }
  }

  moving(on) {
    this.playing = on;
    if (!on) {
      this.readout.textContent = this.rest;
      this.heart.draw();
      return;
    }
    if (this.model.get("motion").length) this.start();
    else this.model.send({ kind: "play" });
  }

  start() {
    const states = this.model.get("motion").map((state) => ({
      name: state.name,
      mesh: new Float32Array(bytes(state.mesh)), edges: new Float32Array(bytes(state.edges)),
    }));
    if (!this.playing || states.length < 2) return;
    const last = states.length - 1;
    let began;  // of the first picture: its time may lie before that of the event that asked for it
    const step = (now) => {
      if (!this.playing || !this.heart.scene) return;
      began ??= now;
      const around = ((now - began) / BEAT) % (2 * last);
      const time = around > last ? 2 * last - around : around;  // there and back
      const k = Math.min(Math.floor(time), last - 1), share = time - k;
      const smooth = share * share * (3 - 2 * share);
      for (const name of ["mesh", "edges"]) {
        const [a, b] = [states[k][name], states[k + 1][name]];
        this.heart.move(name, a.map((value, i) => value + smooth * (b[i] - value)));
      }
      this.readout.textContent = states[share < 0.5 ? k : k + 1].name;
      this.heart.render();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}

function render({ model, el }) {
  const frame = element("iframe", { title: "The heart in 3-D: drag to turn, wheel to zoom", class: "hg-frame", scrolling: "no" });
  const over = document.createElementNS(SVG, "svg");
  over.setAttribute("class", "hg-over");
  over.setAttribute("aria-hidden", "true");
  const readout = element("div", { class: "hg-readout", "aria-live": "off" });
  const stage = element("div", { class: "hg-stage" }, frame, over, readout);
  const bar = element("div", { class: "hg-tools", role: "toolbar", "aria-label": "Tools of the 3-D view" });
  el.classList.add("hg-scene");
  el.append(bar, stage);
  const heart = new Heart(model, stage, frame), tools = new Tools(model, heart, bar, over, readout);
  heart.onNotice = (sentence) => { readout.textContent = sentence; };
  frame.addEventListener("load", () => { if (frame.srcdoc) heart.attach(); });
  unpacked(model.get("page")).then((page) => { frame.srcdoc = page; });
  const sizes = new ResizeObserver(() => heart.resized());
  sizes.observe(stage);
  const sights = new IntersectionObserver((seen) => {
    if (!seen.some((each) => each.isIntersecting)) return;
    if (heart.lost) { heart.lost = false; frame.srcdoc = frame.srcdoc; } else heart.render();
  });
  sights.observe(stage);
  const listeners = {
    "change:revision": () => { tools.playing ? tools.press(tools.play, false) : heart.draw(); },
    "change:camera": () => heart.draw(),
    "change:cursor": () => tools.schedule(),
    "change:views": () => tools.views(),
    "change:motion": () => tools.start(),
    "change:can_play": () => tools.offer(),
    "change:can_cut": () => tools.offer(),
  };
  for (const [name, act] of Object.entries(listeners)) model.on(name, act);
  model.send({ kind: "mounted", revision: model.get("revision") });
  return () => {
    heart.ticket++;
    sizes.disconnect();
    sights.disconnect();
    for (const [name, act] of Object.entries(listeners)) model.off(name, act);
  };
}
export default { render };
