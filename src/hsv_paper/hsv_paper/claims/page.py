"""The page of the claims: a summary, and every claim with its readings."""

from __future__ import annotations

from collections import Counter

from hsv.flight.corners import screening_corners
from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import ELEVATORS, shown
from hsv_paper.claims.table import THRESHOLDS, Finding, Verdict
from hsv_paper.study import markdown

_CORNERS = 2 ** len(load_vehicle().uncertainty)
_SCREENED = len(screening_corners(load_vehicle().uncertainty)) - 1
_BANDWIDTHS = {name: f"{elevator.natural_frequency:g} rad/s" for name, elevator in ELEVATORS.items()}
"""Bandwidth of each elevator, as written on the page."""

_HEADER = f"""# The paper's claims
Made by `hsv-paper claims --out docs/claims.md`; every number is measured. Each claim is quoted word for word and has
one or more readings. A reading is a number with a threshold. The paper gives only two thresholds, ±0.5° and the limits
of the inputs; the others are ours, with their reasons. Readings in bold are the statement itself under the paper's own
conditions. The others repeat it under further conditions: another coupling, corners that the paper does not mention, or
a stricter interpretation. A claim **holds** if all its readings hold, **holds under conditions** if those in bold hold
but another does not, and **does not hold** if one in bold does not, regardless of the others. In the names of readings,
*relative to* denotes a ratio.

*Uncertain parameters*: the paper flies one perturbation but gives only its bounds; ours is half of each bound
(`case1_uncertain`, [`case2_uncertain`](fly.md#case2_uncertain)). *Corners*: all {_CORNERS} combinations of the bounds
are flown, in addition to the nominal vehicle; the *worst corner* is the vehicle least favourable to the claim. The
coupling is *paper-like* unless another is named ([assumptions](assumptions.md)). With that coupling, the paper's
statements on flights without the notch filter depend on a narrow margin ([modes
rejected](#modes-rejected-paper-like-coupling)).

*Actuators* are ideal, like the paper's, unless others are named. The benefit of the notch filter depends on them: even
without the filter, a slow elevator stabilises the elastic modes. Readings of claims on the filter therefore name their
actuators: none (the reading concerns only the filter or the vehicle), ideal, or a second-order elevator with this
bandwidth ({", ".join(_BANDWIDTHS.values())})
together with a fuel delivery of 10 rad/s. If the elevator is not ideal, flights cover
only {_SCREENED} of the corners, and the *worst corner* is the worst of these; linear loops cover all corners.

Several claims share these thresholds of ours: *accurate* means within 2 % of the step, the
usual settling band ({shown(THRESHOLDS["ALTITUDE_BAND"], "m")}, {shown(THRESHOLDS["VELOCITY_BAND"], "m/s")}); *soon*, \
within {THRESHOLDS["SOON"]:g} s, a tenth of
the flight that the paper's figures show; a comparative such as *smaller*, a ratio of at most 1; *a lot more*, by at
least half; a *significant* reduction, to at most half; a *slight* reduction, to at least three quarters; *stable*, that
no flight is lost and that no pole of the linear loop has a positive real part.
"""


def page(judged: dict[str, list[Finding]]) -> str:
    """Return the page of all claims in Markdown."""
    parts = [_HEADER, tally(judged) + "\n", summary(judged)]
    for group, findings in judged.items():
        parts += [f"## {group}\n", *map(details, findings)]
    return "\n".join(parts)


def tally(judged: dict[str, list[Finding]]) -> str:
    """Return a sentence with the number of claims for each verdict."""
    counts = Counter(found.verdict for findings in judged.values() for found in findings)
    holds, conditions, fails = (counts[verdict] for verdict in Verdict)
    return f"Of {counts.total()} claims, {holds} hold, {conditions} hold under conditions, and {fails} do not hold."


def summary(judged: dict[str, list[Finding]]) -> str:
    """Return the table of all claims with their verdicts, in Markdown."""
    rows = [
        {"claim": found.claim.name, "location": found.claim.location, "verdict": found.verdict}
        for findings in judged.values()
        for found in findings
    ]
    return markdown(rows, ()) + "\n"


def details(found: Finding) -> str:
    """Return the section on a claim in Markdown: quote, verdict with its reason, and table of readings."""
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
        f"**{found.verdict.capitalize()}.** {claim.why}\n\n{markdown(rows, ('measured',))}\n"
    )
