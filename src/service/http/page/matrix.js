// 4x4 matrices by columns, as WebGL takes them, and vectors of three.

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const norm = (a) => Math.hypot(...a);
export const unit = (a) => scale(a, 1 / (norm(a) || 1));

export function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) {
    for (let r = 0; r < 4; r++) {
      for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  }
  return out;
}

/** The affine map with these columns. */
export const columns = (x, y, z, origin) =>
  new Float32Array([...x, 0, ...y, 0, ...z, 0, ...origin, 1]);

/** A point through a matrix, with its fourth coordinate. */
export const transform = (m, [x, y, z]) =>
  [0, 1, 2, 3].map((r) => m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]);

export function perspective(fieldOfView, aspect, near, far) {
  const f = 1 / Math.tan(fieldOfView / 2);
  const out = new Float32Array(16);
  out[0] = f / aspect;
  out[5] = f;
  out[10] = (far + near) / (near - far);
  out[11] = -1;
  out[14] = (2 * far * near) / (near - far);
  return out;
}

/** The view from `eye` towards `target`, z up. */
export function lookAt(eye, target) {
  const back = unit(sub(eye, target));
  const right = unit(cross([0, 0, 1], back));
  const up = cross(back, right);
  const rows = [right, up, back];
  const out = new Float32Array(16);
  rows.forEach((row, r) => {
    for (let c = 0; c < 3; c++) out[4 * c + r] = row[c];
    out[12 + r] = -dot(row, eye);
  });
  out[15] = 1;
  return out;
}

/** World (z up, x ahead) from body: pitch, then roll (REP-103: positive pitch lowers the nose). */
export function worldFromBody(roll, pitch) {
  const [cr, sr, cp, sp] = [Math.cos(roll), Math.sin(roll), Math.cos(pitch), Math.sin(pitch)];
  return columns([cp, 0, -sp], [sp * sr, cr, cp * sr], [sp * cr, -sr, cp * cr], [0, 0, 0]);
}

/** Unit vector along gravity (down) in the body. */
export const gravity = (roll, pitch) => [Math.sin(pitch), -Math.cos(pitch) * Math.sin(roll), -Math.cos(pitch) * Math.cos(roll)];

/** An affine map that takes the unit z axis to `vector`, widened by `width`. */
export function along(origin, vector, width) {
  const z = unit(vector);
  const x = unit(cross(Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], z));
  return columns(scale(x, width), scale(cross(z, x), width), vector, origin);
}
