"""Claims: what is recomputed, what came out, what was expected."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hsv.control.design_file import ControlDesign
from hsv.design.inputs import DesignInputs
from hsv.errors import DesignError


@dataclass(frozen=True)
class Claim:
    """One statement of a design, recomputed: ``value`` is what came out, ``expected`` says in words what was due."""

    name: str
    value: float | str
    expected: str
    ok: bool

    def __str__(self) -> str:
        value = self.value if isinstance(self.value, str) else f"{self.value:.6g}"
        return f"{self.name}: {value}, expected {self.expected}"


@dataclass(frozen=True)
class Subject:
    """What is verified: the design as it flies, its certificate, and the design inputs in that."""

    design: ControlDesign
    certificate: dict[str, Any]
    inputs: DesignInputs = field(repr=False)


def same(name: str, value: Any, expected: Any, tolerance: float = 1e-9, floor: Any = 0.0) -> Claim:
    """Claim that every entry of ``value`` is that of ``expected`` to a relative ``tolerance``, or to ``floor``."""
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    if value.shape != expected.shape:
        return Claim(name, f"shape {value.shape}", f"shape {expected.shape}", False)
    allowed = tolerance * np.abs(expected) + floor
    difference = np.abs(value - expected)
    excess = np.where(difference > allowed, difference, 0.0)
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


def gathered(name: str, claims: Callable[[], Iterable[Claim]]) -> list[Claim]:
    """Return the claims; an error on the way becomes the last claim, which fails under ``name``."""
    done: list[Claim] = []
    try:
        done.extend(claims())
    except (DesignError, KeyError, IndexError, TypeError, ValueError, np.linalg.LinAlgError) as error:
        missing = isinstance(error, KeyError)
        done.append(Claim(name, f"no field {error}" if missing else str(error), "to be recomputable", False))
    return done
