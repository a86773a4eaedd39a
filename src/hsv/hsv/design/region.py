"""The declared region of a design: the flights over which its disturbances are measured (paper eq. 17, eq. 19, eq. 47).

    W = {Delta: lower <= Delta <= upper in all flights},   W'(tau): the same with tau times the fault and the bounds.

The flights are simulated with the real closed loop: the coupled vehicle, the notch filter, the design's own gains, the
step from the design's start to its target, the fault; parameters nominal and at every corner of their bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.design.disturbance import ChannelModel, Extremes
from hsv.design.inputs import DesignInputs
from hsv.flight.assembly import assemble
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner, corners, fraction, region_parameters, screening_corners
from hsv.flight.flight import Flight
from hsv.flight.side_by_side import fly_perturbed
from hsv.model.plant import FlightStatus

Result = TypeVar("Result")


def incomplete_share(inputs: DesignInputs) -> float:
    """Return the fraction of fault and parameter bounds covered by W' (paper eq. 47): tau, or 1 if there is none.

    Of a diagonal tau it is the largest factor, which gives the largest set.
    """
    return float(max(inputs.adjustable.tau)) if inputs.adjustable else 1.0


class Region:
    """The flights of a design at corners of its declared region: bounds of fault and parameters times ``share``.

    The share is that of paper eq. 47. ``equipment``: flat parameters of hardware and air that are not ideal.
    """

    def __init__(
        self, design: ControlDesign, inputs: DesignInputs, share: float, equipment: Mapping[str, Any] | None = None
    ) -> None:
        declared = region_parameters(inputs.model_dump(), inputs.flown_vehicle, share)
        self._parts = assemble({**design.to_parameters(), **declared, **(equipment or {})})
        self.share = share
        self._bounds = inputs.flown_vehicle.uncertainty

    def corners(self) -> list[dict[str, float]]:
        """Return the nominal vehicle and every corner of the region."""
        return corners(self._bounds, self.share)

    def screening(self) -> list[Corner]:
        """Return the nominal vehicle and 32 corners."""
        return screening_corners(self._bounds, self.share)

    def fraction(self) -> list[dict[str, float]]:
        """Return the nominal vehicle and a quarter of the corners."""
        return fraction(self._bounds, self.share)

    def fly(self, corner: Corner) -> Flight:
        """Fly one corner.

        Raises:
            DesignError: The flight diverged or saturated; no set can be computed from it.
        """
        return _checked(corner, fly(self._parts.perturbed(corner)))

    def map(
        self,
        job: Callable[[Flight], Result],
        over: Sequence[Corner],
        progress: Callable[[int], None] = lambda done: None,
    ) -> list[Result]:
        """Return ``job`` of every flight, in order; flights share the lanes of a register and run in threads."""
        return fly_perturbed(self._parts, over, lambda corner, flight: job(_checked(corner, flight)), progress)


def _checked(corner: Corner, flight: Flight) -> Flight:
    """Refuse a flight from which no set can be computed."""
    saturated = np.count_nonzero(np.any(flight.history.command != flight.history.u_unsaturated, axis=1))
    if flight.status is not FlightStatus.FINISHED or saturated:
        raise DesignError(
            f"flight with perturbation {dict(corner)}: {flight.status.name}, {saturated} saturated steps, "
            "expected FINISHED without saturation"
        )
    return flight


@dataclass(frozen=True)
class RegionResult:
    """Extremes measured over the region: of the channels (7), of f, w, Delta (9 each), of lag feedback (2).

    The last is the feedback F to the lag of the plan, zero where actuators are ideal.
    """

    flights: int
    channels: Extremes
    remainder: Extremes
    fault: Extremes
    delta: Extremes
    lag_feedback: Extremes


def measure(
    region: Region, model: ChannelModel, over: Sequence[Corner], progress: Callable[[int], None] = lambda done: None
) -> RegionResult:
    """Fly ``over`` and return the extremes of every disturbance (paper eq. 17, eq. 19)."""

    def job(flight: Flight) -> list[np.ndarray]:
        s = model.signals(flight)
        parts = (s.channels, s.remainder, s.fault, s.delta, model.errors(flight)[1])
        return [extreme for part in parts for extreme in (part.min(axis=0), part.max(axis=0))]

    columns = [np.stack(column) for column in zip(*region.map(job, over, progress), strict=True)]
    return RegionResult(len(over), *(Extremes.over(*columns[i : i + 2]) for i in range(0, 10, 2)))
