"use strict";
/* The flight as it comes from the server, and what the page asks of it. */

const REDRAW = 200; // ms between two drawings of the plots
const ROWS = 1024; // that there is room for at first

/* Names of the program in words. */
const words = (name) => name.replaceAll("_", " ");

class LiveCharts extends Charts {
  /* Charts whose arrays grow: time, then the columns. */
  constructor(plots) {
    super({ ...plots, runs: [{ label: "flight", end: 1 }], lengths: [] }, new ArrayBuffer(0));
    this.width = 1 + plots.panels.reduce((sum, panel) => sum + panel.curves.length, 0);
    this.window = null;
    this.following = true;
    this.state.limits = true;
    this.forget();
  }

  forget() {
    this.count = 0;
    this.store = Array.from({ length: this.width }, () => new Float32Array(ROWS));
    this.trim();
  }

  trim() {
    this.arrays = this.store.map((array) => array.subarray(0, this.count));
  }

  /* Add rows, one after the other in `rows`. */
  add(rows) {
    const added = rows.length / this.width;
    while (this.count + added > this.store[0].length) {
      this.store = this.store.map((array) => {
        const longer = new Float32Array(2 * array.length);
        longer.set(array);
        return longer;
      });
    }
    for (let i = 0; i < added; i++) {
      for (let j = 0; j < this.width; j++) this.store[j][this.count + i] = rows[i * this.width + j];
    }
    this.count += added;
    this.trim();
    this.end = Math.max(this.now, 1);
  }

  get now() {
    return this.count ? this.store[0][this.count - 1] : 0;
  }

  /* The newest value of the first curve of a panel, in the units shown. */
  newest(name) {
    const panel = this.panels.find((each) => each.name === name);
    return this.count ? this.store[panel.curves[0].y][this.count - 1] * panel.units[this.state.units].factor : NaN;
  }

  follow() {
    const from = this.window === null ? 0 : Math.max(0, this.now - this.window);
    this.set(this.following ? { time: this.window === null ? null : [from, Math.max(this.now, from + 1)] } : {});
  }

  /* Whoever has zoomed looks at something: the window stays until the double click that shows all. */
  zoomed(panel, change) {
    super.zoomed(panel, change);
    this.following = this.state.time === null;
  }

  /* What is not in sight is drawn when it is. */
  drawLater() {}
}

/* The side view at the newest step, beside the nominal one. */
class Vehicle {
  constructor(charts) {
    this.charts = charts;
    const section = document.getElementById("vehicle"), slider = section.querySelector("[name=exaggeration]");
    this.view = createSideView(section.querySelector(".side-view"), JSON.parse(document.getElementById("airframe").textContent));
    slider.addEventListener("input", () => this.view.setExaggeration(Number(slider.value)));
    section.querySelector("form").addEventListener("submit", (event) => event.preventDefault());
  }

  /* The newest values of the curves of a kind; of what moves in it, the actuators come before the command. */
  sample(...kinds) {
    const { charts } = this;
    const newest = (name) => {
      const { curves } = charts.panels.find((panel) => panel.name === name);
      const curve = kinds.map((kind) => curves.find((each) => each.kind === kind)).find(Boolean);
      return charts.store[curve.y][charts.count - 1];
    };
    const names = ["altitude", "velocity", "angle_of_attack", "pitch_angle", "fuel_equivalence_ratio", "elevator_deflection"];
    const elastic = [newest("elastic_coordinate_1"), newest("elastic_coordinate_2")];
    return { time: charts.now, elastic, ...Object.fromEntries(names.map((name) => [name, newest(name)])) };
  }

  draw(faults) {
    if (!this.charts.count) return;
    const said = faults.map(({ channel, type }) => ({ channel, text: words(`${channel}: ${type}`) }));
    this.view.draw({ ...this.sample("actuator", "actual"), faults: said, nominal: this.sample("nominal") });
  }
}

class Flight {
  constructor(charts) {
    this.charts = charts;
    this.vehicle = new Vehicle(charts);
    this.form = document.getElementById("toolbar").elements;
    this.token = new URLSearchParams(location.hash.slice(1)).get("token");
    this.status = null;
    this.shades = new Map(); // of faults, by first step and words
    this.waiting = new Map(); // for answers, by number
    this.number = 0;
    this.dirty = false;
    this.connect();
    setInterval(() => this.draw(), REDRAW);
  }

  connect() {
    const socket = new WebSocket(`ws://${location.host}/flight`);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (message) => this.receive(message.data);
    socket.onclose = () => this.lost();
    this.socket = socket;
  }

  receive(data) {
    if (data instanceof ArrayBuffer) {
      this.charts.add(new Float32Array(data));
      this.dirty = true;
      return;
    }
    const message = JSON.parse(data);
    if (message.kind === "history") this.charts.forget();
    if (message.kind === "status") this.tell(message);
    if (message.kind === "answer") this.answered(message);
    this.dirty = true;
  }

  lost() {
    this.over = true;
    for (const [, resolve] of this.waiting) resolve({ accepted: false, message: "the live view has ended" });
    this.waiting.clear();
    this.tellState();
    this.enable();
  }

  /* Ask the flight for something; the answer is written below the controls. */
  async ask(command, fields = {}) {
    const id = ++this.number;
    const output = document.getElementById("answer");
    output.className = "";
    output.textContent = `${command} …`;
    const answer = await new Promise((resolve) => {
      this.waiting.set(id, resolve);
      this.socket.send(JSON.stringify({ id, token: this.token, command, ...fields }));
    });
    output.className = answer.accepted ? "good" : "bad";
    output.textContent = answer.accepted ? words(answer.message) : answer.message;
    return answer;
  }

  answered(message) {
    const resolve = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if (resolve) resolve(message);
  }

  tell(status) {
    const again = this.status && this.status.run && status.run && this.status.run.id !== status.run.id;
    if (again) this.shades.clear();
    this.status = status;
    for (const panel of this.charts.panels) panel.limits = status.limits[panel.name] || (panel.name === "level" ? [1] : []);
    this.shade();
    this.fill("diagnostics", Object.entries(status.diagnostics).map(([node, said]) => [
      node, { text: said.words, bad: said.level > 0 }, Object.entries(said.values).map((pair) => pair.join(" ")).join(", "),
    ]));
    this.fill("events", [...status.events].reverse().map((event) => [event.time.toFixed(2), String(event.step), { text: words(event.words), bad: event.warning }]));
    const faults = document.getElementById("faults");
    faults.textContent = status.faults.map((fault) => words(fault.words)).join("; ") || "none";
    faults.classList.toggle("bad", status.faults.length > 0);
    this.tellState();
    this.enable();
  }

  /* Faults that act are shaded up to now, those that have ended up to when they did. */
  shade() {
    const { period } = this.status.run || { period: 0 };
    const acting = new Set(this.status.faults.map((fault) => `${fault.since} ${fault.words}`));
    for (const fault of this.status.faults) {
      const key = `${fault.since} ${fault.words}`;
      if (!this.shades.has(key)) this.shades.set(key, { kind: "fault", from: fault.since * period, to: null, runs: [0] });
    }
    for (const [key, shade] of this.shades) {
      if (!acting.has(key) && shade.to === null) shade.to = Math.max(shade.from, this.charts.now);
    }
  }

  tellState() {
    const said = [];
    const { run, settings, ending, bag } = this.status || { settings: {} };
    if (!run) said.push("Waiting for a flight");
    else said.push(`t = ${this.charts.now.toFixed(2)} s of ${(run.last_step * run.period).toFixed(0)} s`);
    if (ending) {
      said.unshift(`Flight ${ending.how} at t = ${ending.time.toFixed(2)} s`);
      said.length = 1;
      if (bag) said.push(`verdict, metrics and report: ${bag}/report.html`);
    } else if (this.over) said.unshift("Connection lost");
    else if (settings.paused) said.push("paused");
    else if (run && settings.real_time_factor !== undefined) {
      said.push(settings.real_time_factor === 0 ? "as fast as possible" : `${settings.real_time_factor} × real time`);
    }
    const state = document.getElementById("state");
    state.textContent = said.join(" · ");
    state.classList.toggle("bad", Boolean(ending && ending.how !== "finished"));
  }

  /* Controls act while there is a flight, and for whoever has the token. */
  enable() {
    const able = Boolean(this.token && !this.over && this.status && this.status.run && !this.status.ending);
    for (const fieldset of document.querySelectorAll("fieldset.flight")) fieldset.disabled = !able;
    const paused = this.status && this.status.settings.paused;
    this.form.pause.textContent = paused ? "Resume" : "Pause";
    this.form.set_tau.disabled = this.form.tau.disabled = !able || this.status.tau === null;
    const { settings = {}, tau = null } = this.status || {};
    if (document.activeElement !== this.form.pace && settings.real_time_factor !== undefined) this.form.pace.value = settings.real_time_factor;
    if (document.activeElement !== this.form.tau && tau !== null) this.form.tau.value = tau.join(", ");
    /* Until something is answered. */
    if (!this.token && !this.number) document.getElementById("answer").textContent = "Controls need the address with the token, as the start has printed it.";
  }

  fill(section, rows) {
    const body = document.querySelector(`#${section} tbody`);
    const numbers = [...document.querySelectorAll(`#${section} th`)].map((cell) => cell.classList.contains("number"));
    body.replaceChildren(...rows.map((row) => {
      const line = document.createElement("tr");
      line.append(...row.map((cell, index) => {
        const element = document.createElement("td");
        element.textContent = cell.text === undefined ? cell : cell.text;
        element.classList.toggle("number", numbers[index]);
        element.classList.toggle("bad", Boolean(cell.bad));
        return element;
      }));
      return line;
    }));
  }

  draw() {
    if (!this.dirty) return;
    this.dirty = false;
    const { charts } = this;
    const shades = [...this.shades.values()].map((shade) => ({ ...shade, to: shade.to === null ? charts.now : shade.to }));
    for (const panel of charts.panels) {
      panel.shades = shades;
      // A controller of one's own has no tube, and a design may have no set.
      const drawn = !charts.count || panel.curves.some((curve) => charts.arrays[curve.y].some(Number.isFinite));
      panel.element.closest("figure").hidden = !drawn;
    }
    charts.follow();
    this.vehicle.draw(this.status ? this.status.faults : []);
    const level = charts.newest("level"), place = document.getElementById("level");
    place.textContent = Number.isFinite(level) ? level.toPrecision(3) : "–";
    place.classList.toggle("bad", level > 1);
    this.tellState();
  }
}

function connectControls(flight) {
  const { charts, form } = flight;
  const kinds = JSON.parse(document.getElementById("kinds").textContent);
  const offer = (select, names) => select.replaceChildren(...names.map((name) => new Option(words(name), name)));
  const explain = () => {
    const kind = kinds[form.channel.value][form.type.value];
    const due = kind.parameters.filter((parameter) => parameter.due);
    form.parameters.value = "";
    form.parameters.placeholder = due.map((parameter) => `${parameter.name} = …`).join(", ") || "nothing";
    const ranges = kind.parameters.map((parameter) => `${parameter.name}: ${parameter.range}`);
    document.getElementById("meaning").textContent = [kind.meaning, ...ranges].join("; ");
  };
  const offerTypes = () => {
    offer(form.type, Object.keys(kinds[form.channel.value]));
    explain();
  };
  offer(form.channel, Object.keys(kinds));
  form.channel.value = "elevator_deflection";
  offerTypes();
  form.channel.addEventListener("change", offerTypes);
  form.type.addEventListener("change", explain);

  const pause = () => flight.ask("pause", { paused: String(!flight.status.settings.paused) });
  const actions = {
    pause,
    set_pace: () => flight.ask("pace", { real_time_factor: form.pace.value }),
    set_tau: () => flight.ask("tau", { tau: form.tau.value }),
    inject: () => flight.ask("inject", {
      channel: form.channel.value, type: form.type.value, parameters: form.parameters.value, duration: form.duration.value,
    }),
    clear: () => flight.ask("clear"),
  };
  for (const [name, act] of Object.entries(actions)) form[name].addEventListener("click", act);
  const entered = { pace: actions.set_pace, tau: actions.set_tau, parameters: actions.inject, duration: actions.inject };
  for (const [name, act] of Object.entries(entered)) {
    form[name].addEventListener("keydown", (event) => { if (event.key === "Enter") act(); });
  }
  document.getElementById("toolbar").addEventListener("submit", (event) => event.preventDefault());
  document.addEventListener("keydown", (event) => {
    if (event.key !== " " || event.target.closest("input, select, button, a, summary") || form.pause.matches(":disabled")) return;
    event.preventDefault();
    pause();
  });
  document.getElementById("toolbar").addEventListener("change", (event) => {
    switch (event.target.name) {
      case "units":
        document.documentElement.dataset.units = event.target.value;
        charts.set({ units: event.target.value });
        flight.vehicle.view.setUnits(event.target.value);
        break;
      case "window":
        charts.window = event.target.value === "" ? null : Number(event.target.value);
        charts.following = true;
        break;
      case "limits":
        charts.set({ limits: event.target.checked });
        break;
      default:
        return;
    }
    flight.dirty = true;
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.set({}));
}

function start() {
  try {
    const charts = new LiveCharts(JSON.parse(document.getElementById("plots").textContent));
    const flight = new Flight(charts);
    connectControls(flight);
    window.live = flight;
  } catch (error) {
    const trouble = document.getElementById("trouble");
    trouble.textContent = `The page could not start (${error.message}). It needs a browser of 2023 or later.`;
    trouble.hidden = false;
    throw error;
  }
}

start();
