"""Requirements: bounds of signals over a time window, with the signed margin of signal temporal logic.

The margin of a step is (bound - signal) / |bound|, with the opposite sign for a lower bound. Over the steps of the
window, ``always`` takes the smallest margin and ``eventually`` the largest one. ``until`` takes the largest value, over
the steps k of the window, of the smaller of the second margin at k and of all first margins before k. The requirement
is kept if its margin is not negative.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hsv.base.errors import ScenarioError, one_of
from hsv.base.units import UnitSystem, parse_quantity, quantity_text
from hsv.flight.metrics import MARGIN, FlightData, spaced
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS


class Signal(NamedTuple):
    """A signal that a requirement can bound: SI unit, and the function that returns it, shape (n + 1,)."""

    unit: str
    along: Callable[[FlightData], np.ndarray]


def _column(matrix: str, column: int) -> Callable[[FlightData], np.ndarray]:
    return lambda flight: np.asarray(getattr(flight.history, matrix)[:, column])


LEVEL = "level"
"""The signal that a flight has only with an invariant set."""

SIGNALS = {
    **{name: Signal(STATE_UNITS[i], _column("state", i)) for i, name in enumerate(STATE_NAMES)},
    **{name: Signal(INPUT_UNITS[i], _column("command", i)) for i, name in enumerate(INPUT_NAMES)},
    "altitude_error": Signal("m", lambda flight: np.abs(flight.curves[0])),
    "velocity_error": Signal("m/s", lambda flight: np.abs(flight.curves[1])),
    "angle_of_attack_from_nominal": Signal("rad", lambda flight: flight.curves[8]),
    "pitch_angle_from_nominal": Signal("rad", lambda flight: flight.curves[9]),
    "attitude_from_nominal": Signal("rad", lambda flight: np.maximum(flight.curves[8], flight.curves[9])),
    LEVEL: Signal("1", lambda flight: np.full(len(flight.time), np.nan)),
}
"""Signals by name: states, commands u, magnitudes of errors, magnitudes of differences from x_r + x_n, tube level."""

ALWAYS, EVENTUALLY, UNTIL = MODES = ("always", "eventually", "until")
START, FAULT, MANOEUVRE_END = EVENTS = ("start", "fault", "manoeuvre end")

_BOUNDS = ("at_most", "at_least")

_KEYS = ("name", "id", "signal", *_BOUNDS, *MODES, "from", "within")


class Predicate(NamedTuple):
    """An upper or lower bound (SI) of a signal."""

    signal: str
    bound: float
    upper: bool

    def margins(self, values: np.ndarray) -> np.ndarray:
        """Return the margin of each value of the signal as a share of the bound; of NaN, minus infinity."""
        apart = self.bound - values if self.upper else values - self.bound
        found = apart / abs(self.bound)
        found[np.isnan(found)] = -np.inf
        return found

    def words(self, system: UnitSystem) -> str:
        """Return the predicate as text, with the bound in ``system``."""
        bound = quantity_text(self.bound, SIGNALS[self.signal].unit, system)
        return f"{spaced(self.signal)} at {'most' if self.upper else 'least'} {bound}"


@dataclass(frozen=True)
class Requirement:
    """A requirement of a scenario; times in s."""

    name: str
    id: str
    """Identifier in the user's own document; empty: none"""
    predicate: Predicate
    mode: str
    """One of :data:`MODES`"""
    target: Predicate | None
    """With ``until``, the predicate that ends the requirement; otherwise None"""
    begin: str | float
    """Begin of the window: one of :data:`EVENTS`, or a time"""
    within: float
    """Length of the window; infinite: to the end of the flight"""

    @property
    def metric(self) -> str:
        """Name of the requirement's margin among the metrics."""
        return MARGIN + re.sub(r"\W+", "_", self.name.strip().lower())

    def words(self, system: UnitSystem = UnitSystem.metric) -> str:
        """Return the requirement as text, with bounds in ``system``."""
        mode = f"until {self.target.words(system)}" if self.target else self.mode
        begin = self.begin if isinstance(self.begin, str) else f"{self.begin:g} s"
        window = "" if begin == START else f", from {begin}"
        within = f", within {self.within:g} s" if math.isfinite(self.within) else ""
        return f"{self.predicate.words(system)}, {mode}{window}{within}"

    def window(self, flight: FlightData) -> slice:
        """Return the steps of the window in a flight, empty if its begin was not reached; ends count, if flown."""
        if self.begin == FAULT:
            begin = math.inf if flight.fault_start is None else flight.fault_start
        elif self.begin == MANOEUVRE_END:
            altitude, velocity = flight.reference[:, 0], flight.reference[:, 1]
            moving = np.flatnonzero((altitude != altitude[-1]) | (velocity != velocity[-1]))
            begin = float(flight.time[moving[-1] + 1]) if len(moving) else 0.0
        else:
            begin = 0.0 if isinstance(self.begin, str) else self.begin
        first, end = np.searchsorted(flight.time, (begin - 1e-9, begin + self.within + 1e-9))
        return slice(int(first), int(end))


class Margin(NamedTuple):
    """The margin of a requirement in a flight, as a share of its bound, and the step that decides it.

    ``value`` is the value (SI) of the requirement's signal at this ``step``. Both are None if the flight was lost or
    did not reach the window; the margin is then minus infinity.
    """

    margin: float
    step: int | None = None
    value: float | None = None
    window: slice = slice(0, 0)

    @property
    def kept(self) -> bool:
        """Whether the requirement is kept."""
        return self.margin >= 0.0


def decided(mode: str, first: np.ndarray, second: np.ndarray | None = None) -> tuple[float, int | None]:
    """Return the margin over a window and the index that decides, from the margins (n,) of its steps.

    ``second`` are those of the target of ``until``. An empty window is kept by ``always`` (infinity) and broken by the
    other modes (minus infinity), as a minimum and a maximum over nothing are.
    """
    if not len(first):
        return (math.inf if mode == ALWAYS else -math.inf), None
    if second is None:
        index = int(np.argmin(first) if mode == ALWAYS else np.argmax(first))
        return float(first[index]), index
    before = np.concatenate(([math.inf], np.minimum.accumulate(first)[:-1]))
    index = int(np.argmax(np.minimum(before, second)))
    if before[index] >= second[index]:
        return float(second[index]), index
    index = int(np.argmin(first[:index]))
    return float(first[index]), index


def margins(
    requirements: Sequence[Requirement],
    flight: FlightData,
    *,
    ended: bool,
    levels: Callable[[], np.ndarray | None] = lambda: None,
    largest_level: float = math.nan,
) -> dict[str, Margin]:
    """Return the margin of each requirement in a flight, by the name of its metric.

    Args:
        requirements: The requirements of a scenario.
        flight: The flight.
        ended: Whether the flight reached its end; otherwise every margin is minus infinity.
        levels: Returns the tube level at each step of the flight, or None if no invariant set applies.
        largest_level: Largest level of the flight, if known. It suffices for an upper bound that always holds, whose
            deciding step is then not returned, and spares the levels, which take half as long as a flight in lanes.
    """
    known: dict[str, np.ndarray] = {}

    def values(predicate: Predicate, window: slice) -> np.ndarray:
        name = predicate.signal
        if name not in known:
            found = levels() if name == LEVEL else None
            known[name] = SIGNALS[name].along(flight) if found is None else found
        return known[name][window]

    found = {}
    for requirement in requirements:
        predicate, target, mode = requirement.predicate, requirement.target, requirement.mode
        window = requirement.window(flight) if ended else slice(0, 0)
        if window.start == window.stop:
            found[requirement.metric] = Margin(-math.inf)
            continue
        of_level = (predicate.signal, predicate.upper, mode) == (LEVEL, True, ALWAYS)
        if of_level and window == slice(0, len(flight.time)) and not math.isnan(largest_level):
            margin, _ = decided(mode, predicate.margins(np.array([largest_level])))
            found[requirement.metric] = Margin(margin, None, largest_level, window)
            continue
        signal = values(predicate, window)
        second = target.margins(values(target, window)) if target else None
        margin, index = decided(mode, predicate.margins(signal), second)
        assert index is not None
        found[requirement.metric] = Margin(margin, window.start + index, float(signal[index]), window)
    return found


def requirement_rows(
    requirements: Sequence[Requirement], found: Mapping[str, Margin], time: np.ndarray
) -> list[dict[str, Any]]:
    """Return the requirements with their ``found`` margins as plain data, SI; ``time`` (n + 1) is that of the flight.

    Each row has ``metric``, ``id``, ``name``, ``requirement`` (text), ``signal`` and ``bound``, ``margin``, ``kept``,
    the deciding instant ``decided_at_s`` with the ``value`` of the signal, and the window ``from_s`` to ``to_s``; the
    last four may be None.
    """
    rows = []
    for each in requirements:
        margin = found[each.metric]
        steps = (margin.step, margin.window.start, margin.window.stop - 1) if margin.step is not None else (None,) * 3
        decided_at, begin, end = (None if step is None else float(time[step]) for step in steps)
        rows.append(
            {"metric": each.metric, "id": each.id, "name": each.name, "requirement": each.words()}
            | {"signal": each.predicate.signal, "bound": each.predicate.bound}
            | {"margin": margin.margin, "kept": margin.kept, "decided_at_s": decided_at, "value": margin.value}
            | {"from_s": begin, "to_s": end}
        )
    return rows


def read_requirements(rows: object, table: Mapping[str, Any]) -> tuple[Requirement, ...]:
    """Return the requirements in the ``rows`` of a scenario; ``table`` is the whole scenario as read from its file.

    Raises:
        ScenarioError: A field is unknown, missing or wrong, a name is used twice, or a window is always empty.
        QuantityError: A bound or time cannot be read.
    """
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ScenarioError(f"requirement = {rows!r}: expected a list of tables")
    found: list[Requirement] = []
    for index, row in enumerate(rows):
        field = f"requirement[{index}]"
        requirement = _requirement(row, field)
        if any(requirement.metric == other.metric for other in found):
            raise ScenarioError(f"{field}.name = {requirement.name!r}: a requirement has this name already")
        _check_window(requirement, field, table)
        found.append(requirement)
    return tuple(found)


def _requirement(row: Mapping[str, Any], field: str) -> Requirement:
    for key in row:
        if key not in _KEYS:
            raise ScenarioError(f"{field}.{key}: unknown key, expected {one_of(_KEYS, key)}")
    name, own, begin = row.get("name", ""), row.get("id", ""), row.get("from", START)
    if not isinstance(name, str) or not re.search(r"\w", name) or not name.isprintable():
        raise ScenarioError(f"{field}.name = {name!r}: expected a text in one line")
    if not isinstance(own, str) or not own.isprintable():
        raise ScenarioError(f"{field}.id = {own!r}: expected a text in one line")
    bounds, modes = [key for key in _BOUNDS if key in row], [key for key in MODES if key in row]
    if len(bounds) != 1:
        raise ScenarioError(f"{field}: expected either at_most or at_least")
    predicate = _predicate(row.get("signal"), bounds[0], row[bounds[0]], field)
    if len(modes) != 1 or not (modes == [UNTIL] or row[modes[0]] is True):
        raise ScenarioError(
            f"{field}: expected one of always = true, eventually = true, until = 'SIGNAL at_most BOUND'"
        )
    target = None
    if modes == [UNTIL]:
        signal, bound, value = [*str(row[UNTIL]).split(maxsplit=2), "", "", ""][:3]
        if not value or bound not in _BOUNDS:
            raise ScenarioError(
                f"{field}.until = {row[UNTIL]!r}: expected 'SIGNAL at_most BOUND' or 'SIGNAL at_least BOUND'"
            )
        target = _predicate(signal, bound, value, f"{field}.until")
    if begin not in EVENTS:
        if isinstance(begin, str) and not any(map(str.isdigit, begin)):
            raise ScenarioError(f"{field}.from = {begin!r}: expected {one_of(EVENTS, begin)}, or a time")
        begin = parse_quantity(begin, "s", f"{field}.from")
    within = parse_quantity(row["within"], "s", f"{field}.within") if "within" in row else math.inf
    if not within > 0.0:
        raise ScenarioError(f"{field}.within = {row['within']!r}: an empty window, expected more than 0 s")
    return Requirement(name, own, predicate, modes[0], target, begin, within)


def _predicate(signal: object, key: str, bound: object, field: str) -> Predicate:
    if not isinstance(signal, str) or signal not in SIGNALS:
        raise ScenarioError(f"{field}.signal = {signal!r}: expected {one_of(SIGNALS, str(signal))}")
    value = parse_quantity(bound, SIGNALS[signal].unit, f"{field}.{key}")
    if value == 0.0:
        raise ScenarioError(f"{field}.{key} = {bound!r}: expected a bound other than 0, of which margins are shares")
    return Predicate(signal, value, key == "at_most")


def _check_window(requirement: Requirement, field: str, table: Mapping[str, Any]) -> None:
    begin, duration = requirement.begin, table.get("duration")
    if begin == FAULT and not table.get("fault"):
        raise ScenarioError(f"{field}.from = 'fault': an empty window, expected a scenario with a fault")
    if isinstance(begin, float) and isinstance(duration, str):
        end = parse_quantity(duration, "s", "duration")
        if not 0.0 <= begin < end:
            raise ScenarioError(f"{field}.from = {begin:g} s: an empty window, expected 0 s to less than {end:g} s")
