"use strict";
/* The vehicle from its side: bent, with elevator and flame, on the horizon.

   `createSideView(element, geometry)` fills `element` and returns `{draw(sample), setExaggeration(x), setUnits(units)}`.
   `geometry` is that of hsv.model.airframe.side_view. A sample holds SI and radians: {time, altitude, velocity,
   angle_of_attack, pitch_angle, elastic: [eta_1, eta_2], fuel_equivalence_ratio, elevator_deflection,
   faults: [{channel, text}], nominal: the same keys, or nothing}. Angles are drawn as they are, only the bending is
   exaggerated. The colours are those of the page: --ink, --muted, --paper, --panel, --line, --good, --bad, --run0, --run1; that of
   the vehicle is --own, where the element has it. */

function createSideView(element, geometry) {
  const SIZE = { width: 640, height: 300 };
  const METRE = 0.72 * SIZE.width / geometry.length;
  const CENTRE = { x: 0.47 * SIZE.width, y: 0.55 * SIZE.height };
  const DEGREE = Math.PI / 180, FOOT = 0.3048, MINUS = "\u2212";
  const state = { exaggeration: geometry.exaggeration, units: "si", sample: null };

  const node = (name, attributes, parent, text) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key === "style") made.style.cssText = value;
      else made.setAttribute(key, value);
    }
    if (text !== undefined) made.textContent = text;
    parent.append(made);
    return made;
  };
  const label = (x, y, text, style = "", anchor = "start") =>
    node("text", { x, y, "text-anchor": anchor, style: `fill:var(--muted);font-size:13px;${style}` }, svg, text);

  const svg = node("svg", { viewBox: `0 0 ${SIZE.width} ${SIZE.height}`, role: "img",
    style: "display:block;width:100%;height:auto;background:var(--panel);border:1px solid var(--line);border-radius:6px" }, element);
  const title = node("title", {}, svg, "Side view of the vehicle");
  const defs = node("defs", {}, svg);
  const identity = createSideView.count = (createSideView.count || 0) + 1;
  const marker = node("marker", { id: `head-${identity}`, viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 8,
    markerHeight: 8, orient: "auto-start-reverse", markerUnits: "userSpaceOnUse" }, defs);
  node("path", { d: "M0 .8 7.5 4 0 7.2z", style: "fill:context-stroke" }, marker);
  const hot = node("linearGradient", { id: `hot-${identity}`, x1: 1, x2: 0 }, defs);
  for (const [offset, colour, opacity] of [[0, "#fff3b0", 1], [0.35, "#ffb02e", 0.95], [1, "#e5484d", 0.15]]) {
    node("stop", { offset, style: `stop-color:${colour};stop-opacity:${opacity}` }, hot);
  }
  const arrow = `marker-end:url(#head-${identity})`;

  /* Horizon, airflow and scale stay; what moves is drawn over them. */
  node("line", { x1: 0, x2: SIZE.width, y1: CENTRE.y, y2: CENTRE.y,
    style: "stroke:var(--muted);stroke-dasharray:2 5;opacity:.8" }, svg);
  label(8, CENTRE.y - 5, "horizon", "font-size:12px");
  const flow = node("g", { style: `stroke:var(--muted);stroke-width:1.3;opacity:.75` }, svg);
  for (const z of [-4.4, -3.2, 3.2, 4.4]) {
    const x = 0.5 * SIZE.width / METRE;
    node("line", { x1: x * METRE, x2: (x - 2.6) * METRE, y1: -z * METRE, y2: -z * METRE, style: arrow }, flow);
  }
  const flowLabel = label(SIZE.width - 8, 0, "airflow", "font-size:12px", "end");

  const ghost = node("g", { style: "fill:none;stroke:var(--muted);stroke-width:1.2;stroke-dasharray:4 3" }, svg);
  const ghostBody = node("path", {}, ghost), ghostEngine = node("path", {}, ghost), ghostElevator = node("path", {}, ghost);
  const flame = node("path", { style: `fill:url(#hot-${identity})` }, svg);
  const engine = node("path", { style: "fill:var(--muted);stroke:var(--ink);stroke-width:1" }, svg);
  const body = node("path", { style: "fill:var(--own, var(--run0));fill-opacity:.28;stroke:var(--ink);stroke-width:1.5;stroke-linejoin:round" }, svg);
  const axis = node("path", { style: "fill:none;stroke:var(--run0);stroke-width:1;stroke-dasharray:9 3 2 3" }, svg);
  const elevator = node("path", { style: "stroke-width:1.3;stroke-linejoin:round" }, svg);
  const path = node("line", { style: `stroke:var(--good);stroke-width:2;${arrow}` }, svg);
  const pathLabel = label(0, 0, "V", "fill:var(--good);font-size:13px;font-style:italic");
  const bodyAxis = node("line", { style: `stroke:var(--run0);stroke-width:1.3;${arrow}` }, svg);
  const bodyLabel = label(0, 0, "x", "fill:var(--run0);font-style:italic");
  const down = node("line", { style: `stroke:var(--run0);stroke-width:1.3;${arrow}` }, svg);
  const downLabel = label(0, 0, "z", "fill:var(--run0);font-style:italic");
  node("circle", { cx: CENTRE.x, cy: CENTRE.y, r: 4, style: "fill:var(--paper);stroke:var(--ink);stroke-width:1.3" }, svg);
  node("path", { d: `M${CENTRE.x} ${CENTRE.y}v-4a4 4 0 0 1 4 4zv4a4 4 0 0 1-4-4z`, style: "fill:var(--ink)" }, svg);
  const faults = label(12, 22, "", "fill:var(--bad);font-weight:650");
  const stated = label(12, SIZE.height - 12, "");
  const bar = node("path", { style: "fill:none;stroke:var(--ink);stroke-width:1.5" }, svg);
  const barLabel = label(0, SIZE.height - 20, "", "fill:var(--ink)", "middle");

  const list = document.createElement("dl");
  list.className = "readout";
  list.style.cssText = "display:grid;grid-template-columns:repeat(auto-fit,minmax(7rem,1fr));gap:.35rem 1rem;margin:.5rem 0;font-variant-numeric:tabular-nums";
  element.append(list);
  const readout = {};
  for (const [key, name] of [["altitude", "altitude h"], ["velocity", "velocity V"], ["angle", "angle of attack α"],
    ["pitch", "pitch angle θ"], ["path", "path angle γ"], ["fuel", "fuel ratio Φ"], ["elevator", "elevator δe"],
    ["nose", "nose bent up"], ["tail", "tail bent up"]]) {
    const entry = document.createElement("div"), term = document.createElement("dt");
    readout[key] = document.createElement("dd");
    term.textContent = name;
    entry.append(term, readout[key]);
    list.append(entry);
  }

  /* Numbers as people read them. */
  const number = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits).replace("-", MINUS) : "–");
  const degrees = (angle) => `${number(angle / DEGREE, 2)}°`;
  const length = (metres, digits) => (state.units === "paper" ? `${number(metres / FOOT, digits)} ft` : `${number(metres, digits)} m`);
  const small = (metres) => (state.units === "paper" ? `${number(metres / FOOT * 12, 2)} in` : `${number(metres * 1000, 1)} mm`);

  /* From a point of the geometry to the screen: bent, then turned by the pitch angle about the centre of gravity. */
  const placer = (sample) => {
    const cos = Math.cos(sample.pitch_angle), sin = Math.sin(sample.pitch_angle);
    const bend = sample.elastic.map((coordinate) => coordinate * state.exaggeration);
    const turned = (x, z) => [CENTRE.x + (x * cos - z * sin) * METRE, CENTRE.y - (x * sin + z * cos) * METRE];
    const bent = ([x, z, mode, shape, slope]) => turned(x - z * slope * bend[mode], z + shape * bend[mode]);
    return { turned, bent, slope: ([, , mode, , slope]) => slope * bend[mode], bend };
  };
  const closed = (points) => `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z`;

  const elevatorOutline = (place, sample) => {
    const { hinge, outline } = geometry.elevator;
    // Positive: trailing edge down.
    const angle = sample.elevator_deflection + place.slope(hinge), cos = Math.cos(angle), sin = Math.sin(angle);
    const [x, z, mode, shape, slope] = hinge;
    const at = [x - z * slope * place.bend[mode], z + shape * place.bend[mode]];
    return closed(outline.map(([u, w]) => place.turned(at[0] + u * cos - w * sin, at[1] + u * sin + w * cos)));
  };

  const flameOutline = (place, sample) => {
    const { roof, cowl } = geometry.flame;
    const reach = geometry.flame.length * Math.max(0, sample.fuel_equivalence_ratio);
    const far = (point, share) => [point[0] - share * reach, point[1], ...point.slice(2)];
    const middle = roof.map((value, i) => (i === 1 ? 0.5 * (value + cowl[1]) : value));
    return closed([roof, far(roof, 0.45), far(middle, 1), far(cowl, 0.45), cowl].map(place.bent));
  };

  /* An arrow from the centre of gravity, `metres` long, at an angle to the horizon. */
  const point = (line, text, metres, angle, offset) => {
    const x = CENTRE.x + metres * METRE * Math.cos(angle), y = CENTRE.y - metres * METRE * Math.sin(angle);
    line.setAttribute("x1", CENTRE.x);
    line.setAttribute("y1", CENTRE.y);
    line.setAttribute("x2", x);
    line.setAttribute("y2", y);
    text.setAttribute("x", x + offset[0]);
    text.setAttribute("y", y + offset[1]);
  };

  const drawScale = () => {
    const [metres, text] = state.units === "paper" ? [20 * FOOT, "20 ft"] : [5, "5 m"];
    const right = SIZE.width - 14, left = right - metres * METRE, y = SIZE.height - 14;
    bar.setAttribute("d", `M${left} ${y - 4}v8M${left} ${y}H${right}M${right} ${y - 4}v8`);
    barLabel.setAttribute("x", 0.5 * (left + right));
    barLabel.textContent = text;
    stated.textContent = `bending drawn × ${state.exaggeration}, angles as they are`;
  };

  const redraw = () => {
    drawScale();
    const sample = state.sample;
    if (!sample) return;
    const place = placer(sample), gamma = sample.pitch_angle - sample.angle_of_attack;
    const nominal = sample.nominal, other = nominal && placer(nominal);
    ghost.style.display = nominal ? "" : "none";
    if (nominal) {
      ghostBody.setAttribute("d", closed(geometry.body.map(other.bent)));
      ghostEngine.setAttribute("d", closed(geometry.engine.map(other.bent)));
      ghostElevator.setAttribute("d", elevatorOutline(other, nominal));
    }
    body.setAttribute("d", closed(geometry.body.map(place.bent)));
    engine.setAttribute("d", closed(geometry.engine.map(place.bent)));
    axis.setAttribute("d", closed(geometry.axis.map(place.bent)).slice(0, -1));
    elevator.setAttribute("d", elevatorOutline(place, sample));
    flame.setAttribute("d", flameOutline(place, sample));

    const active = sample.faults || [];
    const failed = (channel) => active.some((fault) => fault.channel === channel);
    elevator.style.fill = failed("elevator_deflection") ? "var(--bad)" : "var(--run1)";
    elevator.style.stroke = failed("elevator_deflection") ? "var(--bad)" : "var(--ink)";
    flame.style.stroke = failed("fuel_equivalence_ratio") ? "var(--bad)" : "none";
    faults.textContent = active.length ? `⚠ ${active.map((fault) => fault.text).join("; ")}` : "";

    point(path, pathLabel, 0.69 * geometry.length, gamma, [-4, 18]);
    point(bodyAxis, bodyLabel, 0.62 * geometry.length, sample.pitch_angle, [-4, -8]);
    point(down, downLabel, 0.17 * geometry.length, sample.pitch_angle - 0.5 * Math.PI, [8, 2]);
    flow.setAttribute("transform", `translate(${CENTRE.x} ${CENTRE.y}) rotate(${-gamma / DEGREE})`);
    flowLabel.setAttribute("y", CENTRE.y - 5 * METRE);

    const bend = (index, end) => sample.elastic[index] * end[3];
    readout.altitude.textContent = length(sample.altitude, state.units === "paper" ? 0 : 1);
    readout.velocity.textContent = `${length(sample.velocity, 1)}/s`;
    readout.angle.textContent = degrees(sample.angle_of_attack);
    readout.pitch.textContent = degrees(sample.pitch_angle);
    readout.path.textContent = degrees(gamma);
    readout.fuel.textContent = number(sample.fuel_equivalence_ratio, 3);
    readout.elevator.textContent = degrees(sample.elevator_deflection);
    readout.nose.textContent = small(bend(0, geometry.axis[0]));
    readout.tail.textContent = small(bend(1, geometry.axis[geometry.axis.length - 1]));
    title.textContent = `Side view of the vehicle at ${number(sample.time, 2)} s: pitch ${degrees(sample.pitch_angle)}, `
      + `elevator ${degrees(sample.elevator_deflection)}${active.length ? `, ${faults.textContent.slice(2)}` : ""}`;
  };

  redraw();
  return {
    draw(sample) {
      state.sample = sample;
      redraw();
    },
    setExaggeration(exaggeration) {
      state.exaggeration = exaggeration;
      redraw();
    },
    setUnits(units) {
      state.units = units;
      redraw();
    },
  };
}
