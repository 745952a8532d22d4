"use strict";
// The page of the viewer: draws what arrives, sends what is wished. See `wire.rs` for the messages.

const $ = (id) => document.getElementById(id);
const canvas = $("picture");
const context = canvas.getContext("2d");
const view = {
  state: null, yours: false, windows: 1,
  images: { a: null, b: null, map: null }, headers: { a: null, b: null, map: null },
  wipe: 0.5, frames: [], asked: 0, latency: null,
  // What is prepared, since when; what was asked about a pixel; where the keys' cursor is.
  since: { a: null, b: null }, question: null, cursor: null, object: null,
};
window.halflight = view;
let socket = null;
let retries = 0;
const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

// ---- the socket

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket${location.search}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => { retries = 0; message(""); };
  socket.onmessage = (event) => typeof event.data === "string" ? hear(JSON.parse(event.data)) : receive(event.data);
  socket.onclose = () => {
    retries += 1;
    message("The connection is lost; trying again.");
    setTimeout(connect, Math.min(5000, 300 * retries));
  };
}

const LOOKS = ["explain", "save", "control"];

function ask(wish) {
  if (!view.yours && !LOOKS.includes(wish.do) && view.state) { message("Another window has the controls: take them above."); return; }
  if (socket && socket.readyState === WebSocket.OPEN && socket.bufferedAmount < 1 << 20) {
    if (!["explain", "save", "keep"].includes(wish.do)) view.asked = performance.now();
    socket.send(JSON.stringify(wish));
  }
}

function hear(said) {
  if (said.kind === "state") { view.state = said; showState(); }
  else if (said.kind === "controls") {
    view.yours = said.yours;
    view.windows = said.windows;
    $("watching").hidden = said.yours;
    permit();
    showFigures();
  }
  else if (said.kind === "explain") showExplanation(said);
  else if (said.kind === "kept") message(`Written to ${said.text}`, true);
  else if (said.kind === "error") { message(said.text); if (view.state) showState(true); }
}

// Windows that only look have no controls.
function permit() {
  for (const input of document.querySelectorAll("[data-control], .setting input, .setting select")) input.disabled = !view.yours;
  if (view.state) {
    $("technique-b").disabled ||= !view.state.compare;
    $("turn").disabled ||= !view.state.has_environment;
  }
}

async function receive(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const bytes = new Uint8Array(buffer, 4 + length);
  if (header.kind === "file") { download(header.name, bytes); message(`Saved ${header.name}`, true); return; }
  const image = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
  view.images[header.side]?.close?.();
  view.images[header.side] = image;
  view.headers[header.side] = header;
  const now = performance.now();
  if (header.side === "a") {
    view.frames.push(now);
    if (view.asked) { view.latency = now - view.asked; view.asked = 0; }
  }
  draw();
  showFigures();
}

function download(name, bytes) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([bytes]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// ---- the picture

function draw() {
  const state = view.state;
  const [width, height] = state ? state.size : [640, 360];
  if (canvas.width !== width || canvas.height !== height) {
    [canvas.width, canvas.height] = [width, height];
    document.body.style.setProperty("--aspect", width / height);
  }
  context.imageSmoothingQuality = "high";
  const { a, b, map: mapHeader } = view.headers;
  const two = state?.compare && view.images.b;
  // A map is of one moment and one layer; any other would be stale.
  const fits = mapHeader && a && !a.moving && mapHeader.layer === state?.layer && mapHeader.moment === a.moment && mapHeader.moment === state?.moment;
  const map = two && fits ? view.images.map : null;
  const border = Math.round(two ? view.wipe * width : width);
  if (map) context.drawImage(map, 0, 0, width, height);
  else {
    if (view.images.a) context.drawImage(view.images.a, 0, 0, width, height);
    if (two) {
      context.save();
      context.beginPath();
      context.rect(border, 0, width - border, height);
      context.clip();
      context.drawImage(view.images.b, 0, 0, width, height);
      context.restore();
    }
  }
  const header = map ? mapHeader : a;
  const legend = header?.legend;
  $("legend").hidden = !legend;
  if (legend) {
    const scale = legend.map !== undefined;
    $("legend").classList.toggle("magma", legend.map === "magma");
    $("legend-words").textContent = legend.words ?? "";
    for (const part of [$("legend-low"), $("legend-high"), $("legend-unit"), $("legend").querySelector("i")]) part.hidden = !scale;
    $("legend-low").textContent = number(legend.low);
    $("legend-high").textContent = number(legend.high);
    $("legend-unit").textContent = legend.unit ?? "";
    $("legend-nothing").hidden = !legend.nothing;
  }
  const wipe = $("wipe");
  wipe.hidden = !two || !!map;
  wipe.style.left = `${100 * view.wipe}%`;
  wipe.setAttribute("aria-valuenow", Math.round(100 * view.wipe));
  const failed = a?.failed || (two && b?.failed);
  $("failure").hidden = !failed;
  $("failure").textContent = failed || "";
  showMarks();
}

const number = (value) => value == null ? "–" : Math.abs(value) >= 1e4 || (value !== 0 && Math.abs(value) < 1e-2) ? value.toExponential(2) : Number(value.toPrecision(4)).toString();

function showFigures() {
  const a = view.headers.a;
  if (!a || !view.state) return;
  const now = performance.now();
  view.frames = view.frames.filter((time) => now - time < 1500);
  const rate = view.frames.length > 1 ? (view.frames.length - 1) * 1000 / (view.frames.at(-1) - view.frames[0]) : 0;
  const parts = [`${number(a.milliseconds)} ms a sample`, view.frames.length ? `${rate.toFixed(1)} pictures/s` : "at rest", `${a.width} × ${a.height}`, plural(a.samples, "sample")];
  if (a.relative_error != null) parts.push(`noise ${(100 * a.relative_error).toFixed(2)} %`);
  if (view.latency != null) parts.push(`hand to eye ${view.latency.toFixed(0)} ms`);
  if (view.windows > 1) parts.push(plural(view.windows, "window"));
  $("figures").textContent = parts.join(" · ");
  $("name-a").textContent = a.technique;
  $("name-b").textContent = view.headers.b?.technique ?? "";
  const shown = [a, ...(view.state.compare && view.headers.b ? [view.headers.b] : [])];
  $("stages").replaceChildren(...shown.filter((header) => header.stages.length).map(stagesOf));
  const notes = shown.flatMap((header) => header.notes.map((note) => `${header.technique}: ${note}`));
  $("notes").replaceChildren(...notes.map((note) => { const item = document.createElement("li"); item.textContent = note; return item; }));
}

// The milliseconds of a sample by stages: a bar, and what its colours mean.
function stagesOf(header) {
  const box = document.createElement("div");
  box.className = "stages";
  const total = header.stages.reduce((sum, [, time]) => sum + time, 0) || 1;
  const bar = document.createElement("div");
  bar.className = "parts";
  const keys = document.createElement("div");
  keys.append(`${header.technique}, ${number(header.milliseconds)} ms a sample: `);
  header.stages.forEach(([name, time], i) => {
    const part = document.createElement("span");
    part.style.flex = `${time / total}`;
    part.style.background = `var(--bar-${i % 6})`;
    part.title = `${name} ${number(time)} ms`;
    bar.append(part);
    const key = document.createElement("span");
    key.className = "key";
    const dot = document.createElement("i");
    dot.style.background = `var(--bar-${i % 6})`;
    key.append(dot, `${name} ${time.toFixed(1)} ms`);
    keys.append(key);
  });
  box.append(bar, keys);
  return box;
}

// What is being prepared, and for how long.
function showBusy() {
  const state = view.state;
  if (!state) return;
  const words = [];
  for (const side of state.compare ? ["a", "b"] : ["a"]) {
    const { technique, reference, busy } = state.sides[side === "a" ? 0 : 1];
    const header = view.headers[side];
    const other = !reference && header?.technique !== technique;
    if (!busy && !other) { view.since[side] = null; continue; }
    const began = busy ? performance.now() - 1000 * busy.seconds : performance.now();
    if (!view.since[side] || view.since[side].technique !== technique) view.since[side] = { technique, began };
    const seconds = (performance.now() - view.since[side].began) / 1000;
    words.push(`preparing ${technique} … ${seconds.toFixed(0)} s${busy?.what ? ` (${busy.what})` : ""}`);
  }
  $("busy").hidden = !words.length;
  if (words.length) $("busy").textContent = words.join("\n");
}
setInterval(() => { showBusy(); showFigures(); }, 500);

function putAt(mark, at) {
  mark.hidden = !at;
  if (at) [mark.style.left, mark.style.top] = [`${100 * at[0]}%`, `${100 * at[1]}%`];
}

function showMarks() {
  const question = view.question;
  const old = question && view.state && question.moment !== view.state.moment;
  putAt($("marker"), question && !old ? question.at : null);
  $("explanation").classList.toggle("old", !!old);
  putAt($("cursor"), view.cursor);
}

function showExplanation(said) {
  view.question = { at: [said.x, said.y], moment: view.state?.moment };
  $("explanation").hidden = false;
  $("explanation").classList.toggle("left", said.x > 0.5);
  $("explain-text").textContent = said.text + (said.more ? "\n\nworking out the chain …" : "");
  showMarks();
  $("explanation").scrollIntoView({ block: "nearest" });
}

function forgetExplanation() { view.question = null; $("explanation").hidden = true; showMarks(); }
$("explain-close").onclick = forgetExplanation;

// ---- the panel

function fill(select, names, chosen, label = (name) => name || "the scene's own") {
  const list = names.flatMap((group) => Array.isArray(group) ? group[1] : [group]);
  if (select.dataset.names !== list.join("\n")) {
    select.dataset.names = list.join("\n");
    const option = (name) => new Option(label(name), name);
    select.replaceChildren(...names.map((group) => {
      if (!Array.isArray(group)) return option(group);
      const box = document.createElement("optgroup");
      box.label = group[0];
      box.append(...group[1].map(option));
      return box;
    }));
  }
  select.value = chosen;
}

// Puts a value into a field, unless somebody is at it: writes, or holds the slider.
function put(input, value, force) {
  const held = input.type === "range" ? input.dataset.held : document.activeElement === input && input.tagName === "INPUT" && input.type === "text";
  if (force || !held) input.value = value;
}
for (const range of document.querySelectorAll("input[type=range]")) {
  range.addEventListener("pointerdown", () => { range.dataset.held = "yes"; });
  for (const end of ["pointerup", "pointercancel", "change", "blur"]) range.addEventListener(end, () => { delete range.dataset.held; });
}

function showState(force = false) {
  const state = view.state;
  document.title = `${state.scene} · halflight`;
  if (view.scene !== state.scene) { view.scene = state.scene; view.object = null; forgetExplanation(); }
  fill($("scene"), [...new Set([state.scene, ...state.scenes])], state.scene);
  const techniques = state.techniques.map((entry) => entry.name);
  fill($("technique-a"), techniques, state.sides[0].technique);
  const stored = [...new Set([...state.references, ...(state.sides[1].reference ? [state.sides[1].reference] : [])])].map((name) => `picture:${name}`);
  const right = state.sides[1].reference ? `picture:${state.sides[1].reference}` : state.sides[1].technique;
  fill($("technique-b"), [...techniques, ...(stored.length ? [["stored pictures", stored]] : [])], right, (name) => name.replace(/^picture:/, ""));
  fill($("layer"), ["color", ...(state.compare ? ["flip", "difference"] : []), ...state.layers], state.layer);
  fill($("environment"), ["", ...state.environments], state.environment);
  if (!state.shapes.includes(view.object)) view.object = state.shapes[0] ?? null;
  fill($("object"), state.shapes, view.object);
  $("compare").checked = state.compare;
  $("settings-b-box").hidden = !state.compare || !!state.sides[1].reference;
  $("name-b").hidden = !state.compare;
  $("right-hint").hidden = state.compare;
  put($("exposure"), state.exposure_ev, force); $("exposure-value").textContent = `${state.exposure_ev.toFixed(1)} EV`;
  $("filmic").checked = state.filmic;
  put($("turn"), state.turn_degrees, force); $("turn-value").textContent = `${state.turn_degrees.toFixed(0)}°`;
  put($("fov"), state.field_of_view_degrees, force); $("fov-value").textContent = `${state.field_of_view_degrees.toFixed(0)}°`;
  put($("aperture"), Math.sqrt(state.aperture_radius), force); $("aperture-value").textContent = `${number(state.aperture_radius)} m`;
  $("follows").textContent = state.follows ? "The camera is the scene's." : "The camera is yours; Home follows the scene again.";
  const size = state.size.join("x");
  const other = $("size").querySelector("[value=scene]");
  const known = [...$("size").options].some((option) => option.value === size);
  other.textContent = known ? "other" : size.replace("x", " × ");
  $("size").value = known ? size : "scene";
  $("timeline").hidden = !state.animated;
  $("time").max = state.duration || 10;
  put($("time"), state.seconds, force);
  $("seconds").textContent = `${state.seconds.toFixed(2)} s`;
  $("play").textContent = state.playing ? "Hold" : "Play";
  $("play").setAttribute("aria-pressed", state.playing);
  showObject(force);
  showErrors();
  showSettings("a", state.sides[0], force);
  showSettings("b", state.sides[1], force);
  permit();
  draw();
  showBusy();
}

function showErrors() {
  const { compare, errors, sides } = view.state;
  const names = sides.map((side) => side.reference ?? side.technique);
  let words = "";
  if (compare && !errors) words = "the error is measured once both pictures are at rest";
  else if (compare && errors.reason) words = errors.reason;
  else if (compare) {
    const psnr = errors.psnr == null ? (errors.same ? "PSNR infinite: no pixel differs" : "PSNR –") : `PSNR ${number(errors.psnr)} dB`;
    words = `${names[0]} against ${names[1]}: relMSE ${number(errors.relative_mse)}, ${psnr}, FLIP ${number(errors.flip)}`;
    if (errors.note) words += ` (${errors.note})`;
  }
  $("errors").textContent = words;
}

function showObject(force = false) {
  const state = view.state;
  const moved = Object.fromEntries(state.moved)[view.object] ?? [0, 0, 0];
  const reach = Number(state.reach.toPrecision(2));
  ["x", "y", "z"].forEach((axis, i) => {
    const input = $(`move-${axis}`);
    input.min = Math.min(-reach, moved[i]);
    input.max = Math.max(reach, moved[i]);
    put(input, moved[i], force);
    $(`move-${axis}-value`).textContent = `${number(Number(input.value))} m`;
  });
  put($("material"), Object.fromEntries(state.materials)[view.object] ?? "", force);
}

// Words of documentation without the marks of code.
const plain = (text) => text.replaceAll("`", "").replaceAll('"', "");

function showSettings(side, shown, force) {
  const box = $(`settings-${side}`);
  const entry = view.state.techniques.find((technique) => technique.name === shown.technique);
  const set = Object.fromEntries(shown.settings);
  if (box.dataset.technique !== shown.technique) {
    box.dataset.technique = shown.technique;
    box.replaceChildren(...entry.settings.map((setting) => {
      const item = document.createElement("div");
      item.className = "setting";
      const label = document.createElement("label");
      const input = field(setting);
      input.dataset.key = setting.key;
      input.onchange = () => ask({ do: "set", side, key: setting.key, value: input.type === "checkbox" ? String(input.checked) : input.value.trim() });
      if (input.type === "checkbox") label.append(input, setting.key); else label.append(setting.key, input);
      const about = document.createElement("small");
      const kind = setting.choices ? null : setting.kind;
      about.textContent = [setting.about, kind, setting.unit, setting.limits].filter(Boolean).map(plain).join(" · ");
      item.append(label, about);
      return item;
    }));
  }
  for (const input of box.querySelectorAll("[data-key]")) {
    const value = set[input.dataset.key] ?? "";
    if (input.type === "checkbox") input.checked = (value || input.dataset.default) === "true";
    else put(input, input.tagName === "SELECT" ? value || input.dataset.default : value, force);
  }
}

// The field for a setting: by its type.
function field(setting) {
  const choices = setting.choices;
  if (choices && choices.join() === "true,false") {
    const input = document.createElement("input");
    input.type = "checkbox";
    input.dataset.default = setting.default;
    return input;
  }
  if (choices) {
    const select = document.createElement("select");
    select.append(...choices.map((choice) => new Option(plain(choice), choice)));
    select.dataset.default = setting.default;
    return select;
  }
  const input = document.createElement("input");
  input.type = "text";
  input.placeholder = plain(setting.default) || "off";
  input.spellcheck = false;
  return input;
}

let messageTimer = 0;
function message(text, good = false) {
  const box = $("message");
  clearTimeout(messageTimer);
  box.hidden = !text;
  box.textContent = text;
  box.classList.toggle("good", good);
  if (text) messageTimer = setTimeout(() => { box.hidden = true; }, 9000);
}

$("scene").onchange = (event) => { ask({ do: "open", name: event.target.value }); event.target.blur(); };
$("technique-a").onchange = (event) => { ask({ do: "technique", side: "a", name: event.target.value }); event.target.blur(); };
$("technique-b").onchange = (event) => {
  const name = event.target.value;
  ask(name.startsWith("picture:") ? { do: "reference", name: name.slice(8) } : { do: "technique", side: "b", name });
  event.target.blur();
};
$("compare").onchange = (event) => ask({ do: "compare", on: event.target.checked });
$("layer").onchange = (event) => { ask({ do: "layer", name: event.target.value }); event.target.blur(); };
$("environment").onchange = (event) => { ask({ do: "swap", environment: event.target.value }); event.target.blur(); };
$("material").onchange = (event) => ask({ do: "material", object: view.object ?? "", material: event.target.value });
$("exposure").oninput = (event) => ask({ do: "exposure", ev: Number(event.target.value) });
$("filmic").onchange = (event) => ask({ do: "tone", filmic: event.target.checked });
$("turn").oninput = (event) => ask({ do: "environment", degrees: Number(event.target.value) });
$("fov").oninput = (event) => ask({ do: "field-of-view", degrees: Number(event.target.value) });
$("aperture").oninput = (event) => ask({ do: "aperture", radius: Number(event.target.value) ** 2 });
$("size").onchange = (event) => { const [width, height] = event.target.value.split("x").map(Number); ask({ do: "size", width, height }); event.target.blur(); };
$("play").onclick = () => ask({ do: "play", on: !view.state.playing });
$("time").oninput = (event) => ask({ do: "time", seconds: Number(event.target.value) });
$("home").onclick = () => ask({ do: "home" });
$("fit").onclick = () => ask({ do: "frame" });
$("save-exr").onclick = () => save("exr");
$("save-png").onclick = () => save("png");
function save(format) { message("Saving, once the picture has its whole size …", true); ask({ do: "save", format }); }
$("keep").onclick = () => ask({ do: "keep" });
$("control").onclick = () => ask({ do: "control" });
$("help-button").onclick = () => $("help").showModal();
for (const axis of ["x", "y", "z"]) $(`move-${axis}`).oninput = () => {
  if (view.object == null) return;
  for (const a of ["x", "y", "z"]) $(`move-${a}-value`).textContent = `${number(Number($(`move-${a}`).value))} m`;
  ask({ do: "move", object: view.object, by: ["x", "y", "z"].map((a) => Number($(`move-${a}`).value)) });
};
$("move-back").onclick = () => { if (view.object != null) ask({ do: "move", object: view.object, by: [0, 0, 0] }); };
$("object").onchange = (event) => { view.object = event.target.value; showObject(true); };

// ---- hands

const place = (event) => {
  const box = canvas.getBoundingClientRect();
  return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height, box.height];
};
const fingers = new Map();
let dragged = 0;

canvas.onpointerdown = (event) => {
  canvas.focus();
  canvas.setPointerCapture(event.pointerId);
  fingers.set(event.pointerId, { x: event.clientX, y: event.clientY, button: event.button });
  dragged = 0;
  event.preventDefault();
};
canvas.onpointermove = (event) => {
  const finger = fingers.get(event.pointerId);
  if (!finger) return;
  const height = place(event)[2];
  const [x, y] = [(event.clientX - finger.x) / height, (event.clientY - finger.y) / height];
  if (fingers.size === 2) {
    const [first, second] = [...fingers.values()];
    const before = Math.hypot(first.x - second.x, first.y - second.y);
    [finger.x, finger.y] = [event.clientX, event.clientY];
    const after = Math.hypot(first.x - second.x, first.y - second.y);
    if (before > 1 && after > 1) ask({ do: "dolly", by: before / after });
    ask({ do: "pan", x: x / 2, y: y / 2 });
  } else if (event.ctrlKey || finger.button === 2) {
    ask({ do: "environment", degrees: ((view.state.turn_degrees + 180 * x) % 360 + 360) % 360 });
    view.state.turn_degrees = ((view.state.turn_degrees + 180 * x) % 360 + 360) % 360;
  } else if (event.shiftKey || finger.button === 1) ask({ do: "pan", x, y });
  else if (event.altKey) ask({ do: "look", x, y });
  else ask({ do: "orbit", x, y });
  dragged += Math.abs(event.clientX - finger.x) + Math.abs(event.clientY - finger.y);
  [finger.x, finger.y] = [event.clientX, event.clientY];
};
canvas.onpointerup = canvas.onpointercancel = (event) => {
  const finger = fingers.get(event.pointerId);
  fingers.delete(event.pointerId);
  if (!finger || event.type !== "pointerup" || dragged > 4 || finger.button !== 0) return;
  const [x, y] = place(event);
  act(document.querySelector("input[name=click]:checked").value, x, y);
};

// Explains, or focuses on, what is at a place of the picture; a question goes to the side that is seen there.
function act(what, x, y) {
  if (what !== "explain") { ask({ do: what, x, y }); return; }
  const side = view.state?.compare && view.images.b && x > view.wipe ? "b" : "a";
  view.question = { at: [x, y], moment: view.state?.moment };
  showMarks();
  ask({ do: "explain", x, y, side });
}
canvas.oncontextmenu = (event) => event.preventDefault();
canvas.addEventListener("wheel", (event) => { event.preventDefault(); ask({ do: "dolly", by: Math.exp(Math.max(-1, Math.min(1, event.deltaY / 500))) }); }, { passive: false });

const wipe = $("wipe");
wipe.onpointerdown = (event) => wipe.setPointerCapture(event.pointerId);
wipe.onpointermove = (event) => { if (wipe.hasPointerCapture(event.pointerId)) moveWipe(place(event)[0]); };
wipe.onkeydown = (event) => {
  const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
  if (step) { moveWipe(view.wipe + step); event.preventDefault(); event.stopPropagation(); }
};
function moveWipe(x) { view.wipe = Math.max(0, Math.min(1, x)); draw(); }

document.addEventListener("keydown", (event) => {
  if (event.target.matches("input[type=text], select, dialog, dialog *") || event.ctrlKey || event.metaKey || event.altKey || !view.state) return;
  const range = event.target.matches("input[type=range], input[type=radio]");
  const [cx, cy] = view.cursor ?? [0.5, 0.5];
  const step = 0.03;
  const arrows = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
  const go = { w: [0, 0, 0.05], s: [0, 0, -0.05], a: [-0.05, 0, 0], d: [0.05, 0, 0], q: [0, -0.05, 0], e: [0, 0.05, 0] }[event.key.toLowerCase()];
  if (arrows && !range && view.cursor) {
    const part = event.shiftKey ? 1 / Math.max(...view.state.size) : 0.02;
    const to = (at, by) => Math.max(0, Math.min(1, at + Math.sign(by) * part));
    view.cursor = [to(cx, arrows[0]), to(cy, arrows[1])];
    showMarks();
  }
  else if (arrows && !range) ask({ do: event.shiftKey ? "pan" : "orbit", x: arrows[0], y: arrows[1] });
  else if (go) ask({ do: "fly", by: go });
  else if (event.key === "+" || event.key === "=") ask({ do: "dolly", by: 0.93 });
  else if (event.key === "-") ask({ do: "dolly", by: 1 / 0.93 });
  else if (event.key === " " && !event.target.matches("button, summary")) ask({ do: "play", on: !view.state.playing });
  else if (event.key === "," || event.key === ".") ask({ do: "time", seconds: view.state.seconds + (event.key === "." ? 1 : -1) / 24 });
  else if (event.key === "[" || event.key === "]") ask({ do: "environment", degrees: view.state.turn_degrees + (event.key === "]" ? 5 : -5) });
  else if (event.key.toLowerCase() === "h") ask({ do: "home" });
  else if (event.key.toLowerCase() === "f") ask({ do: "frame" });
  else if (event.key.toLowerCase() === "c") ask({ do: "compare", on: !view.state.compare });
  else if (event.key.toLowerCase() === "g" || (event.key === "Escape" && view.cursor)) { view.cursor = view.cursor ? null : [0.5, 0.5]; showMarks(); }
  else if (event.key === "Escape") forgetExplanation();
  else if (event.key.toLowerCase() === "x") act("explain", cx, cy);
  else if (event.key.toLowerCase() === "o") act("focus", cx, cy);
  else if (event.key.toLowerCase() === "p") save("png");
  else if (event.key.toLowerCase() === "k") ask({ do: "keep" });
  else if (event.key.toLowerCase() === "l") {
    const names = [...$("layer").options].map((option) => option.value);
    ask({ do: "layer", name: names[(names.indexOf(view.state.layer) + 1) % names.length] });
  }
  else if (event.key === "?") $("help").showModal();
  else return;
  event.preventDefault();
});

// ---- files

document.ondragover = (event) => { event.preventDefault(); document.body.classList.add("dropping"); };
document.ondragleave = () => document.body.classList.remove("dropping");
document.ondrop = (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  take([...event.dataTransfer.files]);
};
$("pick").onclick = () => $("files").click();
$("files").onchange = (event) => { take([...event.target.files]); event.target.value = ""; };

// Opens files; of a picture, asks what it is for.
function take(files) {
  if (!files.length) return;
  const size = files.reduce((sum, file) => sum + file.size, 0);
  if (size > 60 << 20) { message(`${files.length === 1 ? files[0].name : "Together, these files"} are larger than 60 MB: open them from the command line.`); return; }
  const picture = files.length === 1 && /\.(exr|hdr|png)$/i.test(files[0].name);
  if (!picture) { send(files, false); return; }
  $("dropped-name").textContent = files[0].name;
  $("dropped-open").hidden = /\.png$/i.test(files[0].name);
  $("dropped").returnValue = "";
  $("dropped").onclose = () => { if ($("dropped").returnValue) send(files, $("dropped").returnValue === "compare"); };
  $("dropped").showModal();
}

// A header with the names and lengths, then the bytes, one file after the other.
async function send(files, reference) {
  if (!view.yours) { message("Another window has the controls: take them above."); return; }
  const parts = await Promise.all(files.map((file) => file.arrayBuffer()));
  const header = new TextEncoder().encode(JSON.stringify({ files: files.map((file) => [file.name, file.size]), reference }));
  const all = new Uint8Array(4 + header.length + parts.reduce((sum, part) => sum + part.byteLength, 0));
  new DataView(all.buffer).setUint32(0, header.length, true);
  all.set(header, 4);
  let at = 4 + header.length;
  for (const part of parts) { all.set(new Uint8Array(part), at); at += part.byteLength; }
  socket.send(all);
}

connect();
