"use strict";
// Stones are values that are never changed: an edit makes a new list, so that undo is the list before it.
const data = JSON.parse(document.getElementById("data").textContent);
const at = (id) => document.getElementById(id);
const canvas = at("view"), pen = canvas.getContext("2d");
const KINDS = ["stretcher", "header", "quoin", "voussoir", "keystone", "springer", "jamb", "sill", "lintel", "rubble", "ashlar"];
const [[a, b], [c, d]] = data.matrix, [ox, oy] = data.origin, turn = a * d - b * c;
const toPixel = ([x, y]) => [(d * (x - ox) - b * (y - oy)) / turn + 0.5, (a * (y - oy) - c * (x - ox)) / turn + 0.5];
const toMetres = ([u, v]) => [a * (u - 0.5) + b * (v - 0.5) + ox, c * (u - 0.5) + d * (v - 0.5) + oy];

let stones = data.stones.map((one) => ({ code: one.code, said: one.said, ring: one.ring.map(toPixel), metres: one.ring }));
let past = [], future = [], selected = [], mode = "", points = [], saved = stones, seen = -1, view = { x: 0, y: 0, zoom: 1 };
const settled = new Set();
const picture = new Image();
let paths = null;

function area(ring) {
  let sum = 0;
  ring.forEach((p, k) => { const q = ring[(k + 1) % ring.length]; sum += p[0] * q[1] - q[0] * p[1]; });
  return sum / 2;
}
function inside(ring, [x, y]) {
  let is = false;
  ring.forEach(([px, py], k) => {
    const [qx, qy] = ring[(k + 1) % ring.length];
    if (py > y !== qy > y && x < ((qx - px) * (y - py)) / (qy - py) + px) is = !is;
  });
  return is;
}
function crosses(p, q, r, s) {
  const side = (u, v, w) => Math.sign((v[0] - u[0]) * (w[1] - u[1]) - (v[1] - u[1]) * (w[0] - u[0]));
  return side(p, q, r) * side(p, q, s) < 0 && side(r, s, p) * side(r, s, q) < 0;
}
function isSimple(ring) {
  const n = ring.length;
  for (let i = 0; i < n; i++) for (let j = i + 2; j < n; j++) {
    if (i === 0 && j === n - 1) continue;
    if (crosses(ring[i], ring[i + 1], ring[j], ring[(j + 1) % n])) return false;
  }
  return true;
}
const along = (ring, from, to) => { const out = []; for (let k = from; ; k = (k + 1) % ring.length) { out.push(ring[k]); if (k === to) return out; } };

// The union of two stones and the joint between them: two bridges between their corners, the largest that does not cross itself.
function joinedRing(one, other) {
  const A = area(one) < 0 ? [...one].reverse() : one, B = area(other) < 0 ? [...other].reverse() : other;
  const bridges = [];
  A.forEach((p, i) => B.forEach((q, j) => bridges.push([Math.hypot(p[0] - q[0], p[1] - q[1]), i, j])));
  bridges.sort((p, q) => p[0] - q[0]);
  const few = bridges.slice(0, 60), most = area(A) + area(B);
  let best = null, size = 0;
  for (const [, i, j] of few) for (const [, k, l] of few) {
    if (i === k && j === l) continue;
    const ring = [...along(A, k, i), ...along(B, j, l)];
    const found = area(ring);
    if (found > size && found > most * 0.98 && found < most * 1.6 && isSimple(ring)) { best = ring; size = found; }
  }
  return best;
}
// Two parts of a ring by the line through two places.
function splitRings(ring, p, q) {
  const hits = [];
  ring.forEach((r, k) => {
    const s = ring[(k + 1) % ring.length];
    const det = (q[0] - p[0]) * (s[1] - r[1]) - (q[1] - p[1]) * (s[0] - r[0]);
    if (!det) return;
    const t = ((q[0] - p[0]) * (p[1] - r[1]) - (q[1] - p[1]) * (p[0] - r[0])) / det;
    if (t >= 0 && t < 1) hits.push([k, [r[0] + t * (s[0] - r[0]), r[1] + t * (s[1] - r[1])]]);
  });
  if (hits.length !== 2) return null;
  const [[i, first], [j, second]] = hits;
  const one = [first, ...ring.slice(i + 1, j + 1), second], other = [second, ...ring.slice(j + 1), ...ring.slice(0, i + 1), first];
  return Math.min(Math.abs(area(one)), Math.abs(area(other))) > 4 ? [one, other] : null;
}

function change(next, select = []) {
  past.push(stones); future = []; stones = next; selected = select; paths = null; show();
}
function undo() { if (past.length) { future.push(stones); stones = past.pop(); selected = []; paths = null; show(); } }
function redo() { if (future.length) { past.push(stones); stones = future.pop(); selected = []; paths = null; show(); } }
function fresh(base) {
  const taken = new Set(stones.map((one) => one.code));
  for (let k = 1; ; k++) if (!taken.has(`${base}${k}`)) return `${base}${k}`;
}
const byHand = (said) => ({ ...said, evidence: "corrected by hand", score: 1 });
const remade = (one, ring, said = one.said, code = one.code) => ({ code, said: byHand(said), ring, metres: null });
function say(text) { at("doubt").textContent = text; }

function join() {
  if (selected.length !== 2) return say("Select two stones to join: click one, Shift and click the other.");
  const [one, other] = selected.map((k) => stones[k]), ring = joinedRing(one.ring, other.ring);
  if (!ring) return say("These two are no neighbours that make one outline.");
  const larger = Math.abs(area(one.ring)) >= Math.abs(area(other.ring)) ? one : other;
  const next = stones.filter((_, k) => !selected.includes(k));
  change([...next, remade(larger, ring)], [next.length]);
}
function split(p, q) {
  const k = selected[0];
  const parts = k === undefined ? null : splitRings(stones[k].ring, p, q);
  if (!parts) return say("The line does not cross the selected stone from side to side.");
  const next = stones.filter((_, n) => n !== k), one = stones[k];
  change([...next, remade(one, parts[0]), remade(one, parts[1], one.said, fresh(`${one.code}-`))], [next.length]);
}
function draw(ring) {
  if (ring.length < 3 || !isSimple(ring) || Math.abs(area(ring)) < 4) return say("An outline has three corners or more and does not cross itself.");
  change([...stones, { code: fresh("N"), said: { kind: "stretcher", evidence: "corrected by hand", score: 1 }, ring, metres: null }], [stones.length]);
}
function remove() { if (selected.length) change(stones.filter((_, k) => !selected.includes(k))); }
function moveCorner(k, n, place) {
  const ring = stones[k].ring.map((p, m) => (m === n ? place : p));
  if (!isSimple(ring)) return say("The outline would cross itself.");
  change(stones.map((one, m) => (m === k ? remade(one, ring) : one)), [k]);
}
function addCorner(k, n, place) {
  const ring = [...stones[k].ring.slice(0, n + 1), place, ...stones[k].ring.slice(n + 1)];
  change(stones.map((one, m) => (m === k ? remade(one, ring) : one)), [k]);
}
function setSaid(name, value) {
  if (selected.length !== 1) return;
  const k = selected[0], one = stones[k], said = { ...one.said };
  if (name === "code") {
    if (!value.trim() || stones.some((other, n) => n !== k && other.code === value.trim())) return say("Each stone has a code of its own."), show();
    return change(stones.map((other, n) => (n === k ? { ...one, said: byHand(said), code: value.trim() } : other)), [k]);
  }
  if (name === "course" && value && !/^\d{1,5}$/.test(value)) return say("Courses are whole numbers from the ground."), show();
  if (value) said[name] = name === "course" ? Number(value) : value; else delete said[name];
  change(stones.map((other, n) => (n === k ? { ...one, said: byHand(said) } : other)), [k]);
}

function text() {
  const features = stones.map((one) => {
    const ring = (one.metres || one.ring.map(toMetres)).map(([x, y]) => [Number(x.toFixed(5)), Number(y.toFixed(5))]);
    return JSON.stringify({ type: "Feature", properties: { code: one.code, ...one.said }, geometry: { type: "Polygon", coordinates: [[...ring, ring[0]]] } });
  });
  return `{"type": "FeatureCollection", "about": ${JSON.stringify(data.title)}, "features": [\n${features.join(",\n")}\n]}\n`;
}
function download(content) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type: "application/geo+json" }));
  link.download = "corrected.geojson";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
// A page that moma serve --edit shows sends its stones there; any other one hands a file to the browser.
async function send(content) {
  const answer = await fetch(document.body.dataset.save, { method: "POST", body: content, headers: { "Content-Type": "application/geo+json" } });
  const told = await answer.json();
  if (!answer.ok) throw new Error(told.error);
  return told.text;
}
async function save() {
  const now = stones;
  try {
    const told = await window.momaOutlines.download(text());
    saved = now;
    show();
    say(told || "Saved. Take it back with: moma outlines PICTURE --corrected corrected.geojson");
  } catch (error) {
    say(`Not saved: ${error.message}. All edits are still here; try again.`);
  }
}

function nextDoubt() {
  const open = data.doubts.map((one, k) => [one, k]).filter(([one, k]) => !settled.has(k) && one.stones.every((code) => stones.some((s) => s.code === code)));
  if (!open.length) return say("No doubts are left.");
  const [one, k] = open.find(([, n]) => n > seen) || open[0];
  seen = k;
  selected = one.stones.map((code) => stones.findIndex((s) => s.code === code));
  const [u, v] = toPixel([one.x, one.y]);
  view.zoom = Math.max(view.zoom, Math.min(canvas.width, canvas.height) / (0.35 * Math.max(data.width, data.height)));
  view.x = u - canvas.width / (2 * view.zoom); view.y = v - canvas.height / (2 * view.zoom);
  show();
  say(`${one.text} (${open.length} open)`);
}
function keep() { if (seen >= 0) { settled.add(seen); nextDoubt(); } }

const colour = (one) => (one.said.evidence === "corrected by hand" ? 2 : (one.said.score ?? 1) < 0.9 ? 1 : 0);
const COLOURS = ["#18b04a", "#ff9d00", "#2f7bff"];
function trace(path, ring) { ring.forEach(([x, y], k) => (k ? path.lineTo(x, y) : path.moveTo(x, y))); path.closePath(); }
function paint() {
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.setTransform(view.zoom, 0, 0, view.zoom, -view.x * view.zoom, -view.y * view.zoom);
  pen.imageSmoothingEnabled = view.zoom < 2;
  if (picture.complete && picture.naturalWidth) pen.drawImage(picture, 0, 0, data.width, data.height);
  if (!paths) {
    paths = COLOURS.map(() => new Path2D());
    for (const one of stones) trace(paths[colour(one)], one.ring);
  }
  pen.lineWidth = 2 / view.zoom;
  paths.forEach((path, k) => { pen.strokeStyle = COLOURS[k]; pen.stroke(path); });
  for (const k of selected) {
    if (!stones[k]) continue;
    const path = new Path2D();
    trace(path, dragging && dragging.corner && dragging.stone === k ? stones[k].ring.map((p, n) => (n === dragging.corner - 1 ? dragging.place : p)) : stones[k].ring);
    pen.fillStyle = "rgba(47,123,255,.25)"; pen.fill(path);
    pen.strokeStyle = "#fff"; pen.stroke(path);
    pen.fillStyle = "#fff";
    for (const [x, y] of stones[k].ring) pen.fillRect(x - 4 / view.zoom, y - 4 / view.zoom, 8 / view.zoom, 8 / view.zoom);
  }
  if (points.length) {
    pen.strokeStyle = "#f0f"; pen.beginPath();
    points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }
}
let asked = false;
function repaint() { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; paint(); }); } }
function facts() {
  const count = (kind) => stones.filter((one) => one.said.kind === kind).length;
  const rows = [["Stones", stones.length], ["Courses", new Set(stones.map((one) => one.said.course).filter((one) => one !== undefined)).size],
    ["Headers to stretchers", `${count("header")} : ${count("stretcher")}`], ["By hand", stones.filter((one) => colour(one) === 2).length],
    ["Doubtful", stones.filter((one) => colour(one) === 1).length], ...data.facts];
  at("facts").replaceChildren(...rows.map((row) => {
    const line = document.createElement("tr");
    line.append(...row.map((value) => { const cell = document.createElement("td"); cell.textContent = value; return cell; }));
    return line;
  }));
}
function show() {
  const one = selected.length === 1 ? stones[selected[0]] : null;
  at("code").value = one ? one.code : ""; at("kind").value = one ? one.said.kind || "" : ""; at("course").value = one ? one.said.course ?? "" : "";
  at("state").textContent = `${stones.length} stones${stones === saved ? "" : ", not saved"}`;
  for (const name of ["split", "draw"]) at(name).setAttribute("aria-pressed", mode === name);
  at("undo").disabled = !past.length; at("redo").disabled = !future.length;
  facts(); repaint();
}
function enter(name) {
  mode = mode === name ? "" : name; points = [];
  say(mode === "split" ? "Click on both sides of the selected stone." : mode === "draw" ? "Click the corners; Enter closes the outline." : "");
  show();
}
function fit() {
  view.zoom = Math.min(canvas.width / data.width, canvas.height / data.height) || 1;
  view.x = (data.width - canvas.width / view.zoom) / 2; view.y = (data.height - canvas.height / view.zoom) / 2;
  repaint();
}
function zoom(factor, x = canvas.width / 2, y = canvas.height / 2) {
  const next = Math.min(40, Math.max(0.02, view.zoom * factor));
  view.x += x / view.zoom - x / next; view.y += y / view.zoom - y / next; view.zoom = next;
  repaint();
}

const pointers = new Map();
let dragging = null, ratio = 1;
const local = (event) => { const box = canvas.getBoundingClientRect(); return [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio]; };
const placed = ([x, y]) => [x / view.zoom + view.x, y / view.zoom + view.y];
canvas.addEventListener("pointerdown", (event) => {
  canvas.focus(); canvas.setPointerCapture(event.pointerId);
  const spot = local(event), place = placed(spot);
  pointers.set(event.pointerId, spot);
  if (pointers.size === 2) { dragging = { pinch: true }; return; }
  dragging = { spot, from: { ...view }, moved: false };
  const reach = (event.pointerType === "touch" ? 18 : 8) * ratio / view.zoom;
  for (const k of mode ? [] : selected) {
    const n = stones[k].ring.findIndex((p) => Math.hypot(p[0] - place[0], p[1] - place[1]) < reach);
    if (n >= 0) dragging = { stone: k, corner: n + 1, place, spot, moved: false };
  }
});
canvas.addEventListener("pointermove", (event) => {
  if (!pointers.has(event.pointerId)) return;
  const spot = local(event), before = [...pointers.values()];
  pointers.set(event.pointerId, spot);
  if (pointers.size === 2) {
    const now = [...pointers.values()], span = ([p, q]) => Math.hypot(p[0] - q[0], p[1] - q[1]) || 1, middle = ([p, q]) => [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
    const m = middle(before), n = middle(now);
    view.x -= (n[0] - m[0]) / view.zoom; view.y -= (n[1] - m[1]) / view.zoom;
    return zoom(span(now) / span(before), n[0], n[1]);
  }
  if (!dragging || dragging.pinch) return;
  if (Math.hypot(spot[0] - dragging.spot[0], spot[1] - dragging.spot[1]) > 4 * ratio) dragging.moved = true;
  if (dragging.corner) dragging.place = placed(spot);
  else if (dragging.moved) { view.x = dragging.from.x - (spot[0] - dragging.spot[0]) / view.zoom; view.y = dragging.from.y - (spot[1] - dragging.spot[1]) / view.zoom; }
  repaint();
});
function release(event) {
  const done = dragging, spot = local(event);
  pointers.delete(event.pointerId);
  if (pointers.size) return;
  dragging = null;
  if (!done || done.pinch) return;
  if (done.corner) { if (done.moved) moveCorner(done.stone, done.corner - 1, done.place); return repaint(); }
  if (done.moved) return;
  const place = placed(spot);
  if (mode === "draw") { points.push(place); return repaint(); }
  if (mode === "split") {
    points.push(place);
    if (points.length === 2) { const [p, q] = points; mode = ""; points = []; split(p, q); show(); }
    return repaint();
  }
  const k = stones.findLastIndex((one) => inside(one.ring, place));
  selected = k < 0 ? [] : event.shiftKey && selected.length === 1 && selected[0] !== k ? [selected[0], k] : [k];
  show();
}
canvas.addEventListener("pointerup", release);
canvas.addEventListener("pointercancel", (event) => { pointers.delete(event.pointerId); dragging = null; repaint(); });
canvas.addEventListener("dblclick", (event) => {
  if (mode || selected.length !== 1) return;
  const place = placed(local(event)), ring = stones[selected[0]].ring, reach = 8 * ratio / view.zoom;
  const n = ring.findIndex((p, k) => {
    const q = ring[(k + 1) % ring.length], length = Math.hypot(q[0] - p[0], q[1] - p[1]) || 1;
    const t = ((place[0] - p[0]) * (q[0] - p[0]) + (place[1] - p[1]) * (q[1] - p[1])) / length ** 2;
    return t > 0 && t < 1 && Math.hypot(p[0] + t * (q[0] - p[0]) - place[0], p[1] + t * (q[1] - p[1]) - place[1]) < reach;
  });
  if (n >= 0) addCorner(selected[0], n, place);
});
canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY * 0.0015), ...local(event)); }, { passive: false });

const ACTIONS = { next: nextDoubt, keep, join, split: () => enter("split"), draw: () => enter("draw"), delete: remove, undo, redo, fit, save };
for (const [name, act] of Object.entries(ACTIONS)) at(name).addEventListener("click", act);
for (const name of ["code", "kind", "course"]) at(name).addEventListener("change", (event) => setSaid(name, event.target.value));
at("stone").addEventListener("submit", (event) => event.preventDefault());
const KEYS = { n: nextDoubt, y: keep, j: join, s: () => enter("split"), d: () => enter("draw"), 0: fit, "+": () => zoom(1.25), "-": () => zoom(0.8),
  Delete: remove, Backspace: remove, Escape: () => { mode = ""; points = []; selected = []; show(); },
  Enter: () => { if (mode === "draw") { const ring = points; mode = ""; points = []; draw(ring); show(); } } };
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
document.addEventListener("keydown", (event) => {
  const typed = event.target.tagName === "INPUT", command = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
  if (command && key === "s") { event.preventDefault(); return save(); }
  if (typed) return;
  if (command && (key === "y" || (key === "z" && event.shiftKey))) { event.preventDefault(); return redo(); }
  if (command && key === "z") { event.preventDefault(); return undo(); }
  if (command || event.altKey || (event.target.tagName === "BUTTON" && event.key === "Enter")) return;
  if (MOVES[event.key]) { const [x, y] = MOVES[event.key]; view.x += (x * 60) / view.zoom; view.y += (y * 60) / view.zoom; return repaint(); }
  const act = KEYS[event.key] || KEYS[key];
  if (act) { event.preventDefault(); act(); }
});
window.addEventListener("beforeunload", (event) => { if (stones !== saved) event.preventDefault(); });
function resize() {
  ratio = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, canvas.clientWidth * ratio); canvas.height = Math.max(1, canvas.clientHeight * ratio);
  repaint();
}
new ResizeObserver(resize).observe(canvas);
at("kinds").replaceChildren(...KINDS.map((one) => { const option = document.createElement("option"); option.value = one; return option; }));
at("title").textContent = data.title;
window.momaOutlines = { download: document.body.dataset.save ? send : download, text, stones: () => stones, select: (many) => { selected = many; show(); }, join, split, draw, remove, moveCorner, setSaid, undo, redo, save, paint, view: (x, y, z) => { view = { x, y, zoom: z }; repaint(); } };
picture.onload = () => { resize(); fit(); document.documentElement.dataset.ready = "true"; };
picture.src = data.picture;
show();
