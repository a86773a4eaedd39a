"""Claims of flights and random sequences: levels, disturbances and plans of a design, flown and drawn again."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from hsv.design.region import Region, incomplete_share, measure
from hsv.design.sets.sampling import sample
from hsv.design.tube import flight_evidence
from hsv.design.tube_problem import channel_model
from hsv.design.verification.claims import Claim, Subject, above, at_most, same
from hsv.design.verification.invariant_set import certified_set

_FLIGHTS, _FLIGHT_SEED = 48, 7
"""How many corners, drawn with which seed, are flown again beside those that set a bound."""


def flight_claims(subject: Subject) -> Iterable[Claim]:
    """Fly the corners that set a bound, and a sample of all, again."""
    stored, design = subject.certificate["tube"], subject.design
    region, model = Region(design, subject.inputs, incomplete_share(subject.inputs)), channel_model(design)
    measured = stored["disturbance"]["measured"]
    seen, everyone = region.fraction(), region.corners()
    setters = sorted({0, *measured["lower_flight"], *measured["upper_flight"]})
    again = measure(region, model, [seen[i] for i in setters]).channels
    for side, value in (("lower", again.lower), ("upper", again.upper)):
        yield same(f"measured disturbances, {side}", value, measured[side], 1e-6, 1e-12)
    found = certified_set(subject)
    disturbance = found.problem.disturbance
    drawn = np.random.default_rng(_FLIGHT_SEED).choice(len(everyone), _FLIGHTS, replace=False)
    flown = region.map(
        lambda flight: flight_evidence(flight, found, disturbance, model), [everyone[i] for i in (0, *drawn)]
    )
    kept = stored["flights"]
    level = max(f.level or 0.0 for f in flown)
    yield at_most("level of flown corners", level, min(1.0, kept["worst_level"] * (1.0 + 1e-6)))
    ratio = max(f.membership.ratio for f in flown)
    yield at_most("disturbances of flown corners", ratio, kept["disturbance_membership"]["worst_ratio"] * (1.0 + 1e-6))
    plan = stored["tightening"]["plan"]
    low, high = plan["pitch_acceleration"]
    least, most = np.append(plan["lowest"], low), np.append(plan["highest"], high)
    lowest, highest = np.min([f.lowest for f in flown], axis=0), np.max([f.highest for f in flown], axis=0)
    yield above("nominal plan of flown corners, lowest", float(np.min(lowest - least)), -1e-9)
    yield above("nominal plan of flown corners, highest", float(np.min(most - highest)), -1e-9)


def sequence_claims(subject: Subject) -> Iterable[Claim]:
    """Draw the random sequences again."""
    kept: dict[str, Any] = subject.certificate["tube"]["invariant_set"]["sampling"]
    drawn = sample(certified_set(subject), kept["sequences"], kept["steps"], kept["seed"])
    yield at_most("worst level of random sequences", drawn["worst_level"], 1.0)
    yield same("worst level of random sequences as certified", drawn["worst_level"], kept["worst_level"], 1e-6)
