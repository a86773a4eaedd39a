"""Scenarios with governed commands: the same flight along the fastest reference that its design permits."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import tomli_w

from hsv.base.errors import GovernorError
from hsv.base.units import rounded, written
from hsv.control.design import PlanBounds
from hsv.control.governor import GovernedReference, Governor, legs_of
from hsv.control.tube_law import TubeLaw
from hsv.flight.assembly import assemble_flight, without_code
from hsv.flight.scenario import load_scenario, scenario_table, scenario_text


@dataclass(frozen=True)
class GovernedScenario:
    """A scenario with governed commands: its text, its reference, and the bounds that the nominal plan keeps."""

    text: str
    reference: GovernedReference
    bounds: PlanBounds


def governed(name: str, blend: float) -> GovernedScenario:
    """Return the scenario ``name`` (or path) with governed commands; ``blend`` (s): half-width of the corners' blends.

    Raises:
        ScenarioError: There is no such scenario, or it cannot be flown.
        GovernorError: The controller is not ``tube_mpc``, the design has no tightened inputs, the nominal law is not
            ``family``, ``blend`` is out of range, or no reference fits the commands.
    """
    scenario = load_scenario(name)
    components = assemble_flight(without_code(scenario))
    law, controller = components.nominal_trajectory.law, components.controller
    if not isinstance(controller, TubeLaw) or controller.design.plan_bounds is None:
        raise GovernorError(
            f"scenario {scenario.name!r}: controller = {scenario.controller!r}, design = {scenario.design!r}: expected "
            "tube_mpc with a design that has tightened inputs"
        )
    if not law.in_core:
        given = scenario.settings["nominal.law"]
        raise GovernorError(f"scenario {scenario.name!r}: nominal.law = {given!r}: expected 'family'")
    bounds, rate = controller.design.plan_bounds, components.plant.data.actuators.rate_limit
    governor = Governor(law.data, scenario.vehicle.described.decoupled, controller.design.period, bounds, rate)
    start = rounded(scenario.initial.altitude), rounded(scenario.initial.velocity)
    reference = governor.govern(start, legs_of(start, *scenario.commands), blend)
    table = scenario_table(scenario_text(name), name)
    commands = []
    for (begin, *before, _), (end, *after, _) in pairwise(reference.corners):
        climbed, gained = (round(b - a, 9) for a, b in zip(before, after, strict=True))
        if climbed or gained:
            changes = {"altitude_change": written(climbed, "m"), "velocity_change": written(gained, "m/s")}
            commands.append({**changes, "start": written(begin, "s"), "end": written(end, "s")})
    blended = {**table.get("reference", {}), "blend": written(reference.blend, "s")}
    return GovernedScenario(tomli_w.dumps({**table, "command": commands, "reference": blended}), reference, bounds)
