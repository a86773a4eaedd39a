"""All claims, by part of the paper and topic, and judging them."""

from __future__ import annotations

from collections.abc import Callable

from hsv.study.claims import (
    adjustable,
    attitude,
    case2,
    codesign,
    controller,
    elastic,
    inputs,
    modelling,
    notch,
    tracking,
)
from hsv.study.claims.claim import Claim, Judged
from hsv.study.claims.evidence import Evidence

GROUPS: dict[str, tuple[Claim, ...]] = {
    "Polytopic model and disturbances": modelling.CLAIMS,
    "Baseline controller": controller.CLAIMS,
    "Notch filter": notch.CLAIMS,
    "Case 1": (*tracking.CLAIMS, *attitude.CLAIMS, *elastic.CLAIMS, *inputs.CASE_1),
    "Adjustable controller": (*codesign.CLAIMS, *adjustable.CLAIMS),
    "Case 2": (*case2.CLAIMS, *inputs.CASE_2),
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
