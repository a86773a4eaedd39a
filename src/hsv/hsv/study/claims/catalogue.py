"""All claims, in the order of the paper, and judging them."""

from __future__ import annotations

from collections.abc import Callable

from hsv.study.claims import adjustable, controller, modelling, notch, simulation
from hsv.study.claims.claim import Claim, Judged
from hsv.study.claims.evidence import Evidence

GROUPS: dict[str, tuple[Claim, ...]] = {
    "Polytopic model and disturbances": modelling.CLAIMS,
    "Baseline controller": controller.CLAIMS,
    "Notch filter": notch.CLAIMS,
    "Case 1": simulation.CLAIMS,
    "Adjustable controller and Case 2": adjustable.CLAIMS,
}


def judge(
    evidence: Evidence, progress: Callable[[str, int, int], None] = lambda what, done, total: None
) -> dict[str, list[Judged]]:
    """Return all claims with their findings, by group."""
    total = sum(map(len, GROUPS.values()))
    judged: dict[str, list[Judged]] = {}
    done = 0
    for group, claims in GROUPS.items():
        judged[group] = []
        for claim in claims:
            progress("claims", done, total)
            judged[group].append(Judged(claim, claim.measure(evidence)))
            done += 1
    progress("claims", total, total)
    return judged
