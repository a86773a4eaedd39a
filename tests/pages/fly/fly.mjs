// node fly.mjs FOLDER [COUNT SEED]: fly all scenarios of FOLDER/described.json with FOLDER/core.wasm, or COUNT random
// settings, whose TOML it writes to the folder; print the fingerprints as JSON.
import { readFileSync, writeFileSync } from "node:fs";
import vm from "node:vm";

const [folder, count, seed] = process.argv.slice(2), script = new URL("../../../src/hsv/hsv/pages/template/fly_core.js", import.meta.url);
vm.runInThisContext(`${readFileSync(script, "utf8")}; globalThis.Core = Core;`);
const described = JSON.parse(readFileSync(`${folder}/described.json`));
const core = new Core(new WebAssembly.Module(readFileSync(`${folder}/core.wasm`)), described);
const found = {};
let state = Number(seed);
const random = () => (state = (state * 1103515245 + 12345) % 2147483648) / 2147483648;
const between = ([low, high, step]) => Number((low + Math.round((random() * (high - low)) / step) * step).toFixed(6));
const pick = (list) => list[Math.floor(random() * list.length)];

function settings(name) {
  const { sliders } = described.scenarios[name], given = {};
  for (const [key, slider] of Object.entries(sliders)) {
    const value = between(slider);
    if (random() < 0.3 && value !== slider[3]) given[key] = value;
  }
  if (random() < 0.7) {
    given.fault = pick([...Object.keys(described.kinds), "none"]);
    const kind = described.kinds[given.fault];
    if (kind) Object.assign(given, { at: between([1, 190, 0.1]) }, kind.parameter ? { size: between(kind.slider) } : {});
  }
  return given;
}

const flights = count ? Array.from({ length: Number(count) }, (_, i) => [i, pick(Object.keys(described.scenarios))]) : Object.keys(described.scenarios).map((name) => [name, name]);
for (const [key, name] of flights) {
  const given = count ? settings(name) : {};
  if (count) writeFileSync(`${folder}/${key}.toml`, core.toml(name, given));
  try {
    const begun = performance.now(), flown = core.fly(name, given), ms = performance.now() - begun;
    found[key] = { fingerprint: await core.fingerprint(flown), steps: flown.steps, metrics: core.metrics(flown), ms, given, name };
  } catch (error) {
    found[key] = { error: error.message, given, name };
  }
}
console.log(JSON.stringify(found));
