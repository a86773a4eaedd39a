import numpy as np
import pytest
from numpy.testing import assert_array_equal

from hsv.base.errors import ParameterError
from hsv.base.units import FOOT
from hsv.model.dynamics import in_model_range
from hsv.model.faults.schedule import ActiveFault
from hsv.model.faults.table import Fault
from hsv.model.plant import PLANT_PARAMETERS, FlightStatus, Plant, plant_faults

DEFAULTS = {p.name: p.default for p in PLANT_PARAMETERS}


def plant(**changes):
    return Plant.from_parameters({**DEFAULTS, **{name.replace("__", "."): value for name, value in changes.items()}})


def test_starts_in_the_trim_of_the_nominal_vehicle_even_if_perturbed():
    nominal, heavy = plant(), plant(vehicle__perturbation__mass=0.1)
    assert heavy.vehicle.mass == 1.1 * nominal.vehicle.mass
    assert_array_equal(heavy.reset().state, nominal.reset().state)
    still_air = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0]
    assert nominal.memory().conditions.tolist() == still_air
    held = nominal.initial.input
    assert abs(nominal.step(held).state[0] - nominal.initial.state[0]) < 1e-9
    assert abs(heavy.step(held).state[1] - nominal.initial.state[1]) < 1.0
    assert heavy.step(held).state[2] != nominal.initial.state[2]


@pytest.mark.parametrize(
    "changes",
    [
        {"sensors.set": "fine"},
        {"actuator.elevator_deflection.set": "elevator_50"},
        {"wind.forward": 3.0},
        {"link.measurement.delay": 1.0},
    ],
)
def test_it_is_ideal_only_with_ideal_equipment_and_still_air(changes):
    assert plant().is_ideal(())
    assert not plant(**changes).is_ideal(())


def test_finishes_after_its_duration():
    bench = plant(duration=0.06)
    assert bench.reset().status is FlightStatus.RUNNING
    statuses = [bench.step(bench.initial.input).status for _ in range(3)]
    assert statuses == [FlightStatus.RUNNING, FlightStatus.RUNNING, FlightStatus.FINISHED]


def test_tells_when_the_model_means_nothing_any_more():
    bench = plant()
    result = bench.reset()
    for _ in range(1000):
        result = bench.step(np.array([0.0, -0.5]))
        if result.status is not FlightStatus.RUNNING:
            break
    assert result.status is FlightStatus.DIVERGED
    assert np.all(np.isfinite(result.state))


def test_input_that_is_no_number_ends_the_flight():
    assert plant().step(np.array([np.nan, 0.2])).status is FlightStatus.DIVERGED


def test_a_change_of_faults_in_flight_leaves_the_memories_of_the_others():
    stuck = Fault.of("elevator_deflection", "lock_in_place", {}), 0, 2**62
    frozen = Fault.of("altitude", "sensor_freeze", {}), 0, 2**62
    unstart = Fault.of("engine", "inlet_unstart_outside", {}), 0, 2**62
    before = plant_faults([stuck, frozen, unstart], 0.02)
    for number, faults in enumerate(before.values.values(), 1):
        assert len(faults.memory) == 1
        faults.memory["kept"] = number
    added = [(Fault.of(channel, kind, given), 5, 2**62) for channel, kind, given in ADDED]
    after = plant_faults([*added, stuck, frozen, unstart], 0.02, before)
    for number, faults in enumerate(after.values.values(), 1):
        assert sorted(faults.memory["kept"]) == [0.0, number]


ADDED = [
    ("elevator_deflection", "bias", {"offset": 0.1}),
    ("engine", "thrust_loss", {"share": 0.5}),
    ("velocity", "sensor_freeze", {}),
]


@pytest.mark.parametrize(
    ("changes", "speed", "sound"),
    [
        ({}, 0.0, 299.1),
        ({"wind__up": 40.0}, 0.0, 299.1),
        ({"wind__forward": 100.0}, 100.0, 299.1),
        # The vehicle's own speed of sound at 110,000 ft is 1004 ft/s; that of the standard atmosphere is 1002.7 ft/s.
        ({"vehicle__name": "winged_cone", "initial__altitude": 33528.0, "initial__velocity": 4590.0}, 0.0, 306.025),
    ],
)
def test_an_inlet_feels_angle_of_attack_and_mach_number_of_the_air(changes, speed, sound):
    bench = plant(**changes)
    state = bench.initial.state
    velocity = state[1] - speed
    alpha, mach = state[2] + changes.get("wind__up", 0.0) / velocity, velocity / sound
    for off_alpha, off_mach, started in ((0.0, 0.0, True), (2e-3, 0.0, False), (0.0, 0.02, False)):
        region = {"angle_of_attack": alpha + off_alpha, "angle_of_attack_reach": 1e-3}
        region |= {"mach": mach + off_mach, "mach_reach": 0.01}
        fault = Fault.of("engine", "inlet_unstart_outside", region)
        bench.reset()
        result = bench.step(bench.initial.input, (ActiveFault(fault, 0),))
        assert (result.forces[2] > 0.0) == started


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("period", 0.0, "parameter period = 0.0: expected double from 0.0001 to 1 s"),
        ("vehicle.model", "XM", "parameter vehicle.model = 'XM': expected one of CM, DM"),
        ("vehicle.coupling", "none", "parameter vehicle.coupling = 'none': expected one of paper_like, derived"),
        ("initial.altitude", 20000.0, "parameter initial.altitude = 20000.0: expected double from 25908 to 26365.2 m"),
    ],
)
def test_a_wrong_parameter_is_named(name, value, message):
    with pytest.raises(ParameterError) as caught:
        Plant.from_parameters({**DEFAULTS, name: value})
    assert str(caught.value).startswith(message)


ANGLE_LIMIT = 0.35
CRUISE = np.array([85_500.0 * FOOT, 7_900.0 * FOOT, 0.03, 0.03, 0.0, 0.1, 0.0, 0.1, 0.0])
"""A state of Case 1 in SI units."""


@pytest.mark.parametrize(
    ("index", "value", "inside"),
    [(2, -0.36, False), (3, 0.36, False), (1, 0.0, False), (8, np.nan, False), (0, np.inf, False)],
)
def test_states_in_and_out_of_the_range_of_the_model(index: int, value: float, inside: bool) -> None:
    state = CRUISE.copy()
    state[index] = value
    assert bool(in_model_range(state, ANGLE_LIMIT)) is inside
