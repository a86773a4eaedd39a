"""Numbers of section 5.2 on the inputs of both cases."""

from __future__ import annotations

from typing import Any

from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence
from hsv_paper.claims.finding import shown


def case1(evidence: Evidence, scenario: str = "case1") -> dict[str, Any]:
    """Return in words the ranges of the inputs over all flights of a scenario, and the permitted ranges."""
    table, limits, words = evidence.corners(scenario), load_vehicle().decoupled, []
    for name, unit, said in (
        ("fuel_equivalence_ratio", "1", "the fuel ratio ranges"),
        ("elevator_deflection", "rad", "the elevator"),
    ):
        low, high = float(table[f"{name}_minimum"].min()), float(table[f"{name}_maximum"].max())
        words.append(f"{said} from {shown(low, unit)} to {shown(high, unit)}")
    fuel, elevator = (
        f"{shown(float(limits.input_minimum[i]), unit)} to {shown(float(limits.input_maximum[i]), unit)}"
        for i, unit in ((0, "1"), (1, "rad"))
    )
    return {
        "ranges": f"{' and '.join(words)} over {evidence.vehicles} flights",
        "limits": f"The permitted ranges are {fuel} and {elevator}.",
    }


def case2(evidence: Evidence) -> dict[str, Any]:
    """Return the same for Case 2."""
    return case1(evidence, "case2")
