"""The page of the claims: a summary, the ranking of the controllers, and every claim with its readings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsv.flight.corners import screening_corners
from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import ELEVATORS, Evidence, nominal, shown, worst
from hsv_paper.claims.table import THRESHOLDS, Finding, Reading, Verdict
from hsv_paper.study import markdown

CONTROLLERS = {
    "RMPC, single gain (DM)": "case1_rmpc",
    "RMPC, fourth gain (DM)": "case1_rmpc_fourth_k",
    "tube without notch (CM)": "case1_no_notch",
    "tube with notch (CM)": "case1",
}
"""Scenarios of the ranked controllers."""

METRICS = {
    "altitude_end_error": ("altitude error at the end", "m"),
    "velocity_end_error": ("velocity error at the end", "m/s"),
    "post_fault_altitude_error": ("largest altitude error after the fault", "m"),
    "post_fault_attitude_deviation": ("attitude excursion after the fault", "rad"),
    "attitude_settling_time": ("attitude settling time", "s"),
    "elastic_decay_time": ("decay time of the elastic rates", "s"),
    "elastic_rate_2_ringing": ("peak-to-peak second elastic rate, 10 s to 20 s after the fault", "kg^0.5 m/s"),
    "altitude_integral_absolute_error": ("integral of the altitude error", "m s"),
    "elevator_deflection_maximum": ("largest elevator deflection", "rad"),
    "saturated_steps": ("steps with saturated inputs", "1"),
}
"""Name and unit of the metrics of the ranking; smaller is better for all of them."""

_CORNERS = 2 ** len(load_vehicle().uncertainty)
_SCREENED = len(screening_corners(load_vehicle().uncertainty)) - 1
_BANDWIDTHS = {name: f"{elevator.natural_frequency:g} rad/s" for name, elevator in ELEVATORS.items()}
"""Names of the elevators for the page."""

_HEADER = f"""# The paper's claims
Made by `hsv-paper claims --out docs/claims.md`; every number is measured. Each claim is quoted word for word and has
one or more readings. A reading is a number with a threshold. The paper gives only two thresholds, ±0.5° and the limits
of the inputs; the others are ours, with their reasons. Readings in bold are the statement itself under the paper's own
conditions. The others repeat it under further conditions: another coupling, corners that the paper does not mention, or
a stricter interpretation. A claim **holds** if all its readings hold, **holds under conditions** if those in bold hold
but another does not, and **does not hold** if one in bold does not, regardless of the others. In the names of readings,
*relative to* denotes a ratio.

*Uncertain parameters*: the paper flies one perturbation but gives only its bounds; ours is half of each bound
(`case1_uncertain`, `case2_uncertain`). *Corners*: all {_CORNERS} combinations of the bounds are flown, in addition to
the nominal vehicle; the *worst corner* is the vehicle least favourable to the claim. The coupling is *paper-like*
unless another is named ([assumptions](assumptions.md)). With that coupling, the paper's statements on flights without
the notch filter depend on a narrow margin ([modes rejected](#modes-rejected-paper-like-coupling)).

*Actuators* are ideal, like the paper's, unless others are named. The benefit of the notch filter depends on them: even
without the filter, a slow elevator stabilises the elastic modes. Readings of claims on the filter therefore name their
actuators: none (the reading concerns only the filter or the vehicle), ideal, or a second-order elevator with this
bandwidth ({", ".join(_BANDWIDTHS.values())})
together with a fuel delivery of 10 rad/s. The summary lists the actuators with which all
readings hold (*yes*) and those with which at least one does not (*not*). If the elevator is not ideal, flights cover
only {_SCREENED} of the corners, and the *worst corner* is the worst of these; linear loops cover all corners.

Several claims share these thresholds of ours: *accurate* means within 2 % of the step, the
usual settling band ({shown(THRESHOLDS["ALTITUDE_BAND"], "m")}, {shown(THRESHOLDS["VELOCITY_BAND"], "m/s")}); *soon*, \
within {THRESHOLDS["SOON"]:g} s, a tenth of
the flight that the paper's figures show; a comparative such as *smaller*, a ratio of at most 1; *a lot more*, by at
least half; a *significant* reduction, to at most half; a *slight* reduction, to at least three quarters; *stable*, that
no flight is lost and that no pole of the linear loop has a positive real part.
"""

_RANKING = """The controllers are compared in Case 1 on the same metrics. Each cell gives the nominal vehicle / the \
worst of all vehicles, with the rank of each in brackets; smaller is better. Robust MPC flies the decoupled model (DM) \
without the filter, as in the paper; the tube controllers fly the coupled model (CM). Rates that have not decayed by \
the end, 100 s after the fault, count as 100 s.
"""


@dataclass(frozen=True)
class Rank:
    """A controller on a metric (SI): value and rank for the nominal vehicle, and for the worst of all."""

    nominal: float
    worst: float
    nominal_place: int
    worst_place: int


Ranks = dict[str, dict[str, Rank]]
"""Ranks by metric and controller."""


def ranking(evidence: Evidence) -> Ranks:
    """Return the ranks of robust MPC and the tube controllers on the same metrics."""
    tables = {name: evidence.corners(scenario) for name, scenario in CONTROLLERS.items()}
    ranks: Ranks = {}
    for metric in METRICS:
        values = np.array([(abs(nominal(table, metric)), worst(table, metric)) for table in tables.values()])
        # Values that differ by less than a thousandth share a rank.
        places = 1 + (values < values[:, None] * (1.0 - 1e-3)).sum(axis=1)
        rows = zip(tables, values.tolist(), places.tolist(), strict=True)
        ranks[metric] = {name: Rank(*value, *place) for name, value, place in rows}
    return ranks


def page(judged: dict[str, list[Finding]], ranks: Ranks) -> str:
    """Return the page in Markdown."""
    parts = [_HEADER, tally(judged) + "\n", summary(judged), "## Ranking\n" + ranking_table(ranks)]
    for group, findings in judged.items():
        parts += [f"## {group}\n", *map(details, findings)]
    return "\n".join(parts)


def tally(judged: dict[str, list[Finding]]) -> str:
    """Return a sentence with the number of claims for each verdict."""
    counts = Counter(found.verdict for findings in judged.values() for found in findings)
    holds, conditions, fails = (counts[verdict] for verdict in Verdict)
    return f"Of {counts.total()} claims, {holds} hold, {conditions} hold under conditions, and {fails} do not hold."


def summary(judged: dict[str, list[Finding]]) -> str:
    """Return the table of all claims with their verdicts."""
    rows = [
        {
            "claim": found.claim.name,
            "location": found.claim.location,
            "verdict": found.verdict,
            "actuators": _conditions(found.readings),
        }
        for findings in judged.values()
        for found in findings
    ]
    return markdown(rows, ()) + "\n"


def details(found: Finding) -> str:
    """Return a claim with its quote, its verdict with the reason, and its readings."""
    named, claim = any(reading.actuators for reading in found.readings), found.claim
    rows = [
        {"reading": f"**{what}**" if number < found.leading else what}
        | ({"actuators": _BANDWIDTHS.get(r.actuators, r.actuators)} if named else {})
        | {"measured": r.measured(), "threshold": r.threshold(), "": "yes" if r.holds else "no"}
        for number, r in enumerate(found.readings)
        if (what := r.what.replace("|", "\\|"))
    ]
    return (
        f"### {claim.name[0].upper()}{claim.name[1:]}\n> {claim.quote}\n\n{claim.location}. "
        f"**{found.verdict.capitalize()}.** {found.why}\n\n{markdown(rows, ('measured',))}\n"
    )


def ranking_table(ranks: Ranks) -> str:
    """Return the ranking with its description."""
    rows: list[dict[str, str]] = []
    for metric, row in ranks.items():
        what, unit = METRICS[metric]
        rows.append({"": what})
        for name, r in row.items():
            worst_of_all = f"{shown(r.worst, unit)} ({r.worst_place})"
            rows[-1][name] = f"{shown(r.nominal, unit)} ({r.nominal_place}) / {worst_of_all}"
    rows.append({"": "**mean rank**"})
    for name in next(iter(ranks.values())):
        places = [(row[name].nominal_place, row[name].worst_place) for row in ranks.values()]
        rows[-1][name] = " / ".join(f"{mean:.1f}" for mean in np.mean(places, axis=0))
    return f"{_RANKING}\n{markdown(rows, ())}\n"


def _conditions(readings: Sequence[Reading]) -> str:
    """Return the actuators with which all readings of a claim hold and those with which not; empty if it names none."""
    failed = {reading.actuators for reading in readings if not reading.holds}
    sides: dict[str, list[str]] = {"yes": [], "not": []}
    for name in dict.fromkeys(reading.actuators for reading in readings if reading.actuators):
        sides["not" if name in failed else "yes"].append(_BANDWIDTHS.get(name, name))
    return "; ".join(f"{word}: {', '.join(side)}" for word, side in sides.items() if side)
