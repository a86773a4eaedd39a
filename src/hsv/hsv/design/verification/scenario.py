"""Checks of a scenario's flight: whether it keeps to what the tube of its design was computed for."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from hsv.base.errors import DesignError
from hsv.design.region import incomplete_share
from hsv.design.tightening import TightenedInputs
from hsv.design.tube import FlightEvidence, flight_evidence
from hsv.design.tube_problem import channel_model
from hsv.design.verification.checks import Check, Subject, above, at_most
from hsv.design.verification.invariant_set import certified_set, lag_feedback
from hsv.design.verification.tolerances import ROUNDING
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner, fraction
from hsv.flight.scenario import Scenario


def bounding_corners(subject: Subject) -> list[Corner]:
    """Return the nominal vehicle and the corners of the parameters that set a bound of the disturbances."""
    measured = subject.certificate["tube"]["disturbance"]["measured"]
    seen = fraction(subject.vehicle.uncertainty, incomplete_share(subject.inputs))
    return [seen[i] for i in sorted({0, *measured["lower_flight"], *measured["upper_flight"]})]


def scenario_checks(
    subject: Subject, scenario: Scenario, over: Iterable[Corner] = ({},), progress: Callable[[int], None] | None = None
) -> Iterable[Check]:
    """Fly ``scenario`` with the design, the vehicle changed to each of ``over``, and check level, disturbances, plan.

    Raises:
        DesignError: The scenario is not flown by the tube law.
    """
    if scenario.controller != "tube_mpc":
        raise DesignError(f"scenario {scenario.name!r}: controller = {scenario.controller!r}, expected 'tube_mpc'")
    parts = assemble_flight(scenario, subject.design)
    found, model = certified_set(subject), channel_model(subject.design, subject.vehicle)
    flown: list[FlightEvidence] = []
    for corner in over:
        flight = fly(parts.perturbed(corner))
        flown.append(flight_evidence(flight, found, found.problem.disturbance, model))
        if progress:
            progress(len(flown))
    name = scenario.name
    yield at_most(f"{name}: level in the set", max(f.level or 0.0 for f in flown), 1.0)
    worst = max((f.membership for f in flown), key=lambda membership: membership.ratio)
    share = incomplete_share(subject.inputs)
    held = f" (W' holds {share:g} of fault and parameter bounds, eq. 47)" if share < 1.0 else ""
    yield at_most(f"{name}: disturbance over its bound, {worst.channel} at step {worst.step}{held}", worst.ratio, 1.0)
    kept = subject.certificate["tube"]["tightening"]
    if (lag := lag_feedback(kept)) is not None:
        reached = np.stack([f.lag_feedback for f in flown])
        room = min(float(np.min(reached[:, 0] - lag[0])), float(np.min(lag[1] - reached[:, 1])))
        yield above(f"{name}: room of the feedback to the lag of the plan", room, -ROUNDING)
    bounds = TightenedInputs(np.array(kept["lower"]), np.array(kept["upper"]))
    lowest, highest = np.min([f.lowest for f in flown], axis=0)[:2], np.max([f.highest for f in flown], axis=0)[:2]
    yield above(f"{name}: room of the nominal plan in U minus F Z", bounds.margins(lowest, highest).min(), 0.0)
