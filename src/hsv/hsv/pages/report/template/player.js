"use strict";
/* The flight played: a side view of every run, and of the nominal trajectory, at the time of one slider. */

const QUANTITIES = ["altitude", "velocity", "angle_of_attack", "pitch_angle", "fuel_equivalence_ratio", "elevator_deflection"];
const ELASTIC = ["elastic_coordinate_1", "elastic_coordinate_2"];
/* Where the inputs of the vehicle are, the best of what is recorded. */
const FLOWN = ["effector", "actuator", "actual"];
/* Pictures a second where people want little motion. */
const CALM_RATE = 2;

class Player {
  constructor(charts, plots) {
    this.charts = charts;
    this.plots = plots;
    this.section = document.getElementById("vehicle");
    this.form = document.getElementById("player");
    this.time = 0;
    this.views = null;
    const { play, time, speed, exaggeration } = this.form.elements;
    time.max = charts.end;
    play.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    time.addEventListener("input", () => this.show(Number(time.value)));
    time.addEventListener("keydown", (event) => {
      if (event.key === " ") play.click();
    });
    speed.addEventListener("change", () => { this.last = null; });
    exaggeration.addEventListener("input", () => this.each((view) => view.setExaggeration(Number(exaggeration.value))));
    this.form.addEventListener("submit", (event) => event.preventDefault());
    this.markFaults();
    new IntersectionObserver((entries) => {
      this.inSight = entries[0].isIntersecting;
      if (this.inSight) this.show(this.time);
    }).observe(this.section);
    matchMedia("print").addEventListener("change", () => this.draw());
  }

  each(work) {
    (this.views || []).forEach(work);
  }

  setUnits(units) {
    this.each((view) => view.setUnits(units));
  }

  markFaults() {
    const marks = this.form.querySelector(".marks"), jumps = this.form.querySelector(".jumps"), end = this.charts.end;
    const seen = new Set();
    this.plots.runs.flatMap((run) => run.faults).forEach((fault) => {
      const key = JSON.stringify(fault);
      if (seen.has(key)) return;
      seen.add(key);
      const mark = document.createElement("span"), jump = document.createElement("button");
      mark.style.left = `${(100 * fault.from) / end}%`;
      mark.style.width = `${(100 * (fault.to - fault.from)) / end}%`;
      jump.type = "button";
      jump.textContent = `fault at ${Number(fault.from.toPrecision(5))} s`;
      jump.title = fault.text;
      jump.addEventListener("click", () => this.show(fault.from));
      marks.append(mark);
      jumps.append(jump);
    });
  }

  /* The curve of a panel of a run that is of the first of these kinds that there is. */
  curve(panel, run, kinds) {
    const curves = this.plots.panels.find((candidate) => candidate.name === panel)?.curves || [];
    return kinds.map((kind) => curves.find((curve) => curve.kind === kind && curve.run === run)).find(Boolean);
  }

  series(run, kind) {
    const kinds = kind === "actual" ? FLOWN : [kind];
    const found = Object.fromEntries([...QUANTITIES, ...ELASTIC].map((name) => [name, this.curve(name, run, kinds)]));
    return Object.values(found).every(Boolean) ? found : null;
  }

  /* The last recorded step that is not after `time`. */
  sample(series, time) {
    const x = this.charts.arrays[series.altitude.x];
    let low = 0, high = x.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (x[middle] <= time + 1e-6) low = middle;
      else high = middle - 1;
    }
    const value = (name) => this.charts.arrays[series[name].y][low];
    return { time: x[low], ...Object.fromEntries(QUANTITIES.map((name) => [name, value(name)])), elastic: ELASTIC.map(value) };
  }

  create() {
    this.views = [];
    this.drawn = [];
    for (const figure of this.section.querySelectorAll("figure")) {
      const run = Number(figure.dataset.run), own = this.series(run, figure.dataset.kind);
      if (!own) {
        figure.remove();
        continue;
      }
      const view = createSideView(figure.querySelector(".side-view"), this.plots.airframe);
      view.setUnits(this.charts.state.units);
      view.setExaggeration(Number(this.form.elements.exaggeration.value));
      const nominal = figure.dataset.kind === "actual" ? this.series(run, "nominal") : null;
      this.views.push(view);
      this.drawn.push({ view, own, nominal, at: figure.querySelector(".at"), faults: nominal ? this.plots.runs[run].faults : [] });
    }
  }

  draw() {
    if (!this.views) this.create();
    for (const { view, own, nominal, at, faults } of this.drawn) {
      const sample = this.sample(own, this.time);
      sample.faults = faults.filter((fault) => fault.from <= sample.time + 1e-6 && sample.time <= fault.to);
      if (nominal) sample.nominal = this.sample(nominal, this.time);
      view.draw(sample);
      at.textContent = `${sample.time.toFixed(2)} s`;
    }
  }

  show(time) {
    this.time = Math.min(time, this.charts.end);
    const { time: slider, now } = this.form.elements;
    slider.value = this.time;
    slider.setAttribute("aria-valuetext", `${this.time.toFixed(2)} s`);
    now.value = `${this.time.toFixed(2)} s`;
    if (this.inSight) this.draw();
  }

  play() {
    if (this.time >= this.charts.end) this.time = 0;
    this.playing = true;
    this.last = null;
    this.form.elements.play.textContent = "❚❚ pause";
    requestAnimationFrame((now) => this.advance(now));
  }

  pause() {
    this.playing = false;
    this.form.elements.play.textContent = "▶ play";
  }

  advance(now) {
    if (!this.playing) return;
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const elapsed = this.last === null ? 0 : now - this.last;
    if (this.last === null || !calm || elapsed >= 1000 / CALM_RATE) {
      this.last = now;
      this.show(this.time + (elapsed / 1000) * Number(this.form.elements.speed.value));
    }
    if (this.time >= this.charts.end) this.pause();
    else requestAnimationFrame((next) => this.advance(next));
  }
}
