/* Charts, copying, and what print and dark mode need. Without this script every number is in a table. */
"use strict";

/** A number with minus signs, not hyphens. */
function signed(number) {
  return String(number).replaceAll("-", "\u2212");
}

/** A chart: points with bars of 95 %, or a line with its band; a series each on and off, those in `off` at first. */
function chartPicture(figure, data, off = new Set()) {
  const plot = figure.querySelector(".plot");
  const readout = element("p", { className: "readout" });
  readout.setAttribute("aria-hidden", "true");
  const short = (value) => (value === null || value === undefined ? "–" : signed(Number(value.toPrecision(3))));
  const labels = (u, places) => places.map((place) => (place === null ? "" : signed(Number(place.toPrecision(6)))));
  let chart = null;
  const log = data.log || [false, false];

  const shape = (pen, role, x, y, size) => {
    pen.beginPath();
    if (role === "nominal") {
      pen.moveTo(x, y - size); pen.lineTo(x + size, y + size * 0.8); pen.lineTo(x - size, y + size * 0.8); pen.closePath();
    } else if (role === "calibrated") pen.rect(x - size * 0.8, y - size * 0.8, 1.6 * size, 1.6 * size);
    else if (role === "truth") {
      pen.moveTo(x, y - size); pen.lineTo(x + size, y); pen.lineTo(x, y + size); pen.lineTo(x - size, y); pen.closePath();
    } else pen.arc(x, y, size * 0.9, 0, 2 * Math.PI);
    pen.fill();
  };
  const drawSeries = (u, index) => {
    const series = data.series[index - 1], pen = u.ctx, ratio = window.devicePixelRatio || 1;
    const x = (k) => u.valToPos(data.at[k], "x", true), y = (value) => u.valToPos(value, "y", true);
    const places = data.at.map((_, k) => k).filter((k) => series.values[k] !== null);
    pen.save();
    pen.beginPath();
    pen.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    pen.clip();
    pen.strokeStyle = pen.fillStyle = colour(series.role);
    pen.lineWidth = 2 * ratio;
    if (series.line) {
      if (series.half) {
        pen.globalAlpha = 0.18;
        pen.beginPath();
        /* On a logarithmic axis a band that reaches zero ends at the frame. */
        const lowest = log[1] ? u.scales.y.min : -Infinity;
        places.forEach((k, n) => pen[n ? "lineTo" : "moveTo"](x(k), y(series.values[k] + (series.half[k] || 0))));
        [...places].reverse().forEach((k) => pen.lineTo(x(k), y(Math.max(lowest, series.values[k] - (series.half[k] || 0)))));
        pen.fill();
        pen.globalAlpha = 1;
      }
      pen.setLineDash((DASHES[series.role] || []).map((dash) => dash * ratio));
      pen.beginPath();
      places.forEach((k, n) => pen[n ? "lineTo" : "moveTo"](x(k), y(series.values[k])));
      pen.stroke();
    } else {
      for (const k of places) {
        if (series.half && series.half[k] !== null) {
          pen.beginPath();
          pen.moveTo(x(k), y(Math.max(log[1] ? u.scales.y.min : -Infinity, series.values[k] - series.half[k])));
          pen.lineTo(x(k), y(series.values[k] + series.half[k]));
          pen.stroke();
        }
        shape(pen, series.role, x(k), y(series.values[k]), 4.5 * ratio);
      }
    }
    pen.restore();
  };
  const say = (u) => {
    const k = u.cursor.idx;
    if (k === null || k === undefined) { readout.textContent = ""; return; }
    const where = data.names ? data.names[k] : data.x + " " + short(data.at[k]);
    const parts = data.series.filter((_, n) => u.series[n + 1].show).map((series) =>
      series.name + " " + short(series.values[k]) + (series.half && series.half[k] !== null ? " ± " + short(series.half[k]) : ""));
    readout.textContent = where + ": " + parts.join("; ") + " (" + data.y + ")";
  };
  /* Bars and bands are to be seen whole, and zero with them. */
  const range = (u) => {
    let low = 0, high = 0;
    const [from, to] = u.series[0].idxs || [0, data.at.length - 1];
    data.series.forEach((series, n) => {
      if (!u.series[n + 1].show) return;
      series.values.forEach((value, k) => {
        if (value === null || k < from || k > to) return;
        const half = series.half ? series.half[k] || 0 : 0;
        low = Math.min(low, value - half);
        high = Math.max(high, value + half);
      });
    });
    const positive = data.series.flatMap((series, n) => (u.series[n + 1].show ? series.values : [])).filter((value) => value > 0);
    if (log[1]) return positive.length ? [Math.min(...positive) / 1.5, Math.max(...positive) * 1.5] : [0.1, 1];
    const room = 0.08 * (high - low || 1);
    return [low < 0 ? low - room : 0, high > 0 ? high + room : room];
  };
  const draw = () => {
    const width = plot.clientWidth;
    if (!width) return;
    if (chart) chart.destroy();
    const first = data.at[0], last = data.at[data.at.length - 1], room = 0.04 * (last - first) || 0.5;
    const axis = { stroke: colour("quiet"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line"), width: 1 }, font: "12px system-ui, sans-serif", labelFont: "13px system-ui, sans-serif", labelSize: 22 };
    const names = (u, places) => places.map((place) => (Number.isInteger(place) && data.names[place]) || "");
    chart = new uPlot({
      width, height: Math.max(240, Math.min(340, width * 0.5)),
      scales: {
        x: { time: false, distr: log[0] ? 3 : 1, range: (u, low, high) => (low !== first || high !== last ? [low, high] : log[0] ? [first / 1.2, last * 1.2] : [first - room, last + room]) },
        y: { range, distr: log[1] ? 3 : 1 },
      },
      legend: { show: false },
      padding: data.names ? [8, 64, 0, 0] : [8, 12, 0, 0],
      cursor: { points: { show: false }, y: false, drag: { x: true, y: false } },
      axes: [
        { ...axis, label: data.x, values: labels, ...(data.names ? { values: names, incrs: [1, 2, 5, 10, 20, 50, 100], rotate: -50, size: 74, space: 22 } : {}) },
        { ...axis, label: data.y, values: labels, size: 58 },
      ],
      series: [{}, ...data.series.map((series, n) => ({ label: series.name, show: !off.has(series.name), paths: () => null, points: { show: false } }))],
      hooks: { drawSeries: [drawSeries], setCursor: [say] },
    }, [data.at, ...data.series.map((series) => series.values)], plot);
  };
  const boxes = data.series.map((series, n) =>
    checkbox(series.name, !off.has(series.name), (on) => {
      if (on) off.delete(series.name); else off.add(series.name);
      if (chart) { chart.setSeries(n + 1, { show: on }); chart.redraw(false, true); }
    },
      (series.line ? "swatch " : "shape ") + series.role).label);
  plot.before(element("div", { className: "controls" }, ...boxes, button("Reset zoom", draw, "Show the whole axis")));
  plot.after(readout);
  draw();
  return { draw, resize: draw };
}

/** Errors along a run that is chosen, of position and of heading, against time or distance. */
function errorsPicture(figure, data) {
  const plot = figure.querySelector(".plot");
  /* It has switches in it: a group, no single image. */
  plot.setAttribute("role", "group");
  const choice = (label, options) => {
    const select = element("select", {}, ...options.map(([value, text]) => element("option", { value, textContent: text })));
    select.addEventListener("change", () => draw());
    return { select, label: element("label", {}, label, select) };
  };
  const run = choice("Run", data.runs.map((one, k) => [k, one.name]));
  const axis = choice("Against", [["t_s", "time"], ["distance_m", "distance driven"]]);
  const hidden = new Set();
  let charts = [];
  const draw = () => {
    const of = data.runs[run.select.value], by = axis.select.value;
    plot.replaceChildren();
    charts = [["position", "position error, mm"], ["heading", "heading error, °"]].map(([key, label]) => {
      const drawn = data.models.map((model, k) => ({ model, values: of.models[k] ? of.models[k][key] : [] })).filter((one) => one.values.length > 0);
      if (drawn.length === 0) return null;
      const holder = element("div", {}, element("div", { className: "plot" }));
      plot.append(holder);
      return chartPicture(holder, {
        x: by === "t_s" ? "time since the run's start, s" : "distance driven, m", y: label, at: of[by], names: null,
        series: drawn.map(({ model, values }) => ({ name: model.name, role: model.role, line: true, values, half: null })),
      }, hidden);
    }).filter(Boolean);
  };
  plot.before(element("div", { className: "controls" }, run.label, axis.label));
  draw();
  return { draw: () => charts.forEach((chart) => chart.draw()), resize: () => charts.forEach((chart) => chart.resize()) };
}

(() => {
  const pictures = new Map();
  const makers = { path: pathPicture, errors: errorsPicture, chart: chartPicture };
  const make = (figure) => {
    if (pictures.has(figure) || !figure.querySelector(".plot").clientWidth) return;
    const data = JSON.parse(figure.querySelector("script").textContent);
    pictures.set(figure, makers[["path", "errors"].find((kind) => figure.classList.contains(kind)) || "chart"](figure, data));
  };
  const all = () => document.querySelectorAll("figure.picture").forEach(make);
  all();
  /* What is in a closed part has no width yet. */
  document.querySelectorAll("details").forEach((part) => part.addEventListener("toggle", all));
  let waiting = 0, lastWidth = window.innerWidth;
  window.addEventListener("resize", () => {
    if (window.innerWidth === lastWidth) return;
    lastWidth = window.innerWidth;
    cancelAnimationFrame(waiting);
    waiting = requestAnimationFrame(() => pictures.forEach((picture) => picture.resize()));
  });
  const redraw = () => pictures.forEach((picture) => picture.draw());
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  window.matchMedia("print").addEventListener("change", () => pictures.forEach((picture) => picture.resize()));
  let opened = [];
  window.addEventListener("beforeprint", () => {
    opened = [...document.querySelectorAll("details.part:not([open])")];
    opened.forEach((part) => { part.open = true; });
    all();
    redraw();
  });
  window.addEventListener("afterprint", () => opened.forEach((part) => { part.open = false; }));
  /* A link into the appendix opens what it leads to. */
  const open = () => {
    const part = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (part && part.tagName === "DETAILS") part.open = true;
  };
  window.addEventListener("hashchange", open);
  open();
  document.querySelectorAll("button.copy").forEach((copy) => copy.addEventListener("click", async () => {
    const text = copy.closest(".code").querySelector("code");
    try {
      await navigator.clipboard.writeText(text.textContent);
      copy.textContent = "Copied";
    } catch {
      window.getSelection().selectAllChildren(text);
      copy.textContent = "Selected: press Ctrl+C";
    }
    setTimeout(() => { copy.textContent = "Copy"; }, 2500);
  }));
})();
