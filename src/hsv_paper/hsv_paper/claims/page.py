"""The page of the claims: a summary, every claim with its readings, and the ranking of the controllers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from hsv.flight.corners import screening_corners
from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.claim import Judged
from hsv_paper.claims.evidence import ELEVATORS, FUEL
from hsv_paper.claims.finding import Reading, Verdict, shown
from hsv_paper.claims.ranking import METRICS, Rank
from hsv_paper.claims.thresholds import REASONS

_SCREENED = screening_corners(load_vehicle().uncertainty)

_CORNERS = 2 ** len(load_vehicle().uncertainty)


def _elevator(name: str) -> str:
    """Return the name of actuators for the page: the bandwidth of the elevator, or ideal or none."""
    actuators = ELEVATORS.get(name)
    return f"{actuators[1].natural_frequency:g} rad/s" if actuators else name


_BANDWIDTHS = ", ".join(_elevator(name) for name, actuators in ELEVATORS.items() if actuators)

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
bandwidth ({_BANDWIDTHS})
together with a fuel delivery of {FUEL.natural_frequency:g} rad/s. The summary lists the actuators with which all
readings hold (*yes*) and those with which at least one does not (*not*). If the elevator is not ideal, flights cover
only {len(_SCREENED) - 1} of the corners, and the *worst corner* is the worst of these; linear loops cover all corners.

{REASONS}"""


def page(judged: dict[str, list[Judged]], ranks: dict[str, dict[str, Rank]]) -> str:
    """Return the page in Markdown."""
    parts = [_HEADER, tally(judged) + "\n", _summary(judged), "## Ranking\n" + _ranking(ranks)]
    for group, entries in judged.items():
        parts.append(f"## {group}\n")
        parts += [_claim(entry) for entry in entries]
    return "\n".join(parts)


def tally(judged: dict[str, list[Judged]]) -> str:
    """Return a sentence with the number of claims for each verdict."""
    counts = Counter(entry.finding.verdict for group in judged.values() for entry in group)
    *first, last = (f"{counts[verdict]} {_PLURAL[verdict]}" for verdict in Verdict)
    return f"Of {counts.total()} claims, {', '.join(first)}, and {last}."


_PLURAL = {Verdict.HOLDS: "hold", Verdict.CONDITIONS: "hold under conditions", Verdict.FAILS: "do not hold"}


def _summary(judged: dict[str, list[Judged]]) -> str:
    rows = ["| claim | location | verdict | actuators |", "| --- | --- | --- | --- |"]
    for entries in judged.values():
        rows += [
            f"| {e.claim.name} | {e.claim.location} | {e.finding.verdict} | {_conditions(e.finding.readings)} |"
            for e in entries
        ]
    return "\n".join(rows) + "\n"


def _conditions(readings: Sequence[Reading]) -> str:
    """Return the actuators with which all readings of a claim hold and those with which not; empty if it names none."""
    kept: dict[str, bool] = {}
    for reading in readings:
        if reading.actuators:
            kept[reading.actuators] = kept.get(reading.actuators, True) and reading.holds
    sides = (("yes", True), ("not", False))
    words = [f"{said}: {', '.join(_elevator(n) for n in kept if kept[n] is side)}" for said, side in sides]
    return "; ".join(text for text, (_, side) in zip(words, sides, strict=True) if side in kept.values())


def _claim(entry: Judged) -> str:
    claim, finding = entry.claim, entry.finding
    named = any(r.actuators for r in finding.readings)
    rows = ["| reading | measured | threshold | |", "| --- | ---: | --- | --- |"]
    if named:
        rows = ["| reading | actuators | measured | threshold | |", "| --- | --- | ---: | --- | --- |"]
    for number, r in enumerate(finding.readings):
        what = f"**{_cell(r.what)}**" if number < finding.leading else _cell(r.what)
        behind = f"{_elevator(r.actuators)} | " if named else ""
        rows.append(f"| {what} | {behind}{r.measured()} | {r.threshold()} | {'yes' if r.holds else 'no'} |")
    table = "\n".join(rows)
    return (
        f"### {claim.name[0].upper()}{claim.name[1:]}\n> {claim.quote}\n\n{claim.location}. "
        f"**{finding.verdict.capitalize()}.** {finding.why}\n\n{table}\n"
    )


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _ranking(ranks: dict[str, dict[str, Rank]]) -> str:
    controllers = list(next(iter(ranks.values())))
    rows = [
        "The controllers are compared in Case 1 on the same metrics. Each cell gives the nominal vehicle / the worst "
        "of all vehicles, with the rank of each in brackets; smaller is better. Robust MPC flies the decoupled model "
        "(DM) without the filter, as in the paper; the tube controllers fly the coupled model (CM). Rates that have "
        "not decayed by the end, 100 s after the fault, count as 100 s.\n",
        "| | " + " | ".join(controllers) + " |",
        "| --- |" + " --- |" * len(controllers),
    ]
    for metric, row in ranks.items():
        what, unit = METRICS[metric]
        cells = [
            f"{shown(r.nominal, unit)} ({r.nominal_place}) / {shown(r.worst, unit)} ({r.worst_place})"
            for r in row.values()
        ]
        rows.append(f"| {what} | " + " | ".join(cells) + " |")
    places = mean_places(ranks)
    rows.append("| **mean rank** | " + " | ".join(f"{a:.1f} / {b:.1f}" for a, b in places.values()) + " |")
    return "\n".join(rows) + "\n"


def mean_places(ranks: dict[str, dict[str, Rank]]) -> dict[str, tuple[float, float]]:
    """Return the mean rank of each controller over all metrics: nominal vehicle, worst of all."""
    rows = list(ranks.values())
    return {
        name: (
            sum(row[name].nominal_place for row in rows) / len(rows),
            sum(row[name].worst_place for row in rows) / len(rows),
        )
        for name in rows[0]
    }
