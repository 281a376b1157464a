// The panel beside the picture: search, stone, colour, time, section, what is shown.

import { mapNames, quantity, written } from "./colours.js";
import { say } from "./words.js";

const MOST = 40; // hits of a search that are listed

/** Make an element; `on…` properties are listeners, texts stay texts. */
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties))
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) made.setAttribute(name, value === true ? "" : value);
  made.append(...children.filter((one) => one !== null));
  return made;
}

const labelled = (text, control) => element("label", {}, element("span", {}, text), control);
const group = (title, open, ...children) => element("details", open ? { open: true } : {}, element("summary", {}, title), ...children);

function choice(options, value, onchange, name) {
  const groups = new Map(), made = element("select", { "aria-label": name, onchange: () => onchange(made.value) });
  for (const [key, text, heading] of options) {
    const option = element("option", { value: key }, text);
    if (!heading) made.append(option);
    else {
      if (!groups.has(heading)) made.append(groups.set(heading, element("optgroup", { label: say(heading) })).get(heading));
      groups.get(heading).append(option);
    }
  }
  made.value = value;
  return made;
}

export class Panel {
  constructor(viewer) {
    this.viewer = viewer;
    this.controls = {};
    this.hits = element("ul", { class: "hits" });
    this.stone = element("div", { class: "stone" }, element("p", {}, "No stone is selected: click one, or search."));
    const motion = viewer.model.motion, mechanisms = viewer.model.mechanisms;
    this.root = element("aside", { class: "panel", "aria-label": "What is shown" },
      this.search(), group("Stone", true, this.stone), this.colour(),
      motion || mechanisms.length ? this.shape() : null, this.shown(), this.cuts(), this.help());
  }

  /** Put the state into the controls. */
  update() {
    const { state, stage } = this.viewer, c = this.controls;
    const set = (name, value) => c[name] && document.activeElement !== c[name] && (c[name].value = value);
    set("by", state.colour.by ?? "");
    set("map", state.colour.map);
    const scale = stage.scale(state.colour.by);
    for (const end of ["low", "high"]) {
      set(end, scale && !scale.text ? Number(state.colour[end].toPrecision(4)) : "");
      c[end].disabled = !scale || scale.text;
    }
    c.unit.textContent = scale && !scale.text && scale.unit !== "-" ? scale.unit : "";
    set("instant", state.instant);
    set("factor", state.factor);
    set("mechanism", state.mechanism);
    if (c.relative) c.relative.checked = state.relative;
    if (c.time) c.time.textContent = `${written(this.viewer.model.motion.times[state.instant])} s`;
    if (c.play) c.play.textContent = say(this.viewer.playing ? "Pause" : "Play");
    set("axis", state.section.axis);
    set("at", state.section.at);
    c.flip.checked = state.section.flip;
    set("explodeBy", state.explode.by);
    set("amount", state.explode.amount);
    set("joint", state.joint.by);
    for (const [name, box] of Object.entries(c.shown)) box.checked = state.show.includes(name);
  }

  search() {
    const field = element("input", { type: "search", placeholder: "Code or kind", "aria-label": "Search by code or kind",
      oninput: () => this.list(field.value), onkeydown: (event) => event.key === "Enter" && this.viewer.select(this.found(field.value)[0] ?? -1, true) });
    this.controls.search = field;
    const isolate = element("button", { type: "button", onclick: () => field.value && this.viewer.isolate(this.found(field.value)) }, "Isolate these");
    return group("Search", true, field, isolate, this.hits);
  }

  found(text) {
    const wanted = text.trim().toLowerCase(), kinds = this.viewer.stage.scale("kind");
    if (!wanted) return [];
    const exact = [], others = [];
    this.viewer.model.codes.forEach((code, i) => {
      const own = code.toLowerCase(), kind = kinds && kinds.values[i] >= 0 ? kinds.words[kinds.values[i]].toLowerCase() : "";
      if (own === wanted) exact.push(i);
      else if (own.includes(wanted) || kind.includes(wanted)) others.push(i);
    });
    return [...exact, ...others];
  }

  list(text) {
    const found = this.found(text);
    this.hits.replaceChildren(...found.slice(0, MOST).map((i) =>
      element("li", {}, element("button", { type: "button", onclick: () => this.viewer.select(i, true) }, this.viewer.model.codes[i]))));
    if (found.length > MOST) this.hits.append(element("li", {}, `… ${found.length}`));
  }

  colour() {
    const { viewer, controls: c } = this, { state, stage } = viewer;
    const options = [["", "no colour"], ...stage.scales.map((one) => [one.name, one.label, one.group])];
    c.by = choice(options, state.colour.by ?? "", (by) => viewer.colourBy(by), "Colour by");
    c.map = choice(mapNames.map((one) => [one, one]), state.colour.map, (map) => viewer.change({ colour: { ...state.colour, map } }), "Colours");
    const end = (name, text) => (c[name] = element("input", { type: "number", step: "any", "aria-label": text,
      onchange: () => c[name].value !== "" && viewer.change({ colour: { ...state.colour, [name]: Number(c[name].value) } }) }));
    c.unit = element("span", { class: "unit" });
    const reset = element("button", { type: "button", onclick: () => viewer.colourBy(state.colour.by) }, "Whole range");
    return group("Colour", true, labelled("Colour by", c.by), labelled("Colours", c.map),
      element("div", { class: "row" }, end("low", "From"), "–", end("high", "To"), c.unit, reset));
  }

  shape() {
    const { viewer, controls: c } = this, { state, model } = viewer, parts = [];
    if (model.mechanisms.length) {
      const options = [["-1", "as it stands"], ...model.mechanisms.map((one, i) => [String(i), one.name])];
      c.mechanism = choice(options, String(state.mechanism), (i) => viewer.change({ mechanism: Number(i) }), "Mechanism");
      c.about = element("p", { class: "about" });
      parts.push(labelled("Mechanism", c.mechanism), c.about);
    }
    c.factor = element("input", { type: "number", min: 0, step: "any", "aria-label": "Exaggeration",
      onchange: () => viewer.change({ factor: Math.max(0, Number(c.factor.value) || 0) }) });
    const good = element("button", { type: "button", onclick: () => viewer.change({ factor: viewer.stage.goodFactor(state) }) }, "Choose");
    parts.push(element("div", { class: "row" }, labelled("Exaggeration ×", c.factor), model.motion ? good : null));
    if (model.motion) {
      c.relative = element("input", { type: "checkbox", onchange: () => viewer.change({ relative: c.relative.checked }) });
      parts.push(labelled("Seen from the supports", c.relative));
      c.instant = element("input", { type: "range", min: 0, max: viewer.stage.instants - 1, step: 1, "aria-label": "Time",
        oninput: () => viewer.change({ instant: Number(c.instant.value) }) });
      c.time = element("output", {});
      c.play = element("button", { type: "button", onclick: () => viewer.play() }, "Play");
      parts.push(element("div", { class: "row" }, labelled("Time", c.instant), c.time, c.play));
    }
    return group("Shape and time", true, ...parts);
  }

  shown() {
    const { viewer, controls: c } = this, { model, state } = viewer;
    const names = [["edges", "Edges"], ["glass", "Stones transparent"]];
    if (model.joints || model.mechanisms.some((one) => one.joints)) names.push(["joints", "Joints"], ["forces", "Resultants of the joints"], ["thrust", "Paths of forces"]);
    if (model.mechanisms.length) names.push(["arrows", "Arrows of the mechanism"]);
    if (model.points) names.push(["points", "Measured points"]);
    model.lines.forEach((one) => names.push([`line ${one.name}`, one.name]));
    c.shown = {};
    const boxes = names.map(([name, text]) => {
      const box = (c.shown[name] = element("input", { type: "checkbox", onchange: () => viewer.show(name, box.checked) }));
      return labelled(text, box);
    });
    const joints = model.joints ?? model.mechanisms.find((one) => one.joints)?.joints;
    if (joints) {
      c.joint = choice(joints.columns.map((one) => [one.name, one.label]), state.joint.by, (by) => viewer.change({ joint: { by } }), "Colour of joints");
      boxes.push(labelled("Colour of joints", c.joint));
    }
    return group("Show", false, ...boxes);
  }

  cuts() {
    const { viewer, controls: c } = this, { state } = viewer, axes = viewer.model.axes;
    c.axis = choice([["", "none"], ...["x", "y", "z"].map((one, k) => [one, axes[k]])], state.section.axis, (axis) => viewer.change({ section: { ...state.section, axis } }), "Section across");
    c.at = element("input", { type: "range", min: 0, max: 1, step: 0.005, "aria-label": "Place of the section",
      oninput: () => viewer.change({ section: { ...state.section, at: Number(c.at.value) } }) });
    c.flip = element("input", { type: "checkbox", onchange: () => viewer.change({ section: { ...state.section, flip: c.flip.checked } }) });
    const groups = viewer.stage.scales.filter((one) => ["course", "phase", "zone", "ring", "kind"].includes(one.name));
    c.explodeBy = choice([["", "none"], ...groups.map((one) => [one.name, one.label])], state.explode.by, (by) => viewer.change({ explode: { by, amount: state.explode.amount || 0.5 } }), "Explode by");
    c.amount = element("input", { type: "range", min: 0, max: 1, step: 0.02, "aria-label": "Distance of the parts",
      oninput: () => viewer.change({ explode: { ...state.explode, amount: Number(c.amount.value) } }) });
    return group("Section and parts", false, labelled("Section across", c.axis), c.at, labelled("Other side", c.flip),
      labelled("Explode by", c.explodeBy), c.amount);
  }

  help() {
    const keys = [["arrow keys", "turn"], ["Shift + arrow keys", "move"], ["+ −", "nearer, farther"], ["1 … 6", "elevations, plan, 3D"],
      ["O", "perspective or to scale"], ["F", "show all of it"], ["N B", "next or previous stone"], ["H I A", "hide, isolate, show all"],
      ["P", "play"], [", .", "instant before or after"], ["/", "search"], ["Esc", "select nothing"]];
    return group("Keys", false, element("dl", {}, ...keys.flatMap(([key, text]) => [element("dt", {}, key), element("dd", {}, text)])));
  }

  /** Tell all that is known of a stone. */
  tell(stone) {
    const { model, stage, state } = this.viewer;
    if (stone < 0) {
      this.stone.replaceChildren(element("p", {}, say("No stone is selected: click one, or search.")));
      return;
    }
    const parts = [element("h3", {}, model.codes[stone])];
    const groups = new Map();
    for (const scale of stage.scales.filter((one) => !one.byVertex)) {
      const value = scale.at(state)[stone], text = scale.text ? scale.words[value] : Number.isNaN(value) ? undefined : quantity(value, scale.unit);
      if (text !== undefined) groups.set(scale.group, [...(groups.get(scale.group) ?? []), [say(scale.label), text]]);
    }
    // what a run found comes after what was known
    for (const [title, rows] of [...groups].sort(([a], [b]) => (a === "Results") - (b === "Results"))) parts.push(this.table(title, rows));
    parts.push(this.table("Relations", this.relations(stone)), this.table("Joints", this.jointRows(stone)),
      this.table("Measured points", this.pointRows(stone)),
      this.table("History", model.events.filter((one) => one[0] === stone).map(([, when, who, what]) => [`${when} ${who}`, what])));
    this.stone.replaceChildren(...parts.filter(Boolean));
  }

  table(title, rows) {
    if (!rows.length) return null;
    const cells = ([name, value]) => element("tr", {}, element("th", {}, name), element("td", {}, ...(Array.isArray(value) ? value : [value])));
    return element("section", {}, element("h4", {}, say(title)), element("table", {}, ...rows.map(cells)));
  }

  link(stone) {
    return element("button", { type: "button", class: "code", onclick: () => this.viewer.select(stone, true) }, this.viewer.model.codes[stone]);
  }

  relations(stone) {
    const { relations } = this.viewer.model, found = new Map();
    if (!relations) return [];
    for (let i = 0; i < relations.kind.length; i++) {
      const subject = relations.pairs[2 * i], object = relations.pairs[2 * i + 1];
      if (subject !== stone && object !== stone) continue;
      const name = say((subject === stone ? relations.names : relations.inverse)[relations.kind[i]]);
      found.set(name, [...(found.get(name) ?? []), this.link(subject === stone ? object : subject)]);
    }
    return [...found];
  }

  jointRows(stone) {
    const joints = this.viewer.stage.joints(this.viewer.state), rows = [];
    if (!joints) return rows;
    for (let j = 0; j < joints.counts.length; j++) {
      const first = joints.bodies[2 * j], second = joints.bodies[2 * j + 1];
      if (first !== stone && second !== stone) continue;
      const force = Math.hypot(...joints.force.subarray(3 * j, 3 * j + 3));
      const told = joints.columns.filter((one) => !Number.isNaN(one.values[j]) && one.values[j] !== 0).map((one) => `${say(one.label)} ${quantity(one.values[j], one.unit)}`);
      rows.push([[...[this.link(first === stone ? second : first)]][0].textContent, [quantity(force, "N"), element("br"), told.join(", ")]]);
    }
    return rows;
  }

  pointRows(stone) {
    const { points, origin } = this.viewer.model, rows = [];
    if (!points) return rows;
    for (let i = 0; i < points.owner.length; i++)
      if (points.owner[i] === stone) {
        const place = [0, 1, 2].map((k) => (points.places[3 * i + k] + origin[k]).toFixed(4));
        rows.push([String(rows.length + 1), `${place.join(", ")} m${points.rejected[i] ? `, ${say("left out as a blunder")}` : ""}`]);
      }
    return rows;
  }
}
