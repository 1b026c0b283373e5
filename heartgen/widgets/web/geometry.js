// Where a camera stands and what it sees: small vector algebra of the 3-D view, in mm.
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const along = (a, b, t) => [a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
const unit = (a) => { const n = Math.hypot(...a) || 1; return [a[0] / n, a[1] / n, a[2] / n]; };
const distance = (a, b) => Math.hypot(...sub(a, b));

// Axes of the picture: to the right, upwards, and from what is looked at towards the eye.
function axesOf(direction, up) {
  const back = unit(direction);
  const right = unit(cross(up, back));
  return { right, up: cross(back, right), back };
}

// A camera as these functions take it: half the height of the picture at a distance of 1, too.
function seenBy(camera, aspect) {
  const position = camera.getPosition(), focal = camera.getFocalPoint();
  return {
    ...axesOf(sub(position, focal), camera.getViewUp()), position, aspect,
    half: Math.tan((camera.getViewAngle() * Math.PI) / 360),
  };
}

// The place of a point in the picture, from -1 to 1 to the right and upwards; null behind the eye.
function project(point, eye) {
  const from = sub(point, eye.position);
  const depth = -dot(from, eye.back);
  if (depth <= 0) return null;
  const reach = depth * eye.half;
  return [dot(from, eye.right) / (reach * eye.aspect), dot(from, eye.up) / reach];
}

// The direction in which a place in the picture is seen.
function ray(place, eye) {
  const sideways = place[0] * eye.half * eye.aspect, upwards = place[1] * eye.half;
  return unit(along(along(along([0, 0, 0], eye.right, sideways), eye.up, upwards), eye.back, -1));
}

// Eye and center from which points (arrays of x, y, z in a row) just fill a picture.
function fit(clouds, direction, up, half, aspect, room) {
  const { right, up: above, back } = axesOf(direction, up);
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  let near = -Infinity, far = Infinity;
  const flat = [];
  for (const cloud of clouds) {
    const stride = 3 * Math.max(1, Math.floor(cloud.length / 30000));
    for (let i = 0; i < cloud.length; i += stride) {
      const p = [cloud[i], cloud[i + 1], cloud[i + 2]];
      flat.push([dot(p, right), dot(p, above), dot(p, back)]);
    }
  }
  for (const [x, y, z] of flat) {
    low[0] = Math.min(low[0], x); high[0] = Math.max(high[0], x);
    low[1] = Math.min(low[1], y); high[1] = Math.max(high[1], y);
    near = Math.max(near, z); far = Math.min(far, z);
  }
  if (!flat.length) return null;
  let cx = (low[0] + high[0]) / 2, cy = (low[1] + high[1]) / 2, eye = near;
  for (let round = 0; round < 3; round++) {
    let sides = [-Infinity, -Infinity, -Infinity, -Infinity];
    for (const [x, y, z] of flat) {  // how far back the eye must be for each edge of the picture
      sides = [
        Math.max(sides[0], z + (x - cx) / (half * aspect)),
        Math.max(sides[1], z - (x - cx) / (half * aspect)),
        Math.max(sides[2], z + (y - cy) / half),
        Math.max(sides[3], z - (y - cy) / half),
      ];
    }
    cx += ((sides[0] - sides[1]) * half * aspect) / 2;
    cy += ((sides[2] - sides[3]) * half) / 2;
    eye = Math.max((sides[0] + sides[1]) / 2, (sides[2] + sides[3]) / 2);
  }
  const middle = (near + far) / 2, back0 = middle + (eye - middle) * room;
  const at = (depth) => along(along(along([0, 0, 0], right, cx), above, cy), back, depth);
  return { eye: at(back0), center: at(middle) };
}

// Where a ray first meets triangles: the triangle's number, and the point's weights in it.
function meet(origin, direction, points, corners) {
  let best = null, nearest = Infinity;
  const [ox, oy, oz] = origin, [dx, dy, dz] = direction;
  for (let t = 0; t < corners.length; t += 3) {
    const a = 3 * corners[t], b = 3 * corners[t + 1], c = 3 * corners[t + 2];
    const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1];
    const uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1];
    const vz = points[c + 2] - points[a + 2];
    const px = dy * vz - dz * vy, py = dz * vx - dx * vz, pz = dx * vy - dy * vx;
    const det = ux * px + uy * py + uz * pz;
    if (Math.abs(det) < 1e-12) continue;
    const sx = ox - points[a], sy = oy - points[a + 1], sz = oz - points[a + 2];
    const u = (sx * px + sy * py + sz * pz) / det;
    if (u < 0 || u > 1) continue;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const v = (dx * qx + dy * qy + dz * qz) / det;
    if (v < 0 || u + v > 1) continue;
    const reach = (vx * qx + vy * qy + vz * qz) / det;
    if (reach > 0 && reach < nearest) {
      nearest = reach;
      best = { corners: [corners[t], corners[t + 1], corners[t + 2]], weights: [1 - u - v, u, v] };
    }
  }
  return best && { ...best, point: along(origin, direction, nearest) };
}
