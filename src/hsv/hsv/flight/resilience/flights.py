"""Flights of a resilience campaign: a case flies all severities on all vehicles, and a bisection on the nominal one."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import cache, lru_cache

import numpy as np

from hsv.base.errors import ControllerError
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.closed_loop import fly
from hsv.flight.flight import Flight
from hsv.flight.metrics import FlightData
from hsv.flight.resilience.campaign import ResilienceCampaign, Subject
from hsv.flight.resilience.faults import SEVERITIES, TRIED, Moment, TriedFault
from hsv.flight.scenario import parse_scenario
from hsv.model.plant import FlightStatus

ATTITUDE_BAND, ALTITUDE_BAND = np.deg2rad(0.5), 30.0 * 0.3048
"""Maximum deviations (rad, m) from the flight without the fault at which a flight counts as recovered."""

_RUNNERS = 16
"""Number of runners that a worker process keeps: those of eight controllers, with two times of occurrence each"""

_ALTITUDE, _ATTITUDE = 0, slice(2, 4)
"""Indices in the state vector: altitude; angle of attack and pitch angle."""


@dataclass(frozen=True)
class FlownFault:
    """The result of a flight with a fault; deviations are from the flight of the same vehicle without the fault."""

    severity: str
    """One of :data:`SEVERITIES`"""
    value: float
    """Value of the parameter that is the severity, in :attr:`TriedFault.unit`"""
    vehicle: int
    """Index of the vehicle; 0 is the nominal one"""
    survived: bool
    """Whether the flight reached its end within the range of the model"""
    attitude: float | None
    """Largest deviation of angle of attack or pitch angle after the fault, rad; None if the controller crashed"""
    altitude: float | None
    """Largest deviation of altitude after the fault, m; None if the controller crashed"""
    recovery_time: float | None
    """Time from the start of the fault until the deviations stay within the bands, s; None if they do not"""
    time_to_loss: float | None
    """Time from the start of the fault to the loss of the flight, s; None if not lost or the controller crashed"""
    crashed: str | None
    """Error of the controller if it crashed, otherwise None"""


@dataclass(frozen=True)
class Boundary:
    """The severities (0 to 1) of a fault between which the loss of the nominal vehicle begins, found by bisection.

    ``lost`` is the smallest severity that was lost, None if all flown severities were survived. ``survived`` is the
    largest severity below it that was survived, None if even 0 was lost; larger ones that were survived do not count.
    """

    survived: float | None
    lost: float | None


class SubjectRunner:
    """Flies one controller with faults at one time of occurrence; shared components are built once."""

    def __init__(self, subject: Subject, moment: Moment) -> None:
        self._subject, self._moment = subject, moment
        unchanged = parse_scenario(subject.file(moment, 0), subject.name)
        self._variants = FlightVariants(unchanged, subject.design, subject.library)
        self._without = cache(self.fly)

    def fly(self, vehicle: int, fault: TriedFault | None = None, value: float = 0.0) -> Flight:
        """Fly the vehicle with this index, without fault or with a ``fault`` whose severity parameter is ``value``."""
        text = self._subject.file(self._moment, vehicle, fault, value)
        return fly(self._variants.components(parse_scenario(text, self._subject.name)))

    def outcome(self, severity: str, vehicle: int, fault: TriedFault, value: float) -> FlownFault:
        """Fly a vehicle with a fault and return the result; ``severity`` is one of :data:`SEVERITIES`."""
        try:
            flight, without = self.fly(vehicle, fault, value), self._without(vehicle)
        except ControllerError as error:
            return FlownFault(severity, value, vehicle, False, None, None, None, None, str(error))
        survived = flight.status is FlightStatus.FINISHED
        start = self._subject.start(self._moment)
        attitude, altitude, recovery = distances(flight, without, start)
        loss = None if survived else float(flight.time[-1]) - start
        return FlownFault(severity, value, vehicle, survived, attitude, altitude, recovery, loss, None)


def distances(flight: FlightData, without: FlightData, start: float) -> tuple[float, float, float | None]:
    """Return the largest deviations of attitude (rad) and altitude (m), and the recovery time (s; None: no recovery).

    ``flight`` is compared from ``start`` (s), the start of the fault, with the flight ``without`` the fault. If one of
    them ends early, the common steps are compared.
    """
    rows = min(len(flight.time), len(without.time))
    after = np.flatnonzero(flight.time[:rows] >= start - 1e-9)
    apart = np.abs(flight.history.state[after] - without.history.state[after])
    attitude, altitude = apart[:, _ATTITUDE].max(axis=1), apart[:, _ALTITUDE]
    # NaN counts as outside.
    outside = np.flatnonzero(~((attitude <= ATTITUDE_BAND) & (altitude <= ALTITUDE_BAND)))
    recovery: float | None = 0.0
    if len(outside):
        back = outside[-1] + 1
        recovery = float(flight.time[after[back]]) - start if back < len(after) else None
    return float(attitude.max()), float(altitude.max()), recovery


def boundary(fault: TriedFault, survives: Callable[[float], bool], known: Mapping[float, bool]) -> Boundary:
    """Return a survived and a lost severity by bisection; (1, None) if none is lost, (None, 0) if even 0 is lost.

    ``survives`` flies with a severity and returns whether the flight survives; ``known`` has the results so far.
    """
    lost = min((severity for severity, survived in known.items() if not survived), default=1.0)
    if all(known.values()) and survives(1.0):
        return Boundary(1.0, None)
    survived = max((severity for severity, survived in known.items() if survived and severity < lost), default=-1.0)
    if survived < 0.0:
        if lost <= 0.0 or not survives(0.0):
            return Boundary(None, 0.0)
        survived = 0.0
    while lost - survived > fault.resolution + 1e-9:
        # Some parameters are integers.
        middle = fault.severity(fault.value(0.5 * (survived + lost)))
        if survives(middle):
            survived = middle
        else:
            lost = middle
    return Boundary(survived, lost)


_campaign = lru_cache(maxsize=1)(ResilienceCampaign.from_text)
_runner = lru_cache(maxsize=_RUNNERS)(SubjectRunner)


def fly_case(text: str, number: int) -> bytes:
    """Fly the case with this ``number`` in the campaign ``text``; return its flights and its boundary as JSON."""
    case = _campaign(text).cases[number]
    runner, fault = _runner(case.subject, case.moment), TRIED[case.fault]
    flown = [
        runner.outcome(severity, vehicle, fault, value)
        for severity, value in zip(SEVERITIES, fault.values, strict=True)
        for vehicle in range(len(case.subject.vehicles))
    ]
    known = {fault.severity(row.value): row.survived for row in flown if row.vehicle == 0}
    found = boundary(fault, lambda severity: runner.outcome("", 0, fault, fault.value(severity)).survived, known)
    return json.dumps({"flights": [asdict(row) for row in flown], "boundary": asdict(found)}).encode()
