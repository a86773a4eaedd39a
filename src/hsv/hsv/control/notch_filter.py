"""Notch filter of the pitch rate (paper eq. 38, eq. 39), discretised by the bilinear transform with prewarping."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.control.estimator import ESTIMATOR_ENABLED, Estimator
from hsv.core import Struct, doubles, lib
from hsv.core.arithmetic import solve, tangent
from hsv.model.signals import PITCH_RATE

DESIGN_NOTCH_PARAMETERS = (
    Parameter("period", 0.02, "control period T", "s", 1e-4, 1.0),
    Parameter("notch.zero_frequency", [15.0], "centre of the notch, one value per section", "rad/s", 0.1, 1e3),
    Parameter("notch.zero_damping", [0.02], "damping ratio of the zeros: smaller is deeper", "", 0.0, 10.0),
    Parameter("notch.pole_frequency", [15.0], "natural frequency of the poles", "rad/s", 0.1, 1e3),
    Parameter("notch.pole_damping", [0.5], "damping ratio of the poles: larger is wider", "", 1e-3, 10.0),
)
"""Parameters of the notch filter of a design."""

FLOWN_NOTCH_PARAMETERS = tuple(
    Parameter(p.name.replace("notch.", "notch.flown."), [], f"flown instead of {p.name}", p.unit, p.minimum, p.maximum)
    for p in DESIGN_NOTCH_PARAMETERS[1:]
)
"""Parameters of a notch filter that replaces the design's in one flight; the invariant set does not hold for it.

An empty list keeps the value of the design.
"""

NOTCH_PARAMETERS = (
    *DESIGN_NOTCH_PARAMETERS,
    Parameter("notch.enabled", True, "false: the pitch rate is not filtered"),
    *FLOWN_NOTCH_PARAMETERS,
)


@dataclass(frozen=True)
class NotchSection:
    """A second-order section of the notch filter (paper eq. 38); frequencies in rad/s, damping ratios dimensionless."""

    zero_frequency: float
    zero_damping: float
    pole_frequency: float
    pole_damping: float

    def state_space(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Return A (2, 2), B (2), C (2), D of the continuous section in controller canonical form (paper eq. 39)."""
        w_z, e_z, w_p, e_p = self.zero_frequency, self.zero_damping, self.pole_frequency, self.pole_damping
        ratio = w_p / w_z
        gain = ratio * ratio
        A = np.array([[-2.0 * e_p * w_p, -(w_p * w_p)], [1.0, 0.0]])
        B = np.array([1.0, 0.0])
        C = gain * np.array([2.0 * e_z * w_z - 2.0 * e_p * w_p, w_z * w_z - w_p * w_p])
        return A, B, C, gain


def default_sections() -> tuple[NotchSection, ...]:
    """Return the sections of the filter with default parameters."""
    return flown_sections({})


def discretise(sections: Sequence[NotchSection], period: float) -> Struct:
    """Return the sections in discrete time as the struct ``hsv_notch``, each prewarped to keep its centre frequency.

    Raises:
        ParameterError: A centre frequency is not below the Nyquist frequency.
    """
    found = []
    for i, section in enumerate(sections):
        angle = section.zero_frequency * period / 2.0
        if angle >= math.pi / 2.0:
            raise ParameterError(
                f"parameter notch.zero_frequency[{i}] = {section.zero_frequency}: "
                f"expected less than the Nyquist frequency {math.pi / period:.6g} rad/s"
            )
        A, _, C, D = section.state_space()
        # Bilinear transform s = (1 / half) (z - 1) / (z + 1); this "half" (pre-warping) keeps the centre frequency.
        half = tangent(angle) / section.zero_frequency
        identity = np.eye(2)
        inverse = solve(identity - half * A, identity)
        output = C[0] * inverse[0] + C[1] * inverse[1]
        # inverse (I + half A) = 2 inverse - I, since I + half A = 2 I - (I - half A); the section has B = (1, 0).
        found.append((2.0 * inverse - identity, 2.0 * half * inverse[:, 0], output, D + half * output[0]))
    return _in_series(sections, found)


def continuous(sections: Sequence[NotchSection]) -> Struct:
    """Return the sections in continuous time (paper eq. 39) as the struct ``hsv_notch`` of the core."""
    return _in_series(sections, [section.state_space() for section in sections])


def _in_series(sections: Sequence[NotchSection], found: Sequence[tuple[Any, ...]]) -> Struct:
    """Return the struct ``hsv_notch`` for ``sections``; ``found`` has the matrices A, B, C, D of each of them.

    It also contains the equilibrium of each section for unit input, which the bilinear transform does not change.
    """
    n = len(sections)
    A, B, C, D = (np.array([row[k] for row in found], float) for k in range(4))
    G = np.array([[0.0, 1.0 / (section.pole_frequency * section.pole_frequency)] for section in sections])
    return Struct("hsv_notch", A=A.reshape(n, 2, 2), B=B.reshape(n, 2), C=C.reshape(n, 2), D=D, G=G.reshape(n, 2))


def notch_response(sections: Sequence[NotchSection], frequencies: np.ndarray) -> np.ndarray:
    """Return the frequency response H(j omega), complex (f), of continuous sections in series (paper eq. 37, eq. 38).

    Args:
        sections: Sections of the filter.
        frequencies: (f) frequencies omega, rad/s.
    """
    total = np.ones(len(frequencies), complex)
    for n in sections:
        zero, pole = 1j * frequencies / n.zero_frequency, 1j * frequencies / n.pole_frequency
        total *= (zero * zero + 2.0 * n.zero_damping * zero + 1.0) / (pole * pole + 2.0 * n.pole_damping * pole + 1.0)
    return total


def with_notch(
    A: np.ndarray, B: np.ndarray, gain: np.ndarray, notch: Struct
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A and B of the vehicle with the filter at its pitch rate, and the feedback as a gain on the joint state.

    Args:
        A: (..., n, n) state matrices of the vehicle, discrete time, with the pitch rate among the states.
        B: (..., n, m) input matrices of the vehicle.
        gain: (m, n) gain of u = gain x, where x contains the filtered pitch rate.
        notch: Discrete filter with s states.

    Returns:
        A (..., n + s, n + s), B (..., n + s, m) and gain (m, n + s), with the filter's states last.
    """
    A_s, B_s, C_s, D_s = series(notch)
    n, s = A.shape[-1], len(A_s)
    whole, inputs = np.zeros((*A.shape[:-2], n + s, n + s)), np.zeros((*B.shape[:-2], n + s, B.shape[-1]))
    whole[..., :n, :n], whole[..., n:, n:], whole[..., n:, PITCH_RATE] = A, A_s, B_s
    inputs[..., :n, :] = B
    full = np.concatenate((gain, np.outer(gain[:, PITCH_RATE], C_s)), axis=1)
    full[:, PITCH_RATE] *= D_s
    return whole, inputs, full


def series(data: Struct) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return A (2 n, 2 n), B (2 n), C (2 n), D of the n sections in ``data`` in series; states in section order."""
    size = 2 * len(data.D)
    A, B, C, D = np.zeros((size, size)), np.zeros(size), np.zeros(size), 1.0
    for i in range(len(data.D)):
        rows = slice(2 * i, 2 * i + 2)
        A[rows] = np.outer(data.B[i], C)
        A[rows, rows] = data.A[i]
        B[rows] = data.B[i] * D
        C = data.D[i] * C
        C[rows] = data.C[i]
        D = float(data.D[i] * D)
    return A, B, C, D


def flown_sections(values: Mapping[str, object]) -> tuple[NotchSection, ...]:
    """Return the sections of the filter in flight; each array of ``notch.flown.*`` that is given replaces the design's.

    Raises:
        ParameterError: A value is wrong, arrays have different lengths, or there are too many sections.
    """
    v = validate((*DESIGN_NOTCH_PARAMETERS, *FLOWN_NOTCH_PARAMETERS), values)
    pairs = zip(DESIGN_NOTCH_PARAMETERS[1:], FLOWN_NOTCH_PARAMETERS, strict=True)
    chosen = [flown if v[flown.name] else designed for designed, flown in pairs]
    columns = [v[parameter.name] for parameter in chosen]
    # The values of the design have the right length, so that an error names a parameter of the flight.
    standard = next((p for p in chosen if p in DESIGN_NOTCH_PARAMETERS), chosen[0])
    n = len(v[standard.name])
    for parameter, column in zip(chosen, columns, strict=True):
        if len(column) != n or n > lib.MAX_SECTIONS:
            raise ParameterError(
                f"parameter {parameter.name}: {len(column)} values, "
                f"expected as many as {standard.name}, {n} (at most {lib.MAX_SECTIONS})"
            )
    return tuple(NotchSection(*row) for row in zip(*columns, strict=True))


class NotchResult(NamedTuple):
    """Result of a step: ``filtered_pitch_rate`` (rad/s), and ``filter_state`` (2 per section) before the step."""

    filtered_pitch_rate: float
    filter_state: np.ndarray


class NotchFilter:
    """Notch filter of the pitch rate: sections in series; without sections the pitch rate passes unchanged."""

    PARAMETERS = (*NOTCH_PARAMETERS, *Estimator.PARAMETERS)

    def __init__(self, sections: Sequence[NotchSection], period: float, estimator: Estimator | None = None) -> None:
        self.sections = tuple(sections)
        self.estimator = estimator
        """State estimator whose pitch rate the caller passes to :meth:`step`; None: that of the measurement."""
        self.data = discretise(sections, period)
        self._state = np.zeros(2 * len(sections))
        self._started = False

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Build the filter from :data:`NOTCH_PARAMETERS` and, if the estimator is enabled, its parameters.

        Raises:
            ParameterError: A value is wrong, or arrays have different lengths.
            DesignError, TrimError: The estimator has no steady gain, or the flight has no initial trim.
        """
        v = validate((*NOTCH_PARAMETERS, ESTIMATOR_ENABLED), values)
        sections = flown_sections(values)
        period = v["period"]
        estimator = Estimator.from_parameters(values, period) if v[ESTIMATOR_ENABLED.name] else None
        return cls(sections if v["notch.enabled"] else [], period, estimator)

    def reset(self) -> None:
        """Reset the filter: the next step starts from the equilibrium for its input."""
        self._started = False

    def step(self, pitch_rate: float) -> NotchResult:
        """Filter the next value of ``pitch_rate`` (rad/s); the first one after a reset starts at equilibrium."""
        if not self._started:
            lib.hsv_notch_rest(self.data.pointer, pitch_rate, doubles(self._state))
            self._started = True
        before = self._state.copy()
        return NotchResult(lib.hsv_notch_step(self.data.pointer, doubles(self._state), pitch_rate), before)
