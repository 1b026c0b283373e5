// The 3-D view: vtk.js in a frame shows what the model holds, and says which state of it is shown.
const PARTS = ["mesh", "edges", "mask"];
const ROOM = 1.04;  // over the distance at which the heart touches the edges of the picture
const CLICK = 4;  // pixels that a pointer may move between press and release
const STARTING = 40, PATIENCE = 30000;  // ms between two looks for vtk.js, and after which it is missed

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const bytes = (view) => view ? view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength) : new ArrayBuffer(0);

async function unpacked(packed) {
  const stream = new Blob([bytes(packed)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return await new Response(stream).text();
}

function part(model, name) {
  const shape = model.get(name), colors = new Uint8Array(bytes(model.get(`${name}_colors`)));
  const points = new Float32Array(bytes(shape.points));
  const short = new Int8Array(bytes(shape.normals));
  return {
    points, colors, corners: new Uint32Array(bytes(shape.corners)),
    normals: Float32Array.from(short, (value) => value / 127),
    element: shape.element && new Uint32Array(bytes(shape.element)),
    values: Object.fromEntries(
      Object.entries(shape.values ?? {}).map(([key, value]) => [key, new Float32Array(bytes(value))])),
  };
}

class Heart {
  constructor(model, stage, frame) {
    Object.assign(this, { model, stage, frame, parts: {}, hidden: new Set(), shown: -1, placed: -1 });
    this.ticket = 0;
    this.onCamera = () => {};
    this.onDrawn = () => {};
    this.onNotice = () => {};
  }

  // vtk.js is in the frame anew each time the frame is put into a document.
  async attach() {
    const ticket = ++this.ticket, end = Date.now() + PATIENCE;
    this.scene = null;
    while (ticket === this.ticket) {
      const inside = this.frame.contentWindow;
      const window3d = inside?.global?.renderWindow;
      const renderer = window3d?.getRenderers().find((r) => r.getActors().length === PARTS.length);
      if (renderer) {
        this.scene = { inside, window3d, renderer, view: window3d.getViews()[0] };
        break;
      }
      if (Date.now() > end) {
        this.onNotice("The 3-D view does not start: this browser may have no WebGL.");
        return;
      }
      await pause(STARTING);
    }
    if (!this.scene) return;
    this.camera.onModified(() => this.onCamera());
    this.listen();
    this.shown = this.placed = -1;
    this.touched = false;
    this.draw();
  }

  // Whether there is something to draw on: a frame that was taken out of its document is empty.
  get alive() {
    return this.scene && this.frame.isConnected && this.scene.inside === this.frame.contentWindow && this.size[0] > 1;
  }

  get camera() { return this.scene.renderer.getActiveCamera(); }

  get size() {
    const box = this.frame.getBoundingClientRect();
    return [box.width, box.height];
  }

  get eye() { const [w, h] = this.size; return seenBy(this.camera, w / Math.max(h, 1)); }

  // Show what the model holds, in one picture, and say so.
  draw() {
    if (!this.scene) return;
    const revision = this.model.get("revision");
    if (revision === 0) return;
    const { renderer } = this.scene;
    renderer.getActors().forEach((actor, i) => {
      const made = this.parts[PARTS[i]] = part(this.model, PARTS[i]);
      this.fill(actor, made);
      actor.setVisibility(made.points.length > 0 && !this.hidden.has(PARTS[i]));
    });
    const camera = this.model.get("camera");
    if (camera.revision !== this.placed) this.look(camera.direction, camera.up);
    this.placed = camera.revision;
    this.render();
    this.shown = this.stage.dataset.shown = revision;
    this.onDrawn();
    this.model.set("shown", revision);
    this.model.save_changes();
  }

  fill(actor, { points, corners, normals, colors }) {
    const { inside } = this.scene;
    const data = actor.getMapper().getInputData();
    const cells = new inside.Uint32Array((corners.length / 3) * 4);
    for (let t = 0, c = 0; t < corners.length; t += 3) {
      cells[c++] = 3;
      for (let k = 0; k < 3; k++) cells[c++] = corners[t + k];
    }
    const attributes = data.getPointData();
    data.getPoints().setData(new inside.Float32Array(points), 3);
    data.getPolys().setData(cells);
    const n = points.length / 3;
    attributes.getArrayByName("rgba").setData(new inside.Uint8Array(colors), n ? colors.length / n : 3);
    attributes.getNormals().setData(new inside.Float32Array(normals), 3);
    data.modified();
  }

  render() {
    if (!this.alive) return;
    this.scene.renderer.resetCameraClippingRange();
    this.scene.window3d.render();
    this.onCamera();
  }

  // Look at the heart from a direction, as close as it fits.
  look(direction, up) {
    this.toward = { direction, up };
    this.touched = false;
    this.refit();
  }

  refit() {
    if (!this.scene || !this.toward) return;
    const [w, h] = this.size;
    if (w < 2 || h < 2) return;  // hidden: it is done when there is a size
    const clouds = PARTS.map((name) => this.parts[name]?.points ?? []).filter((p) => p.length);
    const half = Math.tan((this.camera.getViewAngle() * Math.PI) / 360);
    const { direction, up } = this.toward;
    const found = fit(clouds, direction, up, half, w / h, ROOM);
    if (!found) return;
    this.camera.set({ focalPoint: found.center, position: found.eye, viewUp: up });
    this.camera.modified();
  }

  resized() {
    if (!this.alive) return;
    this.scene.inside.dispatchEvent(new Event("resize"));
    if (!this.touched) this.refit();
    this.render();
  }

  show(name, visible) {
    visible ? this.hidden.delete(name) : this.hidden.add(name);
    const actor = this.scene?.renderer.getActors()[PARTS.indexOf(name)];
    actor?.setVisibility(visible && this.parts[name].points.length > 0);
    this.render();
  }

  // Move the points of parts without telling them anew: a mesh between two of its states.
  move(name, points) {
    const data = this.scene?.renderer.getActors()[PARTS.indexOf(name)].getMapper().getInputData();
    if (!data) return;
    if (points.length !== this.parts[name].points.length) { this.scene.renderer.getActors()[PARTS.indexOf(name)].setVisibility(false); return; }
    data.getPoints().setData(new this.scene.inside.Float32Array(points), 3);
    data.modified();
  }

  // What lies under a pixel of the frame: of the mesh, or else of the mask.
  pick(x, y) {
    const [w, h] = this.size, eye = this.eye;
    const direction = ray([(2 * x) / w - 1, 1 - (2 * y) / h], eye);
    for (const name of ["mesh", "mask"]) {
      const made = this.parts[name];
      if (!made || !made.corners.length || this.hidden.has(name)) continue;
      const hit = meet(eye.position, direction, made.points, made.corners);
      if (hit) return { ...hit, part: name, made };
    }
    return null;
  }

  // Pixels of the frame at which a point is seen.
  place(point) {
    const [w, h] = this.size, at = project(point, this.eye);
    return at && [((at[0] + 1) * w) / 2, ((1 - at[1]) * h) / 2];
  }

  listen() {
    const page = this.scene.inside.document;
    page.documentElement.style.overflow = "hidden";
    let pressed = null, waiting = false;
    page.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; }, true);
    page.addEventListener("pointerup", (event) => {
      const at = [event.clientX, event.clientY];
      if (pressed && distance([...pressed, 0], [...at, 0]) < CLICK) this.onClick?.(this.pick(...at));
      else this.touched = true;
      pressed = null;
    }, true);
    page.addEventListener("wheel", () => { this.touched = true; }, true);
    page.addEventListener("pointermove", (event) => {
      if (event.buttons || waiting) return;
      waiting = true;
      const at = [event.clientX, event.clientY];
      requestAnimationFrame(() => { waiting = false; this.onHover?.(this.pick(...at)); });
    }, true);
    page.addEventListener("pointerleave", () => this.onHover?.(null), true);
    page.addEventListener("keydown", (event) => {  // shortcuts of the page work in here as well
      this.stage.dispatchEvent(new KeyboardEvent("keydown", { key: event.key, bubbles: true }));
    });
    page.querySelector("canvas")?.addEventListener("webglcontextlost", () => { this.lost = true; });
  }

  async picture() {
    const caught = this.scene.view.captureNextImage("image/png");
    this.scene.window3d.render();
    return await caught;
  }
}
