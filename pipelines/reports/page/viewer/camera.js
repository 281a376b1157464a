// The camera: an orbit about a target, in perspective or orthographic, z up.

import { add, cross, dot, minus, product, times } from "./vectors.js";

const OPENING = 0.5; // half the opening of the perspective, tan [-]
export const PIXEL = 0.0254 / 96; // a CSS pixel [m]

/** Elevations and plans by name: turn from the main elevation [rad], and pitch. */
export const VIEWS = {
  Front: [0, 0],
  Right: [Math.PI / 2, 0],
  Back: [Math.PI, 0],
  Left: [-Math.PI / 2, 0],
  Top: [0, Math.PI / 2],
  "3D": [0.5, 0.35],
};

export class Camera {
  /** @param box low and high corner of the scene; @param towards direction to the observer of the main elevation */
  constructor(box, towards) {
    this.main = Math.atan2(towards[1], towards[0]);
    this.size = Math.hypot(...minus(box.high, box.low)) || 1;
    this.state = { yaw: this.main, pitch: 0, target: [0, 0, 0], height: 1, ortho: true };
  }

  /** Show the whole of a box; `aspect` is width over height of the picture. */
  fit(box, aspect) {
    const { side, above, back } = this.axes(), half = times(minus(box.high, box.low), 0.5);
    const reach = (axis) => 2 * axis.reduce((sum, one, k) => sum + Math.abs(one) * half[k], 0);
    this.state.target = times(add(box.low, box.high), 0.5);
    const near = this.state.ortho ? 0 : 0.25 * reach(back); // what is nearer than the target looks larger
    this.state.height = 1.12 * Math.max(reach(above), reach(side) / aspect) + near;
  }

  /** Turn to a named view; all but the last are orthographic. */
  look(name) {
    const [turn, pitch] = VIEWS[name];
    this.state.yaw = this.main + turn;
    this.state.pitch = pitch;
    this.state.ortho = name !== "3D";
  }

  orbit(right, up) {
    this.state.yaw -= right;
    this.state.pitch = Math.min(Math.max(this.state.pitch + up, -Math.PI / 2), Math.PI / 2);
  }

  /** Move by shares of the height of the picture. */
  pan(right, up) {
    const { side, above } = this.axes();
    const way = add(times(side, -right * this.state.height), times(above, -up * this.state.height));
    this.state.target = add(this.state.target, way);
  }

  zoom(factor) {
    this.state.height = Math.min(Math.max(this.state.height * factor, 1e-4 * this.size), 50 * this.size);
  }

  /** Unit vectors: from the target to the observer, to the right, and upwards in the picture. */
  axes() {
    const { yaw, pitch } = this.state;
    const back = [Math.cos(pitch) * Math.cos(yaw), Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch)];
    const side = [-Math.sin(yaw), Math.cos(yaw), 0];
    return { back, side, above: cross(back, side) };
  }

  /** Where the ray through a place of the picture begins, and its way; both sides of the picture go from -1 to 1. */
  ray(x, y, aspect) {
    const { back, side, above } = this.axes(), { target, height, ortho } = this.state;
    const across = add(times(side, 0.5 * x * height * aspect), times(above, 0.5 * y * height)), reach = 2.5 * this.size + height;
    if (ortho) return { eye: add(add(target, across), times(back, reach)), way: times(back, -1) };
    const distance = height / (2 * OPENING), eye = add(target, times(back, distance));
    return { eye, way: add(across, times(back, -distance)) };
  }

  /** 4 × 4 matrix, by columns, from places to clip space; `aspect` is width over height. */
  matrix(aspect) {
    const { back, side, above } = this.axes();
    const { target, height, ortho } = this.state;
    const reach = 2.5 * this.size + height;
    const distance = ortho ? reach : height / (2 * OPENING);
    const eye = add(target, times(back, distance));
    const view = [
      side[0], above[0], back[0], 0, side[1], above[1], back[1], 0, side[2], above[2], back[2], 0,
      -dot(side, eye), -dot(above, eye), -dot(back, eye), 1,
    ];
    if (ortho) {
      const far = 2 * reach;
      return product([2 / (height * aspect), 0, 0, 0, 0, 2 / height, 0, 0, 0, 0, -2 / far, 0, 0, 0, -1, 1], view);
    }
    const near = Math.max(distance - reach, 0.01 * distance), far = distance + reach;
    const depth = [-(far + near) / (far - near), (-2 * far * near) / (far - near)];
    return product([1 / (OPENING * aspect), 0, 0, 0, 0, 1 / OPENING, 0, 0, 0, 0, depth[0], -1, 0, 0, depth[1], 0], view);
  }
}
