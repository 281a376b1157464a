// From the model and the state of a viewer to what is drawn: poses, colours, joints, lines.

import { colourOf, fromHex, GREY, withoutRounding, wordColour } from "./colours.js";
import { add, boxOf, cross, length, minus, rotation, times } from "./vectors.js";

const BLUE = [0, 90, 181], RED = [220, 50, 32], DARK = [40, 40, 60];
const FORCE = 0.06; // length of the largest force over the size of the scene
const WAY = 0.06; // way of the fastest stone of a mechanism over that size, at exaggeration 1
const APART = 0.6; // of the size, over all groups of an exploded view

export class Stage {
  constructor(model, renderer) {
    Object.assign(this, { model, renderer, count: model.codes.length, box: boxOf(model.vertices) });
    this.size = length(minus(this.box.high, this.box.low)) || 1;
    this.flat = this.box.high[1] - this.box.low[1] < 1e-6 * this.size; // disks in the plane of x and z
    this.number = new Map(model.codes.map((code, index) => [code, index]));
    this.middles = this.meanPlaces();
    this.scales = this.listScales();
    this.shapes = new Map(); // of each layer: places at the start, and the stone of each
    this.keep("stones", model.vertices, model.owner);
    if (model.points) this.keepPoints(model.points);
    for (const one of model.lines) this.keepPolylines(one);
  }

  /** Keep a layer whose places move with their stones; -1 for places that stay. */
  keep(name, places, owner, strokes = false) {
    this.renderer.add(name, strokes);
    this.shapes.set(name, { places, owner, each: strokes ? 2 : 1, moved: new Float32Array(places.length) });
  }

  drop(name) {
    this.renderer.remove(name);
    this.shapes.delete(name);
  }

  meanPlaces() {
    const { vertices, owner } = this.model, sums = new Float64Array(4 * this.count);
    for (let i = 0; i < owner.length; i++) {
      for (let k = 0; k < 3; k++) sums[4 * owner[i] + k] += vertices[3 * i + k];
      sums[4 * owner[i] + 3] += 1;
    }
    return Array.from({ length: this.count }, (_, i) => [0, 1, 2].map((k) => sums[4 * i + k] / (sums[4 * i + 3] || 1)));
  }

  /** What can colour the stones: columns, fields on the surface, results in time. */
  listScales() {
    const { columns, fields, motion } = this.model;
    const scales = columns.map((one) => ({ ...one, text: one.unit === null, at: () => one.values }));
    if (motion) {
      const shown = { name: "displacement", label: "displacement at this instant", unit: "m", group: "Results", moving: true };
      scales.unshift({ ...shown, at: (state) => this.displacements(state) });
      motion.values.forEach((one, number) =>
        scales.push({ ...one, name: `in_time_${number}`, label: `${one.label} at this instant`, group: "Results", moving: true, at: (state) => this.inTime(one, state) }));
    }
    for (const one of fields) scales.unshift({ ...one, group: "Results", byVertex: true, at: () => one.values });
    return scales;
  }

  scale(name) { return this.scales.find((one) => one.name === name); }
  get instants() { return this.model.motion?.times.length ?? 1; }

  inTime(one, state) {
    const at = state.instant * this.count;
    return Float32Array.from({ length: this.count }, (_, i) => (one.known[i] ? one.values[at + i] * one.scale[i] : NaN));
  }

  /** Displacement and rotation matrix of a stone at an instant. */
  motionOf(stone, state) {
    const { shift, turn } = this.model.motion, at = 3 * (state.instant * this.count + stone);
    const vector = (series) => [0, 1, 2].map((k) => series.values[at + k] * series.scale[stone]);
    return { shift: minus(vector(shift), this.carried), matrix: rotation(...vector(turn)) };
  }

  /** Mean displacement of the supports, where displacements are shown relative to them. */
  supportsAt(state) {
    const { motion } = this.model;
    if (!motion || !state.relative) return [0, 0, 0];
    let sum = [0, 0, 0], found = 0;
    for (let i = 0; i < this.count; i++)
      if (motion.supports[i]) {
        const at = 3 * (state.instant * this.count + i);
        sum = add(sum, [0, 1, 2].map((k) => motion.shift.values[at + k] * motion.shift.scale[i]));
        found++;
      }
    return found ? times(sum, 1 / found) : sum;
  }

  /** Largest displacement of the vertices of each stone at an instant. */
  displacements(state) {
    const { vertices, owner, motion } = this.model, largest = new Float32Array(this.count);
    this.carried = this.supportsAt(state);
    let stone = -1, c, moved, m;
    for (let i = 0; i < owner.length; i++) {
      if (owner[i] !== stone) {
        stone = owner[i];
        c = motion.centres.subarray(3 * stone, 3 * stone + 3);
        ({ shift: moved, matrix: m } = this.motionOf(stone, state));
      }
      const x = vertices[3 * i] - c[0], y = vertices[3 * i + 1] - c[1], z = vertices[3 * i + 2] - c[2];
      const far = Math.hypot(
        moved[0] + (m[0] - 1) * x + m[1] * y + m[2] * z,
        moved[1] + m[3] * x + (m[4] - 1) * y + m[5] * z,
        moved[2] + m[6] * x + m[7] * y + (m[8] - 1) * z);
      if (far > largest[stone]) largest[stone] = far;
    }
    return largest;
  }

  /** Exaggeration at which the largest displacement of the last instant is a twentieth of the scene. */
  goodFactor(state) {
    if (!this.model.motion) return 1;
    const largest = Math.max(...[this.instants - 1, state.instant].map((instant) =>
      this.displacements({ ...state, instant }).reduce((a, b) => Math.max(a, b), 0)));
    return largest > 0 ? Math.max(1, Number(((0.05 * this.size) / largest).toPrecision(1))) : 1;
  }

  /** Compute where all stones are, and what of them is shown. */
  setPoses(state) {
    this.hidden = new Uint8Array(this.count);
    for (const stone of state.hidden) this.hidden[stone] = 1;
    this.poses = this.posesAt(state);
    const rest = state.mechanism < 0 && state.instant === this.instants - 1 ? this.model.motion?.rest : null;
    for (const name of this.shapes.keys()) this.move(name, name === "stones" ? rest : null, state.factor);
    this.showFaces();
  }

  /** Maps (12 n) from the start to now, three rows of four for each stone. */
  posesAt(state) {
    const poses = new Float32Array(12 * this.count), apart = this.apart(state);
    const mechanism = this.model.mechanisms[state.mechanism], { motion } = this.model;
    this.carried = this.supportsAt(state);
    const way = mechanism ? this.mechanismWay(mechanism) * state.factor : 0;
    for (let i = 0; i < this.count; i++) {
      let a = [1, 0, 0, 0, 1, 0, 0, 0, 1], t = apart(i);
      if (mechanism) {
        const [v, w, c] = this.velocityOf(mechanism, i);
        a = [1, -way * w[2], way * w[1], way * w[2], 1, -way * w[0], -way * w[1], way * w[0], 1];
        t = add(t, times(minus(v, cross(w, c)), way));
      } else if (motion) {
        const { shift, matrix } = this.motionOf(i, state), s = state.factor;
        const c = motion.centres.subarray(3 * i, 3 * i + 3);
        const g = matrix.map((value, k) => s * (value - (k % 4 === 0 ? 1 : 0)));
        a = g.map((value, k) => value + (k % 4 === 0 ? 1 : 0));
        for (let k = 0; k < 3; k++) t[k] += s * shift[k] - g[3 * k] * c[0] - g[3 * k + 1] * c[1] - g[3 * k + 2] * c[2];
      }
      for (let k = 0; k < 3; k++) poses.set([a[3 * k], a[3 * k + 1], a[3 * k + 2], t[k]], 12 * i + 4 * k);
    }
    return poses;
  }

  /** Move the places of a layer with their stones; strokes and points of hidden ones shrink to nothing far away. */
  move(name, rest = null, factor = 1) {
    const { places, owner, each, moved } = this.shapes.get(name), poses = this.poses, solid = name === "stones" || name === "joints";
    for (let i = 0; i < moved.length / 3; i++) {
      const stone = owner[each === 2 ? i >> 1 : i], x = places[3 * i], y = places[3 * i + 1], z = places[3 * i + 2], p = 12 * stone;
      if (stone < 0) moved.set([x, y, z], 3 * i);
      else if (!solid && this.hidden[stone]) moved.fill(1e9, 3 * i, 3 * i + 3);
      else for (let k = 0; k < 3; k++) {
        const row = p + 4 * k;
        moved[3 * i + k] = poses[row] * x + poses[row + 1] * y + poses[row + 2] * z + poses[row + 3];
        if (rest) moved[3 * i + k] += factor * rest.values[3 * i + k] * rest.scale[i];
      }
    }
    this.renderer.set(name, "places", moved);
  }

  /** Let only shown stones and joints have faces and edges. */
  showFaces() {
    const { triangles, edges, owner } = this.model;
    const shown = (index, each, of) => this.hidden.includes(1) ? Uint32Array.from(rowsOf(index, each, (row) => !this.hidden[of[row]])) : Uint32Array.from(index);
    this.faces = shown(triangles, 3, owner);
    this.renderer.set("stones", "faces", this.faces);
    this.renderer.set("stones", "edges", shown(edges, 2, owner));
    if (this.shapes.has("joints")) this.renderer.set("joints", "faces", shown(this.jointFaces, 3, this.shapes.get("joints").owner));
  }

  /** The stone that a ray from `eye` along `way` meets first behind the section, or -1 (Möller and Trumbore 1997). */
  hit(eye, way, section) {
    const place = this.shapes.get("stones").moved, { owner } = this.model, faces = this.faces;
    let nearest = Infinity, stone = -1;
    for (let f = 0; f < faces.length; f += 3) {
      const i = 3 * faces[f], j = 3 * faces[f + 1], k = 3 * faces[f + 2];
      const ax = place[i], ay = place[i + 1], az = place[i + 2];
      const ux = place[j] - ax, uy = place[j + 1] - ay, uz = place[j + 2] - az;
      const vx = place[k] - ax, vy = place[k + 1] - ay, vz = place[k + 2] - az;
      const px = way[1] * vz - way[2] * vy, py = way[2] * vx - way[0] * vz, pz = way[0] * vy - way[1] * vx;
      const size = ux * px + uy * py + uz * pz;
      if (size === 0) continue;
      const sx = eye[0] - ax, sy = eye[1] - ay, sz = eye[2] - az;
      const a = (sx * px + sy * py + sz * pz) / size;
      if (a < 0 || a > 1) continue;
      const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
      const b = (way[0] * qx + way[1] * qy + way[2] * qz) / size;
      if (b < 0 || a + b > 1) continue;
      const t = (vx * qx + vy * qy + vz * qz) / size;
      const cut = section[0] * (eye[0] + t * way[0]) + section[1] * (eye[1] + t * way[1]) + section[2] * (eye[2] + t * way[2]) + section[3];
      if (t < nearest && cut <= 0) [nearest, stone] = [t, owner[faces[f]]];
    }
    return stone;
  }

  velocityOf(mechanism, i) {
    const v = mechanism.velocity.subarray(6 * i, 6 * i + 6);
    return [[...v.subarray(0, 3)], [...v.subarray(3)], [...mechanism.centres.subarray(3 * i, 3 * i + 3)]];
  }

  /** Time by which velocities are multiplied at exaggeration 1. */
  mechanismWay(mechanism) {
    const { vertices, owner } = this.model;
    let fastest = 1e-30;
    for (let i = 0; i < owner.length; i++) {
      const [v, w, c] = this.velocityOf(mechanism, owner[i]);
      fastest = Math.max(fastest, length(add(v, cross(w, minus([...vertices.subarray(3 * i, 3 * i + 3)], c)))));
    }
    return (WAY * this.size) / fastest;
  }

  /** Displacement of each stone in an exploded view: courses upwards, other groups towards the observer. */
  apart(state) {
    const scale = state.explode.amount > 0 ? this.scale(state.explode.by) : null;
    if (!scale) return () => [0, 0, 0];
    const values = scale.at(state), known = [...new Set(values)].filter((one) => scale.text ? one >= 0 : !Number.isNaN(one));
    known.sort((a, b) => a - b);
    const step = (state.explode.amount * APART * this.size) / Math.max(known.length - 1, 1);
    const way = scale.name === "course" ? [0, 0, 1] : this.model.towards;
    return (i) => times(way, step * Math.max(known.indexOf(values[i]), 0));
  }

  /** Smallest and largest value of a scale. */
  range(scale, state) {
    let low = Infinity, high = -Infinity;
    const states = scale.moving ? [0, Math.floor(this.instants / 2), this.instants - 1, state.instant] : [state.instant];
    for (const instant of new Set(states))
      for (const value of scale.at({ ...state, instant })) if (value < low) low = value; else if (value > high) high = value;
    if (low > high && Number.isFinite(low)) high = low;
    if (!Number.isFinite(low)) return [0, 1];
    if (!Number.isFinite(high)) high = low;
    return [scale.moving ? Math.min(low, 0) : low, high].map((value) => withoutRounding(value, scale.unit));
  }

  /** Colour the stones; `colour` has by, map, low and high. */
  setColours(state) {
    const scale = this.scale(state.colour.by), values = scale?.at(state);
    const { low, high } = state.colour, share = (value) => (high > low ? (value - low) / (high - low) : 0.5);
    const tint = (value) => !scale ? [214, 205, 188] : scale.text ? (value < 0 ? GREY : wordColour(value))
      : Number.isNaN(value) ? GREY : colourOf(state.colour.map, share(value));
    const { owner } = this.model, whole = new Uint8Array(3 * this.count), table = new Uint8Array(4 * owner.length);
    for (let i = 0; i < this.count; i++) whole.set(marked(scale?.byVertex ? GREY : tint(values?.[i]), i === state.selected), 3 * i);
    for (let i = 0; i < owner.length; i++) {
      const stone = owner[i];
      if (scale?.byVertex && !Number.isNaN(values[i])) table.set(marked(tint(values[i]), stone === state.selected), 4 * i);
      else for (let k = 0; k < 3; k++) table[4 * i + k] = whole[3 * stone + k];
    }
    this.renderer.set("stones", "tint", table);
  }

  keepPoints(points) {
    const tint = new Uint8Array(4 * points.owner.length);
    points.rejected.forEach((out, i) => tint.set([...(out ? RED : BLUE), 255], 4 * i));
    this.keep("points", points.places, points.owner);
    this.renderer.set("points", "tint", tint);
  }

  keepPolylines(one) {
    const segments = [];
    let first = 0;
    for (const count of one.counts) {
      for (let i = first; i < first + count - 1; i++)
        segments.push([[...one.points.subarray(3 * i, 3 * i + 3)], [...one.points.subarray(3 * i + 3, 3 * i + 6)], -1, fromHex(one.colour), 2.5]);
      first += count;
    }
    this.keepSegments(`line ${one.name}`, segments);
  }

  /** Keep strokes: begin, end, stone, colour and width [px] of each. */
  keepSegments(name, segments) {
    if (!segments.length) return this.drop(name);
    const tint = new Uint8Array(4 * segments.length);
    segments.forEach((one, i) => tint.set([...one[3], 255], 4 * i));
    this.keep(name, Float32Array.from(segments.flatMap((one) => [...one[0], ...one[1]])), Int32Array.from(segments, (one) => one[2]), true);
    this.renderer.set(name, "tint", tint);
    this.renderer.set(name, "width", Float32Array.from(segments, (one) => one[4]));
    if (this.poses) this.move(name);
  }

  /** The joints that are shown: those of the run, or of the mechanism. */
  joints(state) {
    const mechanism = this.model.mechanisms[state.mechanism];
    return mechanism ? mechanism.joints : this.model.joints;
  }

  /** Make the sheets of the joints, their resultants, and the paths of forces through the stones. */
  setJoints(state) {
    const joints = this.joints(state);
    for (const name of ["joints", "forces", "thrust"]) this.drop(name);
    if (!joints) return;
    const column = joints.columns.find((one) => one.name === state.joint.by) ?? joints.columns[0];
    let high = 0;
    for (const value of column.values) if (value > high) high = value;
    this.jointScale = { ...column, low: 0, high: withoutRounding(high, column.unit) };
    const index = [], owner = new Int32Array(joints.corners.length / 3), tint = new Uint8Array(4 * owner.length);
    let first = 0;
    joints.counts.forEach((count, joint) => {
      const value = column.values[joint];
      const own = Number.isNaN(value) ? GREY : colourOf(state.colour.map, this.jointScale.high > 0 ? value / this.jointScale.high : 0.5);
      for (let i = first; i < first + count; i++) {
        owner[i] = joints.bodies[2 * joint + 1];
        tint.set([...own, 255], 4 * i);
        if (i > first + 1) index.push(first, i - 1, i);
      }
      first += count;
    });
    if (index.length) {
      this.keep("joints", joints.corners, owner);
      this.renderer.set("joints", "tint", tint);
      this.jointFaces = Uint32Array.from(index);
      this.move("joints");
      this.showFaces();
    }
    this.keepForces(joints);
  }

  keepForces(joints) {
    const forces = [], thrust = [], size = [];
    for (let j = 0; j < joints.counts.length; j++) size.push(length([...joints.force.subarray(3 * j, 3 * j + 3)]));
    const largest = size.reduce((a, b) => Math.max(a, b), 0) || 1;
    for (let j = 0; j < joints.counts.length; j++) {
      const place = [...joints.place.subarray(3 * j, 3 * j + 3)], kern = joints.kern[j];
      if (Number.isNaN(kern) || size[j] < 1e-4 * largest) continue;
      const half = times([...joints.force.subarray(3 * j, 3 * j + 3)], (0.5 * FORCE * this.size) / largest);
      const [first, second] = joints.bodies.subarray(2 * j, 2 * j + 2);
      forces.push([minus(place, half), add(place, half), second, kern <= 1 + 1e-9 ? BLUE : RED, 3]);
      for (const stone of [first, second]) thrust.push([place, this.middles[stone], stone, RED, 1 + 7 * (size[j] / largest)]);
    }
    this.keepSegments("forces", forces);
    this.keepSegments("thrust", thrust);
  }

  /** Make the arrows of a mechanism. */
  setArrows(state) {
    const mechanism = this.model.mechanisms[state.mechanism];
    if (!mechanism) return this.drop("arrows");
    const way = 1.5 * this.mechanismWay(mechanism), segments = [];
    for (let i = 0; i < this.count; i++) {
      const [v, w, c] = this.velocityOf(mechanism, i), start = this.middles[i];
      const move = times(add(v, cross(w, minus(start, c))), way);
      if (length(move) < 2e-3 * this.size) continue;
      const end = add(start, move), side = times(cross(move, this.model.towards), 0.18);
      segments.push([start, end, i, DARK, 2], ...[1, -1].map((s) => [end, add(minus(end, times(move, 0.25)), times(side, s)), i, DARK, 2]));
    }
    this.keepSegments("arrows", segments);
  }

  /** Plane n·x > d that is cut away, or none. */
  section(state) {
    const { axis, at, flip } = state.section;
    const k = ["x", "y", "z"].indexOf(axis);
    if (k < 0) return [0, 0, 0, -1];
    const place = this.box.low[k] + at * (this.box.high[k] - this.box.low[k]), sign = flip ? -1 : 1;
    const plane = [0, 0, 0, -sign * place];
    plane[k] = sign;
    return plane;
  }
}

/** A colour, towards orange if it marks the selected stone. */
const marked = (colour, selected) => selected ? [0.45 * colour[0] + 140, 0.45 * colour[1] + 87, 0.45 * colour[2]] : colour;

/** Yield the numbers of the rows of an index whose first vertex passes. */
function* rowsOf(index, each, passes) {
  for (let i = 0; i < index.length; i += each) if (passes(index[i])) for (let k = 0; k < each; k++) yield index[i + k];
}
