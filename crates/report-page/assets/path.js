/* The robot's path on a canvas: zoom by wheel, pinch, keys and buttons; runs and tracks on and off. */
"use strict";

/** Small constructor of elements. */
function element(name, properties, ...children) {
  const made = Object.assign(document.createElement(name), properties || {});
  made.append(...children);
  return made;
}

/** A checkbox with its label. */
function checkbox(text, checked, change, swatch) {
  const box = element("input", { type: "checkbox", checked });
  box.addEventListener("change", () => change(box.checked));
  return { box, label: element("label", {}, box, ...(swatch ? [element("span", { className: swatch })] : []), text) };
}

function button(text, click, name) {
  const made = element("button", { type: "button", textContent: text });
  /* A name has the visible words in it: who speaks to the browser says what stands there. */
  const has_words = /[a-z]/i.test(text) && !(name || "").includes(text);
  if (name) made.setAttribute("aria-label", has_words ? text + ": " + name : name);
  made.addEventListener("click", click);
  return made;
}

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

/** Steps of 1, 2 and 5 that give about `count` of them. */
function niceStep(span, count) {
  const rough = span / count, power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((by) => by * power).find((step) => step >= rough);
}

const DASHES = { truth: [], nominal: [9, 5], calibrated: [2, 4], extended: [], explained: [6, 3] };
const WIDTHS = { truth: 5, nominal: 2, calibrated: 2.4, extended: 2, explained: 1.5 };
/* Times the view of all paths. */
const MOST_ZOOM = 200, LEAST_ZOOM = 0.5;
/* So many runs are drawn at first: those at the front of the list. */
const RUNS_AT_FIRST = 24;
/* A list of more is searched, not read. */
const RUNS_WITHOUT_SEARCH = 24;

function pathPicture(figure, data) {
  const plot = figure.querySelector(".plot");
  const canvas = element("canvas");
  plot.append(canvas);
  plot.tabIndex = 0;
  plot.setAttribute("role", "application");
  plot.setAttribute("aria-roledescription", "picture that can be moved and magnified by arrow keys, plus, minus and 0");

  const decoded = (steps) => {
    if (!steps) return null;
    const points = new Float64Array(steps.length), at = [0, 0];
    for (let k = 0; k < steps.length; k++) {
      at[k % 2] += steps[k];
      points[k] = data.origin_m[k % 2] + at[k % 2] * data.step_m;
    }
    return points;
  };
  const runs = data.runs.map((run, k) => ({ name: run.name, on: k < RUNS_AT_FIRST, tracks: run.tracks.map(decoded), marks: decoded(run.marks) }));
  const shown = data.tracks.map(() => true);
  const has = (k) => runs.some((run) => run.tracks[k] && run.tracks[k].length > 0);
  const truth = data.tracks.findIndex((track) => track.role === "truth");
  let magnified = 1, view = null, home = null;

  /** A track as it is drawn: its deviations from the truth magnified. */
  const drawn = (run, track) => {
    const points = run.tracks[track], from = truth < 0 ? null : run.tracks[truth];
    if (!points || magnified === 1 || !from || track === truth) return points;
    return points.map((value, k) => from[k] + magnified * (value - from[k]));
  };
  const visible = function* () {
    for (const run of runs) if (run.on) for (let k = 0; k < data.tracks.length; k++) {
      const points = shown[k] ? drawn(run, k) : null;
      if (points) yield [points, data.tracks[k].role];
    }
  };
  const fit = () => {
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (const [points] of visible()) for (let k = 0; k < points.length; k++) {
      low[k % 2] = Math.min(low[k % 2], points[k]);
      high[k % 2] = Math.max(high[k % 2], points[k]);
    }
    if (!(low[0] <= high[0])) return { x: 0, y: 0, span: 1 };
    const [width, height] = [plot.clientWidth || 1, plot.clientHeight || 1];
    const span = Math.max(high[0] - low[0], (high[1] - low[1]) * width / height, 1e-6);
    return { x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2, span: 1.12 * span };
  };
  const reset = () => { home = fit(); view = { ...home }; draw(); };

  const draw = () => {
    const ratio = window.devicePixelRatio || 1, width = plot.clientWidth, height = plot.clientHeight;
    if (!width || !view) return;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext("2d"), scale = width / view.span;
    const at = (x, y) => [width / 2 + (x - view.x) * scale, height / 2 - (y - view.y) * scale];
    pen.scale(ratio, ratio);
    pen.font = "12px system-ui, sans-serif";
    const step = niceStep(view.span, Math.max(3, width / 130)), digits = Math.max(0, -Math.floor(Math.log10(step)));
    pen.lineWidth = 1;
    for (const axis of [0, 1]) {
      const [middle, half] = axis === 0 ? [view.x, view.span / 2] : [view.y, height / scale / 2];
      for (let k = Math.ceil((middle - half) / step); k * step <= middle + half; k++) {
        const [x, y] = axis === 0 ? at(k * step, 0) : at(0, k * step);
        pen.strokeStyle = colour("line");
        pen.beginPath();
        if (axis === 0) { pen.moveTo(x, 0); pen.lineTo(x, height); } else { pen.moveTo(0, y); pen.lineTo(width, y); }
        pen.stroke();
        pen.fillStyle = colour("quiet");
        const text = (k * step).toFixed(digits).replace("-", "\u2212") + " m";
        if (axis === 0) pen.fillText(text, x + 4, height - 6); else pen.fillText(text, 6, y - 4);
      }
    }
    pen.lineJoin = "round";
    for (const [points, role] of visible()) {
      pen.strokeStyle = colour(role);
      pen.lineWidth = WIDTHS[role];
      pen.globalAlpha = role === "truth" ? 0.4 : 0.9;
      pen.setLineDash(DASHES[role]);
      pen.beginPath();
      for (let k = 0; k < points.length; k += 2) pen[k ? "lineTo" : "moveTo"](...at(points[k], points[k + 1]));
      pen.stroke();
      pen.setLineDash([]);
      pen.globalAlpha = 1;
      pen.fillStyle = colour(role);
      pen.beginPath();
      pen.arc(...at(points[points.length - 2], points[points.length - 1]), role === "truth" ? 5 : 3.5, 0, 2 * Math.PI);
      pen.fill();
    }
    if (truth >= 0 && shown[truth]) for (const run of runs) if (run.on) for (let k = 0; k < run.marks.length; k += 2) {
      const [x, y] = at(run.marks[k], run.marks[k + 1]);
      pen.strokeStyle = colour("truth");
      pen.lineWidth = 1.5;
      pen.strokeRect(x - 4, y - 4, 8, 8);
    }
  };

  const zoom = (by, x = plot.clientWidth / 2, y = plot.clientHeight / 2) => {
    const span = Math.min(home.span / LEAST_ZOOM, Math.max(home.span / MOST_ZOOM, view.span / by));
    const before = view.span / plot.clientWidth, after = span / plot.clientWidth;
    view.x += (x - plot.clientWidth / 2) * (before - after);
    view.y -= (y - plot.clientHeight / 2) * (before - after);
    view.span = span;
    draw();
  };
  const move = (right, down) => {
    const scale = view.span / plot.clientWidth;
    view.x -= right * scale;
    view.y += down * scale;
    draw();
  };
  plot.addEventListener("wheel", (event) => {
    /* A page that is scrolled past is not to be caught: the wheel zooms once the picture was clicked. */
    if (!event.ctrlKey && document.activeElement !== plot) return;
    event.preventDefault();
    const box = plot.getBoundingClientRect();
    zoom(Math.exp(-event.deltaY * 0.0015), event.clientX - box.left, event.clientY - box.top);
  }, { passive: false });
  const fingers = new Map();
  plot.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, event);
    if (event.pointerType === "mouse") plot.setPointerCapture(event.pointerId);
  });
  plot.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
    if (other) {
      const box = plot.getBoundingClientRect();
      const apart = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY) || 1;
      zoom(apart(event) / apart(before), (event.clientX + other.clientX) / 2 - box.left, (event.clientY + other.clientY) / 2 - box.top);
    } else {
      move(event.clientX - before.clientX, event.clientY - before.clientY);
    }
    fingers.set(event.pointerId, event);
  });
  for (const end of ["pointerup", "pointercancel", "pointerleave"]) plot.addEventListener(end, (event) => fingers.delete(event.pointerId));
  plot.addEventListener("dblclick", reset);
  plot.addEventListener("keydown", (event) => {
    const act = {
      "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: reset,
      ArrowLeft: () => move(40, 0), ArrowRight: () => move(-40, 0), ArrowUp: () => move(0, 40), ArrowDown: () => move(0, -40),
    }[event.key];
    if (act && !event.ctrlKey && !event.metaKey && !event.altKey) { event.preventDefault(); act(); }
  });

  const isThere = (track, k) => has(k) || (k === truth && runs.some((run) => run.marks.length > 0));
  const tracks = data.tracks.map((track, k) => (!isThere(track, k) ? "" :
    checkbox(track.name, true, (on) => { shown[k] = on; draw(); }, "swatch " + track.role).label));
  const larger = element("select", {});
  for (const by of [1, 10, 50, 200]) larger.append(element("option", { value: by, textContent: by === 1 ? "as they are" : by + " times larger" }));
  larger.addEventListener("change", () => { magnified = Number(larger.value); reset(); });
  const buttons = [button("+", () => zoom(1.4), "Zoom in"), button("−", () => zoom(1 / 1.4), "Zoom out"), button("Reset", reset, "Show all of the paths")];
  const magnify = truth < 0 || !has(truth) ? [] : [element("label", {}, "Deviations from the measured path drawn", larger)];
  plot.before(element("div", { className: "controls" }, ...tracks), element("div", { className: "controls" }, ...magnify, ...buttons));
  const boxes = runs.map((run) => checkbox(run.name, run.on, (on) => { run.on = on; draw(); }));
  const listed = (k) => !boxes[k].label.hidden;
  const all = (on) => { runs.forEach((run, k) => { if (listed(k)) { run.on = on; boxes[k].box.checked = on; } }); if (on) reset(); else draw(); };
  const list = element("div", { className: "runs" }, ...boxes.map((box) => box.label));
  const search = element("input", { type: "search", className: "runs-search", placeholder: "search runs" });
  search.setAttribute("aria-label", "Search runs by name");
  search.addEventListener("input", () => boxes.forEach(({ label }, k) => { label.hidden = !runs[k].name.toLowerCase().includes(search.value.trim().toLowerCase()); }));
  plot.after(
    element("p", { className: "readout", textContent: "Drag to move; click the picture, then the wheel, + and − magnify; pinch on a touch screen; 0 or a double click shows all. Dots are the ends of runs." }),
    element("fieldset", {}, element("legend", { textContent: "Runs" }),
      element("div", { className: "controls" }, ...(runs.length > RUNS_WITHOUT_SEARCH ? [search] : []), button("All", () => all(true), "All runs of the list"), button("None", () => all(false), "No run of the list")), list));
  reset();
  return { draw, resize: () => { const own = view && home && view.span !== home.span; if (own) draw(); else reset(); } };
}
