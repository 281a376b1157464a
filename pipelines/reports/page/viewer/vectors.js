// Vectors of three numbers, 4 × 4 matrices by columns, and rotations.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const unit = (a) => times(a, 1 / (length(a) || 1));

/** Product of two 4 × 4 matrices. */
export function product(a, b) {
  const out = new Float64Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return out;
}

/** Rotation matrix, by rows, of a rotation vector x, y, z (Rodrigues). */
export function rotation(x, y, z) {
  const angle = Math.hypot(x, y, z);
  if (angle < 1e-12) return [1, -z, y, z, 1, -x, -y, x, 1];
  const s = Math.sin(angle) / angle;
  const c = (1 - Math.cos(angle)) / (angle * angle);
  const w = Math.cos(angle);
  return [
    w + c * x * x, c * x * y - s * z, c * x * z + s * y,
    c * x * y + s * z, w + c * y * y, c * y * z - s * x,
    c * x * z - s * y, c * y * z + s * x, w + c * z * z,
  ];
}

/** Smallest box about places, as low and high corner. */
export function boxOf(places) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < places.length; i += 3)
    for (let k = 0; k < 3; k++) {
      low[k] = Math.min(low[k], places[i + k]);
      high[k] = Math.max(high[k], places[i + k]);
    }
  return places.length ? { low, high } : { low: [0, 0, 0], high: [1, 1, 1] };
}
