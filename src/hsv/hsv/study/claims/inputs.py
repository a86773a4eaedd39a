"""Claims of section 5.2 on the inputs of both cases."""

from __future__ import annotations

from hsv.study.claims.claim import Claim, Finding, Reading, shown
from hsv.study.claims.evidence import Evidence, nominal, worst
from hsv.study.corner_flights import Table
from hsv.vehicle.vehicle import load_vehicle

LIMITED = "saturated_steps"


def _case1(evidence: Evidence) -> Finding:
    table, derived = evidence.corners("case1"), evidence.corners("case1_derived")
    single, fourth = (evidence.spread(name, LIMITED) for name in ("case1_rmpc", "case1_rmpc_fourth_k"))
    return Finding(
        (
            *evidence.spread("case1", LIMITED).readings("limited steps of the whole flight, tube", "1", at_most=0.0),
            Reading("the same, derived coupling, worst corner", worst(derived, LIMITED), "1", at_most=0.0),
            *single.readings("limited steps of the whole flight, RMPC (single gain)", "1", at_most=0.0),
            *fourth.readings("limited steps of the whole flight, RMPC (fourth gain)", "1", at_most=0.0),
        ),
        f"Tube: {_ranges(table)}. {_limits()} What a limiter cuts satisfies the constraints too, so what counts is how "
        "often it had to.",
    )


def _case2(evidence: Evidence) -> Finding:
    table, derived = evidence.corners("case2"), evidence.corners("case2_derived")
    return Finding(
        (
            *evidence.spread("case2", LIMITED).readings("limited steps of the whole flight", "1", at_most=0.0),
            Reading("the same, derived coupling, nominal vehicle", nominal(derived, LIMITED), "1", at_most=0.0),
            Reading("the same, derived coupling, worst corner", worst(derived, LIMITED), "1", at_most=0.0),
        ),
        f"Flown: {_ranges(table)}. {_limits()}",
    )


def _ranges(table: Table) -> str:
    words = []
    for name, unit, said in (("fuel_equivalence_ratio", "1", "fuel ratio"), ("elevator_deflection", "rad", "elevator")):
        low, high = float(table[f"{name}_minimum"].min()), float(table[f"{name}_maximum"].max())
        words.append(f"{said} {shown(low, unit)} to {shown(high, unit)}")
    return f"{', '.join(words)} over {len(table['diverged'])} flights"


def _limits() -> str:
    limits = load_vehicle().decoupled
    fuel, elevator = (
        f"{shown(float(limits.input_minimum[i]), unit)} to {shown(float(limits.input_maximum[i]), unit)}"
        for i, unit in ((0, "1"), (1, "rad"))
    )
    return f"Allowed are {fuel} and {elevator}."


CASE_1 = (
    Claim(
        "inputs satisfy the constraints",
        "It can be seen that control inputs satisfy the input constraints in presence of fault.",
        "5.2, Figure 12",
        _case1,
    ),
)
CASE_2 = (
    Claim(
        "inputs in Case 2",
        "As can be seen from Figure 17, in case of failure, the control inputs of the adjustable method can still be "
        "maintained within a reasonable range.",
        "5.2, Figure 17",
        _case2,
    ),
)
