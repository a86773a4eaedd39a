"""Flights that differ little, several at a time in the lanes of a register: each with the bits that it has alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from hsv import core
from hsv.base.processes import over_threads
from hsv.control.tube_law import TubeLaw
from hsv.core import Struct, doubles, lanes, lib, vector
from hsv.flight.closed_loop import Components, flight_struct, fly, is_ideal
from hsv.flight.flight import Flight, flight_of
from hsv.flight.history import History
from hsv.flight.metrics import FlightData
from hsv.model.faults.table import ENGINE_SIDE

Result = TypeVar("Result")


class FlightGroup:
    """A group of up to :func:`hsv.core.lanes` simultaneous flights, simulated in pieces, with their memory."""

    def __init__(self, rows: int) -> None:
        """Allocate memory for pieces of at most ``rows`` steps."""
        self.lanes = lanes()
        self.history = History.over(np.empty((self.lanes, rows * History.numbers())), rows)
        self._memory = core.loop_memory(self.lanes)
        self._flights: list[Struct] = []

    @staticmethod
    def takes(components: Sequence[Components]) -> bool:
        """Return whether flights can be flown side by side.

        They can where all blocks are the core's own, and nothing differs but vehicle, seed, beginning, faults,
        reference, gains, and the numbers of sensors, links and air.
        """
        if not 1 < len(components) <= lanes() or not all(map(_of_the_core, components)):
            return False
        first, *others = map(_shared, components)
        return all(_same(first, other) for other in others)

    def begin(self, components: Sequence[Components], rows: int, tube_set: Struct | None = None) -> None:
        """Prepare the flights of ``components`` with ``rows`` steps; spare lanes repeat the last flight.

        ``tube_set``: the invariant set whose level is computed, if any.
        """
        full = [*components, *[components[-1]] * (self.lanes - len(components))]
        estimated = not is_ideal(full[0])
        self._flights = [
            flight_struct(own, self.lane(i, estimated=estimated), ended=rows, set=tube_set)
            for i, own in enumerate(full)
        ]

    def lane(self, i: int, *, estimated: bool = True) -> History:
        """Return the history of the last piece in a lane."""
        signals, auxiliary, estimate = self.history
        return History(signals[i], auxiliary[i], estimate[i] if estimated and estimate is not None else None)

    def fly(self, start: int, stop: int) -> int:
        """Fly the steps ``start`` ... ``stop`` - 1; return the one after the last that any flight has flown."""
        return core.fly(self._flights, self._memory, start, stop)

    def ended(self, i: int) -> int:
        """Return the steps that the flight in a lane has flown, or is to fly."""
        return int(self._flights[i].pointer.ended)

    def worst(self, i: int) -> float:
        """Return the largest level so far of the flight in a lane."""
        return float(self._flights[i].pointer.worst)


class TubeLevels:
    """Levels in the invariant set of one design, for flights with its notch filter and a tube law."""

    def __init__(self, parts: Components) -> None:
        """Read the set from the tube law among the components of the flights, if it is one."""
        law, notch = parts.controller, parts.notch_filter
        tube = law.design.tube if isinstance(law, TubeLaw) and notch.sections == law.design.notch else None
        self.set: Struct | None = None
        """The set as the core takes it; None if no set holds for the flights"""
        if tube:
            self.set = Struct("hsv_tube_set", SimpleNamespace(notch=notch.data, shape=tube.shape, centre=tube.centre))

    def worst(self, flight: FlightData) -> float | None:
        """Return the largest level (e - c)' P (e - c) of the flight, None if no set holds for it."""
        if not self.set:
            return None
        given = [doubles(vector(each)) for each in (flight.state, flight.deviation, flight.reference)]
        return float(lib.hsv_worst_level(self.set.pointer, len(flight.state), *given))


def fly_group(group: FlightGroup, components: Sequence[Components]) -> list[Flight]:
    """Return the flights of ``components``, which are valid until the group flies the next ones."""
    rows = components[0].plant.steps + 1
    group.begin(components, rows)
    group.fly(0, rows)
    ideal = is_ideal(components[0])
    return [flight_of(own, group.lane(i, estimated=not ideal).cut(group.ended(i))) for i, own in enumerate(components)]


def fly_perturbed(
    components: Components,
    perturbations: Sequence[Mapping[str, float]],
    job: Callable[[Mapping[str, float], Flight], Result],
    progress: Callable[[int], None] = lambda done: None,
) -> list[Result]:
    """Return ``job`` of every flight in order; the flights are simulated in one thread per processor.

    Args:
        components: Of the flight of the nominal vehicle.
        perturbations: Relative changes of the vehicle's parameters, of one flight each.
        job: Takes a perturbation and its flight.
        progress: Called with the number of flights done.
    """
    width = lanes()

    def of_some(some: Sequence[Mapping[str, float]]) -> list[Result]:
        varied = [components.perturbed(perturbation) for perturbation in some]
        together = FlightGroup.takes(varied)
        flown = fly_group(FlightGroup(components.plant.steps + 1), varied) if together else map(fly, varied)
        return [job(perturbation, flight) for perturbation, flight in zip(some, flown, strict=True)]

    groups = [perturbations[start : start + width] for start in range(0, len(perturbations), width)]
    done = over_threads(of_some, groups, lambda groups: progress(min(groups * width, len(perturbations))))
    return [result for results in done for result in results]


def _of_the_core(components: Components) -> bool:
    return components.controller.in_core and components.nominal_trajectory.law.in_core


def _shared(components: Components) -> tuple[Any, ...]:
    """Return all that flights side by side have in common."""
    plant, notch, tube = components.plant, components.notch_filter, components.controller.kernel
    data, nominal = plant.data, components.nominal_trajectory.data
    engine = any(row.fault.kind.side == ENGINE_SIDE for row in components.fault_injector.known)
    calm = data.atmosphere.still and not engine
    return (
        (plant.steps, plant.period, data.substeps, data.late, calm, data.vehicle.angle_limit, is_ideal(components)),
        data.actuators,
        notch.data,
        notch.estimator and notch.estimator.data,
        nominal,
        [getattr(tube, field.name) for field in fields(tube) if field.name not in ("gains", "starts")],
    )


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if is_dataclass(a) and is_dataclass(b):
        return all(_same(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(_same, a, b))
    return np.array_equal(a, b)
