"""Flights that differ little, several at a time in vector registers: each with the bits that it has alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hsv.compiled import ENABLED
from hsv.control.controller import CONTROLLER_INPUTS
from hsv.control.tube_law import TubeData, memory_of, watch_of
from hsv.lane_types import WIDTH
from hsv.lanes import LaneArray, LaneRecord
from hsv.signals import VARYING
from hsv.simulation.closed_loop import CommandFaults, Components, LoopArrays, Workspace, fly, fly_loop, is_ideal
from hsv.simulation.flight import Flight, flight_of
from hsv.simulation.history import BESIDE, FLOWN, History
from hsv.threads import over_threads
from hsv.vehicle.dynamics import N_INPUTS

Result = TypeVar("Result")


class FlightGroup:
    """Flies up to :data:`hsv.lane_types.WIDTH` flights side by side, and keeps the memory for that."""

    def __init__(self, steps: int) -> None:
        """Make room for flights of so many control periods."""
        self._rows = steps + 1
        self._history = LaneHistory(self._rows)

    @staticmethod
    def takes(components: Sequence[Components]) -> bool:
        """Tell whether flights can be flown side by side.

        They can where equipment and air are ideal and the bench's own laws fly, and nothing is different but vehicle,
        beginning, faults on the command, gains and reference.
        """
        return ENABLED and 1 < len(components) <= WIDTH and all(_fits(components[0], other) for other in components)

    def fly(self, components: Sequence[Components]) -> list[Flight]:
        """Return the flights of ``components``, which are valid until the next ones are flown."""
        ended = np.full(WIDTH, self._rows)
        fly_loop(*lane_loop(components, self._rows), self._history.lanes, ended, 0, self._rows)  # type: ignore[call-arg]
        flown, beside = self._history.arrays
        return [
            flight_of(own, History(flown[i], beside[i], None).cut(int(ended[i]))) for i, own in enumerate(components)
        ]


class LaneHistory:
    """Memory for so many rows of :data:`hsv.lane_types.WIDTH` flights, ideal ones, as arrays and as lanes."""

    def __init__(self, rows: int) -> None:
        """Make room for so many ``rows`` of each."""
        flown, beside, _ = History.over(np.empty((WIDTH, rows * (FLOWN + BESIDE))), rows, estimated=False)
        self.arrays = flown, beside
        self.lanes = LaneArray(flown, split=True), LaneArray(beside, split=True), None


def lane_loop(components: Sequence[Components], rows: int) -> tuple[Any, ...]:
    """Return the first arguments of :func:`fly_loop`, for flights side by side of so many ``rows``.

    Where there are fewer flights than lanes, the last one flies in those that are left.
    """
    lanes = [*components, *[components[-1]] * (WIDTH - len(components))]
    first = lanes[0]
    plants, notch = [own.plant for own in lanes], first.notch_filter.data
    nominal, tube = first.nominal_trajectory, _tube([own.controller.kernel for own in lanes])
    memory = plants[0].memory()
    faults = tuple(CommandFaults.of(own) for own in lanes)
    m, s = N_INPUTS, 2 * len(notch.D)
    zeros: Any = LaneArray.zeros
    vehicle: Any = LaneRecord([plant.vehicle for plant in plants])
    sizes = (s if signal.size == VARYING else signal.size for signal in CONTROLLER_INPUTS)
    memories = (zeros(len(memory_of(tube))), zeros(watch_of(tube).shape))
    arrays = (*map(zeros, sizes), zeros(m), zeros(1), zeros(1), *memories)
    return (
        LaneArray.of([plant.initial.state for plant in plants]),
        plants[0].data._replace(vehicle=vehicle),
        memory._replace(effector=zeros(m), work=zeros(memory.work.shape)),
        None,
        None,
        notch,
        nominal.data,
        None,
        tube,
        None,
        None,
        None,
        faults,
        min(own.first for own in faults),
        _reference(lanes, rows),
        LoopArrays(*arrays),
        Workspace.of(zeros, notch, nominal.data),
    )


def fly_perturbed(
    components: Components,
    perturbations: Sequence[Mapping[str, float]],
    job: Callable[[Mapping[str, float], Flight], Result],
    progress: Callable[[int], None] = lambda done: None,
) -> list[Result]:
    """Return ``job`` of every flight, in order, flown side by side in as many threads as there are processors.

    Args:
        components: Of the flight of the nominal vehicle.
        perturbations: Relative changes of the vehicle's parameters, of one flight each.
        job: Takes a perturbation and its flight.
        progress: Called with the number of flights done.

    Raises:
        ControllerError, ParameterError: As :func:`hsv.simulation.closed_loop.fly`.
    """

    def of_some(some: Sequence[Mapping[str, float]]) -> list[Result]:
        varied = [components.perturbed(perturbation) for perturbation in some]
        together = FlightGroup.takes(varied)
        flown = FlightGroup(components.plant.steps).fly(varied) if together else map(fly, varied)
        return [job(perturbation, flight) for perturbation, flight in zip(some, flown, strict=True)]

    groups = [perturbations[start : start + WIDTH] for start in range(0, len(perturbations), WIDTH)]
    done = over_threads(of_some, groups, lambda groups: progress(min(groups * WIDTH, len(perturbations))))
    return [result for results in done for result in results]


def _fits(first: Components, other: Components) -> bool:
    for own in (first, other):
        compiled = own.controller.compiled_with_loop and own.nominal_trajectory.law.compiled_with_loop
        if not compiled or not is_ideal(own):
            return False
    return first is other or all(
        _same(a, b)
        for a, b in (
            (first.plant.steps, other.plant.steps),
            (first.plant.data[1:-1], other.plant.data[1:-1]),
            (first.notch_filter.data, other.notch_filter.data),
            (first.nominal_trajectory.data, other.nominal_trajectory.data),
            (first.controller.kernel[1:], other.controller.kernel[1:]),
            (first.controller.kernel.gains.shape, other.controller.kernel.gains.shape),
        )
    )


def _same(a: Any, b: Any) -> bool:
    if a is b:
        return True
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    return np.array_equal(a, b)


def _tube(tubes: Sequence[TubeData]) -> Any:
    if all(tube is tubes[0] for tube in tubes):
        return tubes[0]
    gains: Any = LaneArray.of([tube.gains for tube in tubes])
    return tubes[0]._replace(gains=gains)


def _reference(lanes: Sequence[Components], rows: int) -> Any:
    trajectories = [own.nominal_trajectory.reference for own in lanes]
    if all(trajectory is trajectories[0] for trajectory in trajectories):
        return trajectories[0].data
    columns = (
        [getattr(trajectory.along(rows), name) for trajectory in trajectories] for name in _Reference._fields[1:]
    )
    return _Reference(0, *map(LaneArray.of, columns))


class _Reference(NamedTuple):
    """What a :class:`hsv.control.reference_trajectory.ReferenceData` is of one flight."""

    first: int
    state: LaneArray
    input: LaneArray
    defect: LaneArray
