"""Margins of a flight: the loop of a scenario with its hardware, and borders of stability found by flying them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
import tomli_w

from hsv.base.errors import HsvError, QuantityError, ScenarioError, one_of, require
from hsv.certificate.loops import INPUTS, MEASUREMENTS, Feedback, Hardware, vertex_loops
from hsv.certificate.margins import (
    LoopMargins,
    Place,
    VehicleLoops,
    WorstCorner,
    classical_margins,
    is_proved,
    margins_of,
)
from hsv.control.design import ControlDesign
from hsv.control.design_file import certificate_path, find_design, read_certificate
from hsv.control.tube_law import TubeLaw
from hsv.flight.assembly import assemble_flight, assemble_with
from hsv.flight.closed_loop import Components, fly
from hsv.flight.scenario import Scenario, load_scenario, scenario_table, scenario_text
from hsv.model.actuators import SUBSTEPS, ActuatorSet
from hsv.model.lpv.actuated import actuator_names
from hsv.model.signals import INPUT_NAMES, N_RIGID, STATE_NAMES
from hsv.model.trim import initial_trim, trim_at

LEG = 8
"""Number of parts into which each leg of the commanded trajectory is divided."""

BESIDE = 0.02
"""Share of a border of the gain by which the flights on its two sides differ from it."""

DEVIATION = 1e-4
"""Initial error of the pitch angle, rad."""

_E_FOLDS, _LONGEST = (4.0, 16.0), 400.0
"""Durations of the flights inside and outside in times of decay or growth by e, and their maximum, s."""

_LINEAR = 0.1
"""Largest deviation of the elevator for which actuators do not reach their limits, rad."""

_OMITTED = ("fault.", "tau_change.", "feedback.", "reference.", "sensors.", "wind.", "turbulence.", "gust.", "density.")
"""Parameters of a flight that a flight at constant trim in still air, with ideal sensors, does not have."""


@dataclass
class MarginResults:
    """The margins of a design or a scenario: ``loops`` by title of section, worst corners by case, flown borders."""

    name: str
    design: ControlDesign
    loops: dict[str, list[LoopMargins]]
    vehicles: dict[str, VehicleLoops]
    corners: dict[str, WorstCorner] = field(default_factory=dict)
    borders: list[Border] = field(default_factory=list)

    @classmethod
    def of(cls, name: str, design: ControlDesign, vehicles: dict[str, VehicleLoops]) -> MarginResults:
        """Return the margins at the vertices of ``design``, and at all places of the ``vehicles`` by case."""
        loops = {VERTICES: margins_of({f"vertex {i}": loop for i, loop in enumerate(vertex_loops(design))})}
        for case, around in vehicles.items():
            loops[case] = margins_of({place: around.loop("", place) for place in around.places})
        return cls(name, design, loops, vehicles)

    def disk_rows(self, title: str) -> list[dict[str, str]]:
        """Return the disk margins of a section as rows of texts by heading; both inputs: with the attained margin."""
        return [
            {
                "loop at": each.name.replace("_", " "),
                "disk": f"{each.disk.margin:.3f}" if each.disk.margin else "unstable",
                "gain dB": f"{20.0 * np.log10(each.disk.gain):.2f}",
                "phase deg": f"{np.degrees(each.disk.phase):.1f}",
                "at rad/s": f"{each.disk.frequency:.4g}",
                "worst at": each.where
                + (f", reached: {each.disk.attained:.3f}" if each.name == "both" and each.disk.margin else ""),
            }
            for each in self.loops[title]
        ]

    def classical_rows(self, title: str) -> list[dict[str, str]]:
        """Return the classical margins of a section's single loops as rows of texts by heading."""
        rows = []
        for each in self.loops[title]:
            if (c := each.classical) is None:
                continue
            decibels = [f"{20.0 * np.log10(g):.1f}" if 0.0 < g < np.inf else "none" for g in (c.gain_up, c.gain_down)]
            delays = (1e3 * c.delay, c.delay / self.design.period)
            delay = [f"{value:.3g}" if np.isfinite(value) else "none" for value in delays]
            rows.append(
                {
                    "loop at": each.name.replace("_", " "),
                    "up dB": decibels[0],
                    "down dB": decibels[1],
                    "phase deg": f"{np.degrees(c.phase):.1f}" if c.phase < np.inf else "none",
                    "at rad/s": f"{c.gain_crossover:.4g}",
                    "delay ms": delay[0],
                    "periods": delay[1],
                }
            )
        return rows

    def as_dict(self) -> dict[str, Any]:
        """Return all numbers for JSON, units in the keys: SI, factors of the gain, no margin as null."""
        return {
            "name": self.name,
            "design": self.design.name,
            "loops": {title: [_loop_dict(each) for each in found] for title, found in self.loops.items()},
            "corners": {case: _with_units(asdict(worst)) for case, worst in self.corners.items()},
            "flown": [_with_units(asdict(border)) | {"agrees": border.agrees} for border in self.borders],
        }


_JSON_UNITS = {
    **dict.fromkeys(("frequency", "flown_frequency", "gain_crossover", "phase_crossover"), "rad_per_s"),
    **dict.fromkeys(("growth", "flown_growth"), "1_per_s"),
    "phase": "rad",
    "delay": "s",
}


def _with_units(values: Mapping[str, Any]) -> dict[str, Any]:
    return {f"{name}_{_JSON_UNITS[name]}" if name in _JSON_UNITS else name: value for name, value in values.items()}


def _loop_dict(each: LoopMargins) -> dict[str, Any]:
    disk = asdict(each.disk) | {"gain": each.disk.gain, "phase": each.disk.phase}
    classical = _with_units(asdict(each.classical)) if each.classical else None
    return asdict(each) | {"disk": _with_units(disk), "classical": classical}


VERTICES = "vertices"
"""Title of the section on the vertices: the rigid vehicle with the actuators of the design and its notch filter."""


def hardware_of(parts: Components) -> Hardware:
    """Return the linear actuators of a flight, and the delay of its links and of the controller's computation (s)."""
    plant, found = parts.plant, []
    data = plant.data.actuators
    for channel, order, frequency, damping in zip(
        INPUT_NAMES, data.order, data.natural_frequency, data.damping_ratio, strict=True
    ):
        if order:
            found.append(ActuatorSet(channel, int(order), float(frequency), float(damping), np.inf, np.inf, "scenario"))
    periods = plant.data.link.delay + parts.fault_injector.link.delay + plant.data.late / SUBSTEPS
    return Hardware(tuple(found), periods * plant.period)


def refuse_other_loops(scenario: Scenario) -> None:
    """Refuse a scenario whose loop is not the linear one of F, with the reason.

    Raises:
        ScenarioError: The message names the field; the margins of another loop are never given.
    """
    given = scenario.settings.get
    tau = [*scenario.tube.tau, *(value for change in scenario.tube.change for value in change.tau)]
    law = str(given("nominal.law", "family"))
    random = [
        name
        for name in ("jitter", "loss", "corruption")
        for link in ("measurement", "command")
        if given(f"link.{link}.{name}")
    ]
    reasons = (
        (not scenario.design, "design = '': no feedback F, expected a design"),
        (
            scenario.controller != "tube_mpc",
            f"controller = {scenario.controller!r}: its loop is not that of F, expected 'tube_mpc'",
        ),
        (law != "family", f"nominal.law = {law!r}: solved in flight, its loop is not linear, expected 'family'"),
        (any(value < 1.0 for value in tau), f"tube.tau = {min(tau, default=1.0):g}: expected 1"),
        (given("estimator.enabled"), "estimator: its dynamics are not in the loop, expected none"),
        (given("effectiveness.enabled"), "effectiveness: divides the command, not linear, expected no estimator"),
        (given("integral.rate"), "integral: its states are not in the loop, expected no integral action"),
        (random, f"link: random {' and '.join(dict.fromkeys(random))}, expected a constant delay"),
    )
    for applies, reason in reasons:
        if applies:
            raise ScenarioError(f"scenario {scenario.name!r}: no margins: {reason}")


def scenario_loops(scenario: Scenario) -> VehicleLoops:
    """Return the loops of a scenario: its vehicle, hardware and notch filter, along the commanded trajectory.

    The places are the start, points that divide each leg of the commands into :data:`LEG` parts, and the target;
    "fault" is the target with the elevator effectiveness that the faults leave. Other faults are not in the loop.

    Raises:
        ScenarioError: See :func:`refuse_other_loops`.
    """
    refuse_other_loops(scenario)
    parts = assemble_flight(scenario)
    design = _design(parts)
    if np.any(design.tau < 1.0):
        raise ScenarioError(f"scenario {scenario.name!r}: no margins: design {design.name!r} has tau below 1")
    values = {**design.to_parameters(), **scenario.parameters()}
    feedback = Feedback(design.feedback_gain, tuple(parts.notch_filter.sections), design.period, hardware_of(parts))
    points = [(scenario.initial.altitude, scenario.initial.velocity)]
    points += [*zip(scenario.commands.altitudes, scenario.commands.velocities, strict=True)]
    places = {"start": Place(points[0])}
    for leg, (before, after) in enumerate(pairwise(dict.fromkeys(points)), start=1):
        for part in range(1, LEG):
            share = part / LEG
            at = tuple(a + share * (b - a) for a, b in zip(before, after, strict=True))
            places[f"leg {leg}, {part}/{LEG}"] = Place((at[0], at[1]))
    places["target"] = Place(points[-1])
    lost = [
        row.parameters["effectiveness"]
        for row in scenario.fault
        if row.type == "loss_of_effectiveness" and row.channel == INPUT_NAMES[1]
    ]
    if lost:
        places["fault"] = Place(points[-1], float(np.prod(lost)))
    own = dict(scenario.vehicle.perturbation)
    return VehicleLoops(feedback, initial_trim(values)[0], scenario.vehicle.described.uncertainty, places, own)


@dataclass(frozen=True)
class OpenLoop:
    """The loop of plant, hardware, notch filter and feedback, broken at one place: x(k+1) = A x + B v, y = C x.

    v are the signals behind the break, y minus the signals that return to it: y = L v, and v = -y closes the loop, as
    in ``feedback`` and ``margin`` of python-control.
    """

    A: np.ndarray
    """State matrix (n, n), discrete time"""
    B: np.ndarray
    """Input matrix (n, m)"""
    C: np.ndarray
    """Output matrix (m, n)"""
    period: float
    """Sampling period (s)"""
    states: tuple[str, ...]
    """Names of the states: deviations of the vehicle's from trim (SI), actuators, delayed commands, notch filter"""
    signals: tuple[str, ...]
    """Names of the signals at the break: inputs (1, rad) or a measurement (SI)"""

    def to_control(self) -> Any:
        """Return L as a ``StateSpace`` of python-control with named signals; outputs end in ``_returned``."""
        import control

        outputs = [f"{name}_returned" for name in self.signals]
        names = {"states": list(self.states), "inputs": list(self.signals), "outputs": outputs}
        return control.ss(self.A, self.B, self.C, np.zeros((len(self.C),) * 2), self.period, **names)


def loop(
    design: str = "",
    scenario: str | Scenario = "case1",
    altitude: float | str = "",
    velocity: float | str = "",
    *,
    at: str = "elevator",
) -> OpenLoop:
    """Return the linear loop of a design in the flight of a scenario around a level trim, broken ``at`` one place.

    Args:
        design: Name or path of a design; empty: that of the scenario.
        scenario: Scenario, its name or path, with vehicle, actuators, delays and notch filter.
        altitude: m, or a text with unit; empty, with an empty velocity: both as at the start of the scenario.
        velocity: m/s, or a text with unit.
        at: ``elevator``, ``fuel`` or ``both`` inputs, or one of the first five states: the measurement of it.

    Raises:
        ScenarioError: The loop of the scenario is not the linear one of the feedback F; the message says why.
        QuantityError, TrimError: An argument is wrong, or there is no equilibrium.
    """
    require("design", design, str, "a name, or a path as text")
    if at not in (known := (*INPUTS, *MEASUREMENTS)):
        raise QuantityError(f"at = {at!r}: expected {one_of(known, at)}")
    given = load_scenario(scenario) if isinstance(scenario, str) else scenario
    given = given.model_copy(update={"design": design}) if design else given
    around, described = scenario_loops(given), given.vehicle.described
    vehicle, hardware = around.vehicle.perturbed(around.own), around.feedback.hardware
    point = around.places["start"].point
    if altitude != "" or velocity != "":
        reached = trim_at(vehicle, *described.condition(altitude, velocity)).state
        point = float(reached[0]), float(reached[1])
    sampled = around.feedback.around(vehicle, point)
    broken = sampled.broken(at)
    known = (*STATE_NAMES[: None if vehicle.form.elastic else N_RIGID], *actuator_names(hardware.actuators))
    filters = tuple(f"filter_{i + 1}" for i in range(sampled.filter_states))
    waiting = range(len(sampled.A) - len(known) - len(filters))
    delayed = tuple(f"{INPUT_NAMES[i % 2]}_before_{i // 2 + 1}" for i in waiting)
    names = tuple(INPUT_NAMES[i] for i in INPUTS[at]) if at in INPUTS else (at,)
    opened = broken.A - broken.B @ broken.C
    return OpenLoop(opened, broken.B, -broken.C, broken.period, (*known, *delayed, *filters), names)


def margin_verdict(
    scenario: Scenario, design: ControlDesign | None, certificate: Mapping[str, Any] | None = None
) -> dict[str, Any] | None:
    """Return whether ``design`` has the disk margin that the scenario requires; None if it requires none.

    ``kept`` is true, false, or None if the margin is not judged, and ``words`` is a line that says so. The margin is
    that of the elevator loop at the worst vertex, from the ``certificate``, or else from the file next to the
    scenario's design; the pencil verifies it at every vertex. It is not judged without such a block, or if the loop of
    the scenario is not that of F.
    """
    if scenario.disk_margin is None:
        return None
    with suppress(HsvError, LookupError, TypeError, ValueError, OverflowError):
        refuse_other_loops(scenario)
        if certificate is None:
            certificate = read_certificate(certificate_path(find_design(scenario.design)))
        stated = certificate["margins"]["vertices"]["elevator"]["margin"]
        if design is None or np.any(design.tau < 1.0):
            raise ScenarioError(f"scenario {scenario.name!r}: no margins: no design with tau = 1")
        if all(is_proved(loop.broken("elevator"), m) for loop, m in zip(vertex_loops(design), stated, strict=True)):
            kept = min(stated) >= scenario.disk_margin
            verdict = "" if kept else " violated"
            words = f"disk margin at the vertices {min(stated):.3f}{verdict} (limit {scenario.disk_margin:g})"
            return {"kept": kept, "words": words}
    return {"kept": None, "words": f"disk margin not judged: hsv margins {scenario.name}"}


def corner_file(scenario: Scenario, around: VehicleLoops, corner: str) -> str:
    """Return the scenario with the vehicle of a ``corner`` as the text of a TOML file."""
    table = scenario_table(scenario_text(scenario.name), scenario.name)
    changes = {name: f"{100.0 * value:.12g} %" for name, value in around.changes(corner).items()}
    table["vehicle"] = {**table.get("vehicle", {}), "perturbation": changes}
    table["title"] = f"{scenario.title}; the corner with the smallest disk margin"
    return tomli_w.dumps(table)


def _design(parts: Components) -> ControlDesign:
    assert isinstance(parts.controller, TubeLaw)
    return parts.controller.design


@dataclass(frozen=True)
class Border:
    """A border of stability that was computed and flown.

    ``kind`` is "gain up", "gain down" or "delay"; ``border`` the factor of the elevator's row of F, or the number of
    further periods of delay of both commands that the loop tolerates. ``growth`` and ``flown_growth`` (1/s) have the
    computed and the flown growth inside and outside; ``frequency`` and ``flown_frequency`` are in rad/s.
    """

    kind: str
    border: float
    growth: tuple[float, float]
    flown_growth: tuple[float, float]
    frequency: float
    flown_frequency: float

    @property
    def agrees(self) -> bool:
        """Whether the flight inside is stable, the one outside is not, and its frequency is within 5 %."""
        inside, outside = self.flown_growth
        return inside < 0.0 < outside and abs(self.flown_frequency / self.frequency - 1.0) < 0.05


def flown_borders(values: Mapping[str, Any], design: ControlDesign, loops: VehicleLoops) -> list[Border]:
    """Fly the coupled vehicle on both sides of each border of stability, at the constant trim of the start.

    The margins are those of the same trim. The flights begin with a pitch-angle error of :data:`DEVIATION`; what grows
    is their difference from a flight without it. ``values`` are the flat parameters of the flight whose commands and
    faults are omitted. The gain is that of a design in memory with a scaled row of F.

    Raises:
        ScenarioError: The loop is unstable, so that it has no border.
    """
    loop, feedback, place = loops.loop("", "start"), loops.feedback, loops.places["start"]
    if loop.growth >= 0.0:
        raise ScenarioError("flown: the loop is unstable at the start, expected a stable one")
    margins = classical_margins(loop.broken("elevator"))
    found = []
    for kind, border in (("gain up", margins.gain_up), ("gain down", margins.gain_down)):
        if not 0.0 < border < np.inf:
            continue
        sides = [border * (1.0 - BESIDE), border * (1.0 + BESIDE)]
        if kind == "gain down":
            sides.reverse()
        poles = [_fastest(loop.scaled(side, "elevator").poles) for side in sides]
        designs = [replace(design, feedback_gain=design.feedback_gain * [[1.0], [side]]) for side in sides]
        found.append(_border(kind, border, poles, [(values, each) for each in designs]))
    vehicle = loops.vehicle.perturbed(loops.own)

    def poles_at(periods: int) -> complex:
        late = replace(feedback.hardware, delay=feedback.hardware.delay + periods * feedback.period)
        return _fastest(replace(feedback, hardware=late).around(vehicle, place.point, place.effectiveness).poles)

    last = next(n for n in range(200) if poles_at(n + 1).real >= 0.0)
    field = "link.command.delay"
    flights = [({**values, field: values.get(field, 0.0) + n}, design) for n in (last, last + 1)]
    found.append(_border("delay", float(last), [poles_at(last), poles_at(last + 1)], flights))
    return found


def _fastest(poles: np.ndarray) -> complex:
    """Return the pole with the largest real part and an imaginary part that is not negative."""
    upper = poles[poles.imag >= 0.0]
    return complex(upper[np.argmax(upper.real)])


def _border(kind: str, border: float, poles: list[complex], flights: list[tuple[Any, ControlDesign]]) -> Border:
    folds = zip(flights, poles, _E_FOLDS, strict=True)
    flown = [_grown(*flight, min(count / abs(pole.real), _LONGEST)) for flight, pole, count in folds]
    growth = (poles[0].real, poles[1].real)
    return Border(kind, border, growth, (flown[0][0], flown[1][0]), poles[1].imag, flown[1][1])


def _grown(values: Mapping[str, Any], design: ControlDesign, duration: float) -> tuple[float, float]:
    """Return growth (1/s) and frequency (rad/s) of a deviation of the elevator command at constant trim.

    Both are measured in the last two thirds of the flight, which ends where an input is limited or moves
    by more than the loop is linear for.
    """
    period = design.period
    constant = {
        "duration": period * round(duration / period),
        "reference.times": [0.0],
        "reference.altitudes": [values["initial.altitude"]],
        "reference.velocities": [values["initial.velocity"]],
    }
    kept = {name: value for name, value in values.items() if not name.startswith(_OMITTED)}
    parts = assemble_with(design, {**kept, **constant, **design.loop_parameters})
    calm = fly(parts).history
    state = parts.plant.initial.state.copy()
    state[STATE_NAMES.index("pitch_angle")] += DEVIATION
    parts.plant.initial = replace(parts.plant.initial, state=state)
    flown = fly(parts).history
    steps = min(len(calm.command), len(flown.command))
    moved = (flown.command[:steps] - calm.command[:steps])[:, 1]
    beyond = np.any(flown.command != flown.u_unsaturated, axis=1)[:steps] | (np.abs(moved) > _LINEAR)
    steps = int(np.argmax(beyond)) if beyond.any() else steps
    middle, end = moved[steps // 3 : 2 * steps // 3], moved[2 * steps // 3 : steps]
    growth = np.log(np.abs(end).max() / np.abs(middle).max()) / (len(end) * period)
    turns = np.flatnonzero(np.sign(end[1:]) != np.sign(end[:-1]))
    frequency = np.pi * (len(turns) - 1) / ((turns[-1] - turns[0]) * period) if len(turns) > 2 else 0.0
    return float(growth), float(frequency)
