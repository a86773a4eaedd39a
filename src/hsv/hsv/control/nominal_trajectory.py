"""Reference and nominal trajectory (paper eq. 20) under an exchangeable nominal law (eq. 32 to eq. 35)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.control.design import ControlDesign
from hsv.control.nominal_law import NOT_IN_FAMILY, FamilyLaw, KothareLaw, NominalStatus
from hsv.control.notch_filter import DESIGN_NOTCH_PARAMETERS
from hsv.control.reference_trajectory import REFERENCE_PARAMETERS, ReferenceTrajectory
from hsv.core import Struct, doubles, lib
from hsv.model.actuators import ACTUATOR_PARAMETERS
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES
from hsv.model.vehicle import VEHICLE_PARAMETERS

LAWS = ("family", "kothare_online", "qp")

NOMINAL_PARAMETERS = (
    *REFERENCE_PARAMETERS,
    Parameter("nominal.law", "family", "nested gains, the same LMI solved in flight, or a QP", choices=LAWS),
)


class NominalResult(NamedTuple):
    """Nominal step: x_r (9), u_r (2), x_n (9), u_n (2); gain K (2, 9), its index as in :class:`LawResult`, status."""

    reference: np.ndarray
    reference_input: np.ndarray
    deviation: np.ndarray
    input: np.ndarray
    gain: np.ndarray
    gain_index: int
    status: NominalStatus

    @property
    def in_family(self) -> bool:
        """Whether the gain belongs to the nested family of the design."""
        return self.gain_index != NOT_IN_FAMILY


class NominalTrajectory:
    """The nominal system of a flight under its nominal law, starting from x_n(0) = x(0) - x_r(0).

    Measured altitude and velocity schedule its model.
    """

    PARAMETERS = (*NOMINAL_PARAMETERS, *VEHICLE_PARAMETERS, *ACTUATOR_PARAMETERS)
    """The actuators' limits apply to commands in flight only (:func:`hsv.control.governor.command_in_flight`)."""

    def __init__(
        self, design: ControlDesign | None, reference: ReferenceTrajectory, law: FamilyLaw | None = None
    ) -> None:
        """Use ``law``, by default the nested family of the design; without a design, x_n and u_n stay zero."""
        self.reference = reference
        self.data = nominal_data(design) if design else NO_NOMINAL
        self.law = law or FamilyLaw(self.data)
        self._deviation = np.zeros(N_STATES)
        self._step = 0
        self._planned = reference
        self._input = np.zeros(N_INPUTS)

    @classmethod
    def from_parameters(cls, values: Mapping[str, object], design: ControlDesign | None) -> Self:
        """Build from ``design`` and the flat parameters ``values``, see :data:`NOMINAL_PARAMETERS`.

        The model has no perturbed parameters; without a design, the period is the one in ``values``.
        """
        v = validate(NOMINAL_PARAMETERS, values)
        if design is None:
            if v["nominal.law"] != LAWS[0]:
                raise ParameterError(f"parameter nominal.law = {v['nominal.law']!r}: expected a design that it is for")
            period = validate(DESIGN_NOTCH_PARAMETERS, values)["period"]
            return cls(None, ReferenceTrajectory.from_parameters(values, period))
        reference = ReferenceTrajectory.from_parameters(values, design.period)
        return cls(design, reference, _law(v, design, reference))

    @property
    def next_step(self) -> int:
        """Number of the next step."""
        return self._step

    @property
    def deviation(self) -> np.ndarray:
        """Nominal state x_n (9) of the next step; zero before step 0."""
        return self._deviation.copy()

    def change_reference(self, reference: ReferenceTrajectory) -> None:
        """Use ``reference`` until :meth:`reset`; it must equal the present reference in all steps up to now."""
        self.reference = reference

    def reset(self) -> None:
        """Go back to the original reference and to step 0, which sets x_n from the measurement again; reset the law."""
        self.reference = self._planned
        self._deviation[:] = 0.0
        self._step = 0
        self.law.reset()

    def step(self, state: np.ndarray) -> NominalResult:
        """Return reference, nominal state and input of this step from the measured ``state`` (9), then advance x_n."""
        row = self.reference.row(self._step)
        data = self.reference.data
        reference = data.state[row]
        if self._step == 0 and len(self.data.gains):
            self._deviation[:] = state - reference
        self._step += 1
        deviation = self._deviation.copy()
        chosen = self.law.step(deviation)
        self._input[:] = chosen.input
        in_envelope = not len(self.data.gains) or lib.hsv_nominal_advance(
            self.data.polytope.pointer,
            state[0],
            state[1],
            *map(doubles, (self._deviation, self._input, data.defect[row])),
        )
        status = chosen.status if in_envelope else chosen.status | NominalStatus.OUTSIDE_ENVELOPE
        return NominalResult(
            reference, data.input[row], deviation, chosen.input, chosen.gain, chosen.gain_index, status
        )


_FLAT = Struct("hsv_axis", breakpoints=np.array([0.0, 1.0]), coefficients=np.zeros((4, 1, 0)))

NO_NOMINAL = Struct(
    "hsv_nominal",
    polytope=Struct(
        "hsv_polytope",
        S=np.zeros((0, 0)),
        entries=np.zeros(0, np.int64),
        starts=np.zeros(2 * N_STATES + 1, np.int64),
        altitude=_FLAT,
        velocity=_FLAT,
    ),
    gains=np.zeros((0, N_INPUTS, N_STATES)),
    ellipsoids=np.zeros((0, N_RIGID, N_RIGID)),
    interpolated=False,
)
"""The nominal system of a flight without a design: no gains, so that x_n and u_n stay zero."""


def nominal_data(design: ControlDesign) -> Struct:
    """Return the nominal system and the nested family of ``design`` as the struct ``hsv_nominal`` of the core."""
    return Struct(
        "hsv_nominal",
        polytope=design.polytope.data(),
        gains=design.nominal_gains,
        ellipsoids=design.nominal_ellipsoids,
        interpolated=design.interpolated,
    )


def _law(values: Mapping[str, Any], design: ControlDesign, reference: ReferenceTrajectory) -> FamilyLaw | None:
    if values["nominal.law"] == "kothare_online":
        return KothareLaw(design, nominal_data(design))
    if values["nominal.law"] == "qp":
        from hsv.control.qp_law import QpLaw  # its solver takes time to import

        return QpLaw(design, nominal_data(design), reference)
    return None
