"""Checks of repeated flights and random sequences: levels, disturbances and nominal inputs of a design."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from hsv.design.disturbance import ChannelModel
from hsv.design.region import Region, incomplete_share, measure
from hsv.design.sets.ellipsoid_set import EllipsoidSet
from hsv.design.sets.sampling import sample
from hsv.design.tube import FlightEvidence, flight_evidence
from hsv.design.tube_problem import channel_model
from hsv.design.verification.checks import Check, Subject, above, at_most, same
from hsv.design.verification.invariant_set import certified_set, lag_feedback
from hsv.design.verification.tolerances import ROUNDING, TOLERANCES

_FLIGHTS, _FLIGHT_SEED = 48, 7
"""Number and seed of random corners that are flown in addition to those that determine a bound."""


def flight_checks(subject: Subject) -> Iterable[Check]:
    """Repeat the flights at the corners that determine a bound, and at a sample of all corners."""
    stored, share = subject.certificate["tube"], incomplete_share(subject.inputs)
    # As certified: in flight the factor may be another one.
    design = replace(subject.design, tau=subject.design.tau_minimum)
    region, model = Region(design, subject.inputs, share), channel_model(design, subject.vehicle)
    measured = stored["disturbance"]["measured"]
    seen = region.fraction()
    setters = sorted({0, *measured["lower_flight"], *measured["upper_flight"]})
    again = measure(region, model, [seen[i] for i in setters]).channels
    for side, value in (("lower", again.lower), ("upper", again.upper)):
        yield same(f"measured disturbances, {side}", value, measured[side], "flights")
    found = certified_set(subject)
    flown = _sample(region, found, model)
    yield from _worst("flown corners", flown, stored["flights"])
    plan = stored["tightening"]["plan"]
    low, high = plan["pitch_acceleration"]
    least, most = np.append(plan["lowest"], low), np.append(plan["highest"], high)
    lowest, highest = np.min([f.lowest for f in flown], axis=0), np.max([f.highest for f in flown], axis=0)
    yield above("nominal plan of flown corners, lowest", float(np.min(lowest - least)), -ROUNDING)
    yield above("nominal plan of flown corners, highest", float(np.min(most - highest)), -ROUNDING)
    if (lag := lag_feedback(stored["tightening"])) is not None:
        seen_lag = np.stack([f.lag_feedback for f in flown])
        yield above("feedback to the lag of the plan, lowest", float(np.min(seen_lag[:, 0] - lag[0])), -ROUNDING)
        yield above("feedback to the lag of the plan, highest", float(np.min(lag[1] - seen_lag[:, 1])), -ROUNDING)
    if "adjustable" in subject.certificate:
        flown = _sample(Region(design, subject.inputs, 1.0), found, model)
        yield from _worst("flown corners, whole fault", flown, subject.certificate["adjustable"]["complete_fault"])


def _sample(region: Region, found: EllipsoidSet, model: ChannelModel) -> list[FlightEvidence]:
    everyone = region.corners()
    drawn = np.random.default_rng(_FLIGHT_SEED).choice(len(everyone), min(_FLIGHTS, len(everyone)), replace=False)
    disturbance = found.problem.disturbance
    return region.map(
        lambda flight: flight_evidence(flight, found, disturbance, model), [everyone[i] for i in (0, *drawn)]
    )


def _worst(name: str, flown: list[FlightEvidence], kept: dict[str, Any]) -> Iterable[Check]:
    allowance = 1.0 + TOLERANCES["flights"].relative
    level = max(f.level or 0.0 for f in flown)
    yield at_most(f"level of {name}", level, min(1.0, kept["worst_level"] * allowance))
    ratio = max(f.membership.ratio for f in flown)
    yield at_most(f"disturbances of {name}", ratio, kept["disturbance_membership"]["worst_ratio"] * allowance)


def sequence_checks(subject: Subject) -> Iterable[Check]:
    """Repeat the random sequences."""
    kept: dict[str, Any] = subject.certificate["tube"]["invariant_set"]["sampling"]
    drawn = sample(certified_set(subject), kept["sequences"], kept["steps"], kept["seed"])
    yield at_most("worst level of random sequences", drawn["worst_level"], 1.0)
    yield same(
        "worst level of random sequences as certified", drawn["worst_level"], kept["worst_level"], "random sequences"
    )
