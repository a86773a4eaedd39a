"""An estimator of the elevator's effectiveness P in flight: set membership on the pitch channel, compiled.

It is a named extension of the paper's tube law, off by default. In every step it predicts the pitch rate over the last
period with the equations of motion of the nominal vehicle, once with the elevator that was commanded and once without
any. The difference of the two is the effect e of the elevator at full effectiveness; what the pitch rate has done
beyond the prediction without elevator is y. A vehicle of the declared uncertainty satisfies

    (1 + i) D + b = P (1 + g) e + d + v,    y = D + b,

with D the measured change of the pitch rate, b that of the nominal vehicle without elevator and opposite sign, i the
relative error of the moment of inertia, g that of the elevator's effect, d a disturbance that changes slowly, and v the
rest, at most a declared share of e. Every step thus bounds P by an interval. The disturbance is learned while the
elevator is healthy, which is when one of these intervals contains P = 1.

An interval without 1 is a fault. Two explanations are then followed, each as the intersection of what the steps leave
of it: a loss of effectiveness, y - d proportional to e, and an offset, y - d - e constant. They look alike until the
elevator moves, which the correction itself sees to. The command is divided by the middle of the interval of P as long
as a loss of effectiveness explains all steps. Where only the offset does, or nothing, it is not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.control.effectiveness_parameters import EFFECTIVENESS_ENABLED, EFFECTIVENESS_PARAMETERS
from hsv.lanes import choose
from hsv.parameters import check_all
from hsv.vehicle.dynamics import N_RIGID, N_STATES, PITCH_RATE
from hsv.vehicle.initial import INITIAL_PARAMETERS, initial_trim
from hsv.vehicle.integration import advance
from hsv.vehicle.parameters import VehicleParameters
from hsv.vehicle.vehicle import VEHICLE_PARAMETERS, Vehicle

WATCHED_PARAMETERS = (*INITIAL_PARAMETERS, *VEHICLE_PARAMETERS)
"""What the estimator must know of the flight: the nominal vehicle, and the trim in which it starts."""

CONFIRMED = 5
"""Steps that an explanation must have explained before it replaces another fault's."""


class EffectivenessMode(IntEnum):
    """What the estimator takes the elevator for."""

    HEALTHY = 0
    LOSS = 1
    """A loss of effectiveness explains all steps since the fault."""
    OTHER = 2
    """An offset explains them, a loss of effectiveness does not."""
    PENDING = 3
    """What is to replace the explanation so far has yet to explain more steps."""


_HEALTHY, _LOSS, _OTHER, _PENDING = (float(mode) for mode in EffectivenessMode)

# Rows of the memory, after the scratch of the integration.
_WITH = 3
"""State predicted with the elevator."""
_WITHOUT = 4
"""State predicted without it."""
_BEFORE = 5
"""State of the step before: measured where it is rigid, predicted where it is elastic."""
_HELD = 6
"""Input commanded in the step before."""
_KNOWN = 7
"""What is known of the elevator, in the columns that follow."""
_ROWS = 8

_ESTIMATE = 0
"""P by which the command is divided."""
_LOW = 1
_HIGH = 2
"""Interval of P that a loss of effectiveness leaves."""
_OFFSET_LOW = 3
_OFFSET_HIGH = 4
"""Interval that an offset leaves, rad/s."""
_DISTURBANCE = 5
"""d, rad/s, as learned with g = 0."""
_EFFECT = 6
"""e of the step in which it was learned, rad/s."""
_MODE = 7
"""A mode, as a number."""
_COUNT = 8
"""Steps that the explanations have explained."""

_EMPTY_LOW, _EMPTY_HIGH = 2.0, -1.0
"""Ends of an empty interval."""


class EffectivenessData(NamedTuple):
    """The estimator for compiled functions.

    The nominal ``vehicle``, the state (9) in which the flight starts, T (s), relative bounds of the moment of inertia
    and of the elevator's effect, then the parameters; ``learning`` and ``drift`` per step.
    """

    vehicle: VehicleParameters
    start: np.ndarray
    period: float
    inertia: float
    effect: float
    least: float
    bound: float
    offset: float
    learning: float
    drift: float
    noise: float
    steps: float


class Effectiveness(NamedTuple):
    """What is known of the effectiveness after a step: the value used, the interval that it lies in, and the mode."""

    estimate: float
    low: float
    high: float
    mode: EffectivenessMode

    def __str__(self) -> str:
        """Say it in words."""
        said = {
            EffectivenessMode.HEALTHY: "healthy",
            EffectivenessMode.LOSS: f"effectiveness {self.estimate:.3f}, from {self.low:.3f} to {self.high:.3f}",
            EffectivenessMode.OTHER: "faulty, not a loss of effectiveness",
            EffectivenessMode.PENDING: f"unexplained, effectiveness {self.estimate:.3f} kept",
        }
        return said[self.mode]


def effectiveness_data(values: Mapping[str, Any], period: float) -> EffectivenessData | None:
    """Return the estimator that the flat parameters ``values`` describe, for a control ``period`` (s), if one does.

    Raises:
        ParameterError, TrimError: A wrong value, named.
    """
    v = check_all(EFFECTIVENESS_PARAMETERS, values)
    if not v[EFFECTIVENESS_ENABLED.name]:
        return None
    nominal, start = initial_trim(values)
    bounds = Vehicle.from_parameters(values).uncertainty
    effect = 1.0
    for name in ("moment_elevator", "reference_area", "mean_aerodynamic_chord"):
        effect *= 1.0 + bounds.get(name, 0.0)
    return EffectivenessData(
        vehicle=nominal,
        start=start.state.copy(),
        period=period,
        inertia=bounds.get("moment_of_inertia", 0.0),
        effect=min(effect - 1.0, 0.9),
        least=v["effectiveness.least"],
        bound=v["effectiveness.bound"],
        offset=v["effectiveness.offset"],
        learning=min(period / v["effectiveness.time"], 1.0),
        drift=v["effectiveness.drift"] * period,
        noise=v["effectiveness.noise"],
        steps=v["effectiveness.steps"],
    )


def effectiveness_shape(data: EffectivenessData | None) -> tuple[int, int]:
    """Return the shape of the memory of :func:`effectiveness_step`; without an estimator there is none."""
    return (_ROWS if data else 0, N_STATES)


def effectiveness_in(memory: np.ndarray) -> Effectiveness:
    """Return what the ``memory`` of :func:`effectiveness_step` says after a step."""
    row = memory[_KNOWN]
    mode = EffectivenessMode(int(row[_MODE]))
    return Effectiveness(float(row[_ESTIMATE]), float(row[_LOW]), float(row[_HIGH]), mode)


@njit_in_flight()
def _begin(data: Any, memory: Any) -> None:
    for i in range(N_STATES):
        memory[_BEFORE, i] = data.start[i]
        memory[_KNOWN, i] = 0.0
    for column in (_ESTIMATE, _LOW, _HIGH):
        memory[_KNOWN, column] = 1.0


@njit_in_flight()
def effectiveness_bounds(data: Any, y: Any, e: Any, turn: Any, disturbance: Any, effect: Any) -> Any:
    """Return the interval of P that a step leaves, before it is cut to the range of P, and that of an offset (rad/s).

    Args:
        data: :class:`EffectivenessData`.
        y: Change of the pitch rate beyond that without elevator, rad/s.
        e: That of the elevator at full effectiveness, rad/s, not zero.
        turn: Measured change of the pitch rate, rad/s.
        disturbance: d as learned with g = 0, rad/s.
        effect: e of the step in which it was learned, rad/s: with another g it is d - g e.
    """
    g = data.effect
    known = y - disturbance
    margin = data.bound * abs(e) + data.inertia * abs(turn) + data.noise
    strong = (known + g * effect) / ((1.0 + g) * e)
    weak = (known - g * effect) / ((1.0 - g) * e)
    reach = margin / ((1.0 - g) * abs(e))
    offset = known - e
    wide = margin + g * abs(e - effect)
    return min(strong, weak) - reach, max(strong, weak) + reach, offset - wide, offset + wide


@njit_in_flight()
def _limited(value: Any, most: Any) -> Any:
    return min(max(value, -most), most)


@njit_in_flight()
def _kept(holds: Any, low: Any, high: Any) -> Any:
    """Return the interval where it ``holds``, elsewhere an empty one, which no widening brings back."""
    return choose(holds, low, _EMPTY_LOW), choose(holds, high, _EMPTY_HIGH)


@njit_in_flight()
def _in_range(data: Any, low: Any, high: Any) -> Any:
    """Return an interval cut to the range of P, below which it is no loss that a division could make up for."""
    return _kept(high >= data.least, min(max(low, data.least), 1.0), min(high, 1.0))


@njit_in_flight()
def _mode_after(mode: Any, loss: Any, whole: Any, sound: Any, waiting: Any) -> Any:
    """Return the mode after a step.

    Args:
        mode: That before it.
        loss: Whether a loss explains the steps; if not, an offset does, which can always explain the last one alone.
        whole: Whether the interval of P contains 1.
        sound: Whether that of the step alone does.
        waiting: Whether there are too few steps to tell.
    """
    explained = choose(loss, choose(whole, _HEALTHY, _LOSS), _OTHER)
    return choose((mode == _HEALTHY) & sound, _HEALTHY, choose(waiting, _PENDING, explained))


@njit_in_flight()
def _store(known: Any, usable: Any, column: int, value: Any) -> None:
    known[column] = choose(usable, value, known[column])


@njit_in_flight()
def _judge(data: Any, known: Any, usable: Any, first: bool, y: Any, e: Any, turn: Any) -> None:
    """Bring the row ``known`` (9) of the memory up to what a step says, where it is ``usable``."""
    mode = known[_MODE]
    healthy = mode == _HEALTHY
    # The flight begins healthy: what is off then is a disturbance, as far as one is admitted.
    most = data.offset * abs(e)
    disturbance = choose(healthy & first, _limited(y - e, most), known[_DISTURBANCE])
    effect = choose(healthy, e, known[_EFFECT])

    # What this step says alone, and what it leaves of the steps before.
    bounds = effectiveness_bounds(data, y, e, turn, disturbance, effect)
    step_low, step_high = _in_range(data, bounds[0], bounds[1])
    low = max(max(known[_LOW] - data.drift, data.least), step_low)
    high = min(min(known[_HIGH] + data.drift, 1.0), step_high)
    widened = data.drift * abs(e)
    offset_low = max(known[_OFFSET_LOW] - widened, bounds[2])
    offset_high = min(known[_OFFSET_HIGH] + widened, bounds[3])

    # While healthy, and where nothing explains the steps, everything begins with this one.
    begun = healthy | ((low > high) & (offset_low > offset_high))
    low, high = choose(begun, step_low, low), choose(begun, step_high, high)
    offset_low, offset_high = choose(begun, bounds[2], offset_low), choose(begun, bounds[3], offset_high)
    # A first fault is confirmed sooner than what replaces another.
    begin = choose(healthy, CONFIRMED + 1.0 - data.steps, 1.0)
    count = choose(begun, begin, known[_COUNT] + 1.0)

    loss = low <= high
    waiting = (begun | (mode == _PENDING)) & (count < CONFIRMED)
    new = _mode_after(mode, loss, high >= 1.0, step_high >= 1.0, waiting)
    middle = 0.5 * (low + high)
    estimate = choose(new == _PENDING, known[_ESTIMATE], choose(new == _LOSS, middle, 1.0))

    # What is farther off than the bound is no disturbance, whatever it is.
    learned = disturbance + data.learning * _limited(y - e - disturbance, data.bound * abs(e))
    disturbance = choose(healthy & (new == _HEALTHY), _limited(learned, most), disturbance)
    low, high = _kept(loss, low, high)
    offset_low, offset_high = _kept(offset_low <= offset_high, offset_low, offset_high)
    _store(known, usable, _ESTIMATE, estimate)
    _store(known, usable, _LOW, low)
    _store(known, usable, _HIGH, high)
    _store(known, usable, _OFFSET_LOW, offset_low)
    _store(known, usable, _OFFSET_HIGH, offset_high)
    _store(known, usable, _DISTURBANCE, disturbance)
    _store(known, usable, _EFFECT, choose(new == _HEALTHY, e, known[_EFFECT]))
    _store(known, usable, _MODE, new)
    _store(known, usable, _COUNT, count)


@njit_in_flight()
def effectiveness_step(data: Any, memory: Any, step: int, x: Any) -> Any:
    """Return the effectiveness by which the elevator command of ``step`` is divided, 1 where there is no estimator.

    A step whose measurement is not a number, or in which the elevator has no effect, changes nothing.

    Args:
        data: :class:`EffectivenessData`, or None.
        memory: (8, 9), see :func:`effectiveness_shape`; begun in step 0.
        step: k.
        x: Measured state (9); the elastic states are predicted.
    """
    if data is None:
        return 1.0
    if step == 0:
        _begin(data, memory)
    else:
        with_elevator, without, held, known = memory[_WITH], memory[_WITHOUT], memory[_HELD], memory[_KNOWN]
        for i in range(N_STATES):
            with_elevator[i] = memory[_BEFORE, i]
            without[i] = memory[_BEFORE, i]
        advance(with_elevator, held, data.vehicle, data.period, 1, memory)
        held[1] = 0.0
        advance(without, held, data.vehicle, data.period, 1, memory)
        y = x[PITCH_RATE] - without[PITCH_RATE]
        e = with_elevator[PITCH_RATE] - without[PITCH_RATE]
        turn = x[PITCH_RATE] - memory[_BEFORE, PITCH_RATE]
        # The margin of an elevator without effect is infinite; so small an effect is none.
        usable = math.isfinite(y) & math.isfinite(e) & (abs(e) > 1e-9)
        _judge(
            data,
            known,
            usable,
            step == 1,
            choose(usable, y, 1.0),
            choose(usable, e, 1.0),
            choose(usable, turn, 0.0),
        )
        # What the elastic modes have felt is known before it is confirmed.
        unsure = (known[_MODE] == _PENDING) & (known[_LOW] <= known[_HIGH])
        felt = choose(unsure, 0.5 * (known[_LOW] + known[_HIGH]), known[_ESTIMATE])
        for i in range(N_RIGID, N_STATES):
            predicted = without[i] + felt * (with_elevator[i] - without[i])
            memory[_BEFORE, i] = choose(math.isfinite(predicted), predicted, memory[_BEFORE, i])
    for i in range(N_RIGID):
        memory[_BEFORE, i] = x[i]
    return memory[_KNOWN, _ESTIMATE]


@njit_in_flight()
def effectiveness_hold(data: Any, memory: Any, u: Any) -> None:
    """Keep the commanded input ``u`` (2) of a step for the next one; without an estimator nothing is done."""
    if data is None:
        return
    for i in range(len(u)):
        memory[_HELD, i] = u[i]


def effectiveness_along(data: EffectivenessData, states: np.ndarray, inputs: np.ndarray) -> list[Effectiveness]:
    """Return what the estimator knows after each step of a flight, from what it was given.

    Args:
        data: The estimator.
        states: Measured or estimated states (steps, 9).
        inputs: Commanded inputs (steps, 2).
    """
    memory = np.zeros(effectiveness_shape(data))
    known = []
    for step, (x, u) in enumerate(zip(states, inputs, strict=True)):
        effectiveness_step(data, memory, step, x)
        effectiveness_hold(data, memory, u)
        known.append(effectiveness_in(memory))
    return known
