"""Flights of a resilience campaign: a case's severities on all vehicles, and the bisection on the nominal one."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from hsv.base.errors import CampaignError, ControllerError
from hsv.control.library import library_digest
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.closed_loop import fly
from hsv.flight.flight import Flight
from hsv.flight.metrics import FlightData
from hsv.flight.resilience.campaign import Case, ResilienceCampaign, Subject
from hsv.flight.resilience.faults import SEVERITIES, TRIED, Moment, TriedFault
from hsv.flight.scenario import parse_scenario
from hsv.model.plant import FlightStatus

ATTITUDE_BAND, ALTITUDE_BAND = np.deg2rad(0.5), 30.0 * 0.3048
"""Distances (rad, m) from the flight without the fault within which a flight counts as recovered."""

_RUNNERS = 16
"""Runners that a worker keeps: those of eight controllers, so that what is built to time a flight is there later."""

_ALTITUDE, _ATTITUDE = 0, slice(2, 4)
"""Columns of the state: altitude; angle of attack and pitch angle."""


@dataclass(frozen=True)
class FlownFault:
    """Result of a flight; deviations are measured from the same vehicle's flight without the fault."""

    severity: str
    """One of :data:`SEVERITIES`"""
    value: float
    """Value of the fault's parameter, in its unit."""
    vehicle: int
    """0: the nominal one"""
    survived: bool
    """Whether it came to its end within the range of the model"""
    attitude: float | None
    """Largest distance of angle of attack or pitch angle after the fault, rad; None where its controller crashed"""
    altitude: float | None
    """The same of altitude, m"""
    recovery_time: float | None
    """Time after the fault at which it last left the band, s; None where it is out at the end"""
    time_to_loss: float | None
    """Time after the fault at which it was lost, s; None where it was not, or its controller crashed"""
    crashed: str | None
    """Why its controller ended it."""


@dataclass(frozen=True)
class Boundary:
    """The severities (0 to 1) on the nominal vehicle between which a controller is lost.

    ``survived`` is None where the harmless end is lost, ``lost`` where the worst one is survived. Where a milder fault
    is lost and a more severe one survived, it is the mildest loss that counts.
    """

    survived: float | None
    lost: float | None


class SubjectRunner:
    """Flies one controller's flights for one time of occurrence; what they share is built once."""

    def __init__(self, subject: Subject, moment: Moment) -> None:
        if library_digest(subject.scenario.controller) != subject.library:
            raise CampaignError(
                f"controller = {subject.scenario.controller!r}: not the library that the campaign began with, expected "
                f"the one of SHA-256 {subject.library}"
            )
        self._subject, self._moment = subject, moment
        unchanged = parse_scenario(subject.file(moment, 0), subject.name)
        self._variants = FlightVariants(unchanged, subject.design)
        self._without: dict[int, FlightData] = {}

    def fly(self, vehicle: int, fault: TriedFault | None = None, value: float = 0.0) -> Flight:
        """Fly with a fault, or without.

        Raises:
            ControllerError: The controller ended the flight.
        """
        text = self._subject.file(self._moment, vehicle, fault, value)
        return fly(self._variants.components(parse_scenario(text, self._subject.name)))

    def without(self, vehicle: int) -> FlightData:
        """Return the flight without a fault, with which the others are compared.

        Raises:
            ControllerError: The controller ended the flight.
        """
        if vehicle not in self._without:
            self._without[vehicle] = self.fly(vehicle).data()
        return self._without[vehicle]

    def outcome(self, severity: str, vehicle: int, fault: TriedFault, value: float) -> FlownFault:
        """Fly with a fault and return what became of the flight."""
        try:
            flight, without = self.fly(vehicle, fault, value), self.without(vehicle)
        except ControllerError as error:
            return FlownFault(severity, value, vehicle, False, None, None, None, None, str(error))
        survived = flight.status is FlightStatus.FINISHED
        data, start = flight.data(), self._subject.start(self._moment)
        attitude, altitude, recovery = distances(data, without, start)
        loss = None if survived else float(data.time[-1]) - start
        return FlownFault(severity, value, vehicle, survived, attitude, altitude, recovery, loss, None)

    def survives(self, fault: TriedFault, severity: float) -> bool:
        """Return whether the nominal vehicle comes to the end of its flight."""
        try:
            return self.fly(0, fault, fault.value(severity)).status is FlightStatus.FINISHED
        except ControllerError:
            return False


def distances(flight: FlightData, without: FlightData, start: float) -> tuple[float, float, float | None]:
    """Return largest distances of attitude (rad) and altitude (m), and recovery time (s), after ``start`` (s).

    Args:
        flight: Flight with the fault.
        without: The same flight without it; where either ends early, what both have is compared.
        start: Start of the fault.
    """
    rows = min(len(flight.time), len(without.time))
    after = np.flatnonzero(flight.time[:rows] >= start - 1e-9)
    apart = np.abs(flight.state[after] - without.state[after])
    attitude, altitude = apart[:, _ATTITUDE].max(axis=1), apart[:, _ALTITUDE]
    # What is no number is not within.
    outside = np.flatnonzero(~((attitude <= ATTITUDE_BAND) & (altitude <= ALTITUDE_BAND)))
    recovery: float | None = 0.0
    if len(outside):
        back = outside[-1] + 1
        recovery = float(flight.time[after[back]]) - start if back < len(after) else None
    return float(attitude.max()), float(altitude.max()), recovery


def boundary(
    survives: Callable[[float], bool], known: dict[float, bool], resolution: float, at: Callable[[float], float]
) -> Boundary:
    """Return the severities between which a controller is lost, found by bisection.

    Args:
        survives: Tells it of a severity.
        known: Known results by severity.
        resolution: Largest difference of the two.
        at: Returns the severity that is flown for one, where only some can be.
    """
    known = dict(known)
    if all(known.values()):
        known[1.0] = survives(1.0)
    if not any(not survived for survived in known.values()):
        return Boundary(1.0, None)
    lost = min(severity for severity, survived in known.items() if not survived)
    below = [severity for severity, survived in known.items() if survived and severity < lost]
    if not below:
        if lost <= 0.0 or not survives(0.0):
            return Boundary(None, 0.0)
        below = [0.0]
    survived = max(below)
    while lost - survived > resolution + 1e-9:
        middle = at(0.5 * (survived + lost))
        if survives(middle):
            survived = middle
        else:
            lost = middle
    return Boundary(survived, lost)


@lru_cache(maxsize=2)
def _campaign(text: str) -> ResilienceCampaign:
    return ResilienceCampaign.from_text(text)


@lru_cache(maxsize=_RUNNERS)
def _runner(text: str, subject: int, moment: Moment) -> SubjectRunner:
    return SubjectRunner(_campaign(text).subjects[subject], moment)


def runner_of(text: str, case: Case) -> SubjectRunner:
    """Return the runner of a case of the campaign written in ``text``; a worker process keeps the last ones."""
    names = [subject.name for subject in _campaign(text).subjects]
    return _runner(text, names.index(case.subject.name), case.moment)


def time_flight(text: str, number: int) -> bytes:
    """Fly one fault on the nominal vehicle as :func:`fly_case` does; return how long it took (s), as a text.

    Args:
        text: Text of the campaign.
        number: Number of the case times the number of severities, plus the number of the severity.
    """
    number, chosen = divmod(number, len(SEVERITIES))
    case = _campaign(text).cases[number]
    runner, fault = runner_of(text, case), TRIED[case.fault]
    with suppress(ControllerError):
        runner.without(0)  # what is built once is there then
    started = time.perf_counter()
    runner.outcome(SEVERITIES[chosen], 0, fault, fault.values[chosen])
    return repr(time.perf_counter() - started).encode()


def fly_case(text: str, number: int) -> bytes:
    """Fly a case, by its number, of the campaign written in ``text``; return its flights and boundary as JSON."""
    case = _campaign(text).cases[number]
    runner, fault = runner_of(text, case), TRIED[case.fault]
    flown = [
        runner.outcome(severity, vehicle, fault, value)
        for severity, value in zip(SEVERITIES, fault.values, strict=True)
        for vehicle in range(len(case.subject.vehicles))
    ]
    known = {fault.severity(row.value): row.survived for row in flown if row.vehicle == 0}
    found = boundary(
        lambda severity: runner.survives(fault, severity),
        known,
        fault.resolution,
        lambda severity: fault.severity(fault.value(severity)),
    )
    outcome: dict[str, Any] = {"flights": [asdict(row) for row in flown], "boundary": asdict(found)}
    return json.dumps(outcome).encode()
