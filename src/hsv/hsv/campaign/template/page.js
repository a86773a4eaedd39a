"use strict";
/* Plots of a campaign; css() and inflate() come from the report's charts.js. */

const unpack = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);

function layout(x, y, extra = {}) {
  return {
    autosize: true, showlegend: false, hovermode: "closest",
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: { l: 62, r: 16, t: 8, b: 38 },
    font: { size: 12 }, separators: ".\u2009",
    xaxis: { title: { text: x, standoff: 6 }, zeroline: false }, yaxis: { title: { text: y }, zeroline: false, automargin: true },
    ...extra,
  };
}

function draw(id, traces, described) {
  Plotly.react(id, traces, described, { displaylogo: false, responsive: true });
}

function envelopes(data) {
  const time = unpack(data.time), flown = unpack(data.flight_time);
  for (const signal of data.signals) {
    const shade = { type: "scatter", mode: "lines", x: time, line: { width: 0 }, hoverinfo: "skip" };
    const curves = signal.flights.map((flight, index) => ({
      type: "scatter", mode: "lines", x: flown, y: unpack(flight.y), name: flight.label,
      line: { width: 1.4, dash: index ? "dash" : "solid", color: css(`--run${index}`) },
    }));
    draw(`envelope-${signal.name}`, [
      { ...shade, y: unpack(signal.low) },
      { ...shade, y: unpack(signal.high), fill: "tonexty", fillcolor: "rgba(0,114,178,.2)" },
      { type: "scatter", mode: "lines", x: time, y: unpack(signal.mean), name: "mean", line: { width: 1, dash: "dot", color: css("--muted") } },
      ...curves,
    ], layout("time [s]", ""));
  }
}

function limitLines(limit, axis) {
  if (limit === null) return [];
  const [from, along, across] = axis === "x" ? ["yref", "x", "y"] : ["xref", "y", "x"];
  return [limit, -limit].map((value) => ({
    type: "line", [from]: "paper", [`${along}0`]: value, [`${along}1`]: value, [`${across}0`]: 0, [`${across}1`]: 1,
    line: { width: 1.5, color: css("--bad") },
  }));
}

/* Limit lines that lie beyond the data would squeeze it: they are drawn where they are in sight. */
const inSight = (limit, low, high) => limitLines(limit, "x").filter((line) => line.x0 >= low && line.x0 <= high);

function histograms(metrics) {
  for (const [name, metric] of Object.entries(metrics)) {
    const { edges, counts, limit } = metric;
    const middle = counts.map((_, i) => (edges[i] + edges[i + 1]) / 2);
    const width = counts.map((_, i) => edges[i + 1] - edges[i]);
    draw(`histogram-${name}`, [{ type: "bar", x: middle, y: counts, width, marker: { color: css("--run0") } }],
      layout("", "flights", { bargap: 0, shapes: inSight(limit, edges[0], edges[edges.length - 1]) }));
  }
}

function scatter(data, name) {
  const metric = data.metrics[name], flights = unpack(data.flights), y = unpack(metric.values);
  const finite = [...y].filter(Number.isFinite), low = Math.min(...finite), high = Math.max(...finite);
  const shapes = limitLines(metric.limit, "y").filter((line) => line.y0 >= low && line.y0 <= high);
  for (const factor of data.factors) {
    draw(`scatter-${factor.name}`, [{
      type: "scatter", mode: "markers", x: unpack(factor.values), y, text: [...flights].map((flight) => `flight ${flight}`),
      marker: { size: 4, opacity: 0.5, color: css("--run0") }, hovertemplate: "%{text}: %{x:.4g}, %{y:.5g}<extra></extra>",
    }], layout(factor.unit === "1" ? "" : factor.unit, `${name.replaceAll("_", " ")}${metric.unit === "1" ? "" : ` [${metric.unit}]`}`, { shapes }));
  }
}

async function start() {
  try {
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await inflate("library"));
    document.head.append(script);
    const data = JSON.parse(document.getElementById("data").textContent);
    const form = document.getElementById("metric"), all = () => {
      envelopes(data.envelope);
      histograms(data.metrics);
      if (form) scatter(data, form.elements.metric.value);
      document.documentElement.dataset.drawn = "all";
    };
    form?.addEventListener("change", () => scatter(data, form.elements.metric.value));
    form?.addEventListener("submit", (event) => event.preventDefault());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", all);
    all();
  } catch (error) {
    const trouble = document.getElementById("trouble");
    trouble.textContent = `The plots could not be drawn (${error.message}). They need a browser of 2023 or later.`;
    trouble.hidden = false;
    throw error;
  }
}

start();
