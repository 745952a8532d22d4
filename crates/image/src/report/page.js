"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const { width, height, maps } = data;
  const $ = (id) => document.getElementById(id);
  const clamp = (v, low, high) => Math.min(Math.max(v, low), high);
  const MAX_ZOOM_PIXELS = 64; // screen pixels per picture pixel

  // What is looked at. Position is in picture pixels and zoom relative to the whole picture, so that it means the
  // same in every stage whatever its size.
  const view = { candidate: 0, map: "flip", zoom: 1, x: width / 2, y: height / 2, wipe: 0.5, tiles: "picture" };
  const stages = [];

  // ---- stages: the boxes in which pictures are zoomed and panned together

  const fit = (stage) => Math.min(stage.clientWidth / width, stage.clientHeight / height) || 1;

  function place(stage) {
    const scale = fit(stage) * view.zoom;
    const left = stage.clientWidth / 2 - view.x * scale;
    const top = stage.clientHeight / 2 - view.y * scale;
    for (const img of stage.querySelectorAll("img")) {
      img.style.transform = `translate(${left}px, ${top}px) scale(${scale})`;
      img.classList.toggle("crisp", scale * devicePixelRatio >= 2);
    }
    stage.classList.toggle("zoomed", view.zoom > 1);
  }

  function placeAll() {
    stages.forEach(place);
    const main = fit($("stage-picture")) * view.zoom * devicePixelRatio;
    $("zoom-level").value = view.zoom === 1 ? "fit" : `${Math.round(main * 100)} %`;
  }

  /** Zooms by a factor; the picture point under (dx, dy) from the middle of the stage stays where it is. */
  function zoomBy(factor, stage = $("stage-picture"), dx = 0, dy = 0) {
    const base = fit(stage);
    const most = Math.max(1, MAX_ZOOM_PIXELS / base);
    const zoom = clamp(view.zoom * factor, 1, most);
    view.x += dx / (base * view.zoom) - dx / (base * zoom);
    view.y += dy / (base * view.zoom) - dy / (base * zoom);
    view.zoom = zoom;
    settle();
  }

  function panBy(dx, dy, stage) {
    const scale = fit(stage) * view.zoom;
    view.x -= dx / scale;
    view.y -= dy / scale;
    settle();
  }

  /** Keeps the picture in sight, and shows it. */
  function settle() {
    if (view.zoom <= 1.0001) Object.assign(view, { zoom: 1, x: width / 2, y: height / 2 });
    view.x = clamp(view.x, 0, width);
    view.y = clamp(view.y, 0, height);
    placeAll();
  }

  function zoomFit() {
    view.zoom = 1;
    settle();
  }

  function zoomPixel() {
    zoomBy(1 / (fit($("stage-picture")) * devicePixelRatio * view.zoom));
  }

  /** Where in the stage, from its middle, an event happened. */
  function fromMiddle(stage, event) {
    const box = stage.getBoundingClientRect();
    return [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
  }

  function addStage(stage) {
    stages.push(stage);
    stage.style.setProperty("--aspect", `${width} / ${height}`);
    const pointers = new Map();

    stage.addEventListener("wheel", (event) => {
      // At the whole picture, scrolling on leaves it and moves the page.
      if (view.zoom === 1 && event.deltaY > 0) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 33 : 1;
      zoomBy(Math.exp(clamp(-event.deltaY * lines, -240, 240) * 0.0022), stage, ...fromMiddle(stage, event));
    }, { passive: false });

    stage.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      stage.setPointerCapture(event.pointerId);
      stage.classList.add("dragging");
    });
    stage.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return read(stage, event);
      const now = [event.clientX, event.clientY];
      if (pointers.size === 2) {
        const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
        const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
        zoomBy(apart(now) / apart(last), stage, ...fromMiddle(stage, event));
      } else {
        panBy(now[0] - last[0], now[1] - last[1], stage);
      }
      pointers.set(event.pointerId, now);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      stage.addEventListener(end, (event) => {
        pointers.delete(event.pointerId);
        stage.classList.toggle("dragging", pointers.size > 0);
      });
    }
    stage.addEventListener("dblclick", (event) => {
      if (view.zoom > 1) zoomFit();
      else zoomBy(4, stage, ...fromMiddle(stage, event));
    });
    stage.addEventListener("keydown", (event) => {
      if (event.target !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
      const step = event.shiftKey ? 160 : 40;
      const pans = { ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
      const pan = pans[event.key];
      if (!pan || view.zoom === 1) return;
      event.preventDefault();
      panBy(...pan, stage);
    });
  }

  // ---- the wipe

  function setWipe(fraction) {
    view.wipe = clamp(fraction, 0, 1);
    const percent = view.wipe * 100;
    const wipe = $("wipe");
    wipe.style.left = `${percent}%`;
    wipe.setAttribute("aria-valuenow", percent.toFixed(0));
    wipe.setAttribute("aria-valuetext", `${percent.toFixed(0)} % candidate`);
    $("layer-candidate").style.clipPath = `inset(0 ${100 - percent}% 0 0)`;
    $("tag-candidate").style.opacity = view.wipe > 0.04 ? 1 : 0;
    $("tag-reference").style.opacity = view.wipe < 0.96 ? 1 : 0;
  }

  const blink = () => setWipe(view.wipe > 0.5 ? 0 : 1);

  function listenToWipe() {
    const wipe = $("wipe");
    wipe.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      wipe.setPointerCapture(event.pointerId);
    });
    wipe.addEventListener("pointermove", (event) => {
      if (!wipe.hasPointerCapture(event.pointerId)) return;
      event.stopPropagation();
      const box = $("stage-picture").getBoundingClientRect();
      setWipe((event.clientX - box.left) / box.width);
    });
    wipe.addEventListener("dblclick", (event) => {
      event.stopPropagation();
      setWipe(0.5);
    });
    wipe.addEventListener("keydown", (event) => {
      const to = {
        ArrowLeft: view.wipe - 0.02, ArrowDown: view.wipe - 0.02, ArrowRight: view.wipe + 0.02,
        ArrowUp: view.wipe + 0.02, PageDown: view.wipe - 0.1, PageUp: view.wipe + 0.1, Home: 0, End: 1,
      }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      setWipe(to);
    });
  }

  // ---- reading values back from the pictures

  const pixelsOf = new Map();
  let pointed = null;

  /** The bytes of a picture, decoded once. */
  function pixels(img) {
    if (!img.complete || !img.naturalWidth) return null;
    if (!pixelsOf.has(img.src)) {
      const canvas = document.createElement("canvas");
      canvas.width = width;
      canvas.height = height;
      const context = canvas.getContext("2d", { willReadFrequently: true });
      context.drawImage(img, 0, 0);
      if (pixelsOf.size > 7) pixelsOf.delete(pixelsOf.keys().next().value);
      pixelsOf.set(img.src, context.getImageData(0, 0, width, height).data);
    }
    return pixelsOf.get(img.src);
  }

  const hex = (bytes, i) => [0, 1, 2].map((c) => bytes[4 * i + c].toString(16).padStart(2, "0")).join("");
  for (const map of Object.values(maps)) {
    map.index = new Map(map.colors.map((color, i) => [color, i / (map.colors.length - 1)]));
  }

  function mapValue(map, color) {
    const at = map.index.get(color);
    if (at === undefined) return "no value";
    let value = map.low + at * (map.high - map.low);
    if (map.root) value *= Math.abs(value) / map.high;
    if (map.log) return `${at === 0 ? "≤ " : at === 1 ? "≥ " : ""}${(10 ** value).toExponential(1)}`;
    return value.toFixed(map.high < 0.1 ? 5 : 3);
  }

  function read(stage, event) {
    pointed = [stage, event];
    const [dx, dy] = fromMiddle(stage, event);
    const scale = fit(stage) * view.zoom;
    const x = Math.floor(view.x + dx / scale);
    const y = Math.floor(view.y + dy / scale);
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    const i = y * width + x;
    const shown = [`x ${x}  y ${y}`];
    for (const [name, id] of [["candidate", "img-candidate"], ["reference", "img-reference"]]) {
      const bytes = pixels($(id));
      if (bytes) shown.push(`${name} sRGB ${bytes[4 * i]} ${bytes[4 * i + 1]} ${bytes[4 * i + 2]}`);
    }
    const bytes = pixels($("img-map"));
    if (bytes) shown.push(`${maps[view.map].name} ${mapValue(maps[view.map], hex(bytes, i))}`);
    $("readout").textContent = shown.join("  ·  ");
  }

  // ---- what is shown

  function showCandidate() {
    const candidate = data.candidates[view.candidate];
    $("img-candidate").src = candidate.picture;
    $("img-candidate").alt = `Candidate ${candidate.name}`;
    $("tag-candidate").textContent = candidate.name;
    document.querySelectorAll("#candidates input").forEach((input, i) => { input.checked = i === view.candidate; });
    document.querySelectorAll("#tiles button").forEach((button, i) => {
      button.setAttribute("aria-pressed", i === view.candidate);
    });
    document.querySelectorAll("tbody tr").forEach((row, i) => row.classList.toggle("chosen", i === view.candidate));
    showMap();
  }

  function showMap() {
    const map = maps[view.map];
    const img = $("img-map");
    img.src = data.candidates[view.candidate][view.map];
    img.alt = `${map.name} of ${data.candidates[view.candidate].name}`;
    for (const name of Object.keys(maps)) {
      const tab = $(`tab-${name}`);
      tab.setAttribute("aria-selected", name === view.map);
      tab.tabIndex = name === view.map ? 0 : -1;
    }
    $("panel-map").setAttribute("aria-labelledby", `tab-${view.map}`);
    const stops = map.colors.filter((_, i) => i % 15 === 0).map((color) => `#${color}`);
    document.querySelector("#legend .ramp").style.background = `linear-gradient(to right, ${stops.join(", ")})`;
    document.querySelector("#legend .ticks").replaceChildren(...map.ticks.map(([at, label]) => {
      const span = document.createElement("span");
      span.style.left = `${at * 100}%`;
      span.textContent = label;
      return span;
    }));
    $("legend-note").textContent = map.note;
    // What the readout tells is of the pictures shown now; one that is replaced while it decodes tells nothing.
    Promise.all([img.decode(), $("img-candidate").decode()]).then(() => pointed && read(...pointed), () => {});
    showTiles();
  }

  function showTiles() {
    document.querySelectorAll("#tiles img[data-candidate]").forEach((img) => {
      const candidate = data.candidates[img.dataset.candidate];
      img.src = view.tiles === "map" ? candidate[view.map] : candidate.picture;
    });
  }

  function choose(candidate) {
    view.candidate = clamp(candidate, 0, data.candidates.length - 1);
    showCandidate();
  }

  function chooseMap(name, focus) {
    view.map = name;
    showMap();
    if (focus) $(`tab-${name}`).focus();
  }

  // ---- building what depends on the number of candidates

  function element(tag, parent, text) {
    const made = document.createElement(tag);
    if (text !== undefined) made.textContent = text;
    parent.append(made);
    return made;
  }

  function buildChoice() {
    data.candidates.forEach((candidate, i) => {
      const label = element("label", $("candidates"));
      const input = element("input", label);
      Object.assign(input, { type: "radio", name: "candidate" });
      element("span", label, candidate.name);
      input.addEventListener("change", () => choose(i));
    });
  }

  function buildTile(name, figure, candidate) {
    const tile = element("figure", $("tiles"));
    tile.className = "tile";
    const stage = element("div", tile);
    stage.className = "stage";
    const layer = element("div", stage);
    layer.className = "layer";
    const img = element("img", layer);
    Object.assign(img, { alt: name, draggable: false });
    if (candidate === undefined) {
      img.src = data.reference.picture;
      const caption = element("figcaption", tile, name);
      caption.className = "still";
      element("i", caption, "reference");
    } else {
      img.dataset.candidate = candidate;
      const button = element("button", element("figcaption", tile));
      button.type = "button";
      element("b", button, name);
      element("i", button, figure);
      button.addEventListener("click", () => choose(candidate));
    }
    addStage(stage);
  }

  function listen() {
    const click = (id, action) => $(id).addEventListener("click", action);
    click("zoom-in", () => zoomBy(1.5));
    click("zoom-out", () => zoomBy(1 / 1.5));
    click("zoom-fit", zoomFit);
    click("zoom-pixel", zoomPixel);
    click("blink", blink);
    const names = Object.keys(maps);
    names.forEach((name, i) => {
      click(`tab-${name}`, () => chooseMap(name));
      $(`tab-${name}`).addEventListener("keydown", (event) => {
        const step = { ArrowRight: 1, ArrowLeft: names.length - 1 }[event.key];
        if (step) chooseMap(names[(i + step) % names.length], true);
      });
    });
    document.querySelectorAll("#gallery-kind input").forEach((input) => {
      input.addEventListener("change", () => { view.tiles = input.value; showTiles(); });
    });
    document.querySelectorAll("tbody th button").forEach((button, i) => {
      button.addEventListener("click", () => {
        choose(i);
        $("viewer").scrollIntoView({ block: "start" });
      });
    });
    document.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const keys = {
        f: () => chooseMap("flip"), r: () => chooseMap("relative"), s: () => chooseMap("signed"), b: blink,
        "[": () => setWipe(view.wipe - 0.05), "]": () => setWipe(view.wipe + 0.05),
        "+": () => zoomBy(1.5), "=": () => zoomBy(1.5), "-": () => zoomBy(1 / 1.5), "0": zoomFit,
      };
      const action = keys[event.key.toLowerCase()];
      if (action) action();
      else if (/^[1-9]$/.test(event.key) && event.key <= data.candidates.length) choose(event.key - 1);
    });
  }

  $("viewer").hidden = false;
  buildChoice();
  $("img-reference").src = data.reference.picture;
  $("tag-reference").textContent = data.reference.name;
  addStage($("stage-picture"));
  addStage($("stage-map"));
  if (data.candidates.length > 1) {
    $("gallery").hidden = false;
    data.candidates.forEach((candidate, i) => buildTile(candidate.name, candidate.figure, i));
    buildTile(data.reference.name);
  }
  listenToWipe();
  listen();
  setWipe(0.5);
  showCandidate();
  new ResizeObserver(placeAll).observe($("viewer"));
  addEventListener("resize", placeAll);
  placeAll();
})();
