"""Largest positions and rates of the actuators within a certified set, compared with their limits.

The error system is linear, so a certificate holds for actuators whose stops and rate limits no error in the set
reaches. Where they are reached it holds for the same actuators without them, and says nothing of the limited ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.units import UnitSystem, in_system
from hsv.control.design import ControlDesign
from hsv.design.hardware.plan import Plan
from hsv.design.sets.invariant_set import InvariantSet
from hsv.design.tube_problem import known_actuators
from hsv.model.actuators import SUBSTEPS, ActuatorSet, actuator_map
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS
from hsv.model.trim import trim


@dataclass(frozen=True)
class Reach:
    """Range of one actuator: position between ``lowest`` and ``highest``, magnitude of the rate up to ``rate``.

    ``stop`` and ``rate_limit`` are its own, infinite where it has none. SI.
    """

    channel: str
    lowest: float
    highest: float
    rate: float
    stop: float
    rate_limit: float

    @property
    def position(self) -> float:
        """Largest magnitude of the position."""
        return max(abs(self.lowest), abs(self.highest))

    @property
    def inactive(self) -> bool:
        """Whether no limit is reached."""
        return self.position <= self.stop and self.rate <= self.rate_limit

    def said(self, units: UnitSystem = UnitSystem.metric) -> str:
        """Return by how much each limit is reached or not, in words."""
        unit = INPUT_UNITS[INPUT_NAMES.index(self.channel)]
        words = []
        for what, value, limit, of in (
            ("position", self.position, self.stop, unit),
            ("rate", self.rate, self.rate_limit, "1/s" if unit == "1" else f"{unit}/s"),
        ):
            number, shown = in_system(value, of, units)
            named = "" if shown == "1" else f" {shown}"
            if np.isfinite(limit):
                bound = in_system(limit, of, units)[0]
                side = f"inactive by {bound - number:.3g}" if number <= bound else f"beyond it by {number - bound:.3g}"
                words.append(f"{what} up to {number:.3g} of {bound:.3g}{named}, {side}")
            else:
                words.append(f"{what} up to {number:.3g}{named}, no limit")
        return f"{self.channel}: {'; '.join(words)}"

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON, a limit that is none as ``None``."""
        numbers = {name: None if value == np.inf else value for name, value in vars(self).items()}
        return numbers | {"inactive": self.inactive}


def reaches(found: InvariantSet, design: ControlDesign, plan: Plan) -> list[Reach]:
    """Return the reach of each actuator that ``design`` knows, over the set ``found`` and along ``plan``.

    Positions and rates count on every substep on which limits act.
    """
    system, disturbance = found.problem.system, found.problem.disturbance
    flown, commands = plan.actuators(design)
    at_rest = trim(plan.subject.vehicle.decoupled, *plan.record.state[0, :2]).input
    first, result = 0, []
    for actuator in known_actuators(design):
        channel = INPUT_NAMES.index(actuator.channel)
        e_rows = [system.names.index(f"{actuator.channel}_{s}") for s in ("position", "rate")[: actuator.order]]
        low, high, rate = np.inf, -np.inf, 0.0
        for substep in range(1, SUBSTEPS + 1):
            position, turning, entering = _after(actuator, substep * design.period / SUBSTEPS)
            for weights, command, is_rate in ((position, entering[0], False), (turning, entering[1], True)):
                planned = flown[:, first : first + actuator.order] @ weights + command * commands[:, channel]
                on_e = command * system.F[channel]
                on_e[e_rows] += weights
                # Lost elevator goes the way of the command.
                on_d = command * system.F_d[channel]
                on_d[3] += command * (actuator.channel == INPUT_NAMES[1])
                middle = on_e @ found.centre + on_d @ disturbance.centre
                half = np.sqrt(on_e @ found.Q @ on_e) + np.abs(on_d) @ disturbance.half_width
                least = plan.inflation * min(planned.min(), 0.0) + middle - half
                most = plan.inflation * max(planned.max(), 0.0) + middle + half
                if is_rate:
                    rate = max(rate, -least, most)
                else:
                    low, high = min(low, least + at_rest[channel]), max(high, most + at_rest[channel])
        result.append(Reach(actuator.channel, float(low), float(high), float(rate), actuator.stop, actuator.rate_limit))
        first += actuator.order
    return result


def _after(actuator: ActuatorSet, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rows (order) from the states to position and rate after ``time`` (s), and those (2) of a command."""
    F11, F12, F21, F22 = actuator_map(actuator.order, actuator.natural_frequency, actuator.damping_ratio, time)
    if actuator.order == 1:
        turned = -actuator.natural_frequency * F11
        return np.array([F11]), np.array([turned]), np.array([1.0 - F11, -turned])
    return np.array([F11, F12]), np.array([F21, F22]), np.array([1.0 - F11, -F21])
