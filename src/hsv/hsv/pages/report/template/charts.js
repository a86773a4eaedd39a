"use strict";
/* The plots: one chart a panel, all over one time axis, drawn from one state. */

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/* What each kind of curve looks like. */
const LOOKS = {
  actual: { dash: "solid", width: 1.4 },
  actuator: { dash: "dash", width: 1.2 },
  effector: { dash: "dot", width: 1.4 },
  nominal: { dash: "dash", width: 1.1 },
  reference: { dash: "dot", width: 1.2 },
  filtered: { dash: "dot", width: 1.1 },
  bound: { dash: "dash", width: 1 },
  mean: { dash: "dot", width: 1 },
  low: { width: 0 },
  high: { width: 0 },
};
/* Between the curves of these kinds and those before them. */
const FILLS = { high: "rgba(0,114,178,.2)" };
const SHADES = { fault: "rgba(179,38,30,.09)", saturation: "rgba(214,158,0,.3)", tube: "rgba(91,95,199,.22)" };
const RUN_COLOURS = 6;

async function inflate(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/* The numbers of a curve: their bits as integers, each less the one before it, lowest bytes first (payload.py). */
function restored(buffer, offset, length) {
  const bytes = new Uint8Array(buffer, offset, 4 * length), bits = new Uint32Array(length);
  let last = 0;
  for (let i = 0; i < length; i++) {
    const step = bytes[i] | (bytes[i + length] << 8) | (bytes[i + 2 * length] << 16) | (bytes[i + 3 * length] << 24);
    last = (last + step) >>> 0;
    bits[i] = last;
  }
  return new Float32Array(bits.buffer);
}

class Charts {
  /* `plots` describes the panels; `buffer` holds their numbers, one array after the other. */
  constructor(plots, buffer) {
    this.runs = plots.runs;
    this.end = plots.end ?? Math.max(...plots.runs.map((run) => run.end));
    let offset = 0;
    this.arrays = plots.lengths.map((length) => {
      const array = restored(buffer, offset, length);
      offset += array.byteLength;
      return array;
    });
    this.state = { units: document.documentElement.dataset.units, hiddenRuns: new Set(), hiddenKinds: new Set(), limits: false, time: null };
    this.panels = plots.panels.map((panel) => ({ ...panel, element: document.getElementById(`plot-${panel.name}`), stale: true, y: null }));
    this.onTime = () => {};
    this.onZoom = () => {};
    this.watch = new IntersectionObserver((entries) => this.seen(entries), { rootMargin: "300px" });
    this.panels.forEach((panel) => this.watch.observe(panel.element));
  }

  /* Change the state and draw: at once what is in sight, then the rest while nothing else is to do. */
  set(change) {
    if ("units" in change && change.units !== this.state.units) this.panels.forEach((panel) => { panel.y = null; });
    Object.assign(this.state, change);
    this.panels.forEach((panel) => { panel.stale = true; });
    this.panels.filter((panel) => panel.inSight).forEach((panel) => this.draw(panel));
    this.drawLater();
    if ("time" in change) this.onTime(this.state.time);
  }

  seen(entries) {
    for (const entry of entries) {
      const panel = this.panels.find((candidate) => candidate.element === entry.target);
      panel.inSight = entry.isIntersecting;
      if (panel.inSight) this.draw(panel);
    }
    this.drawLater();
  }

  drawLater() {
    if (this.waiting) return;
    const later = window.requestIdleCallback ? (work) => requestIdleCallback(work, { timeout: 100 }) : setTimeout;
    const work = () => {
      this.waiting = false;
      const next = this.panels.find((panel) => panel.stale);
      if (next) this.draw(next);
      if (next) this.drawLater();
      else document.documentElement.dataset.drawn = "all";
    };
    this.waiting = true;
    later(work);
  }

  drawAll() {
    this.panels.forEach((panel) => this.draw(panel));
  }

  draw(panel) {
    if (!panel.stale) return;
    panel.stale = false;
    const first = !panel.drawn;
    panel.drawn = true;
    Plotly.react(panel.element, this.traces(panel), this.layout(panel), {
      displaylogo: false, responsive: true, doubleClick: "autosize",
      modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "autoScale2d", "toImage"]],
      toImageButtonOptions: { filename: panel.name, scale: 2 },
    });
    if (first) panel.element.on("plotly_relayout", (change) => this.zoomed(panel, change));
  }

  shown(curve) {
    return !this.state.hiddenKinds.has(curve.kind) && !this.state.hiddenRuns.has(curve.run);
  }

  /* The values of a curve in the units shown. */
  values(panel, curve) {
    const factor = panel.units[this.state.units].factor;
    return factor === 1 ? this.arrays[curve.y] : Float64Array.from(this.arrays[curve.y], (value) => value * factor);
  }

  traces(panel) {
    const unit = panel.units[this.state.units].unit;
    return panel.curves.filter((curve) => this.shown(curve)).map((curve) => {
      const whose = curve.run !== null && this.runs.length > 1 ? `${this.runs[curve.run].label}, ` : "";
      const colour = curve.run === null ? css("--muted") : css(`--run${curve.run % RUN_COLOURS}`);
      return {
        type: "scatter", mode: "lines", name: whose + curve.label, x: this.arrays[curve.x], y: this.values(panel, curve),
        line: { ...LOOKS[curve.kind], color: colour }, hovertemplate: `%{y:.6g} ${unit}`,
        ...(curve.kind in FILLS ? { fill: "tonexty", fillcolor: FILLS[curve.kind] } : {}),
        opacity: curve.kind === "actual" || curve.run === null ? 1 : 0.75,
      };
    });
  }

  layout(panel) {
    const { time } = this.state;
    const y = panel.y || this.extent(panel);
    const small = y && Math.max(Math.abs(y[0]), Math.abs(y[1])) < 1e-3;
    return {
      autosize: true, showlegend: false, hovermode: "x unified", dragmode: "zoom",
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      margin: { l: 62, r: 16, t: 8, b: 38 }, font: { size: 12 }, separators: ".\u2009",
      modebar: { bgcolor: "rgba(0,0,0,0)", color: css("--muted"), activecolor: css("--ink") },
      xaxis: { range: time || [0, this.end], title: { text: "time [s]", standoff: 6 }, hoverformat: ".6~g", zeroline: false, ticklabeloverflow: "allow" },
      yaxis: { ...(y ? { range: y } : { autorange: true }), exponentformat: "power", minexponent: small ? 3 : 6, zeroline: false, automargin: true },
      shapes: [...this.shading(panel), ...this.limits(panel)],
    };
  }

  shading(panel) {
    return panel.shades.filter((shade) => shade.runs.some((run) => !this.state.hiddenRuns.has(run))).map((shade) => ({
      type: "rect", layer: "below", xref: "x", yref: "paper", x0: shade.from, x1: shade.to, y0: 0, y1: 1,
      line: { width: 0 }, fillcolor: SHADES[shade.kind],
    }));
  }

  limits(panel) {
    const factor = panel.units[this.state.units].factor;
    return panel.limits.map((limit) => ({
      type: "line", xref: "paper", yref: "y", x0: 0, x1: 1, y0: limit * factor, y1: limit * factor,
      line: { width: 1.5, color: css("--bad") },
    }));
  }

  /* The range of what is in the time window, with a margin; null where there is nothing. */
  extent(panel) {
    const [from, to] = this.state.time || [-Infinity, Infinity];
    const factor = panel.units[this.state.units].factor;
    const limits = this.state.limits ? panel.limits : [];
    let low = Math.min(...limits), high = Math.max(...limits);
    for (const curve of panel.curves.filter((candidate) => this.shown(candidate))) {
      const x = this.arrays[curve.x], y = this.arrays[curve.y], ends = y.length === 2;
      for (let i = 0; i < y.length; i++) {
        if ((ends || (x[i] >= from && x[i] <= to)) && Number.isFinite(y[i])) {
          low = Math.min(low, y[i]);
          high = Math.max(high, y[i]);
        }
      }
    }
    if (!(low <= high)) return null;
    const margin = 0.06 * (high - low) || 1e-3 * Math.abs(high) || 1e-6;
    return [(low - margin) * factor, (high + margin) * factor];
  }

  /* A zoom of one panel: its time window is everybody's, its vertical range its own. */
  zoomed(panel, change) {
    const own = change["yaxis.range[0]"] !== undefined ? [change["yaxis.range[0]"], change["yaxis.range[1]"]] : null;
    if (change["xaxis.range[0]"] !== undefined) {
      panel.y = own;
      this.set({ time: [change["xaxis.range[0]"], change["xaxis.range[1]"]] });
    } else if (change["xaxis.autorange"] || change["yaxis.autorange"]) {
      this.panels.forEach((each) => { each.y = null; });
      this.set({ time: null });
    } else if (own) {
      panel.y = own;
    }
    this.onZoom();
  }

  /* The vertical ranges that differ from all that is there, by panel, in the units shown. */
  get zooms() {
    return Object.fromEntries(this.panels.filter((panel) => panel.y).map((panel) => [panel.name, panel.y]));
  }

  set zooms(zooms) {
    this.panels.forEach((panel) => { panel.y = zooms[panel.name] || null; });
    this.set({});
  }
}

/* Draw what the toolbar says, in a window of time; pictures hide the runs that the charts hide. */
function followToolbar(charts, form, time) {
  const unchecked = (name) => [...form.querySelectorAll(`[name=${name}]:not(:checked)`)].map((box) => box.value);
  const hiddenRuns = new Set(unchecked("run").map(Number)), hiddenKinds = new Set(unchecked("kind"));
  for (const each of document.querySelectorAll("main [data-run]")) each.toggleAttribute("hidden", hiddenRuns.has(Number(each.dataset.run)));
  charts.set({ units: form.elements.units.value, hiddenRuns, hiddenKinds, limits: Boolean(form.elements.limits?.checked), time });
}

/* Let a form control the charts, and the address of the page keep what it says; `show(time)` shows it in a window of time. */
function connectCharts(charts, form, show) {
  const { from, to } = form.elements;
  const typed = () => {
    const low = from.value === "" ? 0 : Number(from.value);
    const high = to.value === "" ? charts.end : Number(to.value);
    return low < high && (low > 0 || high < charts.end) ? [low, high] : null;
  };
  const zooms = { get: () => charts.zooms, set: (found) => { charts.zooms = found; } };
  const address = new Address([form], () => show(typed()), zooms);
  form.addEventListener("change", (event) => {
    show([from, to].includes(event.target) ? typed() : charts.state.time);
    address.write();
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.elements.all.addEventListener("click", () => {
    charts.zooms = {};
    charts.set({ time: null });
    address.write();
  });
  charts.onTime = (time) => {
    from.value = time ? Number(time[0].toPrecision(6)) : "";
    to.value = time ? Number(time[1].toPrecision(6)) : "";
  };
  charts.onZoom = () => address.write();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => show(charts.state.time));
  /* On paper every plot is drawn, in the light colours and at the width of its place there. */
  matchMedia("print").addEventListener("change", () => {
    show(charts.state.time);
    charts.drawAll();
    document.querySelectorAll(".js-plotly-plot").forEach((plot) => Plotly.Plots.resize(plot));
  });
  address.read();
}

/* Start the plotting library, draw `plots`, and let `connect(charts)` do what is the page's own. */
async function startCharts(plots, connect) {
  const trouble = document.getElementById("trouble");
  try {
    const [numbers, library] = await Promise.all([inflate("numbers"), inflate("library")]);
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(library);
    document.head.append(script);
    const charts = new Charts(plots, numbers);
    connect(charts);
    window.report = charts;
  } catch (error) {
    trouble.textContent = `The plots could not be drawn (${error.message}). They need a browser of 2023 or later.`;
    trouble.hidden = false;
    throw error;
  }
}
