"""Claims: what is recomputed, what came out, what was expected."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.control.design_file import ControlDesign
from hsv.errors import DesignError

if TYPE_CHECKING:
    from hsv.design.inputs import DesignInputs


@dataclass(frozen=True)
class Claim:
    """One statement of a design, recomputed: ``value`` is what came out, ``expected`` says in words what was due.

    ``required``: a design that fails it must not fly; other claims tell that it is not the one that was written.
    """

    name: str
    value: float | str
    expected: str
    ok: bool
    required: bool = False

    def __str__(self) -> str:
        return f"{self.name}: {self.shown}, expected {self.expected}"

    @property
    def shown(self) -> str:
        """What came out, as text."""
        return self.value if isinstance(self.value, str) else f"{self.value:.6g}"


@dataclass(frozen=True)
class Subject:
    """What is verified: the design as it flies, and its certificate."""

    design: ControlDesign
    certificate: dict[str, Any]

    @cached_property
    def inputs(self) -> DesignInputs:
        """The design inputs in the certificate, checked. Units and models take a moment to import: not for nodes."""
        from hsv.design.inputs import inputs_from_report

        return inputs_from_report(self.certificate["inputs"])


def required(claim: Claim) -> Claim:
    """Return ``claim`` as one without which a design must not fly."""
    return replace(claim, required=True)


def same(name: str, value: Any, expected: Any, tolerance: float = 1e-9, floor: Any = 0.0) -> Claim:
    """Claim that every entry of ``value`` is that of ``expected`` to a relative ``tolerance``, or to ``floor``."""
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    if value.shape != expected.shape:
        return Claim(name, f"shape {value.shape}", f"shape {expected.shape}", False)
    allowed = tolerance * np.abs(expected) + floor
    difference = np.abs(value - expected)
    excess = np.where(difference <= allowed, 0.0, difference)
    excess[np.isnan(excess)] = np.inf
    worst = np.unravel_index(int(np.argmax(excess)), excess.shape) if excess.size else ()
    if excess.size == 0 or excess[worst] == 0.0:
        relative = float(np.max(difference / np.maximum(np.abs(expected), 1e-300), initial=0.0, where=expected != 0.0))
        return Claim(name, relative, f"a relative difference of at most {tolerance:g}", True)
    where = "" if value.ndim == 0 else f"[{', '.join(str(i) for i in worst)}]"
    return Claim(f"{name}{where}", float(value[worst]), f"{float(expected[worst])!r}", False)


def at_most(name: str, value: float, limit: float) -> Claim:
    """Claim that ``value`` is at most ``limit``; not a number is not."""
    return Claim(name, float(value), f"at most {limit:g}", bool(value <= limit))


def above(name: str, value: float, limit: float) -> Claim:
    """Claim that ``value`` is above ``limit``; not a number is not."""
    return Claim(name, float(value), f"above {limit:g}", bool(value > limit))


def inverse(name: str, P: np.ndarray, Q: np.ndarray) -> Claim:
    """Claim that P = Q^-1, entry by entry; entries that all but vanish beside their diagonal to that size."""
    expected = np.linalg.inv(Q)
    expected = 0.5 * (expected + expected.T)
    size = np.sqrt(np.diag(expected))
    return same(name, P, expected, 1e-6, 1e-11 * np.outer(size, size))


def gathered(name: str, claims: Callable[[], Iterable[Claim]]) -> list[Claim]:
    """Return the claims; an error on the way becomes the last claim, which fails under ``name``."""
    done: list[Claim] = []
    try:
        done.extend(claims())
    except (DesignError, KeyError, IndexError, TypeError, ValueError, np.linalg.LinAlgError) as error:
        missing = isinstance(error, KeyError)
        value = f"no field {error}" if missing else str(error)
        done.append(Claim(name, value, "to be recomputable", False, required=True))
    return done


def require(claims: Iterable[Claim]) -> None:
    """Raise DesignError naming the first claim that fails, if any."""
    for claim in claims:
        if not claim.ok:
            raise DesignError(f"claim fails: {claim}")
