"use strict";
/* The controls of the page, and its start. */

function connect(charts) {
  const form = document.getElementById("toolbar");
  const { from, to } = form.elements;
  const unchecked = (name) => [...form.querySelectorAll(`[name=${name}]:not(:checked)`)].map((box) => box.value);
  const window_ = () => {
    const low = from.value === "" ? 0 : Number(from.value);
    const high = to.value === "" ? charts.end : Number(to.value);
    return low < high && (low > 0 || high < charts.end) ? [low, high] : null;
  };
  form.addEventListener("change", (event) => {
    switch (event.target.name) {
      case "units":
        document.documentElement.dataset.units = form.elements.units.value;
        charts.set({ units: form.elements.units.value });
        break;
      case "run":
        charts.set({ hiddenRuns: new Set(unchecked("run").map(Number)) });
        break;
      case "kind":
        charts.set({ hiddenKinds: new Set(unchecked("kind")) });
        break;
      case "limits":
        charts.set({ limits: form.elements.limits.checked });
        break;
      default:
        charts.set({ time: window_() });
    }
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.elements.all.addEventListener("click", () => charts.set({ time: null }));
  charts.onTime = (time) => {
    from.value = time ? Number(time[0].toPrecision(6)) : "";
    to.value = time ? Number(time[1].toPrecision(6)) : "";
  };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.set({}));
}

/* On paper every plot is drawn, in the light colours and at the width of its place there. */
function preparePrinting(charts) {
  const redraw = () => {
    charts.set({});
    charts.drawAll();
    charts.panels.forEach((panel) => Plotly.Plots.resize(panel.element));
  };
  matchMedia("print").addEventListener("change", redraw);
}

async function start() {
  const trouble = document.getElementById("trouble");
  try {
    const [numbers, library] = await Promise.all([inflate("numbers"), inflate("library")]);
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(library);
    document.head.append(script);
    const plots = JSON.parse(document.getElementById("plots").textContent);
    const charts = new Charts(plots, numbers);
    charts.player = new Player(charts, plots);
    connect(charts);
    preparePrinting(charts);
    window.report = charts;
  } catch (error) {
    trouble.textContent = `The plots could not be drawn (${error.message}). They need a browser of 2023 or later.`;
    trouble.hidden = false;
    throw error;
  }
}

start();
