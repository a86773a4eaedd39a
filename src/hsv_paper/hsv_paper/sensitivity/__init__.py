"""Sensitivity studies: on what the results depend, and where each controller loses the vehicle."""

from __future__ import annotations

from hsv_paper.sensitivity import factor, flown, notch
from hsv_paper.study import Study

STUDIES = {
    study.name: study
    for study in (
        Study("coupling", "Inertial coupling", flown.coupling, 5),
        Study("notch", "Centre and depth of the notch filter", notch.run, 10),
        Study("parameters", "Size of the parameter uncertainty", flown.parameters, 5),
        Study("fault", "Depth of the fault", flown.fault, 5),
        Study("factor", "Adjustable factor τ", factor.run, 20),
    )
}
"""All sensitivity studies, by name."""
