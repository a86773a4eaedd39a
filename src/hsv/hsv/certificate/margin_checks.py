"""The block ``margins`` of a certificate: what a design states, and the checks that recompute it.

A design finds its margins by a search over frequencies. The checks decide by the pencil of
:func:`hsv.certificate.margins.crossings`, at every vertex and at the stated worst corners; a few other corners are
drawn afresh. The matrices of the loop come from :mod:`hsv.certificate.loops` in both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.certificate.checks import Check, Checks, Subject, at_most, recomputed
from hsv.certificate.loops import INPUTS, BrokenLoop, vertex_loops
from hsv.certificate.margins import CASES, SLACK, VehicleLoops, design_loops, disk_margin, is_proved
from hsv.control.design import ControlDesign
from hsv.model.vehicle import Vehicle

_DRAWN = 40
"""Number of corners that :func:`margin_checks` draws."""

_LOOP = "elevator"
"""The loop whose margin is stated for the coupled vehicle; it is the smallest of single loops at every design."""


_NOMINAL = ("margin", "frequency", "place")


def margins_report(
    design: ControlDesign,
    vehicle: Vehicle,
    inputs: Mapping[str, Any],
    progress: Progress = lambda *_: None,
) -> dict[str, Any]:
    """Return the block ``margins`` of the certificate of a design, with its inputs as a table in SI."""
    vertices: dict[str, dict[str, list[float]]] = {}
    for name in INPUTS:
        found = [disk_margin(loop.broken(name)) for loop in vertex_loops(design)]
        vertices[name] = {"margin": [each.margin for each in found], "frequency": [each.frequency for each in found]}
        if name == "both":
            vertices[name]["attained"] = [each.attained for each in found]
    report: dict[str, Any] = {"vertices": vertices, "nominal": {}, "corners": {}}
    for case in CASES:
        loops = design_loops(design, vehicle, inputs, case)
        for kind, over in (("nominal", [""]), ("corners", loops.corners())):
            worst = loops.worst(_LOOP, over, partial(progress, f"margins of {kind}, {case} hardware"))
            proved = disk_margin(loops.loop(worst.corner, worst.place).broken(_LOOP))
            stated = asdict(worst) | {"margin": proved.margin, "frequency": proved.frequency}
            report[kind][case] = stated if kind == "corners" else {name: stated[name] for name in _NOMINAL}
    return report


def margin_checks(subject: Subject, seed: int) -> Checks:
    """Check the disk margins at every vertex and, for the coupled vehicle, nominal and at the stated worst corner.

    The margin at the worst corner must also be the smallest among corners that are drawn with the ``seed``.
    """
    loops = vertex_loops(subject.design)
    for name in INPUTS:
        yield from _margins_of(subject, f"margins.vertices.{name}", [loop.broken(name) for loop in loops])
    generator = np.random.default_rng(seed)
    for case in CASES:
        around = _around(subject, case)
        for kind, drawn in (("nominal", [""]), ("corners", generator.choice(around.corners(), _DRAWN).tolist())):
            field = f"margins.{kind}.{case}"
            stated = subject.stated(field)
            corner = stated["corner"] if kind == "corners" else ""
            yield from _margins_of(subject, field, [around.loop(corner, stated["place"]).broken(_LOOP)])
            least = around.worst(_LOOP, drawn).margin
            check = at_most(f"{field}.margin, share above the smallest of {len(drawn)} vehicles", *_over(stated, least))
            yield replace(check, fields=(f"{field}.place", *([f"{field}.corner"] if kind == "corners" else [])))
        field = f"margins.corners.{case}"
        yield recomputed(subject, f"{field}.count", len(around.corners()), "copied")
        unstable = around.worst(_LOOP, around.corners()).unstable if subject.stated(f"{field}.unstable") else 0
        if not unstable:
            unstable = int(subject.stated(f"{field}.margin") == 0.0)
        yield recomputed(subject, f"{field}.unstable", unstable, "copied")


def corner_checks(subject: Subject, progress: Progress = lambda *_: None) -> Checks:
    """Check that no corner of the vehicle's bounds has a smaller disk margin than the one stated."""
    for case in CASES:
        around = _around(subject, case)
        worst = around.worst(_LOOP, around.corners(), partial(progress, f"corners, {case} hardware"))
        field = f"margins.corners.{case}"
        name = f"{field}.margin, share above the smallest of {worst.count} vehicles"
        yield at_most(name, *_over(subject.stated(field), worst.margin))
        yield recomputed(subject, f"{field}.unstable", worst.unstable, "copied")


def _around(subject: Subject, case: str) -> VehicleLoops:
    return design_loops(subject.design, subject.vehicle, subject.certificate["inputs"], case)


def _over(stated: Mapping[str, Any], least: float) -> tuple[float, float]:
    """Return by how much a stated margin exceeds the ``least`` one, and by how much it may."""
    return (float(stated["margin"]) / least - 1.0 if least else float(stated["margin"])), SLACK


def _margins_of(subject: Subject, field: str, loops: Sequence[BrokenLoop]) -> Checks:
    """Check margins and frequencies of ``loops``, stated under ``field`` as an array or, for one loop, as a number.

    A margin must be proved by the pencil, and reached at the stated frequency; that of an unstable loop is 0.
    """
    margins, frequencies = (np.atleast_1d(subject.stated(f"{field}.{name}")) for name in ("margin", "frequency"))
    if not len(margins) == len(frequencies) == len(loops):
        raise DesignError(f"{field}: {len(margins)} margins, {len(frequencies)} frequencies, expected {len(loops)}")
    found = [disk_margin(loop) for loop in loops]
    # With both inputs, the scaling that proves a margin is not stated; it is found again.
    proved = [
        (margin == 0.0 and loop.growth >= 0.0) or is_proved(loop, margin, each.scaling)
        for loop, margin, each in zip(loops, margins.tolist(), found, strict=True)
    ]
    yield replace(
        Check(f"{field}.margin, proved by the pencil", f"{sum(proved)} of {len(loops)}", "all", all(proved)),
        fields=(f"{field}.margin",),
    )
    # The check above alone would accept a margin that is too small.
    for name, kind in (
        ("margin", "disk margins"),
        ("frequency", "frequencies of margins"),
        ("attained", "disk margins"),
    ):
        if name != "attained" or field.endswith("both"):
            values = [getattr(each, name) for each in found]
            stated = subject.stated(f"{field}.{name}")
            yield recomputed(subject, f"{field}.{name}", values if isinstance(stated, list) else values[0], kind)
