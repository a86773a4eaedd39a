import numpy as np
import pytest
from numpy.testing import assert_array_equal

from hsv.errors import ParameterError, TrimError
from hsv.vehicle.plant import PLANT_PARAMETERS, FlightStatus, Plant

DEFAULTS = {p.name: p.default for p in PLANT_PARAMETERS}


def plant(**changes):
    return Plant.from_parameters({**DEFAULTS, **{name.replace("__", "."): value for name, value in changes.items()}})


def test_starts_in_the_trim_of_the_nominal_vehicle_even_if_perturbed():
    nominal, heavy = plant(), plant(vehicle__perturbation__mass=0.1)
    assert heavy.vehicle.mass == 1.1 * nominal.vehicle.mass
    assert_array_equal(heavy.reset().state, nominal.reset().state)
    held = nominal.initial.input
    assert abs(nominal.step(held).state[0] - nominal.initial.state[0]) < 1e-9
    assert abs(heavy.step(held).state[1] - nominal.initial.state[1]) < 1.0
    assert heavy.step(held).state[2] != nominal.initial.state[2]


def test_reset_repeats_the_flight_bit_for_bit():
    bench = plant()
    held = bench.initial.input * 1.01
    first = [bench.reset().state, *(bench.step(held).state for _ in range(50))]
    second = [bench.reset().state, *(bench.step(held).state for _ in range(50))]
    assert_array_equal(first, second)


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


def test_result_is_a_copy():
    bench = plant()
    first = bench.reset().state
    bench.step(bench.initial.input * 1.1)
    assert_array_equal(first, bench.initial.state)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("period", 0.0, "parameter period = 0.0: expected double from 0.0001 to 1 s"),
        ("period", 1, "parameter period = 1: expected double"),
        ("substeps", 2.0, "parameter substeps = 2.0: expected integer"),
        ("substeps", True, "parameter substeps = True: expected integer"),
        ("vehicle.model", "XM", "parameter vehicle.model = 'XM': expected one of CM, DM"),
        ("vehicle.coupling", "none", "parameter vehicle.coupling = 'none': expected one of paper_like, derived"),
        ("initial.altitude", 20000.0, "parameter initial.altitude = 20000.0: expected double from 25908 to 26365.2 m"),
        ("initial.velocity", float("nan"), "parameter initial.velocity = nan: expected double"),
        ("vehicle.perturbation.mass", -1.0, "parameter vehicle.perturbation.mass = -1.0: expected double"),
    ],
)
def test_a_wrong_parameter_is_named(name, value, message):
    with pytest.raises(ParameterError) as caught:
        Plant.from_parameters({**DEFAULTS, name: value})
    assert str(caught.value).startswith(message)


def test_errors_share_one_base():
    from hsv.errors import HsvError

    assert issubclass(TrimError, HsvError)
    assert issubclass(ParameterError, HsvError)
