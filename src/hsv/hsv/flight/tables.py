"""The tables of a scenario file: each field with its unit and range; quantities are read as SI numbers.

A distribution may stand in place of a number. It is read as its mean, and recorded in the context of the validation.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo, field_validator

from hsv.base.errors import DocumentError, ParameterError, QuantityError, ScenarioError, messages, one_of
from hsv.base.files import is_path, parse_toml
from hsv.base.parameters import Parameter, limits_in_words, read_number
from hsv.base.units import has_unit, parse_quantity, rounded, si_unit_of, to_paper, written
from hsv.flight.distribution import Distribution, read_distribution
from hsv.model.faults.table import fault_parameters
from hsv.model.vehicle import DEFAULT_VEHICLE, Vehicle, load_vehicle, parse_vehicle


def refused(name: str, why: object) -> ScenarioError:
    """Return the error for the scenario ``name`` (or path) with the reason ``why``, an error perhaps with notes."""
    first, *others = (f"scenario {(Path(name).stem if is_path(name) else name)!r}: {words}" for words in messages(why))
    error = ScenarioError(first)
    for words in others:
        error.add_note(words)
    return error


def dotted(location: Iterable[int | str]) -> str:
    """Return the name of a field, such as ``fault[0].start``, from its parts."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def set_field(table: dict[str, Any], field: str, value: object, name: str) -> None:
    """Set a ``field`` such as ``fault[0].start`` in the ``table`` of a scenario to a ``value`` as written in a file."""
    parts = [int(part) if part.isdecimal() else part for part in re.findall(r"[^.\[\]]+", field) or [""]]
    place: Any = table
    for index, part in enumerate(parts):
        there, listed = dotted(parts[:index]), isinstance(place, list)
        if not (isinstance(part, int) and part < len(place) if listed else isinstance(place, dict) and part):
            known = ", ".join(f"{there}[{entry}]" for entry in range(len(place))) if listed else ""
            raise refused(name, f"{field}: no such field, expected {known or 'one such as fault[0].start'}")
        if index == len(parts) - 1:
            place[part] = value
        else:
            place = place[part] if listed else place.setdefault(part, {})


def read_changes(texts: Iterable[str]) -> dict[str, object]:
    """Return the changes of a scenario in ``texts`` such as ``duration=50 s``, by field, with values as in a file.

    Raises:
        ScenarioError: A text lacks the field, or two texts name the same.
    """
    changes: dict[str, object] = {}
    for text in texts:
        field, equals, value = (part.strip() for part in text.partition("="))
        if not (field and equals) or field in changes:
            raise ScenarioError(f"set = {text!r}: expected FIELD=VALUE, such as 'duration=50 s', each field once")
        changes[field] = value
        with suppress(DocumentError):  # a text needs no quotes
            changes[field] = parse_toml(f"value = {value}")["value"]
    return changes


@contextmanager
def renamed(old: str, new: str) -> Iterator[None]:
    """Turn a ``ParameterError`` into a ``ScenarioError``, with the first ``old`` in its message replaced by ``new``."""
    try:
        yield
    except ParameterError as error:
        raise ScenarioError(str(error).replace(old, new, 1)) from error


@dataclass(frozen=True)
class Reading:
    """The context of a scenario's validation: its vehicle, and the distributions found so far."""

    vehicle: Vehicle
    """The scenario's vehicle, with its flight envelope and its sets of inertial coupling"""
    drawn: dict[int, Distribution] = field(default_factory=dict)
    """Distributions by ``id()`` of the inline table in which each is written"""

    def distribution(self, table: dict[str, Any], unit: str, name: str, *, whole: bool = False) -> Distribution:
        """Return the distribution of the field ``name`` in its inline ``table``, in ``unit``, and record it."""
        found = self.drawn[id(table)] = read_distribution(table, unit, name, whole=whole)
        return found

    def number(self, parameter: Parameter, value: object, name: str) -> float:
        """Return the ``value`` (SI) that a file gives a ``parameter``, or the mean of a distribution in its place."""
        if not isinstance(value, dict):
            return read_number(parameter, value, name)
        drawn = self.distribution(value, parameter.unit or "1", name, whole=parameter.whole)
        if not parameter.minimum <= drawn.low <= drawn.high <= parameter.maximum:
            limits = limits_in_words(parameter, next(iter(value.values()))[0])
            raise ScenarioError(f"{name} = {value!r}: expected all values{limits}")
        return drawn.middle

    def custom_value(self, name: str, value: object) -> Any:
        """Return an entry of a custom controller's table, with means in place of distributions.

        Only the controller's class knows the unit, so a distribution has the SI unit of its first value.
        """
        if isinstance(value, list):
            return [self.custom_value(name, entry) for entry in value]
        if not isinstance(value, dict):
            return value
        if value and all(isinstance(entry, str) for entry in value.values()):
            return value  # a table of texts, not a distribution
        pair = next(iter(value.values()), None)
        first = pair[0] if isinstance(pair, list) and pair else None
        drawn = self.distribution(value, si_unit_of(first), name)
        return written(drawn.middle, drawn.unit)

    def fault(self, name: str, row: dict[str, Any]) -> dict[str, Any]:
        """Return the ``row`` of a fault in the form of :class:`FaultTable`, with its parameters in a nested table."""
        common = {key: row[key] for key in FaultTable.model_fields if key in row and key != "parameters"}
        channel, kind = (row.get(key) for key in ("channel", "type"))
        if not (isinstance(channel, str) and isinstance(kind, str)):
            return common  # the validation of FaultTable refuses it
        with renamed("fault.", f"{name}."):
            known = {parameter.name: parameter.of(channel) for parameter in fault_parameters(channel, kind)}
        parameters = {}
        for key, value in row.items():
            if key in common:
                continue
            if key not in known:
                expected = (*known, *(each for each in FaultTable.model_fields if each != "parameters"))
                raise ScenarioError(f"{name}.{key}: unknown key, expected {one_of(expected, key)}")
            parameters[key] = self.number(known[key], value, f"{name}.{key}")
        return {**common, "parameters": parameters}


def _reading(info: ValidationInfo) -> Reading:
    assert isinstance(info.context, Reading)
    return info.context


def quantity(
    unit: str,
    limits: tuple[float, float] = (-math.inf, math.inf),
    shown: str = "",
    *,
    axis: str = "",
    bare: bool = True,
) -> BeforeValidator:
    """Return a validator of a quantity within ``limits`` (SI); ``shown`` describes the limits in error messages.

    With an ``axis``, altitude or velocity, the limits are the envelope of the scenario's vehicle. Unless ``bare``, a
    number without a unit is refused, because 5 might mean 5 % but would be read as 500 %.
    """

    def parse(text: object, info: ValidationInfo) -> float:
        (least, largest), value = _ends_and_mean(text, unit, info)
        for given in next(iter(text.values())) if isinstance(text, dict) else (text,):
            if not bare and not has_unit(given):
                raise QuantityError(f"{info.field_name} = {given!r}: the unit is missing, expected one such as '+5 %'")
        low, high = getattr(_reading(info).vehicle, f"{axis}_range") if axis else limits
        if not low <= least <= largest <= high:
            expected = envelope((low, high), unit) if axis else shown
            raise QuantityError(f"{info.field_name} = {text!r}: expected {expected}")
        return value

    return BeforeValidator(parse)


def _numbers(given: object, info: ValidationInfo) -> tuple[float, ...]:
    """Return a dimensionless number, or a list of them, as a tuple, with means in place of distributions."""
    texts = given if isinstance(given, list | tuple) else [given]
    if not texts:
        raise QuantityError(f"{info.field_name} = []: expected one value at least")
    return tuple(_ends_and_mean(text, "1", info)[1] for text in texts)


def envelope(limits: tuple[float, float], unit: str) -> str:
    """Return the flight envelope on an axis as text in feet or ft/s; ``limits`` are in the SI ``unit`` of the axis."""
    low, high = (to_paper(limit, unit) for limit in limits)
    return f"{low[0]:.0f} {low[1]} to {high[0]:.0f} {high[1]}, the flight envelope"


def _ends_and_mean(text: object, unit: str, info: ValidationInfo) -> tuple[tuple[float, float], float]:
    """Return (minimum, maximum) and the mean of a number or distribution, in ``unit``."""
    name = str(info.field_name)
    if isinstance(text, dict):
        drawn = _reading(info).distribution(text, unit, name)
        return (drawn.low, drawn.high), drawn.middle
    value = parse_quantity(text, unit, name)
    return (value, value), value


def _coupling(given: object, info: ValidationInfo) -> str:
    """Return the canonical name of the chosen inertial coupling: a set of the vehicle, or a multiple of ``derived``."""
    vehicle = _reading(info).vehicle
    if isinstance(given, dict):
        (least, _), given = _ends_and_mean(given, "1", info)
        vehicle.coupling_name(least)
    return vehicle.coupling_name(given)


Coupling = Annotated[str, BeforeValidator(_coupling)]
Change = Annotated[float, quantity("1", (-0.9, 10.0), "-90 % to +1000 %", bare=False)]
Time = Annotated[float, quantity("s", (0.0, 1e5), "a time from 0 s to 100000 s")]
Numbers = Annotated[tuple[float, ...], BeforeValidator(_numbers)]


class Table(BaseModel):
    """A table of a scenario; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class VehicleTable(Table):
    """The simulated vehicle; a file may give its name alone, ``vehicle = "glider"``, in place of the table."""

    name: str = DEFAULT_VEHICLE
    """Registered name, or path of a file; with a ``definition``, the name of that vehicle"""
    definition: dict[str, Any] = Field(default_factory=dict)
    """The contents of the vehicle's file, stored in the scenario; empty for a shipped vehicle"""
    model: Literal["CM", "DM"] = "CM"
    coupling: Coupling = ""
    perturbation: dict[str, Change] = Field(default_factory=dict)

    @cached_property
    def described(self) -> Vehicle:
        """The vehicle that this table names or defines."""
        return _defined(self.name, json.dumps(self.definition)) if self.definition else load_vehicle(self.name)


@lru_cache(maxsize=8)
def _defined(name: str, text: str) -> Vehicle:
    # Cached, because every flight of a campaign reads its scenario anew.
    return parse_vehicle(json.loads(text), name)


class InitialTable(Table):
    """The trimmed initial condition of the flight: altitude (m) and velocity (m/s)."""

    altitude: Annotated[float, quantity("m", axis="altitude")]
    velocity: Annotated[float, quantity("m/s", axis="velocity")]


class CommandTable(Table):
    """A change of the commands: a step at ``start``, or a ramp from there to a later ``end``."""

    altitude_change: Annotated[float, quantity("m")] = 0.0
    velocity_change: Annotated[float, quantity("m/s")] = 0.0
    start: Time = 0.0
    end: Time = Field(default_factory=lambda data: data.get("start", 0.0))

    @field_validator("end")
    @classmethod
    def _end_is_after_start(cls, end: float, info: ValidationInfo) -> float:
        if end <= (start := info.data.get("start", 0.0)):
            raise QuantityError(f"end = {end:g} s: expected a time after start, {start:g} s, or none for a step")
        return end

    def share(self, time: float) -> float:
        """Return the share of the change that is commanded at ``time`` (s)."""
        if time >= self.end:
            return 1.0
        return max(0.0, (time - self.start) / (self.end - self.start)) if self.end > self.start else 0.0


class TauChangeTable(Table):
    """A change of the tube factor tau in flight."""

    start: Time
    tau: Numbers


class TubeTable(Table):
    """The tube factor tau, one value or one for each rigid state (default: the design's), and its changes in flight."""

    tau: Numbers = ()
    change: tuple[TauChangeTable, ...] = ()


class FaultTable(Table):
    """A scheduled fault; in a file, the parameters of its type are further keys of the same table."""

    channel: str
    type: str
    start: Time
    stop: Time | None = None
    parameters: dict[str, float] = Field(default_factory=dict)
    """Parameters of the fault type, SI"""


class Breakpoints(NamedTuple):
    """Breakpoints of the piecewise-linear reference: times (s; equal at a step), altitudes (m) and velocities (m/s)."""

    times: tuple[float, ...]
    altitudes: tuple[float, ...]
    velocities: tuple[float, ...]


def breakpoints(altitude: float, velocity: float, commands: Sequence[CommandTable]) -> Breakpoints:
    """Return the breakpoints of the reference from ``altitude`` (m) and ``velocity`` (m/s) along the ``commands``.

    A step has two breakpoints; at t = 0 it has only one, because the reference begins with the value after the step.
    """
    rows: list[tuple[float, float, float]] = []
    for time in sorted({t for c in commands for t in (c.start, c.end)} or {0.0}):
        shares = [c.share(time) for c in commands]
        before = [0.0 if c.start == c.end == time else share for c, share in zip(commands, shares, strict=True)]
        for acting in [before, shares] if time > 0.0 and before != shares else [shares]:
            # Not sum(), which from Python 3.12 on compensates rounding and would give other bits.
            climbed = gained = 0.0
            for share, c in zip(acting, commands, strict=True):
                climbed += share * c.altitude_change
                gained += share * c.velocity_change
            rows.append((time, rounded(altitude + climbed), rounded(velocity + gained)))
    times, altitudes, velocities = zip(*rows, strict=True)
    return Breakpoints(times, altitudes, velocities)


def check_envelope(reference: Breakpoints, commands: Sequence[CommandTable], vehicle: Vehicle) -> None:
    """Refuse commands that lead out of the flight envelope of ``vehicle``."""
    ranges = vehicle.altitude_range, vehicle.velocity_range
    axes = zip(("altitude", "velocity"), reference[1:], ranges, ("m", "m/s"), strict=True)
    for axis, goals, limits, unit in axes:
        for time, goal in zip(reference.times, goals, strict=True):
            if not limits[0] <= goal <= limits[1]:
                acting = [i for i, c in enumerate(commands) if c.share(time) and getattr(c, f"{axis}_change")]
                shown, paper = to_paper(goal, unit)
                raise ScenarioError(
                    f"command[{acting[-1]}].{axis}_change leads to {shown:.0f} {paper} at {time:g} s: "
                    f"expected {envelope(limits, unit)}"
                )


def tables_in(value: object, name: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the field name and the contents of every table in ``value``, including nested tables."""
    if isinstance(value, dict):
        yield name, value
        for key, entry in value.items():
            yield from tables_in(entry, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from tables_in(entry, f"{name}[{index}]")
