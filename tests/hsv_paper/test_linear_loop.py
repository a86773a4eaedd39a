from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hsv.certificate.loops import Feedback, Hardware
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import design
from hsv_paper.linear_loop import TARGET, critical_coupling, largest_growth, stability_limit


def test_the_limit_of_stability_is_the_first_zero_on_the_way():
    points = np.linspace(0.0, 3.0, 13)
    assert stability_limit(lambda x: x - 1.1, points) == pytest.approx(1.1, abs=1e-6)
    assert stability_limit(lambda x: (x - 1.1) * (2.4 - x), points) == pytest.approx(1.1, abs=1e-6)
    assert stability_limit(lambda x: (1.1 - x) * (2.4 - x), points[6::-1]) == pytest.approx(1.1, abs=1e-6)


def test_a_loop_lost_at_once_or_never_has_no_crossing():
    assert stability_limit(lambda x: x + 1.0, [0.5, 1.0]) == 0.5
    assert stability_limit(lambda x: -1.0, [0.5, 1.0]) is None


def test_the_paper_like_coupling_is_just_short_of_the_critical_one():
    without, with_notch = (critical_coupling(Feedback.of(design("baseline"), notched=n)) for n in (False, True))
    assert without == pytest.approx(0.2524, abs=5e-5)
    said = " ".join((Path(__file__).parents[2] / "docs" / "assumptions.md").read_text(encoding="utf-8").split())
    assert f"{without:.4f} times the derived set, {100.0 * (without / 0.25 - 1.0):.1f} % above" in said
    assert f"stable up to {with_notch:.2f} times the derived set" in said


def behind(*names, delay=0.0):
    return Hardware(tuple(ACTUATOR_SETS[name] for name in names), delay)


@pytest.mark.parametrize(
    ("elevator", "expected"),
    [((), -0.004), (("elevator_150",), 0.005), (("elevator_50",), -0.037), (("elevator_20",), -0.31)],
)
def test_without_the_notch_a_slow_elevator_stabilises_the_modes(elevator, expected):
    """Published numbers to their last digit, the worse of both ends of the step before the fault."""
    vehicle = load_vehicle().coupled("paper_like")
    hardware = behind("fuel_10", *elevator) if elevator else Hardware()
    found = largest_growth(Feedback.of(design("baseline"), notched=False, hardware=hardware), vehicle)
    assert found == pytest.approx(expected, abs=0.003)
    assert (found < 0.0) == (expected < 0.0)


@pytest.mark.parametrize(
    ("elevator", "samples", "damping"),
    [
        ((), (5, 4), 0.41),
        (("elevator_150",), (5, 4), 0.40),
        (("elevator_50",), (4, 3), 0.33),
        (("elevator_first_order_20",), (3, 2), 0.28),
        (("elevator_20",), (2, 1), 0.15),
    ],
)
def test_delays_borne_and_rigid_damping_behind_published_elevators(elevator, samples, damping):
    hardware = behind("fuel_10", *elevator) if elevator else Hardware()
    loop = Feedback.of(design("baseline"), hardware=hardware)
    for coupling, borne in zip(("paper_like", "derived"), samples, strict=True):
        vehicle = load_vehicle().coupled(coupling)

        def growth(delay, vehicle=vehicle):
            late = replace(hardware, delay=delay * loop.period)
            return largest_growth(replace(loop, hardware=late), vehicle)

        assert growth(borne) < 0.0 < growth(borne + 1)
    poles = loop.around(load_vehicle().coupled("paper_like"), TARGET).poles
    rigid = [pole for pole in poles if pole.imag > 3.0 and abs(pole) < 10.0]
    assert min(-pole.real / abs(pole) for pole in rigid) == pytest.approx(damping, abs=0.006)


def test_the_sampled_loop_agrees_with_the_flights_on_who_is_stable():
    growth = {
        (coupling, notched): Feedback.of(design("baseline"), notched=notched)
        .around(load_vehicle().coupled(coupling), TARGET)
        .growth
        for coupling in ("paper_like", "derived")
        for notched in (True, False)
    }
    assert growth["paper_like", True] == pytest.approx(-0.293, abs=2e-3)
    assert -0.01 < growth["paper_like", False] < 0.0
    assert growth["derived", True] < -0.15
    assert growth["derived", False] > 1.0
