"""Export of a design's notch filter, nominal trajectory and tube law as blocks of ``hsv_block.h`` in C99."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.control.nominal_trajectory import nominal_data
from hsv.control.tube_law import TubeLaw
from hsv.core import Struct, ffi
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES
from hsv.plugins.fmu_export import ExportedBlock
from hsv.plugins.library import include_folder

SOURCE = "controller.c"
NUMBERS = "design.h"
HEADER = "hsv_block.h"
_COUNTS = ("multiplications", "additions", "comparisons", "numbers of state")


@dataclass(frozen=True)
class StepBound:
    """Maximum number of operations in a step of a block, step 0 included, and the size of its state."""

    multiplications: int
    """Multiplications and divisions."""
    additions: int
    """Additions and subtractions."""
    comparisons: int
    state_size: int


def controller_files(design: ControlDesign) -> dict[str, str]:
    """Return the texts, by file name, of the C sources of the controller of ``design``, which need no other files.

    Raises:
        DesignError: The design has no tube.
    """
    if design.tube is None:
        raise DesignError(f"design {design.name!r}: parameter tube.shape: empty, expected a design with a tube")
    source = files("hsv.plugins").joinpath("export.c").read_text(encoding="utf-8")
    header = (include_folder() / HEADER).read_text(encoding="utf-8")
    return {SOURCE: source, NUMBERS: design_header(design), HEADER: header, **core_headers(source)}


def core_headers(source: str) -> dict[str, str]:
    """Return the texts, by file name, of the core's headers that ``source`` includes, directly or indirectly."""
    found: dict[str, str] = {}
    for name in re.findall(r'^#include "(.+)"$', source, re.MULTILINE):
        header = files("hsv.core").joinpath(name)
        if header.is_file():
            text = header.read_text(encoding="utf-8")
            found |= {name: text, **core_headers(text)}
    return found


def exported_controller(design: ControlDesign) -> ExportedBlock:
    """Return the controller of ``design`` as a block, for export as an FMU.

    Raises:
        DesignError: The design has no tube.
    """
    description = f"Notch filter, nominal trajectory and tube law of the design {design.name}"
    return ExportedBlock("controller", description, SOURCE, controller_files(design), design.period)


def design_header(design: ControlDesign) -> str:
    """Return the text of the C header with the numbers of ``design``, as structs of ``core.h``."""
    about = (
        f"The digest of the design is {design.to_parameters()['design.hash']}. This file is written by "
        '"hsv export-controller"; write it anew instead of changing it.',
        f'The tube is certified for the inertial coupling "{_plain(design.coupling)}" and the factors tau that '
        f"tube_law admits. The control period T is {design.period} s. All numbers are in SI units and radians; core.h "
        "describes the arrays.",
        "Maximum number of operations in a step, step 0 included; a division counts as a multiplication, a subtraction "
        "as an addition:",
    )
    rows = [("block", *_COUNTS), *((name, *vars(most).values()) for name, most in step_bounds(design).items())]
    # The factors tau are a parameter of the block, so that the gain is F alone.
    tube = TubeLaw(design).kernel.replaced(gains=design.feedback_gain[None])
    lines = [
        f'/* Numbers of the design "{_plain(design.name)}".',
        *(f" *\n{textwrap.fill(text, 119, initial_indent=' * ', subsequent_indent=' * ')}" for text in about),
        " *",
        *(f" *   {name:18}{''.join(f'{count:>17}' for count in counts)}" for name, *counts in rows),
        " */",
        "#pragma once",
        '#include "core.h"',
        "",
        f"enum {{ SECTIONS = {len(design.notch)}, FILTERED = {int(design.filtered)} }};",
        f"#define TAU_MINIMUM {_number(design.tau_minimum.min())}",
        constant_array("designed_tau", "double", design.tau),
        *constant("nominal_data", nominal_data(design)),
        *constant("tube_data", tube),
    ]
    return "\n".join(lines) + "\n"


def step_bounds(design: ControlDesign) -> dict[str, StepBound]:
    """Return the maximum operations in a step, and the state size, by block name, from the C headers' loop bounds."""
    n, m, rigid, integrated = N_STATES, N_INPUTS, N_RIGID, 2
    sections, gains, polytope = len(design.notch), len(design.nominal_gains), design.polytope.data()
    axes = [axis.coefficients.shape[1:] for axis in (polytope.altitude, polytope.velocity)]
    vertices, size = polytope.S.shape
    used, weights = len(polytope.entries), 3 * sum(count for _, count in axes)
    membership, filtered = rigid * rigid + rigid, int(design.filtered)
    between = int(design.interpolated and gains > 1)
    return {
        "notch_filter": StepBound((9 + 2) * sections, 6 * sections, 0, 2 * sections),
        "nominal_trajectory": StepBound(
            multiplications=gains * membership + m * n + between * m * (n + 2) + weights + vertices * (1 + size) + used,
            additions=n
            + gains * membership
            + m * n
            + between * m * (n + 4)
            + weights
            + len(axes)
            + vertices * size
            + used
            + n,
            comparisons=gains + m + sum(4 + pieces - 1 for pieces, _ in axes),
            state_size=n,
        ),
        "tube_law": StepBound(
            multiplications=9 * sections * filtered + m * (n + rigid + 2 * integrated) + 1 + integrated,
            additions=2 + (2 + 6 * sections) * filtered + m * (3 * n + integrated + 6) + 3 * integrated,
            comparisons=6 * m + 1,
            state_size=integrated + 2 * sections * filtered,
        ),
    }


def constant(name: str, struct: Struct) -> list[str]:
    """Return the C definitions for ``struct``, of a type in ``core.h``: first its arrays, then the constant ``name``.

    An array is named after the path of its field, e.g. ``tube_data_notch_A``.
    """
    arrays: list[str] = []

    def fields(struct: Struct, name: str, indent: str) -> str:
        lines = []
        for field, declared in ffi.typeof(struct.kind).fields:
            value, own = getattr(struct.pointer, field), f"{name}_{field}"
            if declared.type.kind == "struct":
                text = fields(getattr(struct, field), own, indent + "    ")
            elif declared.type.kind == "pointer":
                text = f"({declared.type.item.cname} *){own}" if value else "0"
                if value:
                    arrays.append(constant_array(own, declared.type.item.cname, getattr(struct, field)))
            elif declared.type.kind == "array":
                text = _number(np.asarray(getattr(struct, field)))
            else:
                text = _number(value)
            lines.append(f"\n{indent}.{field} = {text}")
        return f"{{{','.join(lines)}}}"

    text = fields(struct, name, "    ")
    return [*arrays, f"static const {struct.kind} {name} = {text};"]


def constant_array(name: str, element: str, numbers: np.ndarray) -> str:
    """Return the C definition of an array of numbers, or of structs of numbers; an empty array gets an element 0."""
    shape = ", ".join(map(str, numbers.shape))
    values = textwrap.fill(
        ", ".join(map(_number, numbers.ravel())) or "0", 120, initial_indent="    ", subsequent_indent="    "
    )
    return f"static const {element} {name}[] = {{ /* ({shape}) */\n{values}}};"


def _number(value: Any) -> str:
    """Return a number, or an array or struct of numbers, in C; floating-point numbers are hexadecimal and so exact."""
    if isinstance(value, np.void | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return f"{{{', '.join(map(_number, value))}}}"
    if isinstance(value, int | np.integer | np.bool_):
        return str(int(value))
    return float(value).hex().replace("inf", "INFINITY").replace("nan", "NAN")


def _plain(text: str) -> str:
    """Return ``text`` with special characters replaced, so that it cannot end a comment in C."""
    return re.sub(r"[^A-Za-z0-9_. -]", "_", text)
