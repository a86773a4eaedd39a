"""Margins of a loop: disk margin (proved by a pencil), gain, phase and delay margins, structured for both inputs.

The disk margin is alpha = 1 / max |S - 1/2|, the symmetric one (skew 0) of Seiler, Packard and Gahinet, IEEE Control
Systems 40(5), 2020. Gains from (1 - alpha/2) / (1 + alpha/2) to its inverse, and phases up to 2 atan(alpha/2), leave
the loop stable, also both at a time. With both inputs, each may change on its own: max |S - 1/2| is the structured
singular value mu of two channels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import atan, inf, nan, pi
from typing import Any

import numpy as np
from scipy.linalg import eigvals
from scipy.optimize import brentq, minimize_scalar

from hsv.certificate.loops import INPUTS, MEASUREMENTS, BrokenLoop, Feedback, Hardware, SampledLoop
from hsv.control.design import ControlDesign
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.dynamics import VehicleParameters
from hsv.model.vehicle import Vehicle

SLACK = 1e-6
"""Relative amount by which a proved disk margin is below the one attained at the stated frequency."""

ON_CIRCLE = 1e-9
"""Distance from the unit circle up to which an eigenvalue of the pencil counts as one on it."""

SLOW = Hardware((ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS["elevator_50"]), 0.02)
"""Hardware of the case "slow" of a certificate: fuel valve of 10 rad/s, elevator of 50 rad/s, 20 ms more delay."""

CASES = ("designed", "slow")

_REFINED = np.linspace(0.0, 1.0, 13)


@dataclass(frozen=True)
class DiskMargin:
    """A disk margin: ``margin`` is proved, ``attained`` is reached by a perturbation at ``frequency`` (rad/s).

    The two differ by :data:`SLACK`, or, with both inputs, by what one constant ``scaling`` of the channels costs. An
    unstable loop has the margin 0 and the frequency 0.
    """

    margin: float
    attained: float
    frequency: float
    scaling: float = 1.0

    @property
    def gain(self) -> float:
        """The guaranteed factor of the gain, up; its inverse is the guaranteed factor down."""
        return guaranteed(self.margin)[0]

    @property
    def phase(self) -> float:
        """The guaranteed phase, rad."""
        return guaranteed(self.margin)[1]


UNSTABLE = DiskMargin(0.0, 0.0, 0.0)


def guaranteed(margin: float) -> tuple[float, float]:
    """Return the factor of the gain and the phase (rad) that a disk margin guarantees."""
    return ((2.0 + margin) / (2.0 - margin) if margin < 2.0 else inf), 2.0 * atan(0.5 * margin)


@dataclass(frozen=True)
class ClassicalMargins:
    """Margins of a single loop: factors of the gain up and down (infinity and 0: none), phase (rad), delay (s).

    ``phase_crossover`` and ``gain_crossover`` (rad/s) are the frequencies of the upper gain margin and of the phase
    margin, NaN if there is none; ``gain_crossover`` is that of unit gain with the smallest phase margin.
    """

    gain_up: float
    gain_down: float
    phase: float
    delay: float
    gain_crossover: float
    phase_crossover: float


def grid(period: float, count: int = 540) -> np.ndarray:
    """Return frequencies (rad/s) from 0.01 to nearly the Nyquist frequency, closest where elastic modes lie."""
    top = 0.9999 * pi / period
    parts = (
        np.geomspace(0.01, 10.0, count // 2),
        np.linspace(10.0, 25.0, count // 3),
        np.geomspace(25.0, top, count // 6),
    )
    return np.unique(np.concatenate(parts).clip(max=top))


def mu(M: np.ndarray) -> np.ndarray:
    """Return the structured singular value of ``M`` (..., m, m) for m = 1 or 2 independent complex channels.

    For two channels, mu is the minimum over all scalings of one channel of the largest singular value. A scaling does
    not change the determinant, and it minimises the sum of the squared entries if both off-diagonal entries are equal.
    """
    if M.shape[-1] == 1:
        return np.abs(M[..., 0, 0])
    a, b, c, d = M[..., 0, 0], M[..., 0, 1], M[..., 1, 0], M[..., 1, 1]
    total = np.abs(a) ** 2 + np.abs(d) ** 2 + 2.0 * np.abs(b) * np.abs(c)
    return np.asarray(np.sqrt(0.5 * (total + np.sqrt(np.maximum(total**2 - 4.0 * np.abs(a * d - b * c) ** 2, 0.0)))))


def destabilising(M: np.ndarray) -> float:
    """Return the reciprocal size of a diagonal perturbation found by search for which I - M Delta is singular.

    ``M`` (m, m) is complex, m = 1 or 2. Both channels are perturbed by equal amounts; the relative phase is searched,
    and the eigenvalue of largest magnitude gives size and common phase. This is a lower bound of :func:`mu`.
    """
    if len(M) == 1:
        return float(np.abs(M[0, 0]))

    def radius(phase: float) -> float:
        return float(np.abs(np.linalg.eigvals(M * [1.0, np.exp(1j * phase)])).max())

    phases = np.linspace(0.0, 2.0 * pi, 33)
    best = phases[np.argmax([radius(phase) for phase in phases])]
    step = phases[1]
    found = minimize_scalar(lambda phase: -radius(phase), bounds=(best - step, best + step), method="bounded")
    return max(float(-found.fun), radius(float(best)))


def search(loop: BrokenLoop, frequencies: np.ndarray) -> tuple[float, float]:
    """Return the attained disk margin and its frequency (rad/s), by a search from ``frequencies``; zeros: unstable.

    The largest value on the grid is refined between its neighbours, then evaluated by a linear system.
    """
    if loop.growth >= 0.0:
        return 0.0, 0.0
    half = 0.5 * np.eye(len(loop.C))
    w = frequencies
    for _ in range(6):
        values = mu(loop.sensitivity(w) - half)
        i = int(np.argmax(values))
        peak, low, high = float(w[i]), w[max(i - 1, 0)], w[min(i + 1, len(w) - 1)]
        w = low + (high - low) * _REFINED
    return 1.0 / destabilising(loop.sensitivity_at(peak) - half), peak


def crossings(loop: BrokenLoop, margin: float, scaling: float = 1.0) -> np.ndarray:
    """Return the frequencies (rad/s) at which a singular value of S - 1/2 equals 1 / ``margin``; empty: none.

    They are the eigenvalues on the unit circle of the symplectic pencil of G = S - 1/2, a discrete-time version of the
    test of Boyd, Balakrishnan and Kabamba. If the loop is stable and there are none, and S - 1/2 is smaller at one
    frequency, then 1 / ``margin`` bounds it at all frequencies; no grid is involved. ``scaling`` multiplies the first
    of two channels. The pencil is that of

        z x = A x + B w,    mu = z (A' mu + C' (C x + D w)),    gamma^2 w = D' (C x + D w) + B' mu,    D = I/2.
    """
    A, gamma = loop.A, 1.0 / margin
    n, m = len(A), len(loop.C)
    channels = np.array([scaling, 1.0])[-m:]
    # States scaled by the reachable covariance of a period-by-period impulse: the pencil is then well conditioned.
    size = np.sqrt(_diagonal_gramian(A, loop.B) + 1e-300)
    A, B, C = A * size / size[:, None], loop.B / size[:, None] / channels, loop.C * size * channels[:, None]
    B, C, D = B / np.sqrt(gamma), C / np.sqrt(gamma), 0.5 * np.eye(m) / gamma
    left, right = np.zeros((2 * n + m, 2 * n + m)), np.zeros((2 * n + m, 2 * n + m))
    left[:n, :n], left[n : 2 * n, :n], left[n : 2 * n, n : 2 * n] = np.eye(n), C.T @ C, A.T
    left[n : 2 * n, 2 * n :] = C.T @ D
    right[:n, :n], right[:n, 2 * n :], right[n : 2 * n, n : 2 * n] = A, B, np.eye(n)
    right[2 * n :, :n], right[2 * n :, n : 2 * n], right[2 * n :, 2 * n :] = D.T @ C, B.T, D.T @ D - np.eye(m)
    found = eigvals(right, left)
    found = found[np.isfinite(found)]
    on = found[np.abs(np.abs(found) - 1.0) < ON_CIRCLE]
    return np.unique(np.abs(np.angle(on))) / loop.period


def _diagonal_gramian(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Return the diagonal (n) of the sum of A^k B B' A'^k, by doubling; entries that B does not reach are 1."""
    X, P = A, B @ B.T
    for _ in range(14):
        P = P + X @ P @ X.T
        X = X @ X
    found = np.diag(P).copy()
    found[~(found > 0.0)] = 1.0
    return found


def is_proved(loop: BrokenLoop, margin: float, scaling: float = 1.0) -> bool:
    """Return whether the pencil proves the disk margin ``margin`` of a loop, with ``scaling`` for two channels."""
    if not margin > 0.0 or loop.growth >= 0.0:
        return False
    half, channels = 0.5 * np.eye(len(loop.C)), np.array([scaling, 1.0])[-len(loop.C) :]
    at = (loop.sensitivity_at(1.0) - half) * channels[:, None] / channels
    return bool(np.linalg.norm(at, 2) < 1.0 / margin) and not len(crossings(loop, margin, scaling))


def disk_margin(loop: BrokenLoop, frequencies: np.ndarray | None = None) -> DiskMargin:
    """Return the proved disk margin of a loop broken at a signal, or at both inputs.

    The search gives a frequency; the pencil proves that no other is worse. Where it finds one, the search goes on from
    there, so that a peak between the points of the grid is not missed.
    """
    w = grid(loop.period) if frequencies is None else frequencies
    attained, frequency = search(loop, w)
    if not attained:
        return UNSTABLE
    if len(loop.C) == 2:
        return _structured(loop, w, attained, frequency)
    for _ in range(8):
        between = crossings(loop, attained * (1.0 - SLACK))
        if not len(between):
            return DiskMargin(attained * (1.0 - SLACK), attained, frequency)
        middle = np.sort(np.concatenate((between, 0.5 * (between[1:] + between[:-1]), [frequency])))
        attained, frequency = min((attained, frequency), search(loop, middle))
    return DiskMargin(0.0, attained, frequency)


def _structured(loop: BrokenLoop, frequencies: np.ndarray, attained: float, frequency: float) -> DiskMargin:
    """Return the disk margin of two inputs at once: proved by the best constant scaling, attained by search."""
    half = 0.5 * np.eye(2)
    w = np.unique(np.append(frequencies, frequency * np.linspace(0.9, 1.1, 81)))
    M = loop.sensitivity(w) - half

    def largest(exponent: float) -> float:
        return float(mu_scaled(M, np.exp(exponent)).max())

    at = M[np.searchsorted(w, frequency)]
    start = 0.5 * np.log(np.abs(at[1, 0]) / np.abs(at[0, 1]))
    found = minimize_scalar(largest, bounds=(start - 2.0, start + 2.0), method="bounded", options={"xatol": 1e-4})
    scaling, margin = float(np.exp(found.x)), 1.0 / float(found.fun)
    for _ in range(12):
        if is_proved(loop, margin := margin * (1.0 - SLACK), scaling):
            return DiskMargin(margin, attained, frequency, scaling)
        margin *= 1.0 - 1e-4
    return DiskMargin(0.0, attained, frequency, scaling)


def mu_scaled(M: np.ndarray, scaling: float) -> np.ndarray:
    """Return the largest singular value of ``M`` (..., 2, 2) with ``scaling`` of the first channel: a bound of mu."""
    return np.asarray(np.linalg.norm(M * np.array([[1.0, scaling], [1.0 / scaling, 1.0]]), 2, axis=(-2, -1)))


def classical_margins(loop: BrokenLoop) -> ClassicalMargins:
    """Return gain, phase and delay margins of a single stable loop; the limits of each are refined between grid points.

    The upper gain margin of a discrete loop may lie at the Nyquist frequency, the lower one at frequency zero.
    """
    w = grid(loop.period, 2400)
    L, response = 1.0 / loop.sensitivity(w)[:, 0, 0] - 1.0, loop.transfer
    real = [(f, response(f)) for f in (0.0, *_roots(lambda f: response(f).imag, w, L.imag), pi / loop.period)]
    factors = [(1.0 / abs(value), f) for f, value in real if value.real < 0.0 and np.isfinite(value)]
    up, at_up = min((each for each in factors if each[0] > 1.0), default=(inf, nan))
    down = max((factor for factor, _ in factors if factor < 1.0), default=0.0)
    unit = crossovers(loop, w)
    phase, at_phase = min(((min(lag, 2.0 * pi - lag), f) for f, lag in unit), default=(inf, nan))
    delay = min((lag / f for f, lag in unit), default=inf)
    return ClassicalMargins(up, down, float(phase), float(delay), at_phase, at_up)


def crossovers(loop: BrokenLoop, frequencies: np.ndarray) -> list[tuple[float, float]]:
    """Return the frequencies (rad/s) of unit loop gain, with the phase lag (rad, 0 to 2 pi) that leads from L to -1."""
    values = np.log(np.abs(1.0 / loop.sensitivity(frequencies)[:, 0, 0] - 1.0))
    unit = _roots(lambda f: float(np.log(abs(loop.transfer(f)))), frequencies, values)
    return [(f, float(np.angle(loop.transfer(f))) + pi) for f in unit]


def _roots(function: Callable[[float], float], at: np.ndarray, values: np.ndarray) -> list[float]:
    signs = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0.0)
    return [
        float(brentq(function, at[i], at[i + 1], xtol=1e-12))
        for i in signs.tolist()
        if function(at[i]) * function(at[i + 1]) < 0.0
    ]


@dataclass(frozen=True)
class LoopMargins:
    """The margins of the loop ``name`` over several vertices or places: the smallest of each kind.

    ``each`` has the disk margin by vertex or place, ``where`` is that of the smallest. ``classical`` is None for two
    inputs at once, and if a loop is unstable.
    """

    name: str
    disk: DiskMargin
    where: str
    each: dict[str, float]
    classical: ClassicalMargins | None


def margins_of(loops: Mapping[str, SampledLoop]) -> list[LoopMargins]:
    """Return the margins over ``loops``, by name of vertex or place, of all inputs, then of all measurements."""
    found = []
    for name in (*INPUTS, *MEASUREMENTS):
        broken = {where: loop.broken(name) for where, loop in loops.items()}
        disks = {where: disk_margin(loop) for where, loop in broken.items()}
        where = min(disks, key=lambda at: disks[at].margin)
        single = name != "both" and disks[where].margin > 0.0
        classical = _smallest([classical_margins(loop) for loop in broken.values()]) if single else None
        found.append(LoopMargins(name, disks[where], where, {at: d.margin for at, d in disks.items()}, classical))
    return found


def _smallest(found: Sequence[ClassicalMargins]) -> ClassicalMargins:
    by_gain, by_phase = min(found, key=lambda each: each.gain_up), min(found, key=lambda each: each.phase)
    down, delay = max(each.gain_down for each in found), min(each.delay for each in found)
    crossovers = by_phase.gain_crossover, by_gain.phase_crossover
    return ClassicalMargins(by_gain.gain_up, down, by_phase.phase, delay, *crossovers)


@dataclass(frozen=True)
class Place:
    """A trim point, altitude (m) and velocity (m/s), and the effectiveness of the elevator there."""

    point: tuple[float, float]
    effectiveness: float = 1.0


@dataclass(frozen=True)
class WorstCorner:
    """The smallest disk margin of a loop over the corners of a vehicle's bounds, by search.

    ``corner`` has a sign for each uncertain parameter and is empty for the nominal vehicle; ``place`` is a name.
    ``unstable`` counts the vehicles of all ``count`` whose loop is unstable at a place.
    """

    margin: float
    frequency: float
    corner: str
    place: str
    unstable: int
    count: int


@dataclass(frozen=True)
class VehicleLoops:
    """The loops of a ``feedback`` around a vehicle at named ``places``; of the nominal vehicle or at a corner.

    ``bounds`` are those of the relative changes of the parameters; ``own`` changes those of the nominal vehicle.
    """

    feedback: Feedback
    vehicle: VehicleParameters
    bounds: Mapping[str, float]
    places: Mapping[str, Place]
    own: Mapping[str, float] = field(default_factory=dict)

    def corners(self) -> list[str]:
        """Return the nominal vehicle (an empty text), then all corners of the bounds as signs of the parameters."""
        return ["", *map("".join, product("-+", repeat=len(self.bounds)))]

    def at(self, names: Sequence[str]) -> VehicleLoops:
        """Return the loops at those places that have one of the ``names``."""
        return replace(self, places={name: place for name, place in self.places.items() if name in names})

    def changes(self, corner: str) -> dict[str, float]:
        """Return the relative changes of the vehicle's parameters at a ``corner``, by name."""
        if not corner:
            return dict(self.own)
        return {
            name: float(f"{sign}1") * bound for sign, (name, bound) in zip(corner, self.bounds.items(), strict=True)
        }

    def loop(self, corner: str, place: str) -> SampledLoop:
        """Return the loop around the vehicle of a ``corner`` at a ``place``."""
        at = self.places[place]
        return self.feedback.around(self.vehicle.perturbed(self.changes(corner)), at.point, at.effectiveness)

    def worst(
        self, name: str, corners: Sequence[str], progress: Callable[[int, int], None] = lambda done, total: None
    ) -> WorstCorner:
        """Return the smallest disk margin of the loop broken at ``name`` over ``corners`` and all places.

        On Ctrl-C, the corners that are done make the result; its ``count`` says how many.
        """
        frequencies, found = grid(self.feedback.period), []
        try:
            for done, corner in enumerate(corners, start=1):
                each = [(*search(self.loop(corner, at).broken(name), frequencies), corner, at) for at in self.places]
                found.append(min(each))
                progress(done, len(corners))
        except KeyboardInterrupt:
            if not found:
                raise
        margin, frequency, corner, place = min(found)
        return WorstCorner(margin, frequency, corner, place, sum(each[0] == 0.0 for each in found), len(found))


def design_loops(design: ControlDesign, vehicle: Vehicle, inputs: Mapping[str, Any], case: str) -> VehicleLoops:
    """Return the loops of a design around the coupled vehicle, at start and target of its ``inputs`` (a table in SI).

    The place "fault" is the target after the declared loss of elevator effectiveness. The ``case`` is "designed", the
    actuators of the design, or "slow", those of :data:`SLOW`.
    """
    start, target = (
        (inputs["nominal"][end]["altitude"], inputs["nominal"][end]["velocity"]) for end in ("start", "target")
    )
    faulty = inputs["disturbance"]["elevator_effectiveness"]
    places = {"start": Place(start), "target": Place(target), "fault": Place(target, faulty)}
    hardware = SLOW if case == "slow" else Hardware(design.actuator_sets)
    coupled = vehicle.coupled(design.coupling)
    return VehicleLoops(Feedback.of(design, hardware=hardware), coupled, vehicle.uncertainty, places)
