import shutil

import pytest
from flights import components

from hsv.bench.c_flight import FLAGS, CFlight, largest_difference
from hsv.errors import RunError
from hsv.simulation.closed_loop import fly
from hsv.simulation.history import History

TOLERANCE = 1e-9
"""Relative. The C library's sines and exponentials, which the processor chooses, differ from ours by an ulp, 1e-16; the
loop makes up to 7e-12 of it. A term that is wrong moves the flight by far more than 1e-9."""

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@needs_compiler
@pytest.mark.parametrize(
    "scenario",
    [
        "case1",
        "case1_derived",
        "case1_integral_heavy",
        "case1_no_notch",
        "case1_second_mode_notch",
        "case1_single_k",
        "case1_smooth",
        "case1_uncertain",
        "case2",
    ],
)
def test_the_c_build_flies_the_same_flight(scenario):
    parts = components(scenario, duration=110.0)
    assert largest_difference(fly(parts).history, CFlight(parts).fly()) <= TOLERANCE


@needs_compiler
def test_the_c_build_flies_ramps_filtered_plans_and_changes_of_tau():
    changes = {"nominal.filtered": True, "feedback.tau_minimum": [0.5], "feedback.tau": [0.8]}
    change = {"tau_change.starts": [10.0, 30.0], "tau_change.values": [0.6, 0.9]}
    parts = components("case2_baseline", duration=110.0, **changes, **change)
    assert largest_difference(fly(parts).history, CFlight(parts).fly()) <= TOLERANCE


@needs_compiler
def test_a_flight_that_diverges_ends_at_the_same_step():
    parts = components("case1_derived_no_notch")
    flown, other = fly(parts).history, CFlight(parts).fly()
    assert len(flown.state) == len(other.state) < parts.plant.steps
    # Rounding grows with a diverging flight.
    assert largest_difference(flown, other) < 1e-6


@needs_compiler
def test_another_flight_is_seen():
    parts, other = components(duration=110.0), components(duration=110.0, fault__parameters=["effectiveness=0.9000001"])
    assert largest_difference(fly(parts).history, CFlight(other).fly()) > 1e-9
    assert largest_difference(fly(parts).history, CFlight(components(duration=100.0)).fly()) == float("inf")


def test_what_is_no_number_or_another_zero_is_a_difference():
    zeros, others = History.empty(2), History.empty(2)
    for matrix in (*zeros, *others):
        matrix[:] = 0.0
    assert largest_difference(zeros, others) == 0.0
    others.state[1, 3] = -0.0
    assert 0.0 < largest_difference(zeros, others) < 1e-300
    others.state[1, 3] = float("nan")
    assert largest_difference(zeros, others) == float("inf")


@needs_compiler
def test_a_failed_build_says_so():
    with pytest.raises(RunError, match="C build"):
        CFlight(components(duration=1.0), (*FLAGS, "--no-such-flag"))


def test_components_that_the_c_build_does_not_know_are_refused():
    with pytest.raises(RunError, match="nested family"):
        CFlight(components(duration=1.0, controller="robust_mpc"))
    with pytest.raises(RunError, match=r"nominal\.filtered without a notch filter"):
        CFlight(components("case2", duration=1.0, notch__enabled=False))
