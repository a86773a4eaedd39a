"""A flight called from Python against its loop in C alone, and steps against other simulators."""

from __future__ import annotations

import os
from importlib import import_module
from importlib.util import find_spec

import numpy as np

from hsv.bench.c_build import FLAGS, c_flight
from hsv.bench.figure import Figure, interleaved
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.fingerprint import fingerprint
from hsv.flight.scenario import load_scenario
from hsv.model.dynamics import derivative
from hsv.model.plant import Plant

_STEPS = 200
"""Control periods of a comparison with a general integrator, which takes too long for whole flights."""


def against_c(repeats: int) -> list[Figure]:
    """Return Case 1 flown from Python against the same loop in C alone, compiled for this processor."""
    components = assemble(flight_parameters(load_scenario("case1")))
    in_c = c_flight(components)
    ours, theirs = interleaved(lambda: fly(components), in_c, repeats)
    same = fly(components).fingerprint == fingerprint(in_c().flown)
    what, against = "Case 1, 200 s, called from Python", f"its loop in C alone, cc {' '.join(FLAGS)}"
    note = "the same bits" if same else "OTHER bits"
    return [Figure("in_process", what, against, "s", ours, theirs, "most", 1.3, 1.1, note)]


def against_scipy(repeats: int) -> list[Figure]:
    """Return the plant alone against scipy's DOP853 on the same equations under the same held inputs."""
    from scipy.integrate import solve_ivp

    plant = assemble(flight_parameters(load_scenario("case1"))).plant
    x_0, u = plant.initial.state, plant.initial.input + np.array([0.05, 0.01])
    ends: dict[str, np.ndarray] = {}

    def ours() -> None:
        plant.reset()
        for _ in range(_STEPS):
            ends["ours"] = plant.step(u).state

    def theirs() -> None:
        x = x_0

        def slope(t: float, state: np.ndarray) -> np.ndarray:
            return derivative(state, u, plant.vehicle)

        for _ in range(_STEPS):
            x = solve_ivp(slope, (0.0, plant.period), x, "DOP853", rtol=1e-8, atol=1e-10).y[:, -1]
        ends["theirs"] = x

    times = interleaved(ours, theirs, repeats)
    difference = np.max(np.abs(ends["ours"] - ends["theirs"]) / np.maximum(1.0, np.abs(ends["theirs"])))
    return [
        Figure(
            "scipy",
            f"plant, {_STEPS} control periods, one call each",
            "scipy solve_ivp DOP853, rtol 1e-8, the same right-hand side",
            "s",
            *times,
            note=f"largest relative difference at the end {difference:.1e}",
        )
    ]


def against_jsbsim(repeats: int) -> list[Figure]:
    """Return a step of the plant against one of JSBSim's c172x, if JSBSim is installed."""
    if find_spec("jsbsim") is None:
        return []
    aircraft = import_module("jsbsim").FGFDMExec(None)
    aircraft.set_debug_level(0)
    aircraft.load_model("c172x")
    aircraft.set_output_filename(0, os.devnull)  # else a file appears where the bench is run
    aircraft["ic/h-sl-ft"], aircraft["ic/vc-kts"] = 5000.0, 100.0
    aircraft.run_ic()
    plant: Plant = assemble(flight_parameters(load_scenario("case1"))).plant

    def ours() -> None:
        plant.reset()
        for _ in range(_STEPS):
            plant.step(plant.initial.input)

    def theirs() -> None:
        for _ in range(_STEPS):
            aircraft.run()

    return [
        Figure(
            "jsbsim",
            f"plant, {_STEPS} control periods",
            "JSBSim c172x, as many of its steps",
            "s",
            *interleaved(ours, theirs, repeats),
            note="another aircraft and integrator: the price of a step, no more",
        )
    ]
