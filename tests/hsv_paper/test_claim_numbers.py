import math

import numpy as np
import pytest

from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence
from hsv_paper.claims.numbers import kept_of_level, largest_disturbances, margins
from hsv_paper.claims.table import GROUPS, Verdict
from hsv_paper.designs import certificate

CORNERS = [
    {},
    {"mass": 0.1, "moment_of_inertia": -0.1},
    {"mass": -0.1, "moment_of_inertia": 0.1},
]
OF_PAPER = ("", "none", "ideal")
CLAIMS = {claim.name: claim for group in ("Baseline controller", "Notch filter") for claim in GROUPS[group]}


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    return Evidence(tmp_path_factory.mktemp("evidence"), over=CORNERS)


@pytest.fixture(scope="module")
def findings(evidence):
    return {name: claim.measure(evidence) for name, claim in CLAIMS.items()}


def values(finding, *actuators):
    return {reading.what: reading.value for reading in finding.readings if reading.actuators in (actuators or OF_PAPER)}


def test_what_loses_a_step_s_share_of_its_level_decreases():
    A = np.array([[[0.5, 0.0], [0.0, 0.5]], [[0.0, 0.9], [0.0, 0.0]]])
    B = np.zeros((2, 2, 1))
    assert kept_of_level(A, B, np.zeros((1, 2)), np.eye(2)) == pytest.approx(0.81)
    # The same map seen in another metric grows: a shape decides, not the poles alone.
    assert kept_of_level(A, B, np.zeros((1, 2)), np.diag([4.0, 1.0])) > 1.0


@pytest.mark.long
def test_peaks_fall_but_are_not_eliminated(findings):
    finding = findings["peaks eliminated"]
    assert finding.verdict is Verdict.FAILS
    first, second, *centred = (reading.value for reading in finding.readings)
    assert first == pytest.approx(19.4, abs=0.1)
    assert second == pytest.approx(6.7, abs=0.1)
    assert centred == [math.inf, math.inf]
    assert findings["peak suppressed"].verdict is Verdict.HOLDS


def test_stability_without_the_notch_hangs_on_a_hundredth_of_the_coupling(findings):
    finding = findings["stable without the notch"]
    assert finding.verdict is Verdict.CONDITIONS
    assert finding.readings[0].holds
    assert values(finding)["critical coupling relative to the paper-like one"] == pytest.approx(1.0095, abs=1e-3)
    assert "0.2524" in finding.why


def test_a_slow_elevator_does_what_the_notch_is_for(findings):
    """Largest real parts without the notch by models of published elevators, of the nominal vehicle."""
    growth = {
        reading.actuators: reading.value
        for reading in findings["stable without the notch"].readings
        if reading.what == "largest real part of the poles, nominal vehicle, paper-like coupling"
    }
    assert growth["ideal"] == pytest.approx(-0.004, abs=5e-4)
    assert growth["elevator_150"] == pytest.approx(0.005, abs=5e-4)
    assert growth["elevator_50"] < growth["ideal"]
    assert growth["elevator_20"] == pytest.approx(-0.312, abs=5e-4)
    with_notch = [r for r in findings["stability is not destroyed"].readings if "nominal" in r.what]
    assert [r.actuators for r in with_notch] == list(growth) and all(r.holds for r in with_notch)


def test_claims_on_the_notch_name_their_actuators(findings):
    for claim in GROUPS["Notch filter"]:
        readings = findings[claim.name].readings
        assert all(reading.actuators for reading in readings), claim.name
        leading = readings[: findings[claim.name].leading]
        assert all(reading.actuators in ("none", "ideal") for reading in leading), claim.name


def test_the_notch_raises_the_smallest_margin_and_lowers_that_of_the_rigid_body(findings):
    ideal = list(values(findings["phase margin"]).values())
    assert np.degrees(ideal[0]) > 30.0
    assert np.degrees(ideal[-1]) < -10.0


def test_a_loop_that_is_not_stable_has_no_margin(evidence):
    derived = load_vehicle().coupled("derived")
    assert min(margin.phase for margin in margins(evidence, notched=False)) > 0.0
    assert max(margin.phase for margin in margins(evidence, derived, notched=False)) < 0.0


def test_the_modes_act_through_the_pitch_rate_and_are_not_acted_on_by_it(findings):
    onto_rigid, answer, onto_elastic = (r.value for r in findings["coupling in the pitch rate"].readings)
    assert onto_rigid == pytest.approx(1.0)
    assert 0.9 < answer < 1.0
    assert onto_elastic == pytest.approx(0.0)


def test_filtering_takes_vibration_and_not_parameters_out_of_the_disturbance(findings):
    pitch, bound, acceleration, _ = (r.value for r in findings["filtering reduces uncertainty"].readings)
    assert bound <= pitch < 0.9
    assert acceleration == pytest.approx(1.0, abs=0.01)


def test_neither_set_is_symmetric_about_the_origin(findings):
    one_sided, shifted = (reading.value for reading in findings["symmetric sets"].readings)
    assert one_sided == pytest.approx(1.0)
    assert 0.1 < shifted < 1.0


def test_the_lyapunov_function_decreases_at_every_vertex_and_in_flight(findings):
    assert findings["the Lyapunov function decreases"].verdict is Verdict.HOLDS


def test_disturbances_of_a_flight_lie_in_the_set_that_was_certified():
    bounds = certificate("baseline")["tube"]["disturbance"]["channels"]
    found = largest_disturbances("case1", [{}, {"mass": 0.1, "moment_of_inertia": -0.1}])
    assert found.keys() == bounds.keys()
    for name, values in found.items():
        assert np.all(values <= max(-bounds[name]["lower"], bounds[name]["upper"]))


def test_without_the_notch_there_is_no_filtered_rate_and_more_pitch_acceleration():
    with_notch, without = (largest_disturbances(name, [{}]) for name in ("case1", "case1_no_notch"))
    assert with_notch["filtered_nominal_rate"][0] > 0.0
    assert without["filtered_nominal_rate"][0] == 0.0
    assert with_notch["pitch_acceleration"][0] < 0.9 * without["pitch_acceleration"][0]
