"""The declared region of a design: the flights over which its disturbances are measured (paper eq. 17, eq. 19, eq. 47).

    W = {d: lower <= d <= upper},   with the extremes of the channels d of Delta in the flights as bounds, widened.

W'(tau) is the same set for flights with tau times the fault and tau times the parameter bounds. The flights are
simulated with the full closed loop: the coupled vehicle, the notch filter, the gains of the design, its step command or
ramp from start to target, and the fault. The parameters are nominal or at corners of their bounds:
a quarter of the corners for ten parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from hsv.base.errors import DesignError
from hsv.certificate.coverage import region_parameters
from hsv.control.design import ControlDesign
from hsv.design.disturbance import Extremes
from hsv.design.inputs import CertifiedInputs
from hsv.flight.assembly import assemble_with
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner, corners, fraction, screening_corners
from hsv.flight.disturbance import ChannelModel
from hsv.flight.flight import Flight
from hsv.flight.side_by_side import fly_perturbed
from hsv.model.plant import FlightStatus

Result = TypeVar("Result")


def incomplete_share(inputs: CertifiedInputs) -> float:
    """Return the share of the fault and of the parameter bounds that W' covers (paper eq. 47): tau, or 1 without tau.

    If tau differs between the rigid states, the largest factor is returned, which gives the largest set.
    """
    return float(max(inputs.adjustable.tau)) if inputs.adjustable else 1.0


class Region:
    """The flights of a design in its declared region: nominal vehicle and corners of parameter bounds, with the fault.

    ``share`` multiplies the bounds and the fault (paper eq. 47). ``equipment``: flat parameters of hardware and air.
    """

    def __init__(
        self, design: ControlDesign, inputs: CertifiedInputs, share: float, equipment: Mapping[str, Any] | None = None
    ) -> None:
        declared = region_parameters(inputs.model_dump(), inputs.flown_vehicle, share)
        self._parts = assemble_with(design, {**declared, **(equipment or {})})
        self.share = share
        self._bounds = inputs.flown_vehicle.uncertainty

    def corners(self) -> list[dict[str, float]]:
        """Return the parameter changes by flight: none (nominal vehicle), then those of every corner of the region."""
        return corners(self._bounds, self.share)

    def screening(self) -> list[Corner]:
        """Return the parameter changes by flight: none (nominal vehicle), then those of 32 corners of the region."""
        return screening_corners(self._bounds, self.share)

    def fraction(self) -> list[dict[str, float]]:
        """Return the changes by flight: none, then a quarter of the corners, or all with fewer than ten parameters."""
        return fraction(self._bounds, self.share)

    def fly(self, corner: Corner) -> Flight:
        """Simulate the flight of one corner.

        Raises:
            DesignError: The flight diverges or saturates an input; no set can be computed from it.
        """
        return _checked(corner, fly(self._parts.perturbed(corner)))

    def map(
        self,
        job: Callable[[Flight], Result],
        over: Sequence[Corner],
        progress: Callable[[int], None] = lambda done: None,
    ) -> list[Result]:
        """Simulate the flights of corners ``over`` and return the results of ``job``, in order; errors: :meth:`fly`."""
        return fly_perturbed(self._parts, over, lambda corner, flight: job(_checked(corner, flight)), progress)


def _checked(corner: Corner, flight: Flight) -> Flight:
    """Return ``flight``, or raise DesignError if it diverged or saturated an input: no set can be computed from it."""
    saturated = np.count_nonzero(np.any(flight.history.command != flight.history.u_unsaturated, axis=1))
    if flight.status is not FlightStatus.FINISHED or saturated:
        raise DesignError(
            f"flight with perturbation {dict(corner)}: {flight.status.name}, {saturated} saturated steps, "
            "expected FINISHED without saturation"
        )
    return flight


@dataclass(frozen=True)
class RegionResult:
    """Extremes over all flights, SI: of ``channels``, and of the feedback due to the actuators' lag behind the plan.

    ``lag_feedback`` has an entry per input, 0 with ideal actuators. ``flights`` is the number of flights.
    """

    flights: int
    channels: Extremes
    lag_feedback: Extremes


def measure(
    region: Region, model: ChannelModel, over: Sequence[Corner], progress: Callable[[int], None] = lambda done: None
) -> RegionResult:
    """Simulate the flights of the corners ``over``; return the extremes of the disturbances (paper eq. 17, eq. 19)."""

    def job(flight: Flight) -> list[np.ndarray]:
        parts = model.channels(flight), model.errors(flight)[1]
        return [extreme for part in parts for extreme in (part.min(axis=0), part.max(axis=0))]

    columns = [np.stack(column) for column in zip(*region.map(job, over, progress), strict=True)]
    return RegionResult(len(over), *(Extremes.over(*columns[i : i + 2]) for i in (0, 2)))
