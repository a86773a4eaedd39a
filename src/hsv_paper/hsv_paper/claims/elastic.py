"""Numbers of section 5.2 on the elastic modes in Case 1."""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence
from hsv_paper.claims.notch_loop import critical


def rejected_paper_like(evidence: Evidence) -> dict[str, Any]:
    """Return in words the coupling at which the loop without filter becomes unstable, and how many loops are."""
    limit, scale = critical(evidence), load_vehicle().coupling_scale("paper_like")
    return {
        "limit": "no coupling studied" if limit is None else f"{limit:.4f} times the derived coupling",
        "margin": "" if limit is None else f", {100 * (limit / scale - 1.0):.1f} % above the paper-like one",
        "unstable": int(np.count_nonzero(evidence.growth("paper_like", ()) > 0.0)),
    }


def rejected_derived(evidence: Evidence) -> dict[str, Any]:
    """Return the results with the derived coupling: flight without filter, and loops with the baseline's filter."""
    without = evidence.changed("case1_derived_no_notch")
    section, other = (evidence.design(name).flown.notch[0] for name in ("baseline_derived", "baseline"))
    return {
        "lost": without["diverged"],
        "end": without["end_time"],
        "centre_derived": section.zero_frequency,
        "centre": other.zero_frequency,
        "unstable": int(np.count_nonzero(evidence.growth("derived", (other,)) > 0.0)),
    }
