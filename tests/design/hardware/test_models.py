import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.core.arithmetic import LARGEST
from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import error_system
from hsv.design.hardware.models import Measured, air, declared, delayed
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.disturbance import ChannelModel, along_filter, membership
from hsv.flight.scenario import load_scenario
from hsv.model.dynamics import advance
from hsv.model.signals import N_RIGID, PITCH_RATE
from hsv.model.trim import trim

SLOW = {"set": "elevator_50", "natural_frequency": "5 rad/s"}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"link.measurement.delay": 1}, ["link of the measurement"]),
        ({"link.computational_delay": "5 ms"}, ["link of the command"]),
        ({"actuator.elevator_deflection": SLOW}, ["actuator.elevator_deflection.natural_frequency"]),
        ({"sensors.altitude.drop_out": "1 %", "estimator.enabled": True}, ["drop-out of a sensor", "estimator"]),
    ],
)
def test_what_has_no_bound_is_named(subject, change, named):
    assert declared(subject, load_scenario("case1", change)) == ({}, named)


@pytest.mark.parametrize("state", range(N_RIGID))
def test_an_error_that_the_sensor_hides_moves_neither_feedback_nor_filter(problem, subject, state):
    bias = np.zeros(N_RIGID)
    bias[state] = 0.01
    effect = Measured(np.abs(bias))(problem.system)
    hidden = np.zeros(7)
    hidden[state] = -0.01
    system = problem.system
    assert_allclose(system.F @ hidden + effect.feedthrough @ bias, 0.0, atol=1e-15)
    moved = system.A @ hidden + effect.columns @ bias
    assert_allclose(moved[:, :N_RIGID], subject.design.polytope.A[:, :N_RIGID, state] * -0.01, atol=1e-14)
    assert_allclose(moved[:, N_RIGID:], 0.0, atol=1e-15)


@pytest.mark.parametrize(("column", "size"), [(0, 0.5), (1, 0.5), (2, 0.01)])
def test_air_moves_the_vehicle_as_its_equations_say(problem, subject, column, size):
    """A period in moving or denser air minus one in still air, at mid-envelope; 1 % is left for nonlinearity."""
    vehicle, period = subject.vehicle, subject.design.period
    effect = air(vehicle, period, 1.0, 1.0, 1.0)(problem.system)
    point = trim(vehicle.decoupled, *vehicle.centre)
    ends = []
    for acting in (size, 0.0):
        conditions = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
        conditions[column] += acting
        ends.append(advance(point.state, point.input, vehicle.decoupled, period, 4, conditions)[:N_RIGID])
    found = effect.columns[0, :N_RIGID, column] * size
    assert_allclose(found, ends[0] - ends[1], rtol=0.01, atol=1e-9 * np.abs(found).max())
    assert not effect.feedthrough.any()


DECLARED = {
    "fine": {"sensors": {"set": "fine"}, "seed": 3},
    "coarse": {
        "sensors": {
            "pitch_angle": {"bias": "0.02 deg", "quantum": "0.01 deg"},
            "pitch_rate": {"quantum": "0.02 deg/s", "bias_sigma": "0.01 deg/s"},
            "velocity": {"scale": 1e-4},
        }
    },
    "late": {"sensors": {"pitch_angle": {"latency": 1}, "pitch_rate": {"latency": 2}, "altitude": {"latency": 3}}},
    "all": {
        "sensors": {"set": "fine", "altitude": {"bias": "-3 ft", "quantum": "2 ft"}, "angle_of_attack": {"latency": 1}}
    },
}


@pytest.mark.long
@pytest.mark.parametrize("name", DECLARED)
def test_the_errors_of_an_equipped_flight_evolve_as_the_enlarged_system_says(subject, plan, name):
    """Each step of the error e in a flight with sensors is A e + G d + sensor channels, all within their bounds.

    The remainder, due to scheduling with measured states, is within the widened bounds of the disturbance.
    """
    scenario = load_scenario("case1", DECLARED[name])
    design, vehicle = subject.design, subject.vehicle
    models, unbounded = declared(subject, scenario, LARGEST)
    assert models and not unbounded
    flight = fly(assemble_flight(scenario, design))
    rows, reference, model = flight.history, flight.reference, ChannelModel(design, vehicle)
    channels = model.channels(flight)
    more = models.pop("model errors under sensors")(problem_at(design, model, 0.0, 0.0)).widening
    certified = DisturbanceSet.from_report(subject.certificate["tube"]["disturbance"]["channels"])
    assert membership(channels, certified.lower - more, certified.upper + more).ratio <= 1.0
    late = sum(one.late for one in models.values())
    x, planned = rows.state[:, :N_RIGID], (reference + rows.deviation)[:, :N_RIGID]
    seen_plan = queued(planned, late) - planned
    e = x - planned
    seen_error = flight.history.estimate[:, :N_RIGID] - planned
    # The errors that sensors add to plan and error, apart from late samples.
    added = seen_error - queued(e, late) - seen_plan
    settled = slice(int(late.max()) + 1, None)
    bound = sum(one.error for one in models.values())
    assert np.all(np.abs(added) <= bound + 1e-12 * np.abs(x).max(axis=0))
    assert np.all(np.abs(seen_plan)[settled] <= plan.change(late) + 1e-12)
    observed = along_filter(model.notch, seen_error[:, PITCH_RATE])[1]
    widened = sum(one(problem_at(design, model, 0.0, 0.0)).widening for one in models.values())
    inverse = np.linalg.inv(model.columns[[1, 2, 4]])
    for k in range(settled.start, len(x) - 1, 97):
        system = problem_at(design, model, *rows.state[k, :2])
        effect = Measured(np.ones(N_RIGID))(system)
        whole = delayed(system, late) if late.any() else system
        queue = [e[k - 1 - j, i] for i, n in enumerate(late) for j in range(n)]
        state = np.r_[e[k], observed[k], queue]
        moved = whole.A[0] @ state
        n = len(system.names)
        moved[:n] += system.G[0] @ channels[k] + effect.columns[0] @ (added + seen_plan)[k]
        after = np.r_[e[k + 1], observed[k + 1], [e[k - j, i] for i, n_late in enumerate(late) for j in range(n_late)]]
        off = after - moved
        assert_allclose(off[N_RIGID:], 0.0, atol=1e-12)
        accelerations = inverse @ off[[1, 2, 4]]
        remains = off[[0, 3]] - model.columns[[0, 3]] @ accelerations
        assert np.all(np.abs(np.r_[accelerations, remains]) <= widened[[0, 1, 2, 5, 6]] + 1e-9)


def queued(columns, late):
    """Return the columns, each delayed by its number of steps; the delay line begins filled with the first sample."""
    rows = [np.concatenate((np.repeat(c[:1], n), c[: len(c) - n])) for c, n in zip(columns.T, late, strict=True)]
    return np.column_stack(rows)


def problem_at(design, model, altitude, velocity):
    A, B = design.polytope.at(altitude, velocity)
    return error_system(A[None], B[None], design.feedback_gain, model.notch, model.columns)
