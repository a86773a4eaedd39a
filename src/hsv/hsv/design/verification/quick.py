"""The claims that need neither flights nor sequences, nor solvers, units or models: what a node can afford at start."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from hsv.design.verification.claims import Claim, Subject
from hsv.design.verification.factor import factor_claims
from hsv.design.verification.gains import feedback_claims, nominal_claims
from hsv.design.verification.invariant_set import set_claims
from hsv.design.verification.model import input_claims

Part = Callable[[Subject], Iterable[Claim]]

QUICK: dict[str, Part] = {
    "inputs": input_claims,
    "feedback gain": feedback_claims,
    "nominal gains": nominal_claims,
    "invariant set": set_claims,
    "adjustable factor": factor_claims,
}
"""By part; tens of milliseconds."""
