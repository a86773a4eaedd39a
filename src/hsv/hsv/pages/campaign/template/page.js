"use strict";
/* Plots of a campaign: curves over time by the report's charts, here distributions and dependences. */

const unpack = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
const scaled = (values, { factor }) => (factor === 1 ? values : Float64Array.from(values, (value) => value * factor));
/* The plotting library sets text of its own: no markup of units. */
const plain = (unit) => unit.replaceAll("<sup>½</sup>", "½").replaceAll("<sup>2</sup>", "²");

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

function limitLines(limit, axis, factor) {
  if (limit === null) return [];
  const [from, along, across] = axis === "x" ? ["yref", "x", "y"] : ["xref", "y", "x"];
  return [limit, -limit].map((value) => ({
    type: "line", [from]: "paper", [`${along}0`]: value * factor, [`${along}1`]: value * factor, [`${across}0`]: 0, [`${across}1`]: 1,
    line: { width: 1.5, color: css("--bad") },
  }));
}

function histograms(metrics, units) {
  for (const [name, metric] of Object.entries(metrics)) {
    const own = metric.units[units], edges = scaled(metric.edges, own), { counts } = metric;
    const middle = counts.map((_, i) => (edges[i] + edges[i + 1]) / 2);
    const width = counts.map((_, i) => edges[i + 1] - edges[i]);
    /* Limit lines that lie beyond the data would squeeze it: they are drawn where they are in sight. */
    const shapes = limitLines(metric.limit, "x", own.factor).filter((line) => line.x0 >= edges[0] && line.x0 <= edges[edges.length - 1]);
    draw(`histogram-${name}`, [{ type: "bar", x: middle, y: counts, width, marker: { color: css("--run0") } }],
      layout("", "flights", { bargap: 0, shapes }));
  }
}

function scatter(data, name, units) {
  const metric = data.metrics[name], own = metric.units[units], flights = unpack(data.flights);
  const y = scaled(unpack(metric.values), own), finite = [...y].filter(Number.isFinite);
  const low = Math.min(...finite), high = Math.max(...finite), unit = plain(own.unit);
  const shapes = limitLines(metric.limit, "y", own.factor).filter((line) => line.y0 >= low && line.y0 <= high);
  for (const factor of data.factors) {
    const across = factor.units[units];
    draw(`scatter-${factor.name}`, [{
      type: "scatter", mode: "markers", x: scaled(unpack(factor.values), across), y, text: [...flights].map((flight) => `flight ${flight}`),
      marker: { size: 4, opacity: 0.5, color: css("--run0") }, hovertemplate: "%{text}: %{x:.4g}, %{y:.5g}<extra></extra>",
    }], layout(plain(across.unit), `${metric.words}${unit && ` [${unit}]`}`, { shapes }));
  }
}

async function start() {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  await startCharts(read("plots"), (charts) => {
    const data = read("data"), form = document.getElementById("toolbar"), { units, metric } = form.elements;
    let shown = "";
    const show = (time) => {
      showUnits();
      followToolbar(charts, form, time);
      const wanted = [units.value, metric?.value, css("--run0")].join();
      if (wanted !== shown) {
        histograms(data.metrics, units.value);
        if (metric) scatter(data, metric.value, units.value);
      }
      shown = wanted;
    };
    connectCharts(charts, form, show);
    show(charts.state.time);
  });
}

start();
