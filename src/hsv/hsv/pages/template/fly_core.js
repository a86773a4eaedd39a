"use strict";
/* The core in WebAssembly, and flights in it: scenarios prepared by hsv.pages.fly, with the settings of a visitor. */

const HISTORY = 25, AUXILIARY = 3, CURVES = 10, FLOWN_TO_THE_END = 2 ** 52;

const bytesOf = (base64) => Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));

/* Return a decimal number times 10^-2, with one rounding: -7.4 / 100 is not -0.074. */
const hundredth = (percent) => Number(`${percent}e-2`);
/* Return feet in metres, with one rounding: both integers are exact. */
const metres = (feet) => (Math.round(feet * 1e6) * 3048) / 1e10;
const rounded = (value) => Number(value.toPrecision(15));

class Core {
  /* `described` is from hsv.pages.fly. */
  constructor(module, described) {
    Object.assign(this, described, { api: new WebAssembly.Instance(module).exports });
    this.contents = described.arrays.map(bytesOf);
    this.top = this.api.__heap_base.value;
  }

  /* Views are made anew each time, because the memory may have grown. */
  get view() { return new DataView(this.api.memory.buffer); }
  doubles(address, length) { return new Float64Array(this.api.memory.buffer, address, length); }
  bytes(address, length) { return new Uint8Array(this.api.memory.buffer, address, length); }

  /* Return the address of `size` zero bytes. */
  room(size) {
    const { memory } = this.api, address = Math.ceil(this.top / 64) * 64;
    this.top = address + size;
    const missing = this.top - memory.buffer.byteLength;
    if (missing > 0) memory.grow(Math.ceil(missing / 65536));
    this.bytes(address, size).fill(0);
    return address;
  }

  numbers(values) {
    const address = this.room(8 * values.length);
    this.doubles(address, values.length).set(values);
    return address;
  }

  content(value) { return value.array === undefined ? new Uint8Array(Float64Array.from(value).buffer) : this.contents[value.array]; }

  struct({ struct: kind, values }) {
    const address = this.room(this.structs[kind].size);
    this.fill(address, kind, values);
    return address;
  }

  /* Fill a struct by the names of its fields. A pointer is given as null, an address, a struct, an array or numbers. */
  fill(address, kind, values) {
    for (const [name, value] of Object.entries(values)) {
      const field = this.structs[kind].fields[name], at = address + field.offset;
      if (this.structs[field.type]) this.fill(at, field.type, value.values);
      else if (field.counts !== undefined) this.point(address, at, kind, field, value);
      else if (field.count > 1) this.bytes(at, 8 * field.count).set(this.content(value));
      else if (field.type === "int64_t") this.view.setBigInt64(at, BigInt(value), true);
      else this.view.setFloat64(at, Number(String(value).replace("inf", "Infinity")), true);
    }
  }

  point(address, at, kind, field, value) {
    if (value === null) return;
    let target = value;
    if (value.struct) target = this.struct(value);
    else if (typeof value !== "number") {
      const content = this.content(value);
      target = this.room(content.length);
      this.bytes(target, content.length).set(content);
    }
    this.view.setUint32(at, target, true); /* only now, because the memory may have grown */
    field.counts.forEach(([counted, more], axis) => {
      if (counted && value.shape) this.view.setBigInt64(address + this.structs[kind].fields[counted].offset, BigInt(value.shape[axis] - more), true);
    });
  }

  /* Return the reference as a struct, and x_r for each step; throw if a command has no trim. */
  reference(flight) {
    const { corners, period, rigid, rows: steps } = flight, given = this.numbers(corners.flat()), begun = this.room(8), count = BigInt(corners.length);
    const rows = Number(this.api.hsv_reference_steps(count, given, period, begun)), first = Number(this.view.getBigInt64(begun, true));
    const room = (width) => this.room(8 * width * rows);
    const commands = [room(2), room(2), room(1)], [state, input, defect, residual] = [room(9), room(2), room(9), room(1)];
    this.api.hsv_commands(count, given, period, flight.climbing ? 1 : 0, BigInt(first), BigInt(rows), ...commands);
    this.doubles(residual, rows).fill(Infinity);
    this.api.hsv_reference_rows(this.struct(rigid), BigInt(rows), ...commands, this.numbers(this.guess), period, 2n, state, input, defect, residual);
    const u = this.doubles(input, 2 * rows), [low, high] = flight.limits;
    this.doubles(residual, rows).forEach((size, row) => {
      const inside = [0, 1].every((j) => u[2 * row + j] >= low[j] && u[2 * row + j] <= high[j]);
      if (!(size < this.converged && inside)) throw new Error(`no equilibrium within the limits of the inputs at ${((first + row) * period).toFixed(2)} s`);
    });
    const along = this.room(72 * steps), x = this.doubles(state, 9 * rows), target = this.doubles(along, 9 * steps);
    for (let k = 0; k < steps; k++) {
      const row = 9 * Math.min(Math.max(k - first, 0), rows - 1);
      target.set(x.subarray(row, row + 9), 9 * k);
    }
    return { values: { struct: "hsv_reference", values: { state, input, defect, first, rows } }, along };
  }

  /* Return the faults of a side as an hsv_faults: the one given, if it is of that side. */
  faults(sides, fault, period) {
    const none = { struct: "hsv_faults", values: { rows: null, memory: null, count: 0, period } };
    const kind = fault && this.kinds[fault.type];
    if (!kind || !sides.includes(kind.side)) return none;
    const first = Math.max(Math.ceil(fault.at / period - 1e-9), kind.side === "sensor" ? 1 : 0);
    const parameter = Array.from({ length: 12 }, (_, j) => (j === kind.size ? fault.size : kind.values[j] ?? 0));
    const row = { start: first, stop: FLOWN_TO_THE_END, channel: kind.place, code: kind.code, occurrence: 0, parameter };
    const rows = this.struct({ struct: "hsv_fault", values: row }), memory = this.struct({ struct: "hsv_fault_memory", values: { last: -2, onset: -2 } });
    return { struct: "hsv_faults", values: { rows, memory, count: 1, period } };
  }

  /* Return the scenario `name` with the settings `given`, which differ from it; others stay as shipped. */
  changed(name, given) {
    const flight = structuredClone(this.scenarios[name]), { plant, tube } = flight.flight.values, { corners } = flight;
    const set = (key) => given[key] !== undefined, share = (key, field) => {
      if (set(key)) plant.values.vehicle.values[field] = flight.rigid.values[field] * (1 + hundredth(given[key]));
    };
    if (set("dh")) corners.at(-1)[1] = rounded(flight.initial[0] + metres(given.dh));
    if (set("dv")) corners.at(-1)[2] = rounded(flight.initial[1] + metres(given.dv));
    share("mass", "mass");
    share("inertia", "moment_of_inertia");
    share("elevator", "moment_elevator");
    if (set("tau")) {
      const F = new Float64Array(this.contents[flight.gain.array].slice().buffer);
      tube.values.gains = Object.assign([...F].map((value, i) => (i % 9 < 5 ? value * given.tau : value)), { shape: [1, 2, 9] });
    }
    if (set("wind")) Object.assign(plant.values.atmosphere.values, { wind: [given.wind, 0], ...(given.wind === 0 ? {} : { still: 0 }) });
    if (set("seed")) plant.values.seed = given.seed;
    flight.acting = { ...flight.fault, ...given };
    flight.refitted = set("fault") || set("size") || set("at");
    return flight;
  }

  /* Fly; return steps, and the addresses of their signals. */
  fly(name, given = {}) {
    this.top = this.api.__heap_base.value;
    const flight = this.changed(name, given), { values } = flight.flight, { period, rows } = flight, count = BigInt(rows);
    if (flight.refitted) {
      const { fault: type, at, size } = flight.acting, of = (...sides) => this.faults(sides, { type, at, size }, period);
      values.faults = of("command");
      values.plant_faults = { struct: "hsv_plant_faults", values: { effector: of("dynamics", "effector"), engine: of("engine"), sensor: of("sensor") } };
    }
    const reference = this.reference(flight), history = this.room(8 * HISTORY * rows), auxiliary = this.room(8 * AUXILIARY * rows);
    Object.assign(values, { reference: reference.values, history, auxiliary, estimated: flight.estimated ? this.room(72 * rows) : null, rows, ended: rows });
    const struct = this.struct({ struct: "hsv_flight", values }), loop = this.room(Number(this.api.hsv_memory_size(1n)));
    const effector = this.room(16 * rows), level = this.room(8 * rows), curves = this.room(8 * CURVES * rows), saturated = this.room(2 * rows);
    const steps = Number(this.api.hsv_watch(struct, loop, effector, level));
    if (steps < 0) throw new Error(`step ${-1 - steps} failed`);
    this.api.hsv_curves(BigInt(steps), count, history, auxiliary, reference.along, curves, saturated);
    return { flight, steps, lost: steps < rows, history, effector, level: values.set && level, curves, saturated, reference: reference.along };
  }

  /* Return the fingerprint of a flight as hsv.flight.fingerprint does, with one NaN for all. */
  async fingerprint({ history, steps }) {
    const rows = this.doubles(history, HISTORY * steps).slice(), bits = new BigUint64Array(rows.buffer);
    rows.forEach((value, i) => { if (value !== value) bits[i] = 0x7ff8000000000000n; });
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", rows));
    return `v1:${[...digest].map((byte) => byte.toString(16).padStart(2, "0")).join("")}`;
  }

  /* Return the metrics that scenarios of the page limit, by name, as hsv.flight.metrics defines them. */
  metrics({ flight, steps, curves, saturated }) {
    const curve = (index) => this.doubles(curves + 8 * index * flight.rows, steps), greatest = (values) => values.reduce((most, value) => (most !== most || value <= most ? most : value), 0);
    const size = (values) => greatest(values.map(Math.abs)), { fault, at } = flight.acting, { period } = flight;
    const found = { altitude_error_maximum: size(curve(0)), velocity_error_maximum: size(curve(1)), altitude_end_error: curve(0)[steps - 1], velocity_end_error: curve(1)[steps - 1] };
    const flags = this.bytes(saturated, 2 * steps), start = Math.ceil((at - 1e-9) / period);
    found.saturated_steps = Array.from({ length: steps }, (_, k) => flags[2 * k] | flags[2 * k + 1]).filter(Boolean).length;
    if (fault === "none" || !(start > 0 && start < steps)) return found;
    const window = Math.max(0, Math.ceil((start * period - 5 - 1e-9) / period));
    found.post_fault_attitude_deviation = greatest([2, 3].map((index) => {
      const angle = curve(index), mean = angle.subarray(window, start).reduce((sum, value) => sum + value, 0) / (start - window);
      return size(angle.subarray(start).map((value) => value - mean));
    }));
    found.post_fault_attitude_from_nominal = greatest([8, 9].map((index) => greatest(curve(index).subarray(start))));
    if (!curve(4).some(Boolean)) return found;
    const last = greatest([4, 5].map((index) => {
      const rate = curve(index).subarray(start).map(Math.abs), level = 0.05 * greatest(rate);
      return Math.max(0, rate.findLastIndex((value) => !(value <= level)));
    }));
    if (last < steps - start - 1) found.elastic_decay_time = period * last;
    return found;
  }

  /* Return the scenario file that flies the same with `hsv simulate`. */
  toml(name, given) {
    const { acting, refitted, command } = this.changed(name, given), lines = [`extends = "${name}"`];
    const { sliders } = this.scenarios[name], value = (key) => given[key] ?? sliders[key][3], steps = ["dh", "dv"];
    const text = (number, unit) => (unit ? `"${number} ${unit}"` : Number.isInteger(number) ? number.toFixed(1) : `${number}`);
    for (const [key, [field, unit]] of Object.entries(this.fields)) {
      if (given[key] === undefined || steps.includes(key)) continue;
      lines.push(`${field} = ${key === "seed" ? given.seed : text(given[key], unit)}`);
    }
    if (refitted && acting.fault === "none") lines.push("fault = []");
    if (steps.some((key) => given[key] !== undefined)) {
      lines.push("", "[[command]]", ...steps.map((key) => `${this.fields[key][0].split(".")[1]} = ${text(value(key), this.fields[key][1])}`));
      if (command[1] > command[0]) lines.push(`start = "${command[0]} s"`, `end = "${command[1]} s"`);
    }
    if (refitted && acting.fault !== "none") {
      const { channel, parameter, unit, others } = this.kinds[acting.fault];
      lines.push("", "[[fault]]", `channel = "${channel}"`, `type = "${acting.fault}"`, `start = "${acting.at} s"`);
      if (parameter) lines.push(`${parameter} = ${text(acting.size, unit)}`);
      lines.push(...Object.entries(others).map(([key, other]) => `${key} = "${other}"`));
    }
    return `${lines.join("\n")}\n`;
  }
}
