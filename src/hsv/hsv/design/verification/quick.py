"""Checks that need no flights, random sequences, solvers, units or models: fast enough for a node at its start."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from hsv.design.verification.checks import Check, Subject
from hsv.design.verification.factor_range import factor_checks
from hsv.design.verification.gains import feedback_checks, nominal_checks
from hsv.design.verification.invariant_set import set_checks
from hsv.design.verification.model import input_checks

Part = Callable[[Subject], Iterable[Check]]

QUICK: dict[str, Part] = {
    "inputs": input_checks,
    "feedback gain": feedback_checks,
    "nominal gains": nominal_checks,
    "invariant set": set_checks,
    "adjustable factor": factor_checks,
}
"""Checks by section that take tens of milliseconds."""
