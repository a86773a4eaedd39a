"""Numbers of section 5.2 on how robust MPC tracks Case 1, over the gains of the nominal family."""

from __future__ import annotations

from typing import Any

from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence
from hsv_paper.claims.finding import shown
from hsv_paper.linear_loop import COUPLING_SCALES, critical_coupling

FAMILY = "case1_rmpc_fourth_k"
FLOWN_GAIN = 3
"""Index, in the nested family, of the gain that :data:`FAMILY` flies."""


def gains(evidence: Evidence) -> int:
    """Return how many gains the baseline's nested family has."""
    return len(evidence.design("baseline").flown.nominal_gains)


def losses(evidence: Evidence) -> dict[int, int]:
    """Return the number of vehicles lost by gain, from the last of the family to the first that loses none."""
    lost = {}
    for index in reversed(range(gains(evidence))):
        changes = () if index == FLOWN_GAIN else (("robust_mpc.gain_index", index),)
        lost[index] = int(evidence.corners(FAMILY, *changes)["diverged"].sum())
        if not lost[index]:
            break
    return lost


def rmpc_flexible(evidence: Evidence) -> dict[str, Any]:
    """Return the results of robust MPC on the coupled model, by gain."""
    count, coupled = gains(evidence), ("vehicle.model", "CM")
    last, alone = (evidence.changed(FAMILY, ("robust_mpc.gain_index", count - 1), *c) for c in ((coupled,), ()))
    derived = [
        evidence.changed(FAMILY, ("robust_mpc.gain_index", index), coupled, ("vehicle.coupling", "derived"))
        for index in range(count)
    ]
    family = evidence.design("baseline").flown
    limits = [critical_coupling(family.nominal_gains[index], (), family.period) for index in (0, count - 1)]
    studied = f"at least {COUPLING_SCALES[-1]:g}"
    single_limit, last_limit = (studied if kappa is None else f"{kappa:.3f}" for kappa in limits)
    return {
        "gains": count,
        "lost": sum(flight["diverged"] for flight in derived),
        "decay": last["elastic_settling_time"],
        "last_off": shown(abs(last["altitude_end_error"]), "m"),
        "last_decay": shown(last["elastic_settling_time"], "s"),
        "alone_decay": shown(alone["elastic_settling_time"], "s"),
        "single_limit": single_limit,
        "last_limit": last_limit,
        "paper_like": load_vehicle().coupling_scale("paper_like"),
    }


def rmpc_altitude(evidence: Evidence) -> dict[str, Any]:
    """Return the altitude errors at the end with the last gain and with the tube, and which gains lose vehicles."""
    count, lost = gains(evidence), losses(evidence)
    last = evidence.changed(FAMILY, ("robust_mpc.gain_index", count - 1))
    tightest, error = min(lost), abs(last["altitude_end_error"])
    return {
        "gains": count,
        "tube": shown(abs(evidence.changed("case1_tube_dm")["altitude_end_error"]), "m"),
        "tightest": tightest + 1,
        "survival": _survival(lost, tightest, evidence.vehicles),
        "last": shown(error, "m"),
        "last_error": error,
        "limited": last["saturated_steps"],
    }


def _survival(lost: dict[int, int], tightest: int, vehicles: int) -> str:
    if lost[tightest]:
        return f"that was flown, and {lost[tightest]} of {vehicles} vehicles are lost with it"
    tighter = ", ".join(f"{count} with number {index + 1}" for index, count in lost.items() if count)
    return f"with which none of {vehicles} vehicles is lost" + (f" (lost: {tighter})" if tighter else "")
