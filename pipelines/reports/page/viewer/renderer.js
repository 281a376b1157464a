// WebGL 2: stones whose poses and colours lie in textures, joints, lines, points, and the stone under a pixel.

const WIDTH = 1024; // texels of a row of the textures, far below the limit of any browser
const POSE = 4; // texels of a stone: three rows of its map from the start to now, and what is shown of it

const HEAD = `#version 300 es
precision highp float; precision highp int; precision highp sampler2D;
uniform mat4 camera; uniform sampler2D poses; uniform vec4 section;
vec4 texel(int stone, int k) { int at = stone * ${POSE} + k; return texelFetch(poses, ivec2(at % ${WIDTH}, at / ${WIDTH}), 0); }
vec3 placed(int stone, vec3 p) {
  vec4 q = vec4(p, 1.0);
  return vec3(dot(texel(stone, 0), q), dot(texel(stone, 1), q), dot(texel(stone, 2), q));
}
float shown(int stone) { return texel(stone, 3).x; }
const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);
`;
const FRAGMENT = `#version 300 es
precision highp float; precision highp int;
uniform vec4 section; uniform vec3 back;
in vec3 place; out vec4 colour;
`;
const STONE_VERTEX = `${HEAD}
uniform sampler2D colours; uniform float rest; uniform bool byVertex;
layout(location=0) in vec3 corner; layout(location=1) in float owner; layout(location=2) in vec3 beyond; layout(location=3) in vec4 own;
out vec3 place; flat out vec4 ofStone; out vec4 ofVertex; flat out int stone;
void main() {
  stone = int(owner + 0.5);
  place = placed(stone, corner) + rest * beyond;
  ofStone = texelFetch(colours, ivec2(stone % ${WIDTH}, stone / ${WIDTH}), 0); ofVertex = own;
  gl_Position = shown(stone) > 0.5 ? camera * vec4(place, 1.0) : NOWHERE;
}`;
const STONE_FRAGMENT = `${FRAGMENT}
uniform bool byVertex; uniform float alpha; uniform vec3 sight;
flat in vec4 ofStone; in vec4 ofVertex; flat in int stone;
void main() {
  if (dot(vec4(place, 1.0), section) > 0.0) discard;
  vec3 tint = byVertex && ofVertex.a > 0.5 ? ofVertex.rgb : ofStone.rgb;
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.62 + 0.38 * abs(dot(normal, normalize(sight + vec3(0.0, 0.0, 0.35))));
  if (!gl_FrontFacing && length(section.xyz) > 0.5) {
    float stripe = step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / 9.0));
    tint = mix(tint * 0.55, tint * 0.8, stripe); light = 1.0;
  }
  if (ofStone.a > 0.9) tint = mix(tint, vec3(1.0, 0.62, 0.0), 0.55);
  colour = vec4(tint * light, alpha);
}`;
const PICK_FRAGMENT = `${FRAGMENT}
flat in vec4 ofStone; in vec4 ofVertex; flat in int stone;
void main() {
  if (dot(vec4(place, 1.0), section) > 0.0) discard;
  int id = stone + 1;
  colour = vec4(float(id & 255), float((id >> 8) & 255), float((id >> 16) & 255), 255.0) / 255.0;
}`;
const LINE_VERTEX = `${HEAD}
uniform vec2 size; uniform float nearer;
layout(location=0) in vec3 begin; layout(location=1) in vec3 end; layout(location=2) in float owner; layout(location=3) in vec4 tint; layout(location=4) in float width;
layout(location=5) in vec2 corner;
out vec3 place; out vec4 line;
void main() {
  int stone = int(owner + 0.5);
  vec3 a = owner < 0.0 ? begin : placed(stone, begin), b = owner < 0.0 ? end : placed(stone, end);
  vec4 p = camera * vec4(a, 1.0), q = camera * vec4(b, 1.0);
  vec2 way = (q.xy / q.w - p.xy / p.w) * size;
  float far = length(way);
  vec2 across = far > 1e-6 ? vec2(-way.y, way.x) / far : vec2(0.0, 1.0);
  vec4 at = mix(p, q, corner.x);
  place = mix(a, b, corner.x); line = tint;
  at.xy += across * corner.y * width / size * at.w;
  at.z -= nearer * at.w;
  gl_Position = owner < 0.0 || shown(stone) > 0.5 ? at : NOWHERE;
}`;
const LINE_FRAGMENT = `${FRAGMENT}
in vec4 line;
void main() { if (dot(vec4(place, 1.0), section) > 0.0) discard; colour = line; }`;
const EDGE_VERTEX = `${HEAD}
uniform float rest;
layout(location=0) in vec3 corner; layout(location=1) in float owner; layout(location=2) in vec3 beyond;
out vec3 place; out vec4 line;
void main() {
  int stone = int(owner + 0.5);
  place = placed(stone, corner) + rest * beyond; line = vec4(0.1, 0.1, 0.1, 1.0);
  gl_Position = shown(stone) > 0.5 ? camera * vec4(place, 1.0) : NOWHERE;
}`;
const POINT_VERTEX = `${HEAD}
uniform float nearer;
layout(location=0) in vec3 corner; layout(location=1) in float owner; layout(location=2) in vec4 tint;
out vec3 place; out vec4 line;
void main() {
  int stone = int(owner + 0.5);
  place = placed(stone, corner); line = tint;
  gl_PointSize = 5.0;
  gl_Position = shown(stone) > 0.5 ? camera * vec4(place, 1.0) : NOWHERE;
  gl_Position.z -= nearer * gl_Position.w;
}`;

export class Renderer {
  /** @param canvas to draw on. Throws where the browser has no WebGL 2. */
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl;
    this.programs = {
      stone: this.program(STONE_VERTEX, STONE_FRAGMENT),
      pick: this.program(STONE_VERTEX, PICK_FRAGMENT),
      line: this.program(LINE_VERTEX, LINE_FRAGMENT),
      edge: this.program(EDGE_VERTEX, LINE_FRAGMENT),
      point: this.program(POINT_VERTEX, LINE_FRAGMENT),
    };
    this.poses = gl.createTexture();
    this.colours = gl.createTexture();
    this.meshes = {};
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

  /** Keep vertex arrays under a name; each attribute is [array, size], with `each` per instance; an index draws elements. */
  keep(name, attributes, count, index = null, each = 0) {
    const gl = this.gl;
    this.forget(name);
    const array = gl.createVertexArray(), buffers = [];
    gl.bindVertexArray(array);
    attributes.forEach(([values, size, kind = gl.FLOAT, corner = false], location) => {
      if (!values) return gl.disableVertexAttribArray(location);
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, kind, kind === gl.UNSIGNED_BYTE, 0, 0);
      gl.vertexAttribDivisor(location, each && !corner ? 1 : 0);
      buffers.push(buffer);
    });
    if (index) {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
      buffers.push(buffer);
    }
    gl.bindVertexArray(null);
    this.meshes[name] = { array, buffers, count: index ? index.length : count, indexed: Boolean(index) };
  }

  forget(name) {
    const mesh = this.meshes[name];
    if (!mesh) return;
    mesh.buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
    this.gl.deleteVertexArray(mesh.array);
    delete this.meshes[name];
  }

  keepLines(name, lines) {
    const corners = new Float32Array([0, -0.5, 1, -0.5, 0, 0.5, 1, 0.5]);
    const { begin, end, owner, tint, width } = lines, gl = this.gl;
    const attributes = [[begin, 3], [end, 3], [owner, 1], [tint, 4, gl.UNSIGNED_BYTE], [width, 1], [corners, 2, gl.FLOAT, true]];
    if (owner.length) this.keep(name, attributes, owner.length, null, 1);
    else this.forget(name);
  }

  texture(texture, values, texels, float) {
    const gl = this.gl, rows = Math.max(1, Math.ceil(texels / WIDTH));
    const whole = float ? new Float32Array(4 * WIDTH * rows) : new Uint8Array(4 * WIDTH * rows);
    whole.set(values);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    const [inside, kind] = float ? [gl.RGBA32F, gl.FLOAT] : [gl.RGBA8, gl.UNSIGNED_BYTE];
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, WIDTH, rows, 0, gl.RGBA, kind, whole);
  }

  setPoses(values) { this.texture(this.poses, values, values.length / 4, true); }
  setColours(values) { this.texture(this.colours, values, values.length / 4, false); }

  /** Fit the drawing buffer to the canvas, with so many pixels for one of CSS. */
  resize(ratio) {
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
  }

  use(name, view) {
    const gl = this.gl, { program, at } = this.programs[name];
    gl.useProgram(program);
    gl.uniformMatrix4fv(at("camera"), false, view.matrix);
    gl.uniform4fv(at("section"), view.section);
    gl.uniform1i(at("poses"), 0);
    gl.uniform1i(at("colours"), 1);
    gl.uniform1f(at("rest"), view.rest);
    gl.uniform2f(at("size"), this.canvas.width / 2, this.canvas.height / 2);
    gl.uniform3fv(at("sight"), view.sight);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.poses);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.colours);
    gl.activeTexture(gl.TEXTURE0);
    return at;
  }

  drawMesh(name, mode, instances = 0) {
    const gl = this.gl, mesh = this.meshes[name];
    gl.bindVertexArray(mesh.array);
    if (instances) gl.drawArraysInstanced(mode, 0, instances, mesh.count);
    else if (mesh.indexed) gl.drawElements(mode, mesh.count, gl.UNSIGNED_INT, 0);
    else gl.drawArrays(mode, 0, mesh.count);
    gl.bindVertexArray(null);
  }

  /** Draw a view: matrix, section, rest, sight, background, byVertex, seeThrough, and the names of what is shown. */
  draw(view) {
    const gl = this.gl;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...view.background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const stones = () => {
      const at = this.use("stone", view);
      gl.uniform1i(at("byVertex"), view.byVertex ? 1 : 0);
      gl.uniform1f(at("alpha"), view.seeThrough ? 0.16 : 1);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      this.drawMesh("stones", gl.TRIANGLES);
      gl.disable(gl.POLYGON_OFFSET_FILL);
    };
    if (!view.seeThrough) stones();
    if (view.edges) {
      this.use("edge", view);
      this.drawMesh("edges", gl.LINES);
    }
    for (const name of view.sheets.filter((one) => this.meshes[one])) {
      const at = this.use("stone", view);
      gl.uniform1i(at("byVertex"), 1);
      gl.uniform1f(at("alpha"), 1);
      this.drawMesh(name, gl.TRIANGLES);
    }
    for (const name of view.lines.filter((one) => this.meshes[one])) {
      const at = this.use("line", view);
      gl.uniform1f(at("nearer"), view.seeThrough ? 0.0 : 0.001);
      this.drawMesh(name, gl.TRIANGLE_STRIP, 4);
    }
    if (view.points && this.meshes.points) {
      const at = this.use("point", view);
      gl.uniform1f(at("nearer"), 0.0006);
      this.drawMesh("points", gl.POINTS);
    }
    if (view.seeThrough) {
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      gl.depthMask(false);
      stones();
      gl.depthMask(true);
      gl.disable(gl.BLEND);
    }
  }

  /** Return the number of the stone under a CSS pixel of the canvas, or -1. */
  pick(view, x, y) {
    const gl = this.gl, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!this.target || this.target.width !== width || this.target.height !== height) this.makeTarget(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.frame);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(x, height - 1 - y, 1, 1);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.use("pick", view);
    this.drawMesh("stones", gl.TRIANGLES);
    const pixel = new Uint8Array(4);
    gl.readPixels(x, height - 1 - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixel[0] + 256 * pixel[1] + 65536 * pixel[2] - 1;
  }

  makeTarget(width, height) {
    const gl = this.gl;
    if (this.target) [gl.deleteFramebuffer(this.target.frame), this.target.parts.forEach((one) => gl.deleteRenderbuffer(one))];
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    const parts = [[gl.RGBA8, gl.COLOR_ATTACHMENT0], [gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]].map(([format, place]) => {
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
      return buffer;
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.target = { frame, parts, width, height };
  }
}
