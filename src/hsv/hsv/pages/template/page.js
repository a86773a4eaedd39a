"use strict";
/* Common to all pages: plots by Plotly with a common time window, and a toolbar whose settings the address keeps. */

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
/* Return a unit as plain text for Plotly, which cannot display this markup. */
const plain = (unit) => unit.replaceAll("<sup>½</sup>", "½").replaceAll("<sup>2</sup>", "²");
const RUN_COLOURS = 6;

/* How each kind of curve is drawn. */
const LOOKS = {
  actual: { line: { width: 1.4 } },
  actuator: { line: { dash: "dash", width: 1.2 }, opacity: 0.75 },
  effector: { line: { dash: "dot", width: 1.4 }, opacity: 0.75 },
  nominal: { line: { dash: "dash", width: 1.1 }, opacity: 0.75 },
  reference: { line: { dash: "dot", width: 1.2 }, opacity: 0.75 },
  filtered: { line: { dash: "dot", width: 1.1 }, opacity: 0.75 },
  bound: { line: { dash: "dash", width: 1 } },
  mean: { line: { dash: "dot", width: 1 } },
  low: { line: { width: 0 } },
  high: { line: { width: 0 }, fill: "tonexty", fillcolor: "rgba(0,114,178,.2)" },
  bars: { type: "bar" },
  dots: { mode: "markers", marker: { size: 4, opacity: 0.5 } },
};
const SHADES = { fault: "rgba(179,38,30,.09)", saturation: "rgba(214,158,0,.3)", tube: "rgba(91,95,199,.22)" };

/* The toolbar. Its settings are kept in the address, as `#section&name=value&...`. */
class Toolbar {
  constructor(form) {
    this.form = form;
    this.listeners = [];
    form.addEventListener("change", () => this.changed());
    form.addEventListener("submit", (event) => event.preventDefault());
    form.elements.all?.addEventListener("click", () => this.setTime(null));
    /* A link to a section keeps the settings; an address with settings changes them. */
    window.addEventListener("hashchange", () => (location.hash.includes("=") ? this.read() : this.write()));
    this.read();
  }

  get units() {
    return this.form.elements.units.value;
  }

  /* The selected time window, or null for the whole flight. */
  get time() {
    const { from, to } = this.form.elements;
    if (!from || (from.value === "" && to.value === "")) return null;
    const [low, high] = [Number(from.value), to.value === "" ? Infinity : Number(to.value)];
    return low < high ? [low, high] : null;
  }

  setTime(time) {
    ["from", "to"].forEach((name, end) => { this.form.elements[name].value = time ? Number(time[end].toPrecision(6)) : ""; });
    this.changed();
  }

  unchecked(name) {
    return new Set([...this.form.querySelectorAll(`[name=${name}]:not(:checked)`)].map((box) => box.value));
  }

  changed() {
    this.write();
    this.apply();
  }

  apply() {
    document.documentElement.dataset.units = this.units;
    const hidden = this.unchecked("run");
    for (const each of document.querySelectorAll("main [data-run]")) each.toggleAttribute("hidden", hidden.has(each.dataset.run));
    this.listeners.forEach((listener) => listener());
  }

  /* Return the section and the settings in the address. */
  static address() {
    const parts = location.hash.slice(1).split("&");
    const section = parts[0].includes("=") ? "" : parts.shift();
    return [section, new URLSearchParams(parts.join("&"))];
  }

  read() {
    const [section, settings] = Toolbar.address();
    for (const control of this.form.elements) {
      const { name, value, type } = control, said = settings.get(name);
      if (type === "radio") control.checked ||= said === value;
      else if (type === "checkbox" && settings.has("units")) control.checked = settings.getAll(name).includes(value);
      else if (said !== null && type !== "checkbox" && [...(control.options || [{ value: said }])].some((option) => option.value === said)) control.value = said;
    }
    this.apply();
    if (settings.size) document.getElementById(section)?.scrollIntoView({ behavior: "instant" });
  }

  write() {
    const settings = new URLSearchParams([...new FormData(this.form)].filter(([, value]) => value !== ""));
    const [section] = Toolbar.address();
    history.replaceState(null, "", `#${section ? `${section}&` : ""}${settings}`);
  }
}

async function inflate(id) {
  const text = document.getElementById(id).textContent;
  if (!text) return new ArrayBuffer(0);
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

class Charts {
  /* `described` is from hsv.pages.engine; `buffer` holds the arrays of all curves, one after the other. */
  constructor(described, buffer, toolbar) {
    Object.assign(this, described, { toolbar });
    let offset = 0;
    this.arrays = (described.lengths || []).map((length) => {
      offset += 4 * length;
      return new Float32Array(buffer, offset - 4 * length, length);
    });
    this.end = Math.max(1e-6, ...this.runs.map((run) => run.end));
    for (const panel of this.panels) Object.assign(panel, { element: document.getElementById(`plot-${panel.name}`), stale: true, y: null });
    this.watch = new IntersectionObserver((entries) => this.seen(entries), { rootMargin: "300px" });
    this.panels.forEach((panel) => this.watch.observe(panel.element));
    toolbar.listeners.push(() => this.show());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show());
    /* For printing, draw all plots, in light colours and at the printed width. */
    matchMedia("print").addEventListener("change", () => {
      this.show();
      this.drawAll();
      document.querySelectorAll(".js-plotly-plot").forEach((plot) => Plotly.Plots.resize(plot));
    });
    this.show();
  }

  /* The displayed time window, or null for the whole flight. */
  window() {
    return this.toolbar.time;
  }

  /* Apply the settings of the toolbar and redraw the visible plots. */
  show() {
    const { units } = this.toolbar, time = this.window();
    if (units !== this.units) this.panels.forEach((panel) => { panel.y = null; });
    Object.assign(this, { units, time: time && [time[0], Math.min(time[1], this.end)] });
    this.hidden = { kinds: this.toolbar.unchecked("kind"), runs: this.toolbar.unchecked("run") };
    this.limits = Boolean(this.toolbar.form.elements.limits?.checked);
    this.panels.forEach((panel) => { panel.stale = true; });
    this.panels.filter((panel) => panel.inSight).forEach((panel) => this.draw(panel));
  }

  seen(entries) {
    for (const entry of entries) {
      const panel = this.panels.find((candidate) => candidate.element === entry.target);
      panel.inSight = entry.isIntersecting;
      if (panel.inSight) this.draw(panel);
    }
  }

  drawAll() {
    this.panels.forEach((panel) => this.draw(panel));
  }

  draw(panel) {
    if (!panel.stale) return;
    panel.stale = false;
    const traces = panel.curves.filter((curve) => this.shown(curve)).map((curve) => this.trace(panel, curve));
    Plotly.react(panel.element, traces, this.layout(panel), {
      displaylogo: false, responsive: true, doubleClick: "autosize",
      modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "autoScale2d", "toImage",
        { name: "csv", title: "Download as CSV", icon: Plotly.Icons.disk, click: () => this.save(panel) }]],
      toImageButtonOptions: { filename: panel.name, format: "svg" },
    });
    if (!panel.drawn && !panel.across) panel.element.on("plotly_relayout", (change) => this.zoomed(panel, change));
    panel.drawn = true;
  }

  /* Save what a panel shows as CSV, in the displayed units: a row for each point of each curve. */
  save(panel) {
    const head = (units, name) => `"${name} [${plain(units[this.units].unit) || "1"}]"`;
    const rows = [`curve,${panel.across ? head(panel.across, "x") : '"time [s]"'},${head(panel.units, "y")}`];
    for (const { name, x, y } of panel.element.data) y.forEach((value, i) => rows.push(`"${name}",${x[i]},${value}`));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([`${rows.join("\n")}\n`], { type: "text/csv" }));
    link.download = `${panel.name}.csv`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  shown(curve) {
    return !this.hidden.kinds.has(curve.kind) && !this.hidden.runs.has(String(curve.run));
  }

  /* Return an array in the displayed units; `units` are those by system, or null for an array without a unit. */
  values(index, units) {
    const factor = units ? units[this.units].factor : 1;
    return factor === 1 ? this.arrays[index] : Float64Array.from(this.arrays[index], (value) => value * factor);
  }

  trace(panel, curve) {
    const whose = curve.run !== null && this.runs.length > 1 ? `${this.runs[curve.run].label}, ` : "";
    const color = curve.run === null ? css("--muted") : css(`--run${curve.run % RUN_COLOURS}`);
    const look = LOOKS[curve.kind], x = this.values(curve.x, panel.across);
    const own = curve.kind === "dots" ? { text: Array.from(x, (_, i) => `flight ${i * curve.every}`), hovertemplate: "%{text}: %{x:.4g}, %{y:.5g}<extra></extra>" } : {};
    return {
      type: "scatter", mode: "lines", name: whose + curve.label, x, y: this.values(curve.y, panel.units),
      hovertemplate: `%{y:.6g} ${panel.units[this.units].unit}`, ...look, ...own,
      line: { ...look.line, color }, marker: { ...look.marker, color: panel.across ? css("--run0") : color },
    };
  }

  layout(panel) {
    const y = panel.across ? null : panel.y || this.extent(panel);
    const bars = panel.curves.find((curve) => curve.kind === "bars");
    const small = y && Math.max(Math.abs(y[0]), Math.abs(y[1])) < 1e-3;
    return {
      autosize: true, showlegend: false, hovermode: panel.across ? "closest" : "x unified", dragmode: "zoom", bargap: 0,
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      margin: { l: 62, r: 16, t: 8, b: 38 }, font: { size: 12 }, separators: ".\u2009",
      modebar: { bgcolor: "rgba(0,0,0,0)", color: css("--muted"), activecolor: css("--ink") },
      xaxis: { zeroline: false, ...(panel.across ? {} : {
        range: this.time || [0, this.end], title: { text: "time [s]", standoff: 6 }, hoverformat: ".6~g", ticklabeloverflow: "allow" }) },
      yaxis: { ...(y ? { range: y } : { autorange: true }), title: { text: panel.title || bars?.label || "" }, exponentformat: "power",
        minexponent: small ? 3 : 6, zeroline: false, automargin: true },
      shapes: [...this.shading(panel), ...this.limitLines(panel)],
    };
  }

  shading(panel) {
    return panel.shades.filter((shade) => shade.runs.some((run) => !this.hidden.runs.has(String(run)))).map((shade) => ({
      type: "rect", layer: "below", xref: "x", yref: "paper", x0: shade.from, x1: shade.to, y0: 0, y1: 1,
      line: { width: 0 }, fillcolor: SHADES[shade.kind],
    }));
  }

  limitLines(panel) {
    const [along, across] = panel.limitsOn === "x" ? ["x", "y"] : ["y", "x"];
    const factor = (along === "x" ? panel.across : panel.units)[this.units].factor;
    return panel.limits.map((limit) => ({
      type: "line", [`${along}ref`]: along, [`${along}0`]: limit * factor, [`${along}1`]: limit * factor,
      [`${across}ref`]: "paper", [`${across}0`]: 0, [`${across}1`]: 1, line: { width: 1.5, color: css("--bad") },
    }));
  }

  /* Return the range of the values in the time window, with a margin; null without values. */
  extent(panel) {
    const [from, to] = this.time || [-Infinity, Infinity], { factor } = panel.units[this.units];
    const limits = this.limits ? panel.limits : [];
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

  /* Handle a zoom in one panel: the time window applies to all panels, the vertical range only to this one. */
  zoomed(panel, change) {
    const end = (axis, which) => change[`${axis}axis.range[${which}]`];
    const own = end("y", 0) === undefined ? null : [end("y", 0), end("y", 1)];
    if (own) panel.y = own;
    if (end("x", 0) !== undefined) {
      panel.y = own;
      this.toolbar.setTime([end("x", 0), end("x", 1)]);
    } else if (change["xaxis.autorange"] || change["yaxis.autorange"]) {
      this.panels.forEach((each) => { each.y = null; });
      this.toolbar.setTime(null);
    }
  }
}

/* Start the page: load the plotting library and draw the plots, if there are any, then call `connect`. */
async function startPage(connect = () => {}) {
  const toolbar = new Toolbar(document.getElementById("toolbar")), described = document.getElementById("described");
  if (!described) return;
  try {
    const [numbers, library] = await Promise.all([inflate("numbers"), inflate("library")]);
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(library);
    document.head.append(script);
    window.report = new Charts(JSON.parse(described.textContent), numbers, toolbar);
    window.own = connect(window.report, toolbar) ?? {};
  } catch (error) {
    const trouble = document.getElementById("trouble");
    trouble.textContent = `The plots could not be drawn (${error.message}). They need a browser of 2023 or later.`;
    trouble.hidden = false;
    throw error;
  }
}
