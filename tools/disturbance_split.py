"""What a finer description of the disturbances could bring: python3 tools/disturbance_split.py [DESIGN ...].

Beside the certified half-ranges of pitch angle and elevator feedback: what sequences at one vertex attain, if every
disturbance may do anything within its bounds at every step, as the certificate has it, and if less is allowed. No
certificate of that description of the disturbances can be below these numbers.
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.signal import lfilter

from hsv.control.design import find_design
from hsv.design.certified import CertifiedDesign, load_certified
from hsv.design.disturbance import CHANNELS
from hsv.design.region import Region, incomplete_share, record
from hsv.design.sets.counter_example import responses
from hsv.design.tube_problem import channel_model
from hsv.flight.flight import Flight
from hsv.model.signals import N_RIGID, STATE_NAMES

DESIGNS = ("baseline", "tight", "derived")
SPLIT = ("angle_of_attack_rate", "pitch_acceleration")
PITCH_ANGLE = STATE_NAMES.index("pitch_angle")
SLOW = 2.0
"""Time constant, s, of the filter that divides what is slow from what is fast."""


def slow_and_fast(subject: CertifiedDesign, channels: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the half-widths of both over flights of the nominal vehicle and 32 corners, inflated as W is."""
    inputs, decay = subject.inputs, np.exp(-subject.design.period / SLOW)
    region = Region(subject.design, inputs, incomplete_share(inputs))
    model = channel_model(subject.design, subject.vehicle)

    def extremes(flight: Flight) -> np.ndarray:
        signals = model.signals(record(flight)).channels[:, channels]
        # At rest at the first value: a flight begins with whatever disturbs it.
        slow, _ = lfilter([1.0 - decay], [1.0, -decay], signals, axis=0, zi=decay * signals[:1])
        return np.stack([(part.min(axis=0), part.max(axis=0)) for part in (slow, signals - slow)])

    found = np.stack(region.map(extremes, region.screening()))
    half = 0.5 * inputs.disturbance.inflation * (found[:, :, 1].max(axis=0) - found[:, :, 0].min(axis=0))
    return half[0], half[1]


def lost_by_the_plan(subject: CertifiedDesign) -> float:
    """Return the elevator, rad, that the nominal plan loses to the fault at most, inflated as W is.

    It is what remains of this disturbance if the effectiveness belongs to the vertices, and what the feedback adds to
    the plan is lost in the model. Effectiveness may change at any step there, too.
    """
    inputs = subject.inputs.disturbance
    highest = subject.certificate["tube"]["tightening"]["plan"]["highest"][1]
    return float(inputs.inflation * (1.0 - inputs.elevator_effectiveness) * highest)


def main() -> None:
    """Print a table of the designs named, by default of :data:`DESIGNS`."""
    names = [channel.name for channel in CHANNELS]
    fault, split = names.index("lost_elevator"), [names.index(name) for name in SPLIT]
    for name in sys.argv[1:] or DESIGNS:
        subject = load_certified(find_design(name))
        found = subject.invariant_set()
        problem, half = found.problem, found.problem.disturbance.half_width
        slow, fast = slow_and_fast(subject, split)
        shares = ", ".join(f"{w:.0%}" for w in fast / half[split])
        print(f"{name}: fast shares of {' and '.join(SPLIT)} are {shares} of the bounds")
        of_plan = lost_by_the_plan(subject) / abs(problem.disturbance.lower[fault])
        print(f"  the plan alone loses {of_plan:.0%} of the bound of the lost elevator")
        decay = np.exp(-subject.design.period / SLOW)
        for title, row, certified in (
            ("pitch angle", problem.output_rows()[PITCH_ANGLE], found.half_width[PITCH_ANGLE]),
            ("elevator feedback", problem.output_rows()[N_RIGID + 1], found.feedback[1]),
        ):
            h = np.swapaxes(responses(problem, row), 0, 1)
            free = np.abs(h).sum(axis=1) * half
            sums = np.cumsum(h, axis=1)
            vertices = free.copy()
            vertices[:, fault] *= of_plan
            once = free.copy()
            ends = np.maximum(sums[:, :, fault].max(axis=1), 0.0) - np.minimum(sums[:, :, fault].min(axis=1), 0.0)
            once[:, fault] = ends * half[fault]
            divided = once.copy()
            filtered = lfilter([1.0 - decay], [1.0, -decay], h[:, :, split], axis=1)
            divided[:, split] = np.abs(filtered).sum(axis=1) * slow + np.abs(h[:, :, split]).sum(axis=1) * fast
            held = np.abs(sums[:, -1]) * half
            numbers = {
                "certified": certified,
                "anything": free.sum(axis=1).max(),
                "the fault at the vertices": vertices.sum(axis=1).max(),
                "the fault once and for good": once.sum(axis=1).max(),
                "and slow apart from fast": divided.sum(axis=1).max(),
                "constant": held.sum(axis=1).max(),
            }
            print(f"  {title}, deg: " + ", ".join(f"{key} {np.degrees(value):.3g}" for key, value in numbers.items()))


if __name__ == "__main__":
    main()
