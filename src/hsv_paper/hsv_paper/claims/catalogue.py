"""All claims, by part of the paper and topic, and judging them."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from importlib.resources import files

from hsv_paper.claims.claim import Claim, Judged
from hsv_paper.claims.evidence import Evidence

GROUPS = {
    group: tuple(map(Claim.model_validate, claims))
    for group, claims in tomllib.loads(files(__package__).joinpath("claims.toml").read_text(encoding="utf-8")).items()
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
