"use strict";
/* The side view of the vehicle: in the report at the time of a slider, on the live page at the newest step. */

const DEGREE = Math.PI / 180, FOOT = 0.3048;
const QUANTITIES = ["altitude", "velocity", "angle_of_attack", "pitch_angle", "fuel_equivalence_ratio", "elevator_deflection"];
const ELASTIC = ["elastic_coordinate_1", "elastic_coordinate_2"];
/* Kinds of curves that move the vehicle, in order of preference: the effector of an input, if it is recorded. */
const ACTUAL = ["effector", "actuator", "actual"];
/* Frames per second for users who prefer reduced motion. */
const CALM_RATE = 2;

const fixed = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "\u2212") : "–");
const degrees = (angle) => `${fixed(angle / DEGREE, 2)}°`;
const outline = (points) => `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z`;

/* One side view. Its geometry is from hsv.pages.side_view; the bending is exaggerated, angles are not. A sample, in SI
   units, is {time, QUANTITIES, elastic: [eta_1, eta_2], faults: [{channel, text}], nominal: another sample}. */
class SideView {
  constructor(element, geometry) {
    Object.assign(this, { element, airframe: geometry, geometry, exaggeration: geometry.exaggeration, units: "metric" });
    this.centre = [301, 165];
    this.metre = 460.8 / geometry.length;
  }

  find(selector) {
    return this.element.querySelector(selector);
  }

  /* Return the mappings of points to the screen: bent, then rotated by the pitch angle about the centre of gravity. */
  placed(sample) {
    const cos = Math.cos(sample.pitch_angle), sin = Math.sin(sample.pitch_angle);
    const bend = sample.elastic.map((coordinate) => coordinate * this.exaggeration);
    const turned = (x, z) => [this.centre[0] + (x * cos - z * sin) * this.metre, this.centre[1] - (x * sin + z * cos) * this.metre];
    const bent = ([x, z, mode, shape, slope]) => turned(x - z * slope * bend[mode], z + shape * bend[mode]);
    return { turned, bent, slope: ([, , mode, , slope]) => slope * bend[mode], bend };
  }

  elevator({ turned, bend, slope }, sample) {
    const { hinge, outline: points } = this.geometry.elevator, [x, z, mode, shape, rise] = hinge;
    const angle = sample.elevator_deflection + slope(hinge), cos = Math.cos(angle), sin = Math.sin(angle);
    const at = [x - z * rise * bend[mode], z + shape * bend[mode]];
    // Positive: trailing edge down.
    return outline(points.map(([px, pz]) => turned(at[0] + px * cos - pz * sin, at[1] + px * sin + pz * cos)));
  }

  /* The flame starts between the ends of roof and cowl; its length is proportional to the fuel equivalence ratio. */
  flame({ bent }, sample) {
    const { roof, cowl, length } = this.geometry.flame, reach = length * Math.max(sample.fuel_equivalence_ratio, 0);
    const middle = roof.map((value, index) => 0.5 * (value + cowl[index]));
    const aft = ([x, z, ...bending], share) => [x - share * reach, z, ...bending];
    return outline([roof, aft(roof, 0.45), aft(middle, 1), aft(cowl, 0.45), cowl].map(bent));
  }

  body(place, sample, selector) {
    this.find(`${selector} .body`).setAttribute("d", outline(this.geometry.body.map(place.bent)));
    this.find(`${selector} .engine`).setAttribute("d", outline(this.geometry.engine.map(place.bent)));
    this.find(`${selector} .elevator`).setAttribute("d", this.elevator(place, sample));
  }

  /* An arrow from the centre of gravity, with its label at the tip. */
  arrow(name, length, angle, [dx, dy]) {
    const [x, y] = [this.centre[0] + length * this.metre * Math.cos(angle), this.centre[1] - length * this.metre * Math.sin(angle)];
    this.find(`.${name}`).setAttribute("d", `M${this.centre.join(" ")}L${x} ${y}`);
    this.find(`.${name}-label`).setAttribute("x", x + dx);
    this.find(`.${name}-label`).setAttribute("y", y + dy);
  }

  draw(sample) {
    // The shape of a rigid vehicle is not known.
    this.geometry = sample.elastic.some(Boolean) ? this.airframe : this.airframe.plain;
    const { geometry, units } = this, place = this.placed(sample), gamma = sample.pitch_angle - sample.angle_of_attack;
    this.find(".ghost").style.display = sample.nominal ? "" : "none";
    if (sample.nominal) this.body(this.placed(sample.nominal), sample.nominal, ".ghost");
    this.body(place, sample, ".vehicle");
    this.find(".axis").setAttribute("d", outline(geometry.axis.map(place.bent)).slice(0, -1));
    this.find(".flame").setAttribute("d", this.flame(place, sample));
    for (const [part, channel] of [[".vehicle .elevator", "elevator_deflection"], [".flame", "fuel_equivalence_ratio"]]) {
      this.find(part).classList.toggle("failed", sample.faults.some((fault) => fault.channel === channel));
    }
    const faults = sample.faults.map((fault) => fault.text).join("; ");
    this.find(".faults").textContent = faults && `⚠ ${faults}`;
    this.arrow("path", 0.69 * geometry.length, gamma, [-4, 18]);
    this.arrow("forward", 0.62 * geometry.length, sample.pitch_angle, [-4, -8]);
    this.arrow("down", 0.17 * geometry.length, sample.pitch_angle - 0.5 * Math.PI, [8, 2]);
    this.find(".airflow").setAttribute("transform", `translate(${this.centre}) rotate(${-gamma / DEGREE})`);
    this.find(".exaggeration").textContent = this.exaggeration;
    const [metres, words] = units === "paper" ? [20 * FOOT, "20 ft"] : [5, "5 m"], left = 626 - metres * this.metre;
    this.find(".bar").setAttribute("d", `M${left} 282v8M${left} 286H626M626 282v8`);
    this.find(".bar-label").setAttribute("x", 0.5 * (left + 626));
    this.find(".bar-label").textContent = words;
    const length = (value, digits) => (units === "paper" ? `${fixed(value / FOOT, digits)} ft` : `${fixed(value, digits)} m`);
    const small = (value) => (units === "paper" ? `${fixed((12 * value) / FOOT, 2)} in` : `${fixed(1000 * value, 1)} mm`);
    const readout = {
      altitude: length(sample.altitude, units === "paper" ? 0 : 1), velocity: `${length(sample.velocity, 1)}/s`,
      angle: degrees(sample.angle_of_attack), pitch: degrees(sample.pitch_angle), gamma: degrees(gamma),
      fuel: fixed(sample.fuel_equivalence_ratio, 3), deflection: degrees(sample.elevator_deflection),
      nose: small(sample.elastic[0] * geometry.axis[0][3]), tail: small(sample.elastic[1] * geometry.axis.at(-1)[3]),
    };
    for (const [key, text] of Object.entries(readout)) this.find(`[data-key=${key}]`).textContent = text;
    this.find("title").textContent = `Side view of the vehicle at ${fixed(sample.time, 2)} s: pitch ${readout.pitch}, elevator ${readout.deflection}; ${faults}`;
  }
}

/* The side views of a page, one for each flight. */
class Vehicle {
  constructor(charts, toolbar, slider) {
    Object.assign(this, { charts, time: 0, views: [] });
    for (const figure of document.querySelectorAll("#vehicle figure:has(.side-view)")) {
      const run = Number(figure.dataset.run), view = new SideView(figure.querySelector(".side-view"), charts.airframe);
      this.views.push({ view, run, own: this.series(run, ACTUAL), nominal: this.series(run, ["nominal"]), at: figure.querySelector(".at") });
    }
    slider.addEventListener("input", () => this.change({ exaggeration: Number(slider.value) }));
    toolbar.listeners.push(() => this.change({ units: toolbar.units }));
    this.change({ exaggeration: Number(slider.value), units: toolbar.units });
  }

  change(settings) {
    this.views.forEach(({ view }) => Object.assign(view, settings));
    this.draw();
  }

  /* Return the curves of a run by quantity, or null if one is missing; a rigid vehicle has no elastic curves. */
  series(run, kinds) {
    const found = Object.fromEntries([...QUANTITIES, ...ELASTIC].map((name) => {
      const curves = this.charts.panels.find((panel) => panel.name === name)?.curves.filter((curve) => curve.run === run) || [];
      return [name, kinds.map((each) => curves.find((curve) => curve.kind === each)).find(Boolean)];
    }));
    return QUANTITIES.every((name) => found[name]) ? found : null;
  }

  /* Return the last step that is not after the current time, or the first step; null without steps. */
  sample(series) {
    const { arrays } = this.charts, x = arrays[series.altitude.x];
    if (!x?.length) return null;
    let low = 0, high = x.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (x[middle] <= this.time + 1e-6) low = middle;
      else high = middle - 1;
    }
    const value = (name) => (series[name] ? arrays[series[name].y][low] : 0);
    return { time: x[low], faults: [], ...Object.fromEntries(QUANTITIES.map((name) => [name, value(name)])), elastic: ELASTIC.map(value) };
  }

  draw() {
    for (const { view, run, own, nominal, at } of this.views) {
      const sample = this.sample(own);
      if (!sample) return;
      sample.nominal = nominal && this.sample(nominal);
      sample.faults = this.charts.runs[run].faults.filter((fault) => fault.from <= sample.time + 1e-6 && sample.time <= fault.to);
      view.draw(sample);
      if (at) at.textContent = `${sample.time.toFixed(2)} s`;
    }
  }
}

/* The player of a flight: a button, and a time slider that shows the faults. */
class Player {
  constructor(charts, form, toolbar) {
    const { play, time, speed, exaggeration } = form.elements;
    Object.assign(this, { form, charts, vehicle: new Vehicle(charts, toolbar, exaggeration) });
    time.max = charts.end;
    play.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    time.addEventListener("input", () => this.show(Number(time.value)));
    time.addEventListener("keydown", (event) => { if (event.key === " ") play.click(); });
    speed.addEventListener("change", () => { this.last = null; });
    form.addEventListener("submit", (event) => event.preventDefault());
    const faults = new Map(charts.runs.flatMap((run) => run.faults).map((fault) => [JSON.stringify(fault), fault]));
    faults.forEach((fault) => this.mark(fault));
  }

  get time() {
    return this.vehicle.time;
  }

  mark(fault) {
    const mark = document.createElement("span"), jump = document.createElement("button"), { end } = this.charts;
    mark.style.cssText = `left:${(100 * fault.from) / end}%;width:${(100 * (fault.to - fault.from)) / end}%`;
    Object.assign(jump, { type: "button", textContent: `fault at ${Number(fault.from.toPrecision(5))} s`, title: fault.text });
    jump.addEventListener("click", () => this.show(fault.from));
    this.form.querySelector(".marks").append(mark);
    this.form.querySelector(".jumps").append(jump);
  }

  show(time) {
    const { time: slider, now } = this.form.elements, { end } = this.charts;
    this.vehicle.time = Math.min(time, end);
    slider.value = this.time;
    now.value = `${this.time.toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", now.value);
    this.vehicle.draw();
  }

  play() {
    if (this.time >= this.charts.end) this.vehicle.time = 0;
    Object.assign(this, { playing: true, last: null });
    this.form.elements.play.textContent = "❚❚ pause";
    requestAnimationFrame((now) => this.advance(now));
  }

  pause() {
    this.playing = false;
    this.form.elements.play.textContent = "▶ play";
  }

  advance(now) {
    if (!this.playing) return;
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches, elapsed = this.last === null ? 0 : now - this.last;
    if (this.last === null || !calm || elapsed >= 1000 / CALM_RATE) {
      this.last = now;
      this.show(this.time + (elapsed / 1000) * Number(this.form.elements.speed.value));
    }
    if (this.time >= this.charts.end) this.pause();
    else requestAnimationFrame((next) => this.advance(next));
  }
}
