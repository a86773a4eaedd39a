"""The page of the claims: a summary, every claim with its readings, and the ranking of the controllers."""

from __future__ import annotations

import math
from collections import Counter

from hsv.study.claims.claim import Judged, Reading, Verdict
from hsv.study.claims.ranking import METRICS, Rank
from hsv.units import to_paper

_HEADER = """# The paper's claims
Made by `hsv claims --out docs/claims.md`, every number measured. A claim is quoted word for word and read in one or
more ways, each a number with a threshold (±0.5° and the limits of the inputs are the paper's; it gives no others, the
rest are ours, with the reason beside them). The readings in bold are the statement itself, on the paper's own
conditions; the others ask the same under further ones: other couplings, corners where the paper does not speak of them,
stricter readings. A claim **holds** if all readings do, **holds under conditions** if those in bold do and another does
not, and **does not hold** if one in bold does not, whatever the others say.
*Corners*: all 1024 combinations of the bounds of the ten uncertain parameters, each flown, and the nominal vehicle. The
*paper-like* coupling is meant where none is named ([assumptions](assumptions.md)).
"""


def page(judged: dict[str, list[Judged]], ranks: dict[str, dict[str, Rank]]) -> str:
    """Return the page in Markdown."""
    everything = [entry for group in judged.values() for entry in group]
    counts = Counter(entry.finding.verdict for entry in everything)
    total = ", ".join(f"{counts[verdict]} {_PLURAL[verdict]}" for verdict in Verdict)
    parts = [_HEADER, f"Of {len(everything)} claims {total}.\n", _summary(judged), "## Ranking\n" + _ranking(ranks)]
    for group, entries in judged.items():
        parts.append(f"## {group}\n")
        parts += [_claim(entry) for entry in entries]
    return "\n".join(parts)


_PLURAL = {Verdict.HOLDS: "hold", Verdict.CONDITIONS: "hold under conditions", Verdict.FAILS: "do not hold"}


def shown(value: float, unit: str) -> str:
    """Return a number (SI) in the paper's unit, with the unit."""
    if not math.isfinite(value):
        return "not defined" if math.isnan(value) else "unbounded"
    number, name = to_paper(value, unit)
    return f"{number:.4g}" + ("" if name == "1" else f" {name}")


def condition(reading: Reading) -> str:
    """Return the threshold of a reading in words."""
    if reading.at_most is not None:
        return f"at most {shown(reading.at_most, reading.unit)}"
    assert reading.at_least is not None
    return f"at least {shown(reading.at_least, reading.unit)}"


def _summary(judged: dict[str, list[Judged]]) -> str:
    rows = ["| claim | location | verdict |", "| --- | --- | --- |"]
    for entries in judged.values():
        rows += [f"| {e.claim.name} | {e.claim.location} | {e.finding.verdict} |" for e in entries]
    return "\n".join(rows) + "\n"


def _claim(entry: Judged) -> str:
    claim, finding = entry.claim, entry.finding
    rows = ["| reading | measured | threshold | |", "| --- | ---: | --- | --- |"]
    for number, r in enumerate(finding.readings):
        what = f"**{_cell(r.what)}**" if number < finding.leading else _cell(r.what)
        rows.append(f"| {what} | {shown(r.value, r.unit)} | {condition(r)} | {'yes' if r.holds else 'no'} |")
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
        "Case 1 on the same metrics: nominal vehicle / worst of 1025 vehicles, the place of each in brackets, smaller "
        "is better. Robust MPC flies the decoupled model (DM), as in the paper, the tubes the coupled one (CM). Rates "
        "that have not decayed at the end, 100 s after the fault, count as 100 s.\n",
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
    places = {name: (_mean(ranks, name, "nominal_place"), _mean(ranks, name, "worst_place")) for name in controllers}
    rows.append("| **mean place** | " + " | ".join(f"{a:.1f} / {b:.1f}" for a, b in places.values()) + " |")
    return "\n".join(rows) + "\n"


def _mean(ranks: dict[str, dict[str, Rank]], name: str, place: str) -> float:
    return sum(getattr(row[name], place) for row in ranks.values()) / len(ranks)
