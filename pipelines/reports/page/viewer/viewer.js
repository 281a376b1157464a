// One viewer: canvas, panel, tools, keyboard and mouse, link to a view, picture of a view.

import { Camera, PIXEL, VIEWS } from "./camera.js";
import { gradient, mapNames, quantity, readable, wordColour, written, colourOf } from "./colours.js";
import { element, Panel } from "./panel.js";
import { Renderer } from "./renderer.js";
import { Stage } from "./stage.js";
import { say } from "./words.js";

const TURN = 0.008; // by a pixel of the mouse [rad]
const PLAY = 8; // seconds that a whole run plays, at most
const FEW = 12; // words of a legend
const FRAME = 25; // time for a frame in motion, which decides its resolution [ms]
const COARSEST = 0.3; // of that resolution
const REST = 200; // time without motion after which the full resolution is drawn [ms]

export class Viewer {
  /** @param root element of the viewer; @param model unpacked */
  constructor(root, model) {
    Object.assign(this, { root, model, playing: false, listeners: [], fineness: 1 });
    this.canvas = element("canvas", { tabindex: 0, role: "img", "aria-label": `3D view of ${model.title}; arrow keys turn it, N selects the next stone` });
    this.legend = element("div", { class: "legend" });
    this.bar = element("div", { class: "scale" });
    this.status = element("p", { class: "status", role: "status", "aria-live": "polite" });
    this.renderer = new Renderer(this.canvas);
    this.stage = new Stage(model, this.renderer);
    this.camera = new Camera(this.stage.box, model.towards);
    this.state = {
      colour: { by: model.colour, map: mapNames[0], low: 0, high: 1 }, instant: this.stage.instants - 1, factor: 1,
      relative: false, section: { axis: "", at: 0.5, flip: false }, explode: { by: "", amount: 0 }, hidden: [],
      selected: -1, joint: { by: (model.joints ?? model.mechanisms.find((one) => one.joints)?.joints)?.columns[0].name ?? "" },
      mechanism: model.mechanisms.length ? 0 : -1, show: ["edges", "arrows", ...(this.stage.flat ? [] : model.lines.map((one) => `line ${one.name}`))],
    };
    this.panel = new Panel(this);
    const notes = model.notes.map((one) => element("p", { class: "note" }, one));
    root.replaceChildren(this.tools(), element("div", { class: "stage" }, this.canvas, this.legend, this.bar), this.panel.root, this.status, ...notes);
    this.look(this.stage.flat ? "Front" : "3D");
    this.listen();
    this.colourBy(model.colour);
    this.fit();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  tools() {
    const button = (text, onclick, title = text) => element("button", { type: "button", title, onclick }, text);
    const views = Object.keys(VIEWS).map((name) => button(name, () => this.look(name)));
    return element("div", { class: "tools", role: "toolbar", "aria-label": "Views" }, ...views,
      button("To scale", () => this.toggleScale(), "Orthographic or perspective"), button("Fit", () => this.fit()),
      button("Hide", () => this.hide()), button("Isolate", () => this.isolate([this.state.selected])), button("Show all", () => this.isolate(null)),
      button("Link", () => this.copyLink(), "Link to this view"), button("PNG", () => this.savePicture(), "Picture of this view"));
  }

  look(name) { this.camera.look(name); this.fit(); }
  fit() { this.camera.fit(this.stage.box, this.canvas.clientWidth / this.canvas.clientHeight || 1.5); this.moved(); }
  toggleScale() { this.camera.state.ortho = !this.camera.state.ortho; this.moved(); }

  /** Change part of the state, and draw it. */
  change(part) {
    Object.assign(this.state, part);
    const state = this.state, keys = Object.keys(part);
    const any = (...names) => names.some((name) => keys.includes(name));
    const scale = this.stage.scale(state.colour.by);
    if (any("instant", "factor", "relative", "explode", "hidden", "mechanism")) this.stage.setPoses(state);
    if (any("colour", "selected") || (scale?.moving && any("instant", "relative"))) this.stage.setColours(state);
    if (any("joint", "mechanism") || (any("colour") && this.stage.joints(state))) this.stage.setJoints(state);
    if (any("mechanism")) {
      this.stage.setArrows(state);
      if (this.panel.controls.about) this.panel.controls.about.textContent = this.model.mechanisms[state.mechanism]?.about ?? "";
    }
    if (any("selected", "mechanism") || (any("instant") && state.selected >= 0)) this.panel.tell(state.selected);
    this.panel.update();
    this.drawLegend();
    this.moved();
  }

  colourBy(by) {
    const scale = this.stage.scale(by), colour = { ...this.state.colour, by: scale ? by : null };
    if (scale && !scale.text) [colour.low, colour.high] = this.stage.range(scale, this.state);
    this.change({ colour, instant: this.state.instant, mechanism: this.state.mechanism });
  }

  show(name, shown) {
    this.change({ show: [...this.state.show.filter((one) => one !== name), ...(shown ? [name] : [])] });
  }

  select(stone, centre = false) {
    if (centre && stone >= 0) this.camera.state.target = this.placeOf(stone);
    this.change({ selected: stone });
    this.status.textContent = stone < 0 ? "" : this.sentence(stone);
  }

  sentence(stone) {
    const kind = this.stage.scale("kind"), scale = this.stage.scale(this.state.colour.by), parts = [this.model.codes[stone]];
    if (kind && kind.values[stone] >= 0) parts.push(say(kind.words[kind.values[stone]]));
    if (scale && !scale.byVertex && scale !== kind) {
      const value = scale.at(this.state)[stone];
      if (scale.text ? value >= 0 : !Number.isNaN(value)) parts.push(`${say(scale.label)} ${scale.text ? scale.words[value] : quantity(value, scale.unit)}`);
    }
    return parts.join(", ");
  }

  placeOf(stone) {
    const p = this.stage.middles[stone], m = this.stage.poses.subarray(12 * stone, 12 * stone + 12);
    return [0, 4, 8].map((k) => m[k] * p[0] + m[k + 1] * p[1] + m[k + 2] * p[2] + m[k + 3]);
  }

  hide() {
    const { selected, hidden } = this.state;
    if (selected >= 0) this.change({ hidden: [...hidden, selected] });
  }

  /** Show only these stones; null: all. */
  isolate(stones) {
    if (stones === null) return this.change({ hidden: [] });
    const kept = new Set(stones.filter((one) => one >= 0));
    if (kept.size) this.change({ hidden: this.model.codes.map((_, i) => i).filter((i) => !kept.has(i)) });
  }

  play() {
    this.playing = !this.playing && this.stage.instants > 1;
    if (this.playing && this.state.instant === this.stage.instants - 1) this.change({ instant: 0 });
    const begun = performance.now(), first = this.state.instant, rate = Math.max(this.stage.instants / PLAY, 12) / 1000;
    const step = (now) => {
      if (!this.playing) return;
      const instant = Math.min(first + Math.floor((now - begun) * rate), this.stage.instants - 1);
      if (instant === this.stage.instants - 1) this.playing = false;
      if (instant !== this.state.instant || !this.playing) this.change({ instant });
      if (this.playing) requestAnimationFrame(step);
    };
    this.panel.update();
    if (this.playing) requestAnimationFrame(step);
  }

  /** After a change of camera or state: draw in the next frame, and keep the link to it. */
  moved() {
    this.draw();
    this.listeners.forEach((tell) => tell(this));
    clearTimeout(this.linking);
    if (this.root.dataset.link !== undefined) this.linking = setTimeout(() => history.replaceState(null, "", `#${this.hash()}`), 300);
  }

  draw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame((now) => {
      this.waiting = null;
      const passed = this.moving ? now - this.drawn : 0;
      Object.assign(this, { moving: true, drawn: now });
      if (passed) this.adapt(passed);
      this.drawNow(this.fineness);
      clearTimeout(this.resting);
      this.resting = setTimeout(() => { this.moving = false; this.drawNow(); }, Math.max(REST, 3 * passed));
    });
  }

  /** Choose the resolution that this machine manages in motion, by the time between two frames. */
  adapt(passed) {
    const change = Math.min(Math.max(Math.sqrt(FRAME / passed), 0.6), 1.1);
    this.fineness = Math.min(Math.max(this.fineness * change, COARSEST), 1);
  }

  /** What the renderer draws; in motion without edges where they would make it stop. */
  view(moving = false) {
    const { show } = this.state, aspect = this.canvas.clientWidth / this.canvas.clientHeight, dark = document.documentElement.dataset.theme === "dark";
    return {
      matrix: this.camera.matrix(aspect), section: this.stage.section(this.state), sight: this.camera.axes().back,
      background: dark ? [0.11, 0.12, 0.13] : [0.97, 0.97, 0.96],
      seeThrough: show.includes("glass"), closed: !this.stage.flat && !this.state.section.axis && !show.includes("glass"), edges: show.includes("edges") && !(moving && this.fineness <= COARSEST), points: show.includes("points"),
      sheets: show.includes("joints") ? ["joints"] : [],
      strokes: ["forces", "thrust", "arrows", ...this.model.lines.map((one) => `line ${one.name}`)].filter((one) => show.includes(one)),
    };
  }

  /** Draw with so many pixels for one of CSS; without a number, with enough for smooth edges. */
  drawNow(ratio = Math.min(1.5 * (window.devicePixelRatio || 1), 2)) {
    if (!this.canvas.clientWidth) return;
    this.renderer.resize(ratio);
    this.renderer.draw(this.view(this.moving));
    this.drawScale();
  }

  drawScale() {
    const { ortho, height } = this.camera.state;
    this.bar.hidden = !ortho;
    if (!ortho) return;
    const metres = height / this.canvas.clientHeight, nice = [1, 2, 5].map((one) => one * 10 ** Math.floor(Math.log10(metres * 120)));
    const long = nice.filter((one) => one <= metres * 120).at(-1);
    this.bar.style.width = `${long / metres}px`;
    this.bar.textContent = `${quantity(long, "m")} · 1 : ${written(metres / PIXEL, 3)}`;
  }

  drawLegend() {
    const { colour, factor, mechanism, instant, show } = this.state, scale = this.stage.scale(colour.by), parts = [];
    if (scale?.text) {
      const used = [...new Set(scale.values)].filter((one) => one >= 0).sort((a, b) => a - b);
      parts.push(element("b", {}, say(scale.label)), ...used.slice(0, FEW).map((one) => swatch(wordColour(one), say(scale.words[one]))));
      if (used.length > FEW) parts.push(element("span", {}, `… ${used.length}`));
    } else if (scale) parts.push(...this.ramp(scale.label, scale.unit, colour.low, colour.high));
    const joint = this.stage.jointScale;
    if (joint && show.includes("joints")) parts.push(...this.ramp(`${say("joints")}: ${say(joint.label)}`, joint.unit, 0, joint.high));
    if (show.includes("forces") && this.stage.joints(this.state)) parts.push(swatch([0, 90, 181], say("resultant within the kern")), swatch([220, 50, 32], say("outside")));
    if (this.model.motion && mechanism < 0) parts.push(element("span", {}, `${say("Displacements")} × ${written(factor)}${this.stage.instants > 1 ? `, t = ${written(this.model.motion.times[instant])} s` : ""}`));
    this.legend.replaceChildren(...parts);
  }

  ramp(label, unit, low, high) {
    const { factor, unit: name } = readable(unit, Math.max(Math.abs(low), Math.abs(high)));
    const bar = element("span", { class: "ramp" });
    bar.style.background = gradient(this.state.colour.map);
    return [element("b", {}, `${say(label)}${name ? ` [${name}]` : ""}`), bar,
      element("span", { class: "ends" }, element("span", {}, written(low / factor)), element("span", {}, written(high / factor)))];
  }

  /** The stone at a place of the canvas in CSS pixels, or -1. */
  stoneAt(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { eye, way } = this.camera.ray((2 * (Math.floor(x) + 0.5)) / width - 1, 1 - (2 * (Math.floor(y) + 0.5)) / height, width / height);
    return this.stage.hit(eye, way, this.stage.section(this.state));
  }

  listen() {
    let last = null, far = 0;
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (event) => { last = [event.clientX, event.clientY]; far = 0; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
      far += Math.abs(dx) + Math.abs(dy);
      last = [event.clientX, event.clientY];
      if (far < 4) return;
      if (event.shiftKey || event.buttons & 6) this.camera.pan(dx / canvas.clientHeight, -dy / canvas.clientHeight);
      else this.camera.orbit(dx * TURN, dy * TURN);
      this.moved();
    });
    canvas.addEventListener("pointerup", (event) => {
      if (last && far < 4) this.select(this.stoneAt(event.offsetX, event.offsetY));
      last = null;
    });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); this.camera.zoom(Math.exp(event.deltaY * 0.0012)); this.moved(); }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    const { state, count } = { state: this.state, count: this.stage.count };
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const next = (by) => {
      const hidden = new Set(state.hidden);
      let stone = state.selected;
      for (let i = 0; i < count; i++) { stone = (stone + by + count) % count; if (!hidden.has(stone)) break; }
      this.select(stone);
    };
    const go = (by) => this.change({ instant: Math.min(Math.max(state.instant + by, 0), this.stage.instants - 1) });
    const acts = {
      "+": () => { this.camera.zoom(1 / 1.15); this.moved(); }, "-": () => { this.camera.zoom(1.15); this.moved(); },
      o: () => this.toggleScale(), f: () => this.fit(), n: () => next(1), b: () => next(-1), h: () => this.hide(),
      i: () => this.isolate([state.selected]), a: () => this.isolate(null), p: () => this.play(), ",": () => go(-1), ".": () => go(1),
      "/": () => this.panel.controls.search.focus(), escape: () => this.select(-1),
    };
    acts["="] = acts["+"];
    Object.keys(VIEWS).forEach((name, i) => (acts[String(i + 1)] = () => this.look(name)));
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (step && event.shiftKey) this.camera.pan(-0.05 * step[0], -0.05 * step[1]);
    else if (step) this.camera.orbit(-0.1 * step[0], 0.1 * step[1]);
    else if (acts[event.key.toLowerCase()]) acts[event.key.toLowerCase()]();
    else return;
    event.preventDefault();
    if (step) this.moved();
  }

  /** The view as the part of an address after #. */
  hash() {
    const { hidden, selected, ...rest } = this.state, codes = this.model.codes, { lang } = document.documentElement;
    return `${lang && lang !== "en" ? `lang=${lang}&` : ""}view=${encodeURIComponent(JSON.stringify({ ...rest, camera: this.camera.state, selected: codes[selected] ?? null, hidden: hidden.map((i) => codes[i]) }))}`;
  }

  /** Take the view of an address; what does not fit this model is left out. */
  takeHash(hash) {
    const text = new URLSearchParams(hash.replace(/^#/, "")).get("view");
    if (!text) return;
    try {
      const { camera, selected, hidden, ...rest } = JSON.parse(text);
      Object.assign(this.camera.state, camera);
      const known = Object.fromEntries(Object.entries(rest).filter(([name]) => name in this.state));
      known.instant = Math.min(Math.max(Number(known.instant) || 0, 0), this.stage.instants - 1);
      known.mechanism = Math.min(Math.max(Number(known.mechanism ?? -1), -1), this.model.mechanisms.length - 1);
      this.change({ ...known, hidden: (hidden ?? []).map((code) => this.stage.number.get(code)).filter((i) => i !== undefined), selected: this.stage.number.get(selected) ?? -1 });
    } catch {
      this.status.textContent = say("This link does not describe a view.");
    }
  }

  async copyLink() {
    const address = `${location.href.split("#")[0]}#${this.hash()}`;
    history.replaceState(null, "", address);
    try {
      await navigator.clipboard.writeText(address);
      this.status.textContent = say("The link is copied.");
    } catch {
      this.status.textContent = say("The link is in the address line.");
    }
  }

  /** The view with its title, legend and scale as a canvas. */
  picture() {
    this.drawNow();
    const { width, height } = this.canvas, ratio = width / this.canvas.clientWidth;
    const made = element("canvas", { width, height }), pen = made.getContext("2d");
    pen.drawImage(this.canvas, 0, 0);
    pen.fillStyle = getComputedStyle(this.root).color;
    pen.font = `${13 * ratio}px sans-serif`;
    const lines = [this.model.title], scale = this.stage.scale(this.state.colour.by);
    if (!this.bar.hidden) lines.push(this.bar.textContent);
    if (this.model.motion) lines.push(this.legend.lastChild?.textContent ?? "");
    lines.forEach((line, i) => pen.fillText(line, 10 * ratio, (20 + 17 * i) * ratio));
    if (!scale) return made;
    const x = 10 * ratio, y = height - 40 * ratio;
    pen.fillText([...this.legend.querySelectorAll("b")].map((one) => one.textContent)[0], x, y - 6 * ratio);
    if (scale.text) {
      const used = [...new Set(scale.values)].filter((one) => one >= 0).sort((a, b) => a - b).slice(0, FEW);
      let at = x;
      for (const one of used) {
        pen.fillStyle = `rgb(${wordColour(one)})`;
        pen.fillRect(at, y, 12 * ratio, 12 * ratio);
        pen.fillStyle = getComputedStyle(this.root).color;
        pen.fillText(say(scale.words[one]), at + 16 * ratio, y + 11 * ratio);
        at += pen.measureText(say(scale.words[one])).width + 28 * ratio;
      }
      return made;
    }
    for (let i = 0; i < 200; i++) {
      pen.fillStyle = `rgb(${colourOf(this.state.colour.map, i / 199)})`;
      pen.fillRect(x + i * ratio, y, ratio + 1, 10 * ratio);
    }
    pen.fillStyle = getComputedStyle(this.root).color;
    const ends = this.legend.querySelector(".ends").children;
    pen.fillText(ends[0].textContent, x, y + 26 * ratio);
    pen.fillText(ends[1].textContent, x + 200 * ratio - pen.measureText(ends[1].textContent).width, y + 26 * ratio);
    return made;
  }

  savePicture() {
    this.picture().toBlob((blob) => {
      const link = element("a", { href: URL.createObjectURL(blob), download: `${this.model.title.replace(/[^\p{L}\p{N}]+/gu, "-")}.png` });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }

  /** Turn the camera for so many frames; return the milliseconds between them. */
  async turn(frames = 60) {
    const times = [];
    for (let i = 0; i <= frames; i++) {
      this.camera.orbit(0.03, 0);
      this.draw();
      times.push(await new Promise(requestAnimationFrame));
    }
    return times.slice(1).map((time, i) => time - times[i]);
  }
}

function swatch(colour, text) {
  const box = element("i", {});
  box.style.background = `rgb(${colour})`;
  return element("span", { class: "swatch" }, box, text);
}
