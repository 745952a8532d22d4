"use strict";
// The page of the viewer: draws what arrives, sends what is wished. See `wire.rs` for the messages.

const $ = (id) => document.getElementById(id);
const canvas = $("picture");
const context = canvas.getContext("2d");
const view = {
  state: null, yours: false, windows: 1,
  images: { a: null, b: null, map: null }, headers: { a: null, b: null, map: null },
  wipe: 0.5, frames: [], asked: 0, latency: null,
};
window.halflight = view;
let socket = null;
let retries = 0;

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

function ask(wish) {
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
    $("control").hidden = said.yours;
  }
  else if (said.kind === "explain") { $("explanation").hidden = false; $("explain-text").textContent = said.text; }
  else if (said.kind === "kept") message(`Written to ${said.text}`, true);
  else if (said.kind === "error") message(said.text);
}

async function receive(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const bytes = new Uint8Array(buffer, 4 + length);
  if (header.kind === "file") { download(header.name, bytes); return; }
  const image = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
  view.images[header.side]?.close?.();
  view.images[header.side] = image;
  view.headers[header.side] = header;
  const now = performance.now();
  if (header.side === "a") {
    view.frames.push(now);
    view.frames = view.frames.filter((time) => now - time < 1500);
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
    $("frame").style.setProperty("--aspect", width / height);
  }
  context.imageSmoothingQuality = "high";
  const two = state?.compare && view.images.b;
  const map = two && ["flip", "difference"].includes(state.layer) && view.headers.a && !view.headers.a.moving ? view.images.map : null;
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
  const header = map ? view.headers.map : view.headers.a;
  const legend = header?.legend;
  $("legend").hidden = !legend;
  if (legend) {
    $("legend").classList.toggle("magma", state.layer === "flip");
    $("legend-low").textContent = number(legend[0]);
    $("legend-high").textContent = number(legend[1]);
  }
  const wipe = $("wipe");
  wipe.hidden = !two || !!map;
  wipe.style.left = `${100 * view.wipe}%`;
  wipe.setAttribute("aria-valuenow", Math.round(100 * view.wipe));
  const failed = view.headers.a?.failed || (two && view.headers.b?.failed);
  $("failure").hidden = !failed;
  $("failure").textContent = failed || "";
}

const number = (value) => value == null ? "–" : Math.abs(value) >= 1e4 || (value !== 0 && Math.abs(value) < 1e-2) ? value.toExponential(2) : Number(value.toPrecision(4)).toString();

function showFigures() {
  const a = view.headers.a;
  if (!a) return;
  const rate = view.frames.length > 1 ? (view.frames.length - 1) * 1000 / (view.frames.at(-1) - view.frames[0]) : 0;
  const parts = [`${a.milliseconds.toFixed(1)} ms`, `${rate.toFixed(1)} pictures/s`, `${a.width} × ${a.height}`, `${a.samples} samples`];
  if (a.relative_error != null) parts.push(`noise ${(100 * a.relative_error).toFixed(2)} %`);
  if (view.latency != null) parts.push(`hand to eye ${view.latency.toFixed(0)} ms`);
  if (view.windows > 1) parts.push(`${view.windows} windows`);
  $("figures").textContent = parts.join(" · ");
  $("name-a").textContent = a.technique;
  $("name-b").textContent = view.headers.b?.technique ?? "";
  const bars = $("stages");
  const total = a.stages.reduce((sum, [, time]) => sum + time, 0) || 1;
  bars.replaceChildren(...a.stages.map(([name, time], i) => {
    const bar = document.createElement("span");
    bar.style.flex = `${time / total}`;
    bar.style.background = `var(--bar-${i % 6})`;
    bar.textContent = bar.title = `${name} ${time.toFixed(1)} ms`;
    return bar;
  }));
  const notes = [...a.notes.map((note) => `${a.technique}: ${note}`)];
  if (view.state?.compare && view.headers.b) notes.push(...view.headers.b.notes.map((note) => `${view.headers.b.technique}: ${note}`));
  $("notes").replaceChildren(...notes.map((note) => { const item = document.createElement("li"); item.textContent = note; return item; }));
}

// ---- the panel

function fill(select, names, chosen) {
  if (document.activeElement === select) return;
  if (select.dataset.names !== names.join("\n")) {
    select.dataset.names = names.join("\n");
    select.replaceChildren(...names.map((name) => new Option(name || "the scene's own", name)));
  }
  select.value = chosen;
}

function put(input, value) { if (document.activeElement !== input) input.value = value; }

function showState() {
  const state = view.state;
  document.title = `${state.scene} · halflight`;
  fill($("scene"), [...new Set([state.scene, ...state.scenes])], state.scene);
  const techniques = state.techniques.map((entry) => entry.name);
  fill($("technique-a"), techniques, state.sides[0].technique);
  fill($("technique-b"), techniques, state.sides[1].technique);
  fill($("layer"), ["color", ...(state.compare ? ["flip", "difference"] : []), ...state.layers], state.layer);
  fill($("environment"), ["", ...state.environments], state.swap.environment);
  fill($("object"), state.shapes, $("object").value || state.shapes[0]);
  $("compare").checked = state.compare;
  $("technique-b").disabled = !state.compare;
  $("settings-b-box").hidden = !state.compare;
  $("name-b").hidden = !state.compare;
  put($("exposure"), state.exposure_ev); $("exposure-value").textContent = `${state.exposure_ev.toFixed(1)} EV`;
  $("filmic").checked = state.filmic;
  put($("turn"), state.turn_degrees); $("turn-value").textContent = `${state.turn_degrees.toFixed(0)}°`;
  put($("fov"), state.field_of_view_degrees); $("fov-value").textContent = `${state.field_of_view_degrees.toFixed(0)}°`;
  put($("aperture"), Math.sqrt(state.aperture_radius)); $("aperture-value").textContent = `${number(state.aperture_radius)} m`;
  const size = state.size.join("x");
  const other = $("size").querySelector("[value=scene]");
  const known = [...$("size").options].some((option) => option.value === size);
  other.textContent = known ? "other" : size.replace("x", " × ");
  put($("size"), known ? size : "scene");
  $("timeline").hidden = !state.animated;
  $("time").max = state.duration || 10;
  put($("time"), state.seconds);
  $("seconds").textContent = `${state.seconds.toFixed(2)} s`;
  $("play").textContent = state.playing ? "Hold" : "Play";
  $("play").setAttribute("aria-pressed", state.playing);
  const errors = state.errors;
  $("errors").textContent = !state.compare ? "" : errors
    ? `left against right: relMSE ${number(errors.relative_mse)}, PSNR ${number(errors.psnr)} dB, FLIP ${number(errors.flip)}`
    : "the error is measured once both pictures are at rest";
  showSettings("a", state.sides[0]);
  showSettings("b", state.sides[1]);
  draw();
}

function showSettings(side, shown) {
  const box = $(`settings-${side}`);
  const entry = view.state.techniques.find((technique) => technique.name === shown.technique);
  const set = Object.fromEntries(shown.settings);
  if (box.dataset.technique !== shown.technique) {
    box.dataset.technique = shown.technique;
    box.replaceChildren(...entry.settings.map((setting) => {
      const item = document.createElement("div");
      item.className = "setting";
      const label = document.createElement("label");
      label.textContent = setting.key;
      const input = document.createElement("input");
      input.type = "text";
      input.dataset.key = setting.key;
      input.placeholder = setting.default;
      input.spellcheck = false;
      input.onchange = () => ask({ do: "set", side, key: setting.key, value: input.value.trim() });
      label.append(input);
      const about = document.createElement("small");
      about.textContent = [setting.about, setting.kind, setting.unit, setting.limits].filter(Boolean).join(" · ");
      item.append(label, about);
      return item;
    }));
  }
  for (const input of box.querySelectorAll("input")) put(input, set[input.dataset.key] ?? "");
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

$("scene").onchange = (event) => { $("explanation").hidden = true; ask({ do: "open", name: event.target.value }); event.target.blur(); };
for (const side of ["a", "b"]) $(`technique-${side}`).onchange = (event) => { ask({ do: "technique", side, name: event.target.value }); event.target.blur(); };
$("compare").onchange = (event) => ask({ do: "compare", on: event.target.checked });
$("layer").onchange = (event) => { ask({ do: "layer", name: event.target.value }); event.target.blur(); };
$("environment").onchange = (event) => { ask({ do: "swap", environment: event.target.value, material: $("material").value }); event.target.blur(); };
$("material").onchange = (event) => ask({ do: "swap", environment: $("environment").value, material: event.target.value });
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
$("save-exr").onclick = () => ask({ do: "save", format: "exr" });
$("save-png").onclick = () => ask({ do: "save", format: "png" });
$("keep").onclick = () => ask({ do: "keep" });
$("control").onclick = () => ask({ do: "control" });
$("help-button").onclick = () => $("help").showModal();
for (const axis of ["x", "y", "z"]) $(`move-${axis}`).oninput = () => ask({ do: "move", object: $("object").value, by: ["x", "y", "z"].map((a) => Number($(`move-${a}`).value)) });
$("object").onchange = () => {
  const moved = Object.fromEntries(view.state.moved)[$("object").value] ?? [0, 0, 0];
  ["x", "y", "z"].forEach((axis, i) => { $(`move-${axis}`).value = moved[i]; });
};

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
  const what = document.querySelector("input[name=click]:checked").value;
  ask({ do: what, x, y });
};
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
  if (event.target.matches("input[type=text], select, dialog *") || event.ctrlKey || event.metaKey || event.altKey) return;
  const range = event.target.matches("input[type=range]");
  const step = 0.03;
  const arrows = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
  const go = { w: [0, 0, 0.05], s: [0, 0, -0.05], a: [-0.05, 0, 0], d: [0.05, 0, 0], q: [0, -0.05, 0], e: [0, 0.05, 0] }[event.key.toLowerCase()];
  if (arrows && !range) ask({ do: event.shiftKey ? "pan" : "orbit", x: arrows[0], y: arrows[1] });
  else if (go) ask({ do: "fly", by: go });
  else if (event.key === "+" || event.key === "=") ask({ do: "dolly", by: 0.93 });
  else if (event.key === "-") ask({ do: "dolly", by: 1 / 0.93 });
  else if (event.key === " " && !event.target.matches("button, summary")) ask({ do: "play", on: !view.state.playing });
  else if (event.key === "," || event.key === ".") ask({ do: "time", seconds: view.state.seconds + (event.key === "." ? 1 : -1) / 24 });
  else if (event.key === "[" || event.key === "]") ask({ do: "environment", degrees: view.state.turn_degrees + (event.key === "]" ? 5 : -5) });
  else if (event.key.toLowerCase() === "h") ask({ do: "home" });
  else if (event.key.toLowerCase() === "f") ask({ do: "frame" });
  else if (event.key.toLowerCase() === "c") ask({ do: "compare", on: !view.state.compare });
  else if (event.key.toLowerCase() === "x") ask({ do: "explain", x: 0.5, y: 0.5 });
  else if (event.key.toLowerCase() === "p") ask({ do: "save", format: "png" });
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
document.ondrop = async (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  const file = event.dataTransfer.files[0];
  if (!file) return;
  if (file.size > 60 << 20) { message(`${file.name} is larger than 60 MB: open it from the command line.`); return; }
  const name = new TextEncoder().encode(file.name);
  const bytes = new Uint8Array(await file.arrayBuffer());
  const all = new Uint8Array(name.length + 1 + bytes.length);
  all.set(name);
  all.set(bytes, name.length + 1);
  socket.send(all);
};

connect();
