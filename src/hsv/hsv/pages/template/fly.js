"use strict";
/* The page that flies in the browser: settings in, picture and verdict out. */

const BINS = 700; // columns of a curve; each shows the least and the largest value in it
const DEGREES = 180 / Math.PI, FEET = 1 / FOOT;
/* Plots: title, unit, curves as [class, signal, factor]. A signal is a column of the history, or one of the flight's arrays. */
const PLOTS = [
  ["altitude", "ft", [["reference", "reference:0", FEET], ["run0", 0, FEET]]],
  ["velocity", "ft/s", [["reference", "reference:1", FEET], ["run0", 1, FEET]]],
  ["angle of attack, pitch angle", "deg", [["run0", 2, DEGREES], ["run1 dash", 3, DEGREES]]],
  ["elevator: command, effector", "deg", [["run0", 22, DEGREES], ["run1 dash", "effector:1", DEGREES]]],
  ["rates of the elastic modes 1, 2", "kg½ m/s", [["run0", 6, 1], ["run1 dash", 8, 1]]],
  ["level of the error in the tube, inside below 1", "", [["bound", "edge", 1], ["run0", "level:0", 1]]],
];
const WIDTHS = { reference: 9, effector: 2, level: 1 };
const $ = (id) => document.getElementById(id);
const element = (name, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
};
/* Decode a text of the address; one that is not an encoding stays as it is. */
const decoded = (text) => { try { return decodeURIComponent(text); } catch { return text; } };
const inWords = (name) => name.replaceAll("_", " ");

class Page {
  constructor(core) {
    const panel = (name, index) => ({ name, curves: [{ kind: "effector", run: 0, x: 0, y: index + 1 }] });
    this.core = core;
    this.form = $("settings");
    this.charts = { airframe: core.airframe, end: 1, arrays: [], runs: [{ faults: [] }], panels: [...QUANTITIES, ...ELASTIC].map(panel) };
    this.player = new Player(this.charts, $("player"), { listeners: [], units: "paper" });
    const show = this.player.show.bind(this.player);
    this.player.show = (time) => { show(time); this.mark(); };
    this.form.addEventListener("input", ({ target }) => this.set(target));
    this.form.addEventListener("submit", (event) => event.preventDefault());
    addEventListener("hashchange", () => this.read());
    document.querySelector(".skip").addEventListener("click", (event) => { event.preventDefault(); $("set-scenario").focus(); }); // the address holds the flight
    $("copy").addEventListener("click", () => navigator.clipboard.writeText($("toml").textContent));
    $("link").addEventListener("click", () => navigator.clipboard.writeText(location.href));
    this.read();
  }

  /* The range, step and shipped value of a setting; null for one that the scenario does not have. */
  slider(key) {
    const { fault, sliders, rows, period } = this.core.scenarios[this.name], type = this.given.fault ?? fault.fault, kind = this.core.kinds[type];
    if (key === "at") return kind ? [1, Math.floor((rows - 1) * period) - 1, 1, fault.at] : null;
    if (key === "size") return kind?.parameter ? [...kind.slider.slice(0, 3), type === fault.fault ? fault.size : kind.slider[3]] : null;
    return sliders[key] ?? null;
  }

  /* Read the address; what stands there is data, and a setting out of its range is named and not used. */
  read() {
    const [name, ...entries] = decoded(location.hash.slice(1)).split("&"), { scenarios, kinds, fields } = this.core, refused = [];
    Object.assign(this, { name: Object.hasOwn(scenarios, name) ? name : "case1", given: {}, time: null });
    if (name && this.name !== name) refused.push(`no scenario ${name}`);
    const pairs = new URLSearchParams(entries.join("&")), type = pairs.get("fault");
    if (type !== null && (type === "none" || Object.hasOwn(kinds, type))) this.given.fault = type;
    for (const [key, text] of pairs) {
      if (key === "fault" && this.given.fault) continue;
      const range = key === "at" || key === "size" || Object.hasOwn(fields, key) ? this.slider(key) : null, value = Number(Number(text).toFixed(6));
      const good = text.trim() && range && value >= range[0] && value <= range[1] && (key !== "seed" || Number.isInteger(value));
      if (good) this.given[key] = value;
      else refused.push(range ? `${key} = ${text}, expected ${range[0]} to ${range[1]}` : `${key} = ${text}, not a setting of this flight`);
    }
    this.reduce();
    $("trouble").textContent = refused.length ? `Not used from the address: ${refused.join("; ")}.`.slice(0, 300) : "";
    $("trouble").hidden = !refused.length;
    this.choices();
    this.fly();
  }

  /* Make the form for the scenario. */
  choices() {
    const { scenarios, kinds, fields } = this.core, options = (names, chosen) => names.map((each) => element("option", { value: each, textContent: scenarios[each]?.title ?? inWords(each), selected: each === chosen }));
    const label = (key, text, control) => element("label", { htmlFor: `set-${key}` }, element("span", { textContent: text }), element("output", { id: `value-${key}` }), Object.assign(control, { id: `set-${key}`, name: key }));
    const select = (key, names, chosen) => label(key, key[0].toUpperCase() + key.slice(1), element("select", {}, ...options(names, chosen)));
    const type = this.given.fault ?? scenarios[this.name].fault.fault, words = inWords(kinds[type]?.parameter ?? "");
    const texts = { size: `Fault: ${words}`, at: "Start of the fault", ...Object.fromEntries(Object.entries(fields).map(([key, entry]) => [key, entry[2]])) };
    const sliders = Object.entries(texts).filter(([key]) => this.slider(key)).map(([key, text]) => {
      const [min, max, step, usual] = this.slider(key);
      return label(key, text, element("input", { type: key === "seed" ? "number" : "range", min, max, step, value: this.given[key] ?? usual }));
    });
    const again = element("button", { type: "button", textContent: "as shipped" });
    again.addEventListener("click", () => { this.given = {}; this.choices(); this.fly(); this.write(); });
    this.form.replaceChildren(select("scenario", Object.keys(scenarios), this.name), select("fault", ["none", ...Object.keys(kinds)], type), ...sliders, again);
  }

  set({ name: key, value }) {
    const again = key === "scenario" || key === "fault";
    if (key === "scenario") Object.assign(this, { name: value, given: {}, time: null });
    else if (key === "fault") {
      const { at } = this.given;
      Object.assign(this.given, { fault: value, size: undefined, at: value === "none" ? undefined : at });
    } else if (value === "" || !this.slider(key)) return;
    else this.given[key] = key === "seed" ? Math.min(Math.max(Math.round(Number(value)), 0), this.slider(key)[1]) : Number(value);
    this.reduce();
    if (again) {
      this.choices();
      $(`set-${key}`).focus();
    }
    this.write();
    cancelAnimationFrame(this.waiting);
    this.waiting = requestAnimationFrame(() => this.fly());
  }

  /* Leave out the settings that have their shipped values. */
  reduce() {
    const { fault } = this.core.scenarios[this.name];
    for (const [each, chosen] of Object.entries(this.given)) if (chosen === undefined || chosen === (each === "fault" ? fault.fault : this.slider(each)?.[3])) delete this.given[each];
  }

  write() {
    history.replaceState(null, "", `#${[this.name, ...Object.entries(this.given).map((pair) => pair.join("="))].join("&")}`);
  }

  /* The settings for the core: those given, and the size that a changed fault has by default. */
  settings() {
    const { given } = this, size = given.fault === undefined || given.fault === "none" ? null : this.slider("size");
    return size && given.size === undefined ? { ...given, size: size[3] } : given;
  }

  async fly() {
    const { core, name } = this, given = this.settings(), published = core.scenarios[name].fingerprint, begun = performance.now(), latest = (this.latest = {});
    for (const key of ["size", "at", ...Object.keys(core.fields)]) {
      const range = this.slider(key), shown = $(`value-${key}`), unit = key === "at" ? "s" : key === "size" ? core.kinds[this.given.fault ?? core.scenarios[name].fault.fault]?.unit : core.fields[key]?.[1];
      if (!range || !shown) continue;
      const value = this.given[key] ?? range[3];
      shown.textContent = key === "seed" ? "" : `${value} ${unit}${unit?.startsWith("rad") ? ` = ${(value * DEGREES).toFixed(1)}°${unit.slice(3)}` : ""}`;
      shown.parentElement.classList.toggle("changed", key in this.given);
    }
    const shipped = !Object.keys(given).length;
    $("toml").textContent = shipped ? `hsv simulate ${name}` : `cat > mine.toml <<'END'\n${core.toml(name, given)}END\nhsv simulate ./mine.toml`;
    let flown;
    try {
      flown = core.fly(name, given);
    } catch (error) {
      this.say("wrong", `Cannot be flown: ${error.message}`, "", "hsv simulate refuses this flight, too.");
      return;
    }
    this.draw(flown);
    this.judge(flown);
    const end = flown.lost ? `Lost at ${((flown.steps - 1) * flown.flight.period).toFixed(2)} s, where the vehicle leaves the range of its model. ` : "";
    const picture = performance.now() - begun;
    if (!globalThis.crypto?.subtle) {
      this.say("", `${end}Flown, but without a fingerprint`, "", "Browsers compute it only for https and for files.");
      return;
    }
    const found = await core.fingerprint(flown), meaning = "SHA-256 of all numbers of the flight, 25 in each of its steps";
    if (latest !== this.latest) return; // another flight began meanwhile
    if (shipped && found === published) this.say("as-published", "Fingerprint as published", found, `${meaning}: your browser computed them all as published, to the last bit, as every machine and form of this bench does.`);
    else if (shipped) this.say("wrong", "Not the published flight: this browser or this build computes something else", found, `Published is ${published}.`);
    else this.say("", `${end}Changed: hsv simulate prints this fingerprint too`, found, `${meaning}. The file below flies the same.`);
    Object.assign(document.body.dataset, { done: found, milliseconds: picture });
  }

  say(kind, verdict, fingerprint, meaning) {
    document.querySelector(".result").className = `result ${kind}`;
    $("verdict").textContent = verdict;
    $("fingerprint").textContent = fingerprint;
    $("meaning").textContent = meaning;
  }

  /* Return a signal of a flight as a function of the step. */
  signal(flown, source) {
    if (source === "edge") return () => 1;
    const [name, column] = typeof source === "number" ? ["history", source] : source.split(":");
    const width = WIDTHS[name] ?? HISTORY, values = flown[name] ? this.core.doubles(flown[name], width * flown.steps) : null;
    return values && ((step) => values[width * step + Number(column)]);
  }

  draw(flown) {
    const { flight, steps } = flown, { period, rows } = flight, end = (rows - 1) * period, { fault: type, at } = flight.acting, kind = this.core.kinds[type];
    const acting = kind && at <= end ? [{ channel: kind.channel, text: `${inWords(kind.channel)}: ${inWords(type)}`, from: at, to: end }] : [];
    const drawings = PLOTS.flatMap(([title, unit, curves]) => {
      const drawn = curves.map(([look, source, factor]) => [look, this.signal(flown, source), factor]);
      const rigid = title.startsWith("rates") && !drawn.some(([, signal]) => signal(steps - 1) || signal(steps >> 1));
      return rigid || drawn.some(([, signal]) => !signal) ? [] : this.drawing(title, unit, drawn, steps, rows, acting.map(({ from }) => (100 * from) / end));
    });
    const places = [0, 0.25, 0.5, 0.75, 1].map((share) => element("span", { className: share === 0 ? "first" : share === 1 ? "last" : "", style: `left:${100 * share}%`, textContent: `${Number((share * end).toPrecision(4))} s` }));
    document.querySelector(".plots").replaceChildren(...drawings, element("div", { className: "places" }, ...places));
    for (const each of document.querySelectorAll(".plots .drawing")) {
      each.addEventListener("pointermove", ({ clientX, buttons, pointerType }) => {
        const { left, width } = each.getBoundingClientRect();
        if (pointerType === "mouse" || buttons) this.player.show(Math.max(0, ((clientX - left) / width) * end));
      });
    }
    const columns = [0, 1, 2, 3, 23, "effector:1", 5, 7].map((source) => this.signal(flown, source));
    const { time } = $("player").elements;
    this.charts.arrays = [Float64Array.from({ length: steps }, (_, k) => k * period), ...columns.map((signal) => Float64Array.from({ length: steps }, (_, k) => signal(k)))];
    Object.assign(this.charts, { end, runs: [{ faults: acting }] });
    time.max = end;
    $("player").querySelectorAll(".marks, .jumps").forEach((each) => each.replaceChildren());
    acting.forEach((fault) => this.player.mark(fault));
    $("vehicle").classList.toggle("rigid", !columns[6](steps >> 1) && !columns[6](steps - 1));
    if (!this.player.playing) this.player.show(this.time === null ? Math.min(end, (acting[0]?.from ?? 1) + 1) : this.player.time);
    this.time = this.player.time;
  }

  /* Return the elements of a plot; curves that are not finite have gaps. */
  drawing(title, unit, curves, steps, rows, faults) {
    const bin = Math.max(1, Math.ceil(rows / BINS));
    let low = Infinity, high = -Infinity;
    const points = curves.map(([, signal, factor]) => {
      const found = [];
      for (let begin = 0; begin < steps; begin += bin) {
        let least = NaN, most = NaN, first = true;
        for (let k = begin; k < Math.min(begin + bin, steps); k++) {
          const value = signal(k) * factor;
          if (!Number.isFinite(value)) continue;
          if (!(value >= least)) { least = value; first = false; }
          if (!(value <= most)) { most = value; first = true; }
        }
        found.push([begin + bin / 2, ...(first ? [least, most] : [most, least])]);
        if (least < low) low = least;
        if (most > high) high = most;
      }
      return found;
    });
    if (title.startsWith("level")) [low, high] = [0, Math.min(high, 3)];
    const margin = 0.06 * (high - low) || 1e-3 * Math.abs(high) || 1e-6;
    [low, high] = [low - margin, high + margin];
    const place = (value) => (100 * (value - low)) / (high - low);
    const path = (found) => found.map(([x, ...ys], i) => ys.map((y, j) => (Number.isFinite(y) ? `${i + j && Number.isFinite(found[i - 1]?.[1] ?? 0) ? "L" : "M"}${((1000 * x) / rows).toFixed(1)} ${(100 - Math.min(Math.max(place(y), -50), 150)).toFixed(2)}` : "")).join("")).join("");
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    Object.entries({ viewBox: "0 0 1000 100", preserveAspectRatio: "none", "aria-hidden": "true" }).forEach((pair) => svg.setAttribute(...pair));
    curves.forEach(([look], i) => {
      const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
      line.setAttribute("class", look);
      line.setAttribute("d", path(points[i]));
      svg.append(line);
    });
    const scale = 10 ** Math.floor(Math.log10((high - low) / 3)), step = [1, 2, 5, 10].find((each) => (high - low) / (each * scale) <= 4) * scale, ticks = [];
    for (let tick = Math.ceil(low / step) * step; tick <= high; tick += step) {
      ticks.push(element("span", { className: "tick", style: `bottom:${place(tick).toFixed(2)}%` }, element("span", { textContent: String(Number(tick.toPrecision(6))).replace("-", "−") })));
    }
    const shades = faults.map((left) => element("span", { className: "shaded", style: `left:${left}%;width:${100 - left}%` }));
    const box = element("div", { className: "drawing" }, ...shades, ...ticks, svg, element("span", { className: "now" }));
    return [element("p", { className: "drawing-title", textContent: `${title}${unit ? ` [${unit}]` : ""}` }), box];
  }

  /* Draw the time of the player in all plots. */
  mark() {
    document.querySelectorAll(".now").forEach((each) => { each.style.left = `${(100 * this.player.time) / this.charts.end}%`; });
  }

  judge(flown) {
    const found = this.core.metrics(flown), missing = found.post_fault_attitude_from_nominal === undefined ? "does not apply: no fault" : "not reached";
    document.querySelector(".judged tbody").replaceChildren(...flown.flight.judged.map(([name, words, limit, factor, unit]) => {
      const value = found[name], text = (number) => `${Number((number * factor).toPrecision(3))} ${unit === "1" ? "" : unit}`;
      const over = value !== undefined && !(Math.abs(value) <= limit), verdict = over ? "✗ over" : flown.lost ? "✗ not flown to the end" : value === undefined ? missing : "✓ within";
      return element("tr", {}, element("th", { scope: "row", textContent: words }), element("td", { className: "number", textContent: value === undefined ? "–" : text(value) }),
        element("td", { className: "number", textContent: text(limit) }), element("td", { className: over || flown.lost || verdict === "not reached" ? "bad" : value === undefined ? "" : "good", textContent: verdict }));
    }));
  }
}

(async () => {
  try {
    const described = JSON.parse($("described").textContent);
    globalThis.page = new Page(new Core(await WebAssembly.compile(bytesOf(described.module)), described));
  } catch (error) {
    $("trouble").textContent = `This page needs a browser with WebAssembly, of 2023 or later (${error.message}).`;
    $("trouble").hidden = false;
    throw error;
  }
})();
