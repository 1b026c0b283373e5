// Tells the value of the surface under the mouse: of all its points that are drawn there, the nearest.
const NEAR = 7; // pixels from the mouse within which a point is taken
const FRONT = 3; // mm behind the nearest point at which another is hidden by it

function difference(a, b) { return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]; }
function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
function unit(a) { const n = Math.sqrt(dot(a, a)); return a.map((v) => v / n); }

function found(name) {
  for (const renderer of globalThis.global?.renderWindow?.getRenderers() ?? []) {
    for (const actor of renderer.getActors()) {
      const data = actor.getMapper()?.getInputData();
      const values = data?.getPointData()?.getArrayByName(name);
      if (values) return { renderer, points: data.getPoints().getData(), values: values.getData() };
    }
  }
  return null;
}

function valueAt({ renderer, points, values }, x, y, width, height) {
  const camera = renderer.getActiveCamera();
  const eye = camera.getPosition();
  const ahead = unit(difference(camera.getFocalPoint(), eye));
  const right = unit(cross(ahead, camera.getViewUp()));
  const up = cross(right, ahead);
  const scale = height / 2 / Math.tan((camera.getViewAngle() * Math.PI) / 360);
  let best = null, depth = Infinity, away = Infinity;
  for (let i = 0, p = 0; i < values.length; i += 1, p += 3) {
    const d = [points[p] - eye[0], points[p + 1] - eye[1], points[p + 2] - eye[2]];
    const z = dot(d, ahead);
    const off = Math.hypot(width / 2 + (scale * dot(d, right)) / z - x, height / 2 - (scale * dot(d, up)) / z - y);
    if (off > NEAR || z > depth + FRONT) continue;
    if (z < depth - FRONT || off < away) { best = values[i]; away = off; }
    depth = Math.min(depth, z);
  }
  return best;
}

function tell([name, title, unitName]) {
  const box = document.createElement("output");
  box.hidden = true;
  box.style.cssText = "position: fixed; z-index: 9; pointer-events: none; background: #26303bee; color: #fff; "
    + "padding: 3px 9px; border-radius: 6px; font: 13px system-ui, sans-serif";
  addEventListener("mousemove", (event) => {
    const surface = event.buttons ? null : found(name);
    const value = surface && valueAt(surface, event.clientX, event.clientY, innerWidth, innerHeight);
    box.hidden = value === null;
    if (box.hidden) return;
    if (!box.isConnected) document.body.append(box); // the viewer clears the page when it comes
    box.textContent = `${title} ${value.toFixed(2)} ${unitName}`;
    box.style.left = `${Math.min(event.clientX + 14, innerWidth - box.offsetWidth - 6)}px`;
    box.style.top = `${Math.min(event.clientY + 14, innerHeight - box.offsetHeight - 6)}px`;
  });
  addEventListener("mouseout", () => { box.hidden = true; });
}
