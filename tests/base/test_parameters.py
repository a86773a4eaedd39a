import math

import numpy as np
import pytest

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.control.controller import CONTROLLER_PARAMETERS
from hsv.control.design import DESIGN_PARAMETERS
from hsv.control.nominal_trajectory import NOMINAL_PARAMETERS
from hsv.control.notch_filter import NOTCH_PARAMETERS
from hsv.control.robust_mpc import ROBUST_MPC_PARAMETERS
from hsv.model.faults.injector import FAULT_PARAMETERS
from hsv.model.plant import PLANT_PARAMETERS

TABLES = (
    PLANT_PARAMETERS,
    NOTCH_PARAMETERS,
    NOMINAL_PARAMETERS,
    CONTROLLER_PARAMETERS,
    ROBUST_MPC_PARAMETERS,
    FAULT_PARAMETERS,
    DESIGN_PARAMETERS,
)
PERIOD = Parameter("period", 0.02, "control period", "s", 1e-4, 1.0)
ARRAY = Parameter("gains", [1.0], "gains", minimum=0.0)


@pytest.mark.parametrize(
    ("parameter", "value"), [(PERIOD, 0.01), (PERIOD, np.float64(0.01)), (ARRAY, [0.0, 2.5]), (ARRAY, np.array([1.0]))]
)
def test_admissible_values_pass_unchanged(parameter, value):
    assert parameter.check(value) == value


@pytest.mark.parametrize(
    ("parameter", "value", "message"),
    [
        (PERIOD, 1, "parameter period = 1: expected double from 0.0001 to 1 s"),
        (PERIOD, True, "parameter period = True: expected double"),
        (PERIOD, math.nan, "parameter period = nan: expected double"),
        (PERIOD, 2.0, "parameter period = 2.0: expected double from 0.0001 to 1 s"),
        (Parameter("x", 1.0, "x", "m", 0.0), -1.0, "parameter x = -1.0: expected double of at least 0 m"),
        (Parameter("x", 1.0, "x", maximum=2.0), 3.0, "parameter x = 3.0: expected double of at most 2"),
        (Parameter("n", 2, "count"), 2.0, "parameter n = 2.0: expected integer"),
        (Parameter("on", True, "switch"), 1, "parameter on = 1: expected bool"),
        (Parameter("w", "a", "word", choices=("a", "b")), "c", "parameter w = 'c': expected one of a, b"),
        (ARRAY, 1.0, "parameter gains = 1.0: expected double array of at least 0"),
        (ARRAY, [1.0, 2], "parameter gains[1] = 2: expected double array"),
        (ARRAY, [-1.0], "parameter gains[0] = -1.0: expected double array of at least 0"),
        (PERIOD, 10**400, "parameter period = 1000"),
    ],
)
def test_others_are_refused_by_name_value_and_expectation(parameter, value, message):
    with pytest.raises(ParameterError) as caught:
        parameter.check(value)
    assert str(caught.value).startswith(message)


def test_a_table_fills_in_defaults_and_ignores_foreign_names():
    assert validate((PERIOD, ARRAY), {"period": 0.5, "foreign": "x"}) == {"period": 0.5, "gains": [1.0]}


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table[0].name)
def test_every_default_is_admissible_described_and_of_one_name(table):
    validate(table, {})
    assert all(parameter.description for parameter in table)
    assert len({parameter.name for parameter in table}) == len(table)


def test_parameters_shared_by_several_tables_are_the_same():
    seen: dict[str, Parameter] = {}
    for parameter in (p for table in TABLES for p in table):
        assert seen.setdefault(parameter.name, parameter) == parameter
