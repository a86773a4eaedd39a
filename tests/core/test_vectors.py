"""The core against the results of the functions before it, bit for bit: tests/golden/vectors.npz, of commit b8ecf8c.

Inputs are stored as they were given. Of a large result NAME there are ``NAME.rows``, the first 8 bytes (little-endian)
of the SHA-256 of each row, and ``NAME.first``, its first rows. Texts are JSON. Entry i of what concerns the vehicle has
vehicle i % 5; case i of effectors has actuators i % 4 and a command that is late by 0.65 (i % 3) substeps.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import core_calls as calls
import numpy as np
import pytest

from hsv.control.design import find_design, read_design
from hsv.control.effectiveness import effectiveness_data
from hsv.control.nominal_law import level
from hsv.control.nominal_trajectory import nominal_data
from hsv.control.notch_filter import NotchSection, discretise
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.core import Struct, arithmetic, doubles, ffi, lib, vector
from hsv.design.disturbance import decompose
from hsv.design.error_system import tube_errors
from hsv.flight.responses import along_filter, lag_response
from hsv.flight.scenario import load_scenario
from hsv.model.actuators import actuator_data, actuators_at_rest
from hsv.model.atmosphere import atmosphere_data, atmosphere_state
from hsv.model.dynamics import VehicleParameters, advance, derivative, forces, jacobian, vehicle_struct
from hsv.model.faults.schedule import fault_memory, fault_rows
from hsv.model.links import link_state
from hsv.model.lpv.actuated import respond
from hsv.model.lpv.linearisation import Filter, extended_derivative, extended_jacobian
from hsv.model.lpv.polytope import Polytope, axis_weights
from hsv.model.sensors import SENSOR_SETS, sensor_data, sensor_state
from hsv.model.signals import STATE_NAMES
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

PERIOD = 0.02
with np.load(Path(__file__).parents[1] / "golden" / "vectors.npz") as file:
    ENTRIES = dict(file)

INSIDE = ("elementary.complex", "sampling.mix")
"""Results of static functions of the core, which no caller outside can reach; Jacobians and sequences test them."""

VEHICLES = [VehicleParameters(*row) for row in ENTRIES["vehicles"].tolist()]


class Golden:
    """Entries whose name begins with one of some words: inputs, and results to compare with."""

    def __init__(self, *words: str) -> None:
        self._left = {name for name in ENTRIES if name.split(".")[0] in words and not name.startswith(INSIDE)}

    def __getitem__(self, name: str) -> Any:
        self._left.discard(name)
        entry = ENTRIES[name]
        return json.loads(entry.item()) if entry.dtype.kind == "S" else entry

    def check(self, name: str, found: Any) -> None:
        """Compare all bits; a NaN is a NaN whatever its sign and payload."""
        if name in ENTRIES:
            expected = self[name]
            found = np.array(found, expected.dtype)
            assert found.shape == expected.shape, name
            different = (_bits(found) != _bits(expected)).any()
            assert not different, f"{name}: {found[found != expected]}, expected {expected[found != expected]}"
            return
        digests = [hashlib.sha256(_bits(row).tobytes()).digest() for row in np.array(found)]
        rows = np.array([int.from_bytes(digest[:8], "little") for digest in digests], np.uint64)
        self._left -= {f"{name}.first", f"{name}.last"}
        assert np.flatnonzero(rows != self[f"{name}.rows"]).tolist() == [], f"{name}, see its first rows"

    def done(self) -> None:
        """Refuse entries that were neither used nor compared with."""
        assert not self._left


def _bits(array: np.ndarray) -> np.ndarray:
    array = np.ascontiguousarray(array)
    if array.dtype.kind != "f":
        return array
    return np.where(np.isnan(array), np.nan, array).view(np.uint64)


def elementary(z: Golden) -> None:
    angles = z["elementary.angle.x"].tolist()
    for name, column in zip(("sine", "cosine"), zip(*map(calls.sine_cosine, angles), strict=True), strict=True):
        z.check(f"elementary.sine_cosine.{name}", column)
    z.check("elementary.tangent", arithmetic.of_each(arithmetic.tangent, angles))
    for name, function in (
        ("arcsine", arithmetic.arcsine),
        ("exponential", arithmetic.exponential),
        ("logarithm", arithmetic.logarithm),
    ):
        z.check(f"elementary.{name}", arithmetic.of_each(function, z[f"elementary.{name}.x"]))
    points = z["elementary.arctangent2.y"].tolist(), z["elementary.arctangent2.x"].tolist()
    z.check("elementary.arctangent2", [lib.hsv_arctangent2(y, x) for y, x in zip(*points, strict=True)])


def noise(z: Golden) -> None:
    z.check("noise.philox", [calls.philox(c[:4], c[4:]) for c in z["noise.philox.counter"].tolist()])
    arguments = z["noise.numbers.arguments"].tolist()
    z.check("noise.uniforms", [calls.written(lib.hsv_uniforms, 2, *row) for row in arguments])
    z.check("noise.normals", [calls.written(lib.hsv_normals, 2, *row) for row in arguments])


def design(name: str) -> Any:
    return read_design(find_design(name))


def polytopes(z: Golden) -> None:
    baseline = design("baseline")
    samples = baseline.altitude_samples, baseline.velocity_samples
    linear = Polytope(baseline.polytope.A, baseline.polytope.B, *(axis_weights(*own, "linear") for own in samples))
    points = np.stack((z["polytope.altitude"], z["polytope.velocity"]), axis=1).tolist()
    for name, polytope in (
        ("baseline", baseline.polytope),
        ("adjustable", design("adjustable").polytope),
        ("linear", linear),
    ):
        data = polytope.data()
        # The schedule of one entry in each vertex is that of the weights.
        r = len(polytope.A)
        ones = Struct(
            "hsv_polytope",
            **data.values | {"S": np.pad(np.eye(r), ((0, 0), (0, -r % lib.SUMS))), "entries": np.arange(r)},
        )
        z.check(f"polytope.{name}.weights", [calls.written(lib.hsv_schedule, 99, ones.pointer, *p)[:r] for p in points])
        z.check(f"polytope.{name}.S", [calls.written(lib.hsv_schedule, 99, data.pointer, *p) for p in points])
        room = ffi.new("double[99]")
        z.check(f"polytope.{name}.inside", [lib.hsv_schedule(data.pointer, *p, room) for p in points])
        for axis in ("altitude", "velocity"):
            z.check(f"polytope.{name}.{axis}.coefficients", getattr(data, axis).coefficients.reshape(4, -1))
        z.check(f"polytope.{name}.packed", data.S)
        z.check(f"polytope.{name}.entries", data.entries)
        z.check(f"polytope.{name}.starts", data.starts)


def nominal_laws(z: Golden) -> None:
    defects = z["nominal_input.baseline.deviation"][::-1] * 0.0078125
    for name in ("baseline", "smooth"):
        own = design(name)
        data = nominal_data(own)
        x = z[f"nominal_input.{name}.deviation"]
        u, index = np.empty((len(x), 2)), np.empty((len(x), 1))
        inside = [lib.hsv_nominal_input(data.pointer, *map(doubles, rows)) for rows in zip(x, u, index, strict=True)]
        z.check(f"nominal_input.{name}.u_n", u)
        z.check(f"nominal_input.{name}.index", index[:, 0])
        z.check(f"nominal_input.{name}.inside", inside)
        z.check(f"nominal_input.{name}.level", [[level(P, row) for P in data.ellipsoids] for row in x])
        new = x.copy()
        points = zip(z[f"nominal_advance.{name}.altitude"], z[f"nominal_advance.{name}.velocity"], strict=True)
        inside = [
            lib.hsv_nominal_advance(data.polytope.pointer, *point, *(doubles(vector(each)) for each in rows))
            for point, *rows in zip(points, new, u, defects, strict=True)
        ]
        z.check(f"nominal_advance.{name}.deviation", new)
        z.check(f"nominal_advance.{name}.inside", inside)


def vehicle(z: Golden) -> None:
    assert len(z["vehicles"]) == 5
    x, u, c = z["dynamics.x"], z["dynamics.u"], z["dynamics.conditions"]
    own = [VEHICLES[i % 5] for i in range(len(x))]
    points = [*zip(x, u, own, strict=True)]
    for name, found in zip("AB", zip(*(jacobian(*point) for point in points), strict=True), strict=True):
        z.check(f"dynamics.jacobian.{name}", found)
    z.check("dynamics.derivative", [derivative(*point) for point in points])
    z.check("dynamics.derivative_in", [derivative(*point, now) for point, now in zip(points, c, strict=True)])
    z.check("dynamics.forces", [forces(*point) for point in points])
    windy = [
        calls.written(lib.hsv_forces, 6, a, b, vehicle_struct(p).pointer, now)
        for a, b, p, now in zip(x, u, own, c, strict=True)
    ]
    z.check("dynamics.forces_in", windy)
    z.check(
        "dynamics.air_relative",
        [calls.written(lib.hsv_air_relative, 4, a[1], a[3] - a[2], *b[:2]) for a, b in zip(x, c, strict=True)],
    )
    lengths = [*zip(z["integration.period"], z["integration.substeps"].tolist(), strict=True)]
    calm = [advance(*point, *length) for point, length in zip(points, lengths, strict=True)]
    z.check("integration.advance", calm)
    windy = [advance(*point, *length, now) for point, length, now in zip(points, lengths, c, strict=True)]
    z.check("integration.advance_in", windy)
    trims = [trim(VEHICLES[int(row[0])], *row[1:]) for row in z["trim.points"].tolist()]
    for name in ("state", "input", "residual"):
        z.check(f"trim.{name}", [getattr(found, name) for found in trims])
    for name, printed in (("two", False), ("four", True)):
        notch = Filter(*(z[f"extended.{name}.{field}"] for field in Filter._fields))
        points = [*zip(z[f"extended.{name}.x"], u, own, strict=False)]
        z.check(f"extended.{name}.derivative", [extended_derivative(*point, notch, printed) for point in points])
        both = zip(*(extended_jacobian(*point, notch, printed) for point in points), strict=True)
        for matrix, found in zip("AB", both, strict=True):
            z.check(f"extended.{name}.jacobian.{matrix}", found)


def references(z: Golden) -> None:
    for name, (times, altitudes, velocities, kind, blend, period) in z["reference.arguments"].items():
        parker = load_vehicle("parker").decoupled
        data = ReferenceTrajectory(times, altitudes, velocities, period, parker, kind, blend).data
        z.check(f"reference.{name}.first_step", data.first)
        columns = data.state, data.input, data.defect
        z.check(f"reference.{name}.some.values", np.hstack(columns)[z[f"reference.{name}.some"]])
        for field, column in zip(("state", "input", "defect"), columns, strict=True):
            z.check(f"reference.{name}.{field}", column)


def actuators(z: Golden) -> None:
    rows = [*zip(z["actuator.order"].tolist(), z["actuator.arguments"].tolist(), strict=True)]
    maps = [calls.actuator_map(order, *row[:3]) if order else (0.0,) * 4 for order, row in rows]
    z.check("actuator.map", maps)
    steps = [
        calls.actuator_step(order, own, row[3:5], row[5], row[6:], row[2])
        for (order, row), own in zip(rows, maps, strict=True)
    ]
    z.check("actuator.step", steps)


def tables(z: Golden, name: str) -> list[Struct]:
    """Return the faults of every case before they act."""
    none = fault_rows((), (), PERIOD)
    columns = z[f"faults.{name}.tables"]
    rows = np.zeros(len(columns), none.rows.dtype)
    rows["start"], rows["stop"], rows["channel"], rows["code"], rows["occurrence"] = columns[:, :5].T
    rows["cycle"], rows["parameter"] = columns[:, 5:7], columns[:, 7:]
    cases = np.split(rows, np.cumsum(z[f"faults.{name}.counts"])[:-1])
    return [Struct("hsv_faults", rows=own.copy(), memory=fault_memory(len(own)), period=PERIOD) for own in cases]


def faults(z: Golden) -> None:
    commands, alpha = z["faults.commands"], z["faults.angle_of_attack"].tolist()
    mach, fuel = z["faults.mach"].tolist(), z["faults.fuel"].tolist()
    equipment = [actuator_data(values, VEHICLES[0], PERIOD) for values in z["faults.actuators"]]
    for i, d in enumerate(equipment):
        columns = d.order, d.natural_frequency, d.damping_ratio, *d.map.T, d.minimum, d.maximum
        z.check(f"faults.actuators.{i}", np.stack((*columns, d.rate_limit, d.acceleration_limit), axis=1))
    results = []
    for i, rows in enumerate(tables(z, "effector")):
        start, late, lines = np.array([0.25, 0.1]), i % 3 * 0.65, []
        state, effector, before = actuators_at_rest(start), start.copy(), start
        for k, command in enumerate(commands):
            acting = calls.begin_faults(rows, k, 17)
            for j in range(4):
                share = min(max(late - j, 0.0), 1.0)
                for given, begin, length in ((before, float(j), share), (command, j + share, 1.0 - share)):
                    if length > 0.0:
                        own = equipment[i % 4], (state, effector), rows, k, begin, given, alpha[k]
                        calls.move_effectors(*own, length)
                        lines.append([acting, *effector, *state.ravel()])
            before = command
        results.append(np.array(lines))
    z.check("faults.effector.move_effectors.last", [lines[-1] for lines in results])
    z.check("faults.effector.move_effectors.first", results[1][:60])
    digests = [hashlib.sha256(np.where(np.isnan(r), np.nan, r).tobytes()).digest() for r in results]
    z.check("faults.effector.move_effectors.rows", [int.from_bytes(digest[:8], "little") for digest in digests])
    z.check(
        "faults.command.apply_command_faults",
        [
            np.ravel([calls.command_faults(rows, k, 17, u) for k, u in enumerate(commands)])
            for rows in tables(z, "command")
        ],
    )
    sensors(z)
    points = [*enumerate(zip(alpha, mach, fuel, strict=True))]
    z.check(
        "faults.engine.apply_engine_faults",
        [np.ravel([calls.engine_faults(rows, k, 17, *point) for k, point in points]) for rows in tables(z, "engine")],
    )


def sensors(z: Golden) -> None:
    found, none = [], fault_rows((), (), PERIOD)
    for i, (values, rows) in enumerate(zip(z["sensors.values"], tables(z, "sensor"), strict=True)):
        for channel in STATE_NAMES:
            # Only one of the two is refused: the other gets its standard value.
            for one, other, standard in (("drift_time", "drift_sigma", 0.0), ("drift_sigma", "drift_time", 1.0)):
                known = SENSOR_SETS[values.get("sensors.set", "ideal")].channels.get(channel, {})
                if values.get(f"sensors.{channel}.{one}") and other not in known:
                    values[f"sensors.{channel}.{other}"] = values.get(f"sensors.{channel}.{other}") or [standard]
        data, memory = sensor_data(values, PERIOD), sensor_state()
        given = data, memory, rows if i % 2 else none
        found.append(np.ravel([calls.measure(*given, k, 23 + i, x) for k, x in enumerate(z["sensors.x"])]))
        if i in (3, 5, 11):
            fields = "noise bias bias_sigma drift_sigma drift_decay walk scale scale_sigma lag_decay latency drop_out"
            names = ("on", *fields.split(), "quantum", "minimum", "maximum")
            z.check(f"sensors.data.{i}", [np.asarray(getattr(data, name), float) for name in names])
    z.check("sensors.measure", found)


def equipment(z: Golden) -> None:
    payloads, found = z["links.payload"], []
    for i, row in enumerate(z["links.data"].tolist()):
        names = [name for name, _ in ffi.typeof("hsv_link").fields]
        values = *map(int, row[:3]), *row[3:7], *map(bool, row[7:])
        link = Struct("hsv_link", **dict(zip(names, values, strict=True)))
        n = (9, 2)[i % 2]
        memory, lines = link_state(link, n, payloads[-1, :n] if i % 4 == 1 else None), np.zeros((len(payloads), 9))
        for k, payload in enumerate(payloads):
            lines[k, :n] = calls.receive(link, memory, k, 100 + i, payload[:n])
        found.append(lines.ravel())
    z.check("links.receive", found)

    found, points = [], [*zip(z["air.altitude"].tolist(), z["air.speed"].tolist(), strict=True)]
    for i, values in enumerate(z["air.values"]):
        data = atmosphere_data(values, PERIOD)
        memory = atmosphere_state(data)
        found.append(
            np.ravel([calls.atmosphere_step(data, memory, k, 7 * i, *point) for k, point in enumerate(points)])
        )
    z.check("air.atmosphere_step", found)
    z.check("air.dryden_cross_map", [calls.dryden_cross_map(r) for r in z["air.dryden_cross_map.r"]])
    gusts = zip(*(z[f"air.gust_mean.{name}"].tolist() for name in ("begin", "end", "length", "stays")), strict=True)
    z.check("air.gust_mean", [lib.hsv_gust_mean(*gust) for gust in gusts])
    altitudes, parker = z["air.speed_of_sound.altitude"], vehicle_struct(load_vehicle("parker").decoupled)
    sound = [lib.hsv_speed_of_sound(altitude, parker.pointer) for altitude in altitudes.tolist()]
    # The law of that commit held from 11 to 32 km.
    held = (altitudes > 11_020.0) & (altitudes < 32_161.0)
    z.check("air.speed_of_sound", np.where(held, sound, z["air.speed_of_sound"]))


def filters(z: Golden) -> None:
    values, found = z["notch.input"], []
    for i, (sections, period) in enumerate(zip(z["notch.sections"], z["notch.periods"].tolist(), strict=True)):
        notch = discretise([NotchSection(*section) for section in sections], period)
        columns = (notch.A, notch.B, notch.C, notch.D, notch.G)
        z.check(f"notch.data.{i}", np.hstack([each.reshape(len(sections), -1) for each in columns]))
        filtered, states = along_filter(notch, values)
        found.append(np.concatenate((filtered, np.pad(states[0], (0, 8 - states.shape[1])))))
    z.check("notch.filter_step", found)

    y, u = z["estimator.measurement"], z["estimator.command"]
    for i, period in enumerate((0.02, 0.01, 0.025)):
        start, held, process, noise, iterations = (
            z[f"estimator.{i}.{name}"] for name in ("start", "input", "process", "noise", "iterations")
        )
        A, B = jacobian(start, held, VEHICLES[i])
        z.check(f"estimator.{i}.transition", calls.written(lib.hsv_transition, 121, A, B, period).reshape(11, 11))
        gain, given = np.empty((11, 5)), [doubles(vector(each)) for each in (A, B, process, noise)]
        needed = lib.hsv_steady_gain(*given[:2], period, *given[2:], 100_000, 1e-12, doubles(gain))
        z.check(f"estimator.{i}.gain", gain)
        assert needed == iterations
        own = {"vehicle": vehicle_struct(VEHICLES[i]), "period": period, "substeps": 2}
        data, memory, lines = Struct("hsv_estimator", gain=gain, start=start, **own), np.zeros(11), []
        for k in range(len(y)):
            estimate = calls.written(lib.hsv_estimate, 9, data.pointer, doubles(memory), k, y[k], u[max(k - 1, 0)])
            lines.append(np.concatenate((estimate, memory)))
        z.check(f"estimator.{i}.estimate_step", lines)
        z.check(f"estimator.{i}.estimate_step.last", lines[-1])


def effectiveness(z: Golden) -> None:
    flown = load_scenario("case1_active_deep", {"duration": "6 s", "fault[0].start": "0.6 s"}).parameters()
    names = [name for name, _ in ffi.typeof("hsv_effectiveness").fields if name not in ("vehicle", "start")]
    z.check("effectiveness.data.0", [getattr(effectiveness_data(flown, PERIOD), name) for name in names])
    for i, changes in enumerate(z["effectiveness.changes"]):
        data = effectiveness_data({**flown, **changes}, PERIOD)
        for kind in ("quiet", "noisy"):
            states, inputs = z[f"effectiveness.{kind}.states"], z[f"effectiveness.{kind}.inputs"]
            known = calls.effectiveness_along(data, states, inputs)
            rows = [[now.estimate, now.low, now.high, float(now.mode)] for now in known]
            z.check(f"effectiveness.{i}.{kind}", rows)
            z.check(f"effectiveness.{i}.{kind}.known", rows[::7])


def elimination(z: Golden) -> None:
    for n in range(1, 7):
        found = np.zeros((12, n, 3))
        for i, (A, b) in enumerate(zip(z[f"elimination.{n}.A"], z[f"elimination.{n}.b"], strict=True)):
            found[i, :, : 1 if i % 3 == 2 else 3] = arithmetic.solve(A, b[:, : 1 if i % 3 == 2 else 3])
        z.check(f"elimination.{n}.x", found)


def sequences(z: Golden) -> None:
    for i, n in enumerate((5, 7, 4)):
        columns, begin, found = z[f"sampling.{i}.columns"], z[f"sampling.{i}.begin"], np.zeros((2, 4, 2))
        for (first, end), worst in zip(((0, 40), (40, 120)), found, strict=True):
            given = *columns.shape, doubles(columns), n, doubles(begin), first, end, 250, 12345 + i
            lib.hsv_sample_sequences(*given, doubles(worst))
        z.check(f"sampling.{i}.run", found)

    names = "state deviation command reference reference_input defect lost through inverse remaining gain lag"
    given = {name: z[f"designs.{name}"] for name in names.split()}
    x, x_n, u, x_r, u_r, defect, lost, through, inverse, remaining, gain, lag = given.values()
    polytope = design("baseline").polytope
    notch = discretise([NotchSection(15.0, 0.02, 15.0, 0.5), NotchSection(19.5, 0.05, 20.0, 0.6)], PERIOD)
    actuators = Struct("hsv_sampled", **{field: z[f"designs.actuators.{field}"] for field in "ABCD"})
    flight: Any = SimpleNamespace(
        history=SimpleNamespace(state=x, deviation=x_n), reference=x_r, reference_input=u_r, defect=defect
    )
    z.check("disturbance.signals", np.hstack(decompose(polytope, notch, inverse, remaining, flight, u, lost, through)))
    z.check("actuated.respond", np.hstack(respond(actuators, u - u_r)))
    z.check("error_system.tube_errors", tube_errors(x, x_n, x_r, notch, actuators, u - u_r))
    z.check("error_system.lag_response", np.hstack(lag_response(polytope, gain, notch, actuators, x[:, :2], lag)))


PARTS = {
    elementary: ("elementary",),
    noise: ("noise",),
    polytopes: ("polytope",),
    nominal_laws: ("nominal_input", "nominal_advance"),
    vehicle: ("vehicles", "dynamics", "integration", "trim", "extended"),
    references: ("reference",),
    actuators: ("actuator",),
    faults: ("faults", "sensors"),
    equipment: ("links", "air"),
    filters: ("notch", "estimator"),
    effectiveness: ("effectiveness",),
    elimination: ("elimination",),
    sequences: ("sampling", "designs", "disturbance", "actuated", "error_system"),
}


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.__name__)
def test_bits_are_those_of_the_golden_vectors(part):
    golden = Golden(*PARTS[part])
    part(golden)
    golden.done()


def test_every_entry_belongs_to_a_part():
    assert {name.split(".")[0] for name in ENTRIES} == {word for words in PARTS.values() for word in words}
