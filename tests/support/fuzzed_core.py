"""Calls of the core with random numbers in place of any of its data: ``python3 fuzzed_core.py SECONDS [SEED]``.

Numbers and integers of any size, infinities and NaN stand in vehicles, polytopes, gains, notch filters, sensors,
actuators, links, air, faults and memories. Left as they are: sizes of arrays, which the binding checks, the indices of
the polytope's entries, which the library computes, and the number of substeps, on which the time depends.

It ends after SECONDS of processor time and prints the number of its flights. The sanitizers with which the core was
compiled end it at the first fault.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import core_calls
import numpy as np
from test_golden_flights import LINES, golden

from hsv.core import Struct, fly, lanes, lib, loop_memory
from hsv.flight.closed_loop import flight_struct
from hsv.flight.history import History
from hsv.model.dynamics import derivative, jacobian
from hsv.model.vehicle import load_vehicle

STEPS = 200
STARTS = (0, 0, 0, 1, 51, 2**31)
NUMBERS = (
    *(np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, 1e-300, 1e300, -1e300, -1.0, 0.5, 2.0),
    *(2.0**31, -(2.0**63), 2.0**64),
)
INTEGERS = (0, 1, -1, 2, 3, 51, 2**31 - 1, 2**31, -(2**31), 2**53, 2**63 - 1, -(2**63))
OUTPUTS = ("history", "auxiliary", "estimated", "nominal_law", "controller", "ended", "returned", "answer")
KEPT = {"entries", "substeps", *OUTPUTS}


def changed(value: Any, random: np.random.Generator, share: float, kind: str = "") -> Any:
    """Return a copy of ``value``, in which each number is replaced with a probability of ``share``."""
    if isinstance(value, Struct):
        kept = KEPT | ({"starts"} if value.kind == "hsv_polytope" else set())
        values = {n: v if n in kept else changed(v, random, share) for n, v in value.values.items()}
        return Struct(value.kind, **values)
    if isinstance(value, np.ndarray) and value.dtype.names:
        made = value.copy()
        for name in value.dtype.names:
            made[name] = changed(made[name], random, share)
        return made
    if value is None or not np.size(value):
        return value
    given = np.array(value)
    pool = INTEGERS if given.dtype.kind in "iub" else NUMBERS
    given = given.astype(np.int64 if pool is INTEGERS else float)
    new = np.array(pool)[random.integers(len(pool), size=given.shape)]
    made = np.where(random.random(given.shape) < share, new, given)
    return made if isinstance(value, np.ndarray) else made.tolist()


def main(seconds: float, seed: int) -> None:
    random, calls = np.random.default_rng(seed), 0
    vehicles = [load_vehicle(name).coupled() for name in ("parker", "winged_cone_lift")]
    scalars = [core_calls.sine_cosine, core_calls.dryden_cross_map, lib.hsv_tangent, lib.hsv_arcsine]
    scalars += [lib.hsv_exponential, lib.hsv_logarithm]
    while time.process_time() < seconds:
        count, share = random.choice([1, lanes()]), 10.0 ** -random.integers(4)
        if calls % 10 == 0:
            parts, _ = golden(random.integers(len(LINES)))
        flights = [changed(flight_struct(parts, History.empty(STEPS)), random, share) for _ in range(count)]
        start = STARTS[random.integers(len(STARTS))]
        fly(flights, loop_memory(count), start, start + STEPS)
        numbers = np.array(NUMBERS)[random.integers(len(NUMBERS), size=9)]
        for function in scalars:
            function(numbers[0])
        core_calls.actuator_map(INTEGERS[random.integers(len(INTEGERS))], *numbers[:3])
        vehicle = vehicles[random.integers(len(vehicles))]
        vehicle = type(vehicle)(*changed(list(vehicle), random, share))
        derivative(numbers, numbers[:2], vehicle)
        jacobian(numbers, numbers[:2], vehicle)
        calls += 1
    print(calls)


if __name__ == "__main__":
    main(float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else time.time_ns())
