"""Similar flights, simulated several at a time in the lanes of vector registers, each with the bits it has alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from hsv import core
from hsv.base.processes import over_threads
from hsv.control.tube_law import TubeLaw
from hsv.core import Struct, doubles, lanes, lib, vector
from hsv.flight.closed_loop import Components, flight_struct, fly, is_ideal
from hsv.flight.flight import Flight, flight_of
from hsv.flight.history import History
from hsv.flight.metrics import FlightData, curve_memory
from hsv.model.faults.table import ENGINE_SIDE

Result = TypeVar("Result")
Variant = TypeVar("Variant")

_MOST_HISTORY = 64 * 2**20
"""Largest memory (bytes) of the histories of all lanes; longer flights fly one at a time"""


class FlightGroup:
    """A simulator of up to :func:`hsv.core.lanes` flights at a time, which keeps the memory for them."""

    def __init__(self) -> None:
        self.lanes = lanes()
        self._memory = core.loop_memory(self.lanes)
        self._numbers = np.empty((self.lanes, 0))
        self._curves: list[tuple[np.ndarray, np.ndarray]] = []

    @staticmethod
    def takes(components: Sequence[Components], rows: int | None = None) -> bool:
        """Return whether the flights of ``components`` can be simulated side by side, each in a lane of its own.

        There must be 2 to :func:`hsv.core.lanes` flights, each with a nominal law and a controller of the core. They
        may differ only in vehicle, seed, initial state, faults, reference, gains, and the numbers of sensors, links and
        air, but not in the vehicle's angle limit, in :func:`is_ideal`, or in whether there is wind or an engine
        fault. The histories of all lanes, ``rows`` steps each (default: the whole flight), must not exceed 64 MiB.
        """
        of_the_core = all(each.controller.in_core and each.nominal_trajectory.law.in_core for each in components)
        if not 1 < len(components) <= lanes() or not of_the_core:
            return False
        if lanes() * (rows or components[0].plant.steps + 1) * History.numbers() * 8 > _MOST_HISTORY:
            return False
        first, *others = map(_shared, components)
        return all(_same(first, other) for other in others)

    def fly(self, components: Sequence[Components], tube_set: Struct | None = None) -> list[tuple[Flight, float]]:
        """Return the flights of ``components``, each with its largest level in ``tube_set``, -inf without a set.

        The flights are valid until the next call. Spare lanes repeat the last flight.
        """
        rows, estimated = components[0].plant.steps + 1, not is_ideal(components[0])
        if self._numbers.shape[1] != rows * History.numbers():
            # Kept for the next flights, because the first access to new memory takes longer than the computation.
            self._numbers = np.empty((self.lanes, rows * History.numbers()))
            self._curves = [curve_memory(rows) for _ in range(self.lanes)]
        histories = [History.over(lane, rows, estimated=estimated) for lane in self._numbers]
        full = [*components, *[components[-1]] * (self.lanes - len(components))]
        structs = [flight_struct(own, history, set=tube_set) for own, history in zip(full, histories, strict=True)]
        core.fly(structs, self._memory, 0, rows)
        flown = zip(components, histories, self._curves, (struct.pointer for struct in structs), strict=False)
        return [(flight_of(own, history.cut(end.ended), curves), end.worst) for own, history, curves, end in flown]


class TubeLevels:
    """Computes levels in a design's invariant set, for flights with a tube law and the notch filter of the design."""

    def __init__(self, parts: Components) -> None:
        """Take the set of a tube law in ``parts`` that flies with its design's notch filter; else there is none."""
        law, notch = parts.controller, parts.notch_filter
        tube = law.design.tube if isinstance(law, TubeLaw) and notch.sections == law.design.notch else None
        self.set: Struct | None = None
        """The core's struct of the set; None if no set applies to the flights"""
        if tube:
            self.set = Struct("hsv_tube_set", notch=notch.data, shape=tube.shape, centre=tube.centre)

    def worst(self, flight: FlightData) -> float | None:
        """Return the largest level of the tube error in the flight, None if no set applies to the flight.

        The level is (e - c)' P (e - c) for the tube error e and the invariant set with centre c and matrix P.
        """
        return None if (found := self._evaluated(flight)) is None else found[0]

    def along(self, flight: FlightData) -> np.ndarray | None:
        """Return the level at every step, shape (n + 1,), None if no set applies to the flight."""
        return None if (found := self._evaluated(flight)) is None else found[1]

    def _evaluated(self, flight: FlightData) -> tuple[float, np.ndarray] | None:
        if not self.set:
            return None
        given = [doubles(vector(each)) for each in (flight.history.state, flight.history.deviation, flight.reference)]
        levels = np.empty(len(flight.time))
        return float(lib.hsv_levels(self.set.pointer, len(levels), *given, doubles(levels))), levels


def fly_each(
    variants: Sequence[Variant],
    build: Callable[[Variant], Components],
    job: Callable[[Variant, Flight], Result],
    progress: Callable[[int], None] = lambda done: None,
) -> list[Result]:
    """Fly the components that ``build`` returns for each variant; return the results of ``job(variant, flight)``.

    The results are in order. The flights are simulated in one thread per processor, with :class:`FlightGroup` where
    possible. ``progress`` receives the number of finished flights.
    """
    width = lanes()

    def of_some(some: Sequence[Variant]) -> list[Result]:
        varied = [build(variant) for variant in some]
        together = FlightGroup.takes(varied)
        flown = [flight for flight, _ in FlightGroup().fly(varied)] if together else map(fly, varied)
        return [job(variant, flight) for variant, flight in zip(some, flown, strict=True)]

    groups = [variants[start : start + width] for start in range(0, len(variants), width)]
    done = over_threads(of_some, groups, lambda groups: progress(min(groups * width, len(variants))))
    return [result for results in done for result in results]


def fly_perturbed(
    components: Components,
    perturbations: Sequence[Mapping[str, float]],
    job: Callable[[Mapping[str, float], Flight], Result],
    progress: Callable[[int], None] = lambda done: None,
) -> list[Result]:
    """Fly ``components`` with every perturbation of the vehicle, relative changes by name, as :func:`fly_each` does."""
    return fly_each(perturbations, components.perturbed, job, progress)


def _shared(components: Components) -> tuple[Any, ...]:
    """Return the data of a flight that must be equal in all flights that are simulated side by side."""
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
        [value for name, value in tube.values.items() if name not in ("gains", "starts")],
    )


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if isinstance(a, Struct) and isinstance(b, Struct):
        return _same([*a.values.values()], [*b.values.values()])
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(_same, a, b))
    return np.array_equal(a, b)
