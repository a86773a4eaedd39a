"""Commands of a flight: steps and ramps of altitude and velocity, and the piecewise-linear reference they add up to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import ValidationInfo, field_validator, model_validator

from hsv.base.errors import QuantityError, ScenarioError
from hsv.base.units import rounded, to_paper
from hsv.flight.fields import Table, Time, envelope, quantity
from hsv.model.vehicle import Vehicle


class CommandTable(Table):
    """A change of the commands: a step at ``start``, a ramp from there where ``end`` is later."""

    altitude_change: Annotated[float, quantity("m")] = 0.0
    velocity_change: Annotated[float, quantity("m/s")] = 0.0
    start: Time = 0.0
    end: Time = 0.0

    @model_validator(mode="before")
    @classmethod
    def _end_where_it_starts(cls, data: Any) -> Any:
        return {"end": data["start"], **data} if isinstance(data, dict) and "start" in data else data

    @field_validator("end")
    @classmethod
    def _not_before_its_start(cls, end: float, info: ValidationInfo) -> float:
        start = info.data.get("start", 0.0)
        if end < start:
            raise QuantityError(f"end = {end:g} s: expected no time before start, {start:g} s")
        return end

    def share(self, time: float) -> float:
        """Return the share of the change that is commanded at ``time`` (s)."""
        if time >= self.end:
            return 1.0
        return max(0.0, (time - self.start) / (self.end - self.start)) if self.end > self.start else 0.0


class Breakpoints(NamedTuple):
    """The reference: times (s), altitudes (m), velocities (m/s), linear between; two equal times are a step."""

    times: tuple[float, ...]
    altitudes: tuple[float, ...]
    velocities: tuple[float, ...]


def breakpoints(altitude: float, velocity: float, commands: Sequence[CommandTable]) -> Breakpoints:
    """Return what ``commands`` add to an initial ``altitude`` (m) and ``velocity`` (m/s).

    A step at t = 0 is one breakpoint: the reference begins where it leads.
    """
    rows: list[tuple[float, float, float]] = []
    for time in sorted({t for c in commands for t in (c.start, c.end)} or {0.0}):
        shares = [c.share(time) for c in commands]
        before = [0.0 if c.start == c.end == time else share for c, share in zip(commands, shares, strict=True)]
        for taken in [before, shares] if time > 0.0 and before != shares else [shares]:
            # One after the other: from Python 3.12 on, sum() adds numbers with compensation.
            climbed = gained = 0.0
            for share, c in zip(taken, commands, strict=True):
                climbed += share * c.altitude_change
                gained += share * c.velocity_change
            rows.append((time, rounded(altitude + climbed), rounded(velocity + gained)))
    times, altitudes, velocities = zip(*rows, strict=True)
    return Breakpoints(times, altitudes, velocities)


def check_envelope(reference: Breakpoints, commands: Sequence[CommandTable], vehicle: Vehicle) -> None:
    """Refuse commands that lead out of the flight envelope of ``vehicle``.

    Raises:
        ScenarioError: Names the command that does.
    """
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
