"""The paper's figures, drawn from this project's designs and flights."""

from __future__ import annotations

from hsv_paper.figures import frequency, invariant_set, over_time
from hsv_paper.figures.figure import PaperFigure
from hsv_paper.figures.over_time import CASE_1, CASE_2

FIGURES = {
    figure.number: figure
    for figure in (
        PaperFigure(
            2,
            "Bode diagram comparison of polytopic LPV and DM. (a) Amplitude frequency characteristic. "
            "(b) Phase frequency characteristic.",
            frequency.figure_02,
        ),
        PaperFigure(
            3,
            "Bode diagram of notch filter's effect on flexible hypersonic vehicle. (a) Effect of omega_p "
            "when epsilon_p = 0.5. (b) Effect of epsilon_p when omega_p = 15.",
            frequency.figure_03,
        ),
        PaperFigure(4, "Open-loop pole distribution.", frequency.figure_04),
        PaperFigure(5, "Bode diagram of Notch filter on flexible modes.", frequency.figure_05),
        PaperFigure(
            6,
            "The state of system in the mRPI set at the same time.",
            invariant_set.figure_06,
            (invariant_set.WITH, invariant_set.WITHOUT),
        ),
        PaperFigure(
            8,
            "Bode diagram comparison of codesigned polytopic LPV model and ECM. (a) Amplitude frequency "
            "characteristics. (b) Phase frequency characteristics.",
            frequency.figure_08,
        ),
        PaperFigure(
            9,
            "Trajectory in Case 1. (a) Altitude. (b) Velocity.",
            over_time.figure_09,
            (*CASE_1, *over_time.RMPC_SINGLE),
        ),
        PaperFigure(
            10, "States in Case 1. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", over_time.figure_10, CASE_1
        ),
        PaperFigure(
            11,
            "The generalized flexible coordinates of real system in Case 1. (a) The first-order "
            "generalized flexible coordinate. (b) Derivative of the first-order generalized flexible "
            "coordinate. (c) The second-order generalized flexible coordinate. (d) Derivative of the "
            "second-order generalized flexible coordinate.",
            over_time.figure_11,
            CASE_1,
        ),
        PaperFigure(
            12, "Control inputs in Case 1. (a) Fuel-to-air ratio. (b) Elevator deflection.", over_time.figure_12, CASE_1
        ),
        PaperFigure(
            13,
            "Derivative of the generalized flexible coordinates of nominal system in the case of notch "
            "filter for the second-order flexible mode. (a) Derivative of the first-order generalized "
            "flexible coordinate. (b) Derivative of the second-order generalized flexible coordinate.",
            over_time.figure_13,
            (over_time.SECOND_MODE, over_time.NO_FILTER),
        ),
        PaperFigure(14, "Trajectory in case 2. (a) altitude. (b) Velocity.", over_time.figure_14, CASE_2),
        PaperFigure(
            15, "States in Case 2. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", over_time.figure_15, CASE_2
        ),
        PaperFigure(
            16,
            "The generalized flexible coordinates of real system in Case 2. (a) The first-order "
            "generalized flexible coordinate. (b) Derivative of the first-order generalized flexible "
            "coordinate. (c) The second-order generalized flexible coordinate. (d) Derivative of the "
            "second-order generalized flexible coordinate.",
            over_time.figure_16,
            CASE_2,
        ),
        PaperFigure(
            17, "Control inputs in Case 2. (a) Fuel-to-air ratio. (b) Elevator deflection.", over_time.figure_17, CASE_2
        ),
    )
}
"""All figures by the paper's number; Figures 1 and 7 are block diagrams."""
