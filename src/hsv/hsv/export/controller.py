"""Notch filter, nominal trajectory and tube law of a design as one C99 file for ``hsv_block.h``."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from hsv.control.c_block import include_folder
from hsv.control.design import ControlDesign
from hsv.control.nominal_law import MEMBERSHIP_TOLERANCE, NominalStatus
from hsv.control.notch_filter import NotchSection, discretise
from hsv.errors import DesignError
from hsv.vehicle.dynamics import N_INPUTS, N_RIGID, N_STATES

SOURCE = "controller.c"
HEADER = "hsv_block.h"


@dataclass(frozen=True)
class StepBound:
    """The most that a step of a block computes, step 0 included, and the numbers that it keeps in its state."""

    multiplications: int
    """And divisions."""
    additions: int
    """And subtractions."""
    comparisons: int
    state_size: int


def controller_files(design: ControlDesign) -> dict[str, str]:
    """Return the texts of the files, by name, that fly ``design`` without this library: the source and its header.

    Raises:
        DesignError: The design carries no tube.
    """
    if design.tube is None:
        raise DesignError(f"design {design.name!r}: parameter tube.shape: empty, expected a design with a tube")
    header = (include_folder() / HEADER).read_text(encoding="utf-8")
    return {SOURCE: controller_source(design), HEADER: header}


def controller_source(design: ControlDesign, notch: Sequence[NotchSection] = ()) -> str:
    """Return the C source of the three blocks, with these sections of the notch filter in place of the design's."""
    data, polytope = discretise(notch or design.notch, design.period), design.polytope.data()
    constants = {
        "notch_A": data.A,
        "notch_B": data.B,
        "notch_C": data.C,
        "notch_D": data.D,
        "notch_rest": data.G,
        "altitude_breakpoints": polytope.altitude.breakpoints,
        "altitude_weights": polytope.altitude.coefficients,
        "velocity_breakpoints": polytope.velocity.breakpoints,
        "velocity_weights": polytope.velocity.coefficients,
        "vertices": np.concatenate((design.polytope.A, design.polytope.B), axis=2),
        "nominal_gains": design.nominal_gains,
        "nominal_ellipsoids": design.nominal_ellipsoids,
        "feedback_gain": design.feedback_gain,
        "input_minimum": design.input_minimum,
        "input_maximum": design.input_maximum,
        "designed_tau": design.tau,
    }
    environment = Environment(
        loader=PackageLoader("hsv", "export"),
        autoescape=False,  # it is no HTML
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"initialiser": _initialiser, "plain": _plain}
    return environment.get_template(f"{SOURCE}.j2").render(
        design=design,
        digest=design.to_parameters()["design.hash"],
        file=SOURCE,
        constants=constants,
        constant_bytes=sum(array.nbytes for array in constants.values()),
        bounds=step_bounds(design, notch),
        boundary=1.0 + MEMBERSHIP_TOLERANCE,
        outside_family=NominalStatus.OUTSIDE_FAMILY.value,
        outside_envelope=NominalStatus.OUTSIDE_ENVELOPE.value,
    )


def step_bounds(design: ControlDesign, notch: Sequence[NotchSection] = ()) -> dict[str, StepBound]:
    """Return the bounds of a step of each block, by its name, counted from the loops of its C source."""
    n, m, rigid, integrated = N_STATES, N_INPUTS, N_RIGID, 2
    sections, gains = len(notch or design.notch), len(design.nominal_gains)
    axes = [axis.coefficients.shape[1:] for axis in (design.polytope.altitude, design.polytope.velocity)]
    vertices, width = len(design.polytope.A), n * (n + m)
    membership, weights = rigid * rigid + rigid, 3 * sum(count for _, count in axes)
    filtered = sections if design.filtered else 0
    # Between two gains: the input of the inner one, the share of the outer one, and their sum.
    products, sums = (m * n + 1 + m, m * n + 2 + 2 * m) if design.interpolated and gains > 1 else (0, 0)
    return {
        "notch_filter": StepBound((9 + 2) * sections, 6 * sections, 0, 2 * sections),
        "nominal_trajectory": StepBound(
            multiplications=gains * membership + m * n + products + weights + vertices * (1 + width) + width,
            additions=n + gains * membership + m * n + sums + weights + len(axes) + vertices * width + width + n,
            comparisons=gains + sum(3 + pieces - 1 for pieces, _ in axes),
            state_size=n,
        ),
        "tube_law": StepBound(
            multiplications=9 * filtered + m * (n + rigid + 3 * integrated) + integrated,
            additions=2 * n + 2 + 6 * filtered + m * (n + integrated + 4) + 3 * integrated,
            comparisons=4 * m + 1,
            state_size=integrated + 2 * filtered,
        ),
    }


def _plain(text: str) -> str:
    """Return a name as it can stand in a comment of C: it must not end it."""
    return re.sub(r"[^A-Za-z0-9_. -]", "_", text)


def _initialiser(array: np.ndarray, column: int = 4) -> str:
    """Return the initialiser of a C array whose first brace stands in ``column``; hexadecimal numbers are exact."""
    if array.ndim > 1:
        parts, separator = [_initialiser(row, column + 1) for row in array], ","
    else:
        parts, separator = textwrap.wrap(", ".join(map(float.hex, array.tolist())), 114 - column), ""
    return "{" + f"{separator}\n{' ' * (column + 1)}".join(parts) + "}"
