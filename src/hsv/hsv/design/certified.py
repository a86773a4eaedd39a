"""A certified design, read back from its two files with its inputs and its invariant set."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from hsv.control.checks import Subject, load_subject
from hsv.design.disturbance import DisturbanceSet
from hsv.design.inputs import DesignInputs, inputs_from_report
from hsv.design.sets.invariant_set import InvariantSet
from hsv.design.tube_problem import tube_problem


@dataclass(frozen=True)
class CertifiedDesign(Subject):
    """A design and its certificate."""

    @cached_property
    def inputs(self) -> DesignInputs:
        """The design inputs in the certificate, checked."""
        return inputs_from_report(self.certificate["inputs"])

    @property
    def disturbance(self) -> DisturbanceSet:
        """W as certified."""
        return DisturbanceSet.from_report(self.certificate["tube"]["disturbance"]["channels"])

    @property
    def lag_feedback(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Least and largest feedback (2 each) to the lag of the plan; none where actuators are ideal."""
        lag = self.certificate["tube"]["tightening"].get("lag_feedback")
        return (np.array(lag["lower"]), np.array(lag["upper"])) if lag else None

    def invariant_set(self) -> InvariantSet:
        """Return the set of the certificate, for the design as it flies."""
        problem = tube_problem(self.design, self.vehicle, self.disturbance)
        return InvariantSet.from_report(problem, self.certificate["tube"]["invariant_set"])


def load_certified(path: Path) -> CertifiedDesign:
    """Return the parameter file at ``path`` with its certificate.

    Raises:
        DesignError: A file that is missing or malformed.
    """
    return CertifiedDesign(**vars(load_subject(path)))
