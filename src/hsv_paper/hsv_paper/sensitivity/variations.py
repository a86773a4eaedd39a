"""The baseline design with one group of its weights, or the input bounds of K, multiplied by a factor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsv.base.processes import Progress
from hsv.control.design import ControlDesign, find_design, read_design
from hsv.design.baseline import disturbance_columns, nominal_family, nominal_problem, with_family
from hsv.design.feedback import feedback_gain
from hsv.design.inputs import DesignInputs, InputSize, RigidScale, find_inputs, read_inputs
from hsv.model.signals import N_RIGID, N_STATES
from hsv_paper.figures.style import BLUE, GREEN, ORANGE, RED
from hsv_paper.sensitivity.controllers import PURPLE

FACTORS = (0.5, 0.5**0.5, 1.0, 2.0**0.5, 2.0)
"""Factors by which a group is multiplied; 1: the baseline's own value."""


@dataclass(frozen=True)
class Group:
    """Fields that are varied together, of state scale, input scale or input bound, and their colour in the plots."""

    label: str
    color: str
    states: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    bounds: tuple[str, ...] = ()

    def times(self, part: Any, factor: float) -> Any:
        """Return the inputs of F or of K, ``part``, with this group times ``factor``."""
        fields = {"state_scale": self.states, "input_scale": self.inputs, "input_bound": self.bounds}
        tables = {name: _times(getattr(part, name), names, factor) for name, names in fields.items() if names}
        return part.model_copy(update=tables)


def _times(table: RigidScale | InputSize, names: Sequence[str], factor: float) -> RigidScale | InputSize:
    return table.model_copy(update={name: factor * getattr(table, name) for name in names})


_INPUTS = ("fuel_equivalence_ratio", "elevator_deflection")

ELEVATOR = Group("scale of the elevator", RED, inputs=_INPUTS[1:])
WEIGHTS = (
    Group("scale of altitude and velocity", BLUE, states=("altitude", "velocity")),
    Group("scale of the angles and the pitch rate", GREEN, states=("angle_of_attack", "pitch_angle", "pitch_rate")),
    Group("scale of the fuel equivalence ratio", ORANGE, inputs=_INPUTS[:1]),
    ELEVATOR,
)
"""The weights are one over the squares of these scales: psi and sigma of K (eq. 31), and those of F."""

BOUNDS = Group("bounds of the nominal inputs", PURPLE, bounds=_INPUTS)
"""Groups of K alone (eq. 35)."""

GROUPS = {"F": WEIGHTS, "K": (*WEIGHTS, BOUNDS)}


@dataclass(frozen=True)
class Variations:
    """The design inputs of the baseline, and the design that is flown."""

    inputs: DesignInputs
    flown: ControlDesign

    def feedback(self, group: Group, factor: float) -> ControlDesign:
        """Return the design with F recomputed, with ``group`` of its weights multiplied by ``factor``.

        Raises:
            DesignError: No solution.
        """
        if factor == 1.0:
            return self.flown
        part = group.times(self.inputs.feedback, factor)
        polytope = self.flown.polytope
        found = feedback_gain(
            polytope.A[:, :N_RIGID, :N_RIGID],
            polytope.B[:, :N_RIGID],
            disturbance_columns(self.inputs),
            part.state_scale.array(),
            part.input_scale.array(),
            part.method,
        )
        gain = np.zeros((2, N_STATES))
        gain[:, :N_RIGID] = found.F
        return replace(self.flown, feedback_gain=gain, tube=None)

    def nominal(self, group: Group, factor: float) -> ControlDesign:
        """Return the design with the family of K recomputed, ``group`` of its weights or bounds times ``factor``.

        Raises:
            DesignError: No solution.
        """
        if factor == 1.0:
            return self.flown
        changed = self.inputs.model_copy(update={"nominal": group.times(self.inputs.nominal, factor)})
        problem = nominal_problem(changed, self.flown.polytope, changed.nominal.input_bound.array())
        family = nominal_family(changed, problem, lambda *_: None)
        scaled = replace(
            self.flown, nominal_state_scale=problem.state_scale, nominal_input_scale=problem.input_scale, tube=None
        )
        return with_family(scaled, problem, family)

    def design(
        self, factors: Mapping[str, Sequence[float]], progress: Progress
    ) -> dict[tuple[str, Group, float], ControlDesign]:
        """Return the designs by law (F or K), group and factor; errors as above."""
        wanted = [(law, group, factor) for law, along in factors.items() for group in GROUPS[law] for factor in along]
        designs = {}
        for done, (law, group, factor) in enumerate(wanted):
            progress("weights, designs", done, len(wanted))
            make = self.feedback if law == "F" else self.nominal
            designs[law, group, factor] = make(group, factor)
        progress("weights, designs", len(wanted), len(wanted))
        return designs


def baseline_variations() -> Variations:
    """Return those of the shipped baseline."""
    return Variations(read_inputs(find_inputs("baseline")), read_design(find_design("baseline")))
