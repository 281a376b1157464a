// WebGL 2: layers of triangles, lines, strokes and points, whose places and colours are computed outside.

const VERTEX = `#version 300 es
precision highp float;
uniform mat4 camera; uniform vec2 size; uniform float nearer, grain; uniform vec4 ink;
layout(location=0) in vec3 begin; layout(location=1) in vec4 tint; layout(location=2) in vec3 end; layout(location=3) in float width; layout(location=4) in vec2 corner;
out vec3 place; out vec4 paint;
`;
const FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 section; uniform vec3 sight; uniform float alpha;
in vec3 place; in vec4 paint; out vec4 colour;
`;
const FACE_VERTEX = `${VERTEX}
void main() { place = begin; paint = tint; gl_Position = camera * vec4(place, 1.0); }`;
const FACE_FRAGMENT = `${FRAGMENT}
void main() {
  if (dot(vec4(place, 1.0), section) > 0.0) discard;
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.62 + 0.38 * abs(dot(normal, normalize(sight + vec3(0.0, 0.0, 0.35))));
  vec3 tint = paint.rgb;
  if (!gl_FrontFacing && length(section.xyz) > 0.5) {
    float stripe = step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0));
    tint = mix(tint * 0.55, tint * 0.8, stripe); light = 1.0;
  }
  colour = vec4(tint * light, alpha);
}`;
const LINE_VERTEX = `${VERTEX}
void main() {
  place = begin; paint = ink; gl_PointSize = max(4.0 * grain, 1.0);
  gl_Position = camera * vec4(place, 1.0);
}`;
const POINT_VERTEX = LINE_VERTEX.replace("paint = ink", "paint = tint").replace("1.0);\n}", "1.0);\n  gl_Position.z -= nearer * gl_Position.w;\n}");
const STROKE_VERTEX = `${VERTEX}
void main() {
  vec4 p = camera * vec4(begin, 1.0), q = camera * vec4(end, 1.0);
  vec2 way = (q.xy / q.w - p.xy / p.w) * size;
  float far = length(way);
  vec2 across = far > 1e-6 ? vec2(-way.y, way.x) / far : vec2(0.0);
  vec4 at = mix(p, q, corner.x);
  place = mix(begin, end, corner.x); paint = tint;
  at.xy += across * corner.y * max(width * grain, 1.0) / size * at.w;
  gl_Position = at;
}`;
const LINE_FRAGMENT = `${FRAGMENT}
void main() { if (dot(vec4(place, 1.0), section) > 0.0) discard; colour = vec4(paint.rgb, 1.0); }`;

export class Renderer {
  /** @param canvas to draw on. Throws where the browser has no WebGL 2. */
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl;
    this.programs = {
      face: this.program(FACE_VERTEX, FACE_FRAGMENT),
      line: this.program(LINE_VERTEX, LINE_FRAGMENT),
      point: this.program(POINT_VERTEX, LINE_FRAGMENT),
      stroke: this.program(STROKE_VERTEX, LINE_FRAGMENT),
    };
    this.layers = {};
    gl.enable(gl.DEPTH_TEST);
    gl.polygonOffset(1, 2); // faces behind their own edges
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || "shader");
    const places = new Map();
    return { program, at: (name) => places.get(name) ?? places.set(name, gl.getUniformLocation(program, name)).get(name) };
  }

  /** Make room for a layer: strokes have two places and one colour and width each, all others one place and colour. */
  add(name, strokes = false) {
    this.remove(name);
    const gl = this.gl, array = gl.createVertexArray(), buffers = { places: gl.createBuffer(), tint: gl.createBuffer() };
    gl.bindVertexArray(array);
    const point = (location, buffer, size, kind, stride, at, each) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, kind, kind === gl.UNSIGNED_BYTE, stride, at);
      gl.vertexAttribDivisor(location, each);
    };
    const each = strokes ? 1 : 0;
    point(0, buffers.places, 3, gl.FLOAT, strokes ? 24 : 0, 0, each);
    point(1, buffers.tint, 4, gl.UNSIGNED_BYTE, 0, 0, each);
    if (strokes) {
      Object.assign(buffers, { width: gl.createBuffer(), corner: gl.createBuffer() });
      point(2, buffers.places, 3, gl.FLOAT, 24, 12, 1);
      point(3, buffers.width, 1, gl.FLOAT, 0, 0, 1);
      point(4, buffers.corner, 2, gl.FLOAT, 0, 0, 0);
      this.fill(buffers.corner, new Float32Array([0, -0.5, 1, -0.5, 0, 0.5, 1, 0.5]));
    }
    gl.bindVertexArray(null);
    this.layers[name] = { array, buffers, counts: {}, strokes };
  }

  remove(name) {
    const layer = this.layers[name];
    if (!layer) return;
    Object.values(layer.buffers).forEach((buffer) => this.gl.deleteBuffer(buffer));
    this.gl.deleteVertexArray(layer.array);
    delete this.layers[name];
  }

  fill(buffer, values, target = this.gl.ARRAY_BUFFER) {
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, values, this.gl.DYNAMIC_DRAW);
  }

  /** Set an array of a layer: places, tint, width; or the rows of one of its indices, faces or edges. */
  set(name, part, values) {
    const layer = this.layers[name], gl = this.gl, index = part === "faces" || part === "edges";
    layer.buffers[part] ??= gl.createBuffer();
    if (index) gl.bindVertexArray(null);
    this.fill(layer.buffers[part], values, index ? gl.ELEMENT_ARRAY_BUFFER : gl.ARRAY_BUFFER);
    layer.counts[part] = part === "places" ? values.length / (layer.strokes ? 6 : 3) : values.length;
  }

  /** Fit the drawing buffer to the canvas, with so many pixels for one of CSS. */
  resize(ratio) {
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
  }

  /** Draw a layer with a program: its faces or edges, its points, or its strokes. */
  drawLayer(name, program, part, view, nearer = 0, alpha = 1) {
    const gl = this.gl, layer = this.layers[name];
    if (!layer) return;
    const { program: own, at } = this.programs[program];
    gl.useProgram(own);
    gl.uniformMatrix4fv(at("camera"), false, view.matrix);
    gl.uniform4fv(at("section"), view.section);
    gl.uniform3fv(at("sight"), view.sight);
    gl.uniform4f(at("ink"), 0.1, 0.1, 0.1, 1);
    gl.uniform2f(at("size"), this.canvas.width / 2, this.canvas.height / 2);
    gl.uniform1f(at("nearer"), nearer);
    gl.uniform1f(at("grain"), this.canvas.width / this.canvas.clientWidth);
    gl.uniform1f(at("alpha"), alpha);
    gl.bindVertexArray(layer.array);
    if (layer.strokes) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, layer.counts.places);
    else if (part === "points") gl.drawArrays(gl.POINTS, 0, layer.counts.places);
    else {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, layer.buffers[part]);
      gl.drawElements(part === "edges" ? gl.LINES : gl.TRIANGLES, layer.counts[part], gl.UNSIGNED_INT, 0);
    }
    gl.bindVertexArray(null);
  }

  /** Draw a view: matrix, section, sight, background, seeThrough, closed, edges, points, names of sheets and strokes. */
  draw(view) {
    const gl = this.gl;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...view.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const stones = (alpha) => {
      gl.enable(gl.POLYGON_OFFSET_FILL);
      if (view.closed) gl.enable(gl.CULL_FACE);
      this.drawLayer("stones", "face", "faces", view, 0, alpha);
      gl.disable(gl.CULL_FACE);
      gl.disable(gl.POLYGON_OFFSET_FILL);
    };
    if (!view.seeThrough) stones(1);
    if (view.edges) this.drawLayer("stones", "line", "edges", view);
    for (const name of view.sheets) this.drawLayer(name, "face", "faces", view);
    gl.disable(gl.DEPTH_TEST); // forces act within the stones
    for (const name of view.strokes) this.drawLayer(name, "stroke", "", view);
    gl.enable(gl.DEPTH_TEST);
    if (view.points) this.drawLayer("points", "point", "points", view, 0.0006);
    if (!view.seeThrough) return;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    stones(0.16);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
}
