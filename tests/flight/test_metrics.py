import math

import numpy as np
import pytest
from flights import components
from numpy.testing import assert_allclose

from hsv.base.units import UnitSystem
from hsv.flight.closed_loop import fly
from hsv.flight.history import History
from hsv.flight.limits import Verdict, limits_kept, verdict_sentence, verdicts
from hsv.flight.metrics import METRICS, FlightData
from hsv.flight.scenario import load_scenario

PERIOD = 0.02
REFERENCE = np.array([1000.0, 500.0, 0.02, 0.03, 0.0, 1.0, 0.0, 0.8, 0.0])


def flight(duration=100.0, fault=None, **columns):
    """Return a flight at rest at its reference, except for the given columns (functions of time)."""
    time = np.arange(round(duration / PERIOD) + 1) * PERIOD
    state = np.tile(REFERENCE, (len(time), 1))
    deviation = np.zeros_like(state)
    command = np.tile([0.3, 0.2], (len(time), 1))
    saturated = np.zeros_like(command, bool)
    places = {
        "altitude": (state, 0),
        "velocity": (state, 1),
        "alpha": (state, 2),
        "theta": (state, 3),
        "rate_1": (state, 6),
        "rate_2": (state, 8),
        "nominal_alpha": (deviation, 2),
        "fuel": (command, 0),
        "elevator": (command, 1),
        "fuel_limited": (saturated, 0),
        "elevator_limited": (saturated, 1),
    }
    for name, function in columns.items():
        array, column = places[name]
        array[:, column] = array[:, column] + function(time)
    history = History.of(
        state=state, deviation=deviation, command=command, u_unsaturated=np.where(saturated, np.nan, command)
    )
    return FlightData(time, history, np.tile(REFERENCE, (len(time), 1)), fault)


def test_exponential_response_has_the_textbook_times():
    tau = 5.0
    m = flight(altitude=lambda t: -100.0 * np.exp(-t / tau)).metrics
    assert m["altitude_rise_time"] == pytest.approx(tau * math.log(9.0), abs=2 * PERIOD)
    assert m["altitude_settling_time"] == pytest.approx(tau * math.log(50.0), abs=2 * PERIOD)
    assert m["altitude_overshoot"] == 0.0
    assert m["altitude_integral_absolute_error"] == pytest.approx(100.0 * tau, rel=1e-4)
    assert m["altitude_end_error"] == pytest.approx(-100.0 * math.exp(-100.0 / tau), rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_second_order_response_overshoots_as_the_textbook_says_up_and_down(sign):
    zeta, omega = 0.5, 1.0
    damped = omega * math.sqrt(1 - zeta**2)

    def error(t):
        decay = np.exp(-zeta * omega * t)
        return -sign * 10.0 * decay * (np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t))

    m = flight(velocity=error).metrics
    assert m["velocity_overshoot"] == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)), abs=1e-4)
    assert m["velocity_settling_time"] == pytest.approx(8.1, abs=0.1)
    assert m["velocity_rise_time"] == pytest.approx(1.64, abs=0.05)


def test_response_metrics_stop_at_the_fault_but_errors_do_not():
    def error(t):
        return np.where(t < 50.0, -100.0 * np.exp(-t), 30.0)

    m = flight(fault=50.0, altitude=error).metrics
    assert m["altitude_settling_time"] < 5.0
    assert m["altitude_overshoot"] == 0.0
    assert m["altitude_end_error"] == 30.0
    assert m["altitude_integral_absolute_error"] == pytest.approx(100.0 + 30.0 * 50.0, rel=1e-2)


def test_attitude_deviation_is_from_the_mean_before_the_fault_or_from_nominal():
    def alpha(t):
        # It oscillates about 0.001 in the 5 s before the fault, differs before, and jumps by 0.004 at the fault.
        return np.select([t < 45.0, t < 50.0], [0.1, 0.001 + 1e-4 * np.sin(2 * math.pi * t)], 0.005)

    m = flight(fault=50.0, alpha=alpha, nominal_alpha=lambda t: 0.002 + 0 * t).metrics
    assert m["post_fault_attitude_deviation"] == pytest.approx(0.004, abs=1e-6)
    assert m["post_fault_attitude_from_nominal"] == pytest.approx(0.003, abs=1e-9)
    assert m["attitude_from_nominal"] == pytest.approx(0.098, abs=1e-9)


def test_decay_time_is_that_of_the_envelope_and_the_slower_mode_counts():
    def ring(tau):
        return lambda t: np.where(t < 50.0, 5.0, np.exp(-(t - 50.0) / tau) * np.cos(15.0 * (t - 50.0)))

    m = flight(fault=50.0, rate_1=ring(2.0), rate_2=ring(4.0)).metrics
    half_swing = math.pi / 15.0
    assert m["elastic_rate_1_decay_time"] == pytest.approx(2.0 * math.log(20.0), abs=half_swing)
    assert m["elastic_rate_2_decay_time"] == pytest.approx(4.0 * math.log(20.0), abs=half_swing)
    assert m["elastic_decay_time"] == m["elastic_rate_2_decay_time"]


def test_input_ranges_and_saturated_steps():
    m = flight(
        fuel=lambda t: 0.1 * np.sin(t),
        elevator=lambda t: -0.05 * (t > 3.0),
        fuel_limited=lambda t: t < 0.09,
        elevator_limited=lambda t: (t > 0.05) & (t < 0.15),
    ).metrics
    assert_allclose([m["fuel_equivalence_ratio_minimum"], m["fuel_equivalence_ratio_maximum"]], [0.2, 0.4], atol=1e-4)
    assert_allclose([m["elevator_deflection_minimum"], m["elevator_deflection_maximum"]], [0.15, 0.2])
    # Limited: steps 0-4 of one input, 3-7 of the other. A step with both limited counts once.
    assert m["saturated_steps"] == 8


def test_a_flight_that_ended_in_numbers_that_are_none_still_has_metrics():
    def gone(t):
        return np.where(t > 99.0, np.nan, np.exp(-t))

    m = flight(fault=50.0, altitude=gone, velocity=gone, alpha=gone, rate_1=gone, rate_2=gone).metrics
    assert math.isnan(m["altitude_end_error"])
    assert "elastic_rate_1_decay_time" not in m


def test_order_and_names_are_those_of_the_table():
    curves = {name: lambda t: -np.exp(-t) for name in ("altitude", "velocity", "rate_1")}
    assert list(flight(fault=50.0, **curves).metrics) == list(METRICS)


@pytest.mark.parametrize(("scenario", "limited"), [("case1", False), ("case1_derived_no_notch", True)])
def test_a_flight_that_was_recorded_has_the_same_metrics_in_every_bit(scenario, limited):
    flown = fly(components(scenario, duration=110.0))
    signals = {name: getattr(flown.history, name) for name in ("state", "deviation", "command")}
    unlimited = np.where(flown.saturated, np.nan, flown.history.command)
    history = History.of(**signals, u_unsaturated=unlimited)
    recorded = FlightData(flown.time, history, flown.reference.copy(), flown.fault_start)
    assert flown.saturated.any() == limited
    for name in ("curves", "saturated"):
        assert np.array_equal(getattr(flown, name), getattr(recorded, name))
    assert flown.metrics == recorded.metrics


@pytest.mark.parametrize(
    ("value", "ended", "words"),
    [
        (-2.0, True, "within"),
        (2.1, True, "over"),
        (math.nan, True, "over"),
        (None, True, "not within"),
        (0.0, False, "not flown to the end"),
        (-3.0, False, "over"),
    ],
)
def test_a_limit_is_kept_only_by_a_flight_that_came_to_its_end(value, ended, words):
    verdict = Verdict(2.0, value, ended)
    assert verdict.words == words
    assert verdict.kept == (words == "within")


DECAY = {"elastic_decay_time": 67.1, "altitude_overshoot": 0.04}


@pytest.mark.parametrize(
    ("metrics", "ended", "sentence"),
    [
        ({"saturated_steps": 0.0}, True, "within its limit"),
        ({"saturated_steps": 0.0, **DECAY}, True, "within its limit; not judged: elastic decay time (67.1 s), 1 other"),
        ({"saturated_steps": 3.0}, True, "1 of 1 limits violated: saturated steps 3 (limit 0)"),
        ({}, True, "1 of 1 limits violated: saturated steps not within"),
        ({"saturated_steps": 0.0}, False, "not flown to the end"),
        ({"saturated_steps": 3.0}, False, "not flown to the end; 1 of 1 limits violated: saturated steps 3 (limit 0)"),
    ],
)
def test_the_verdict_is_one_sentence(metrics, ended, sentence):
    judged = verdicts(load_scenario("case1_rmpc"), metrics, {}, ended=ended)
    assert verdict_sentence(judged, metrics, UnitSystem.metric) == sentence


def test_what_a_healthy_flight_lacks_does_not_apply_and_breaks_no_limit():
    healthy = flight(altitude=lambda t: 100.0 * np.exp(-t / 5.0))
    assert healthy.missing["velocity_overshoot"] == "no velocity step"
    assert {why for name, why in healthy.missing.items() if "fault" in name or "decay" in name} == {"no fault"}
    case1 = load_scenario("case1")
    judged = verdicts(case1, {**healthy.metrics, "altitude_end_error": 0.0}, healthy.missing, ended=True)
    assert limits_kept(judged, UnitSystem.metric) == "within all 3 limits; 3 do not apply: no fault"
    lost = verdicts(case1, healthy.metrics, healthy.missing, ended=False)
    assert not any(verdict.kept for verdict in lost.values())
    assert not lost["elastic_decay_time"].words.startswith("does not apply")


def test_the_table_says_what_each_metric_needs():
    steps = {"altitude": lambda t: 9.0 * np.exp(-t), "velocity": lambda t: 9.0 * np.exp(-t)}
    elastic = {"rate_1": lambda t: np.exp(-t), "rate_2": lambda t: np.exp(-t)}
    for given, lacking in (
        ({"fault": 50.0, **steps, **elastic}, ()),
        ({"fault": 50.0, **elastic}, ("step of altitude", "step of velocity")),
        ({"fault": 50.0, **steps}, ("fault, and an elastic vehicle",)),
        ({**steps, **elastic}, ("fault", "fault, and a step before it", "fault, and an elastic vehicle")),
    ):
        assert flight(**given).missing.keys() == {name for name, m in METRICS.items() if m.needs in lacking}
    assert all(metric.formula for metric in METRICS.values())


def test_a_time_that_was_not_reached_has_no_number_and_breaks_its_limit():
    ringing = flight(fault=50.0, altitude=lambda t: 100.0 + 0 * t, rate_1=lambda t: np.cos(15.0 * t))
    for name, why in (("altitude_rise_time", "not within 50 s"), ("elastic_decay_time", "not within 50 s")):
        assert name not in ringing.metrics and ringing.missing[name] == why
    verdict = verdicts(load_scenario("case1"), ringing.metrics, ringing.missing, ended=True)["elastic_decay_time"]
    assert (verdict.words, verdict.kept) == ("not within 50 s", False)
