"use strict";
/* The flight, as received from the server, and the commands of the page. */

const REDRAW = 200; // time between updates of the plots, ms
const ROWS = 1024; // initial capacity of the arrays, rows

/* Return an identifier in words. */
const words = (name) => name.replaceAll("_", " ");

/* Return a number in a text with four digits, whole numbers and other texts unchanged. */
const rounded = (text) => (/^-?\d*\.\d+(e[-+]?\d+)?$/.test(text) ? String(Number(Number(text).toPrecision(4)) + 0) : text);

class Flight {
  constructor(charts, toolbar) {
    Object.assign(this, { charts, toolbar, status: null, over: false, dirty: false });
    this.width = 1 + charts.panels.reduce((sum, panel) => sum + panel.curves.length, 0);
    this.form = document.getElementById("controls").elements;
    this.token = toolbar.form.elements.token.value;
    this.shades = []; // shaded intervals of faults
    this.waiting = new Map(); // functions that take the answers to pending requests, by request number
    this.number = 0;
    this.forget();
    charts.window = () => this.window();
    this.vehicle = new Vehicle(charts, toolbar, document.getElementById("exaggeration"));
    this.vehicle.time = Infinity;
    toolbar.listeners.push(() => { this.dirty = true; });
    this.connectControls();
    this.connect();
    setInterval(() => this.draw(), REDRAW);
  }

  /* Return the time window of a zoom, otherwise the last seconds that the toolbar selects, or null for everything. */
  window() {
    const last = Number(this.toolbar.form.elements.window.value);
    return this.toolbar.time ?? (last ? [Math.max(0, this.now - last), Math.max(this.now, 1)] : null);
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}/flight`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = (message) => this.receive(message.data);
    this.socket.onclose = () => this.lost();
  }

  receive(data) {
    this.dirty = true;
    if (data instanceof ArrayBuffer) {
      this.add(new Float32Array(data));
      return;
    }
    const message = JSON.parse(data);
    if (message.kind === "history") this.forget();
    if (message.kind === "status") this.tell(message);
    if (message.kind === "answer") {
      this.waiting.get(message.id)?.(message);
      this.waiting.delete(message.id);
    }
  }

  forget() {
    this.count = 0;
    this.store = Array.from({ length: this.width }, () => new Float32Array(ROWS));
    this.trim();
  }

  /* Add the rows that `rows` holds, one after the other. */
  add(rows) {
    const added = rows.length / this.width;
    while (this.count + added > this.store[0].length) {
      this.store = this.store.map((array) => {
        const longer = new Float32Array(2 * array.length);
        longer.set(array);
        return longer;
      });
    }
    rows.forEach((value, index) => { this.store[index % this.width][this.count + Math.floor(index / this.width)] = value; });
    this.count += added;
    this.trim();
  }

  /* Let the charts draw the rows received so far. */
  trim() {
    this.charts.arrays = this.store.map((array) => array.subarray(0, this.count));
    this.now = this.count ? this.store[0][this.count - 1] : 0;
    this.charts.end = Math.max(this.now, 1);
  }

  lost() {
    this.over = true;
    this.waiting.forEach((resolve) => resolve({ accepted: false, message: "the live view has ended" }));
    this.waiting.clear();
    this.tellState();
    this.enable();
  }

  /* Send a command; the answer is written below the controls. */
  async ask(command, fields = {}) {
    const id = ++this.number, output = document.getElementById("answer");
    output.className = "";
    output.textContent = `${command} …`;
    const answer = await new Promise((resolve) => {
      this.waiting.set(id, resolve);
      this.socket.send(JSON.stringify({ id, token: this.token, command, ...fields }));
    });
    output.className = answer.accepted ? "good" : "bad";
    output.textContent = answer.accepted ? words(answer.message) : answer.message;
  }

  tell(status) {
    this.status = status;
    for (const panel of this.charts.panels) panel.limits = status.limits[panel.name] || (panel.name === "level" ? [1] : []);
    this.shade();
    this.fill("diagnostics", Object.entries(status.diagnostics).map(([node, said]) => [
      words(node), { text: said.words, bad: said.level > 0 }, Object.entries(said.values).filter((pair) => pair[1] !== "").map(([name, value]) => `${words(name)} ${rounded(value)}`).join(", "),
    ]));
    this.fill("events", [...status.events].reverse().map((event) => [event.time.toFixed(2), String(event.step), { text: words(event.words), bad: event.warning }]));
    const faults = document.getElementById("faults");
    faults.textContent = status.faults.map((fault) => words(fault.words)).join("; ") || "none";
    faults.classList.toggle("bad", status.faults.length > 0);
    this.tellState();
    this.enable();
  }

  /* Shade active faults up to now, and others up to their end. */
  shade() {
    const period = this.status.run?.period || 0;
    this.shades = this.status.shades.map(({ channel, type, from, to }) => ({
      kind: "fault", from: from * period, to: to === null ? Infinity : to * period, runs: [0], channel, text: words(`${channel}: ${type}`),
    }));
    this.charts.runs[0].faults = this.shades;
  }

  tellState() {
    const { run, settings = {}, ending, bag } = this.status || {}, pace = settings.real_time_factor;
    let said = run ? [`t = ${this.now.toFixed(2)} s of ${(run.last_step * run.period).toFixed(0)} s`] : ["Waiting for a flight"];
    if (ending) said = [`Flight ${ending.how} at t = ${ending.time.toFixed(2)} s`, ...(bag ? [`verdict, metrics and report: ${bag}/report.html`] : [])];
    else if (this.over) said.unshift("Connection lost");
    else if (settings.paused) said.push("paused");
    else if (run && pace !== undefined) said.push(pace === 0 ? "as fast as possible" : `${pace} × real time`);
    const state = document.getElementById("state");
    state.textContent = said.join(" · ");
    state.classList.toggle("bad", Boolean(ending && ending.how !== "finished"));
    const repeat = document.getElementById("repeat");
    repeat.hidden = !(ending && bag);
    repeat.firstChild.textContent = `hsv info ${/^[\w./-]+$/.test(bag) ? bag : `'${bag.replaceAll("'", "'\\''")}'`}`;
  }

  /* Enable the controls if a flight is in progress and the address has the token. */
  enable() {
    const { form } = this, { settings = {}, tau = null, run, ending } = this.status || {};
    const able = Boolean(this.token && !this.over && run && !ending);
    for (const fieldset of document.querySelectorAll("fieldset.flight")) fieldset.disabled = !able;
    form.pause.textContent = settings.paused ? "Resume" : "Pause";
    form.set_tau.disabled = form.tau.disabled = !able || tau === null;
    if (document.activeElement !== form.pace && settings.real_time_factor !== undefined) form.pace.value = settings.real_time_factor;
    if (document.activeElement !== form.tau && tau !== null) form.tau.value = tau.join(", ");
    if (!this.token && !this.number) document.getElementById("answer").textContent = "Controls need the address with the token, as the start has printed it.";
  }

  /* Fill a table with rows of texts, or of {text, bad}. */
  fill(section, rows) {
    const numbers = [...document.querySelectorAll(`#${section} th`)].map((cell) => cell.classList.contains("number"));
    document.querySelector(`#${section} tbody`).replaceChildren(...rows.map((row) => {
      const line = document.createElement("tr");
      row.forEach((cell, index) => {
        const element = line.insertCell();
        element.textContent = cell.text ?? cell;
        element.classList.toggle("number", numbers[index]);
        element.classList.toggle("bad", Boolean(cell.bad));
      });
      return line;
    }));
  }

  draw() {
    if (!this.dirty) return;
    this.dirty = false;
    const { charts } = this, shades = this.shades.map((shade) => ({ ...shade, to: Math.min(shade.to, this.now) }));
    for (const panel of charts.panels) {
      panel.shades = shades;
      // Hide plots without data: a custom controller has no tube, and a design may have no invariant set.
      panel.element.closest("figure").hidden = this.count > 0 && !panel.curves.some((curve) => charts.arrays[curve.y].some(Number.isFinite));
    }
    const elastic = charts.panels.filter((panel) => panel.name.startsWith("elastic")).flatMap((panel) => panel.curves);
    document.body.classList.toggle("rigid", this.count > 0 && !elastic.some((curve) => charts.arrays[curve.y].some(Boolean)));
    charts.show();
    this.vehicle.draw();
    const curve = charts.panels.find((panel) => panel.name === "level").curves[0], level = charts.arrays[curve.y].at(-1);
    const place = document.getElementById("level");
    place.textContent = Number.isFinite(level) ? level.toPrecision(3) : "–";
    place.classList.toggle("bad", level > 1);
    this.tellState();
  }

  connectControls() {
    const { form, charts: { kinds } } = this;
    const offer = (select, names) => select.replaceChildren(...names.map((name) => new Option(words(name), name)));
    const explain = () => {
      const { meaning, parameters } = kinds[form.channel.value][form.type.value];
      form.parameters.value = "";
      form.parameters.placeholder = parameters.filter(({ due }) => due).map(({ name }) => `${name} = …`).join(", ") || "nothing";
      document.getElementById("meaning").textContent = [meaning, ...parameters.map(({ name, range }) => `${name}: ${range}`)].join("; ");
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

    const { channel, type, parameters, duration } = form;
    const actions = {
      pause: () => this.ask("pause", { paused: String(!this.status.settings.paused) }),
      set_pace: () => this.ask("pace", { real_time_factor: form.pace.value }),
      set_tau: () => this.ask("tau", { tau: form.tau.value }),
      inject: () => this.ask("inject", { channel: channel.value, type: type.value, parameters: parameters.value, duration: duration.value }),
      clear: () => this.ask("clear"),
    };
    for (const [name, act] of Object.entries(actions)) form[name].addEventListener("click", act);
    const entered = { pace: actions.set_pace, tau: actions.set_tau, parameters: actions.inject, duration: actions.inject };
    for (const [name, act] of Object.entries(entered)) {
      form[name].addEventListener("keydown", (event) => { if (event.key === "Enter") act(); });
    }
    document.getElementById("controls").addEventListener("submit", (event) => event.preventDefault());
    document.addEventListener("keydown", (event) => {
      if (event.key !== " " || event.target.closest("input, select, button, a, summary") || form.pause.matches(":disabled")) return;
      event.preventDefault();
      actions.pause();
    });
  }
}
