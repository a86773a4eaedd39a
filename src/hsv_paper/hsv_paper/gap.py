"""What is certified and what is reached: bounds, worst sequences and flights of the designs; W over parts of a tube."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hsv.base.errors import DesignError
from hsv.base.files import parse_json, read_text
from hsv.base.processes import Progress
from hsv.certificate.checks import Subject, load_subject
from hsv.certificate.convolution import LONGEST
from hsv.certificate.verification import Tube, bounds_at
from hsv.control.design_file import find_design
from hsv.flight.closed_loop import fly
from hsv.flight.corners import screening_corners
from hsv.flight.flown_checks import OUTPUTS, region, share_of
from hsv.model.dynamics import advance
from hsv.model.lpv.linearisation import acceleration_channels
from hsv.model.lpv.polytope import evaluate
from hsv.model.signals import ACCELERATED, CHANNELS, N_RIGID, STATE_NAMES
from hsv_paper.plots import BLUE, DEGREES, GREEN, GREY, RED, new_figure

RATES = (30.48, 9.144)
"""Largest rates of altitude (m/s) and velocity (m/s^2): 100 ft/s and 30 ft/s^2, as in the design `tight`."""

HEADS = ("altitude m", "velocity m/s", "alpha deg", "pitch deg", "pitch rate deg/s", "fuel", "elevator deg")
_UNITS = np.array([1.0, 1.0, DEGREES, DEGREES, DEGREES, 1.0, DEGREES])

KINDS = {
    "certified": {"color": GREY, "marker": "|"},
    "at limited rates": {"color": GREEN, "marker": "d"},
    "worst sequence": {"color": RED, "marker": "s"},
    "worst flight": {"color": BLUE, "marker": "o"},
}
"""The bounds from the largest to the smallest, and how they are drawn."""


def flown(path: Path) -> dict[str, float]:
    """Return number, level, ratio to W and outputs of the drawn flights in the JSON that ``hsv verify`` has printed.

    Raises:
        DesignError: The file is not such JSON.
    """
    try:
        found: dict[str, float] = {}
        for claim in parse_json(read_text(path))["claims"]:
            number, drawn, name = claim["name"].partition(" drawn flights: ")
            if drawn:
                found |= {"number": float(number), name: float(claim["value"])}
        return {name: found[name] for name in ("number", "level", "ratio to W", *OUTPUTS)}
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise DesignError(f"{path}: {error}, expected the output of hsv verify NAME --json") from error


def bounds(subject: Subject, flights: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Return the half-ranges (7) of the outputs of a design, SI, by :data:`KINDS`; no rates if it is adjustable."""
    tube = Tube(subject, subject.design, "tube")
    found = {"certified": np.concatenate((tube.half_width[:N_RIGID], tube.feedback))}
    if len(tube.A) == len(subject.design.polytope.A):  # the same loops at every tau
        found["at limited rates"] = np.minimum(found["certified"], bounds_at(tube, RATES, [LONGEST] * len(tube.rows)))
    found["worst sequence"] = np.array(subject.stated("tube.invariant_set.counter_examples.half_range"))
    found["worst flight"] = np.array([flights[name] for name in OUTPUTS])
    return found


def held(subject: Subject, row: int, steps: int = 3000) -> tuple[float, float]:
    """Return the largest output ``row`` of disturbances in W that are constant, at one vertex.

    The first number is that of the steady state, the second the largest on the way there, within ``steps``.
    """
    tube = Tube(subject, subject.design, "tube")
    A, columns, c = tube.A, tube.G * tube.half, tube.rows[row]
    steady = np.abs(c @ np.linalg.solve(np.eye(A.shape[1]) - A, columns)).sum(axis=-1).max()
    moved, largest = np.zeros_like(columns), 0.0
    for _ in range(steps):
        moved = A @ moved + columns
        largest = max(largest, float(np.abs(c @ moved).sum(axis=-1).max()))
    return float(steady), largest


Gap = dict[str, tuple[dict[str, float], dict[str, np.ndarray]]]
"""By design: its :func:`flown` and its :func:`bounds`."""


def gap_of(paths: Sequence[Path], progress: Progress) -> Gap:
    """Return flights and bounds of the designs after which the files ``paths`` are named."""
    found = {}
    for done, path in enumerate(paths):
        progress("bounds", done, len(paths))
        flights = flown(path)
        found[path.stem] = flights, bounds(load_subject(find_design(path.stem)), flights)
    progress("bounds", len(paths), len(paths))
    return found


def bound_rows(found: Gap) -> list[dict[str, str]]:
    """Return the rows of the table of all bounds, in m, m/s and deg."""
    return [
        {"design": f"`{name}`", "bound": kind} | dict(zip(HEADS, map("{:#.3g}".format, values * _UNITS), strict=True))
        for name, (_, kinds) in found.items()
        for kind, values in kinds.items()
    ]


def flight_rows(found: Gap) -> list[dict[str, str]]:
    """Return the rows of the table of flights, and of the pitch angle under constant disturbances."""
    rows = []
    for name, (flights, _) in found.items():
        subject = load_subject(find_design(name))
        steady, largest = np.degrees(held(subject, STATE_NAMES.index("pitch_angle")))
        declared = subject.stated("inputs.disturbance")
        window = {*(declared["fault_window"] or [declared["fault_start"]])}
        rows.append(
            {
                "design": f"`{name}`",
                "fault at, s": " to ".join(map("{:g}".format, sorted(window))),
                "drawn flights": f"{flights['number']:.0f}",
                "largest level": f"{flights['level']:.3f}",
                "largest ratio to W": f"{flights['ratio to W']:.3f}",
                "constant, steady: deg": f"{steady:.3f}",
                "on the way: deg": f"{largest:.3f}",
            }
        )
    return rows


def draw(found: Gap) -> Figure:
    """Return the figure of all bounds, each divided by the certified one."""
    figure = new_figure(0.9 + 0.22 * len(found))
    for axis, head, k in zip(figure.subplots(1, len(HEADS), sharey=True), HEADS, range(len(HEADS)), strict=True):
        for kind, style in KINDS.items():
            points = [
                (kinds[kind][k] / kinds["certified"][k], row)
                for row, (_, kinds) in enumerate(found.values())
                if kind in kinds
            ]
            axis.plot(*np.transpose(points), linestyle="none", markersize=4, label=kind, **style)
        axis.set(xlim=(0.0, 1.08), xticks=(0.0, 0.5, 1.0), xlabel=head.rpartition(" ")[0] or head)
        axis.set_yticks(range(len(found)), list(found))
    axis.invert_yaxis()
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper center", ncols=len(KINDS))
    return figure


def needed_rows(name: str, progress: Progress, steps: int = 60, directions: int = 50) -> list[dict[str, str]]:
    """Return by how much the acceleration channels exceed W of the design ``name`` over parts of its tube.

    The vehicle and 32 corners of its bounds move from errors on the boundary of a part of the ellipsoid, at ``steps``
    of the plan of the design's flight: those that are extreme in an output, and ``directions`` random ones. What the
    polytopic model does not explain (eq. 13 to 18) is divided by the bound of W. These are lower bounds of a W that is
    proved over this part of the tube.
    """
    subject = load_subject(find_design(name))
    design, vehicle, tube = subject.design, subject.vehicle, Tube(subject, subject.design, "tube")
    flight, polytope = fly(region(subject, design, share_of(subject.certificate["inputs"]))), design.polytope
    nominal = flight.reference + flight.history.deviation
    at = np.unique(np.linspace(0, 0.15 * len(nominal), steps).astype(int))
    S = np.concatenate((polytope.A, polytope.B), axis=2)
    inverse = np.linalg.inv(acceleration_channels(vehicle, design.period)[ACCELERATED])
    random = np.random.default_rng(0).standard_normal((directions, len(tube.c))) @ np.linalg.cholesky(tube.Q).T
    surface = np.vstack((random, *(sign * tube.rows @ tube.Q for sign in (1.0, -1.0))))
    surface /= np.sqrt(np.sum(np.linalg.solve(np.linalg.cholesky(tube.Q), surface.T) ** 2, axis=0))[:, None]
    vehicles = [vehicle.decoupled.perturbed(corner) for corner in screening_corners(vehicle.uncertainty)]

    def unexplained(k: int, e: np.ndarray) -> np.ndarray:
        """Return the three accelerations (vehicles, 3) that the model does not explain after step k with error e."""
        x, u = nominal[k].copy(), flight.plan[k] + tube.system.F @ e
        x[:N_RIGID] += e[:N_RIGID]
        weights = [evaluate(axis, x[[i]])[0] for i, axis in enumerate((polytope.altitude, polytope.velocity))]
        moved = np.concatenate((x - flight.reference[k], u - flight.reference_input[k]))
        expected = flight.reference[k + 1] + flight.defect[k] + np.tensordot(np.outer(*weights).ravel(), S, 1) @ moved
        after = [advance(x, u, each, design.period, 2) for each in vehicles]
        return np.array((np.array(after) - expected)[:, ACCELERATED] @ inverse.T)

    rows = []
    parts = {"the plan alone (e = 0)": (0.0, surface[:1]), "half the tube": (0.5, surface), "the tube": (1.0, surface)}
    for what, (part, errors) in parts.items():
        centre, ratios = tube.c * (part > 0.0), np.zeros((len(vehicles), 3))
        for done, k in enumerate(at, 1):
            found = np.array([unexplained(k, centre + part * e) for e in errors])
            ratios = np.maximum(ratios, (found / np.where(found > 0.0, tube.upper[:3], tube.lower[:3])).max(axis=0))
            progress(f"W over {what}", done, len(at))
        for label, over in (("nominal", ratios[0]), (f"{len(vehicles)} vehicles", ratios.max(axis=0))):
            cells = {c.name.replace("_", " "): f"{ratio:.2f}" for c, ratio in zip(CHANNELS, over, strict=False)}
            rows.append({"e in": what, "vehicles": label} | cells)
    return rows
