"""Structs of the core are filled by field name with arrays of the declared shapes, or refused in one line."""

import pickle
import re

import numpy as np
import pytest
from flights import components

from hsv.base.errors import ParameterError
from hsv.control.nominal_law import ellipsoid_level
from hsv.control.notch_filter import NotchSection, discretise
from hsv.core import Struct, compare_enumerators, doubles, dtype, ffi, fly, instruction_set, lanes, lib, loop_memory
from hsv.core.arithmetic import solve
from hsv.flight.closed_loop import flight_struct
from hsv.flight.history import History
from hsv.model.dynamics import VehicleParameters, derivative, jacobian, vehicle_struct
from hsv.model.faults.table import FAULT_KINDS
from hsv.model.vehicle import load_vehicle

NOTCH = discretise([NotchSection(15.0, 0.02, 15.0, 0.5), NotchSection(20.0, 0.05, 21.0, 0.6)], 0.02)


def test_fields_of_the_vehicle_are_those_of_the_core_in_its_order():
    assert [name for name, _ in ffi.typeof("hsv_vehicle").fields] == list(VehicleParameters._fields)
    vehicle = load_vehicle().coupled()
    struct = vehicle_struct(vehicle)
    assert tuple(getattr(struct.pointer, name) for name in vehicle._fields) == vehicle


def test_enumerators_that_differ_from_those_of_the_core_are_named():
    numbers = {kind.enumerator: kind.code for kind in FAULT_KINDS.values()}
    compare_enumerators("hsv_fault_kind", numbers)
    with pytest.raises(ImportError, match=r"^enum hsv_fault_kind of the core: BIAS = 9, BIAS = 26, NEW = 27, expected"):
        compare_enumerators("hsv_fault_kind", numbers | {"BIAS": 26, "NEW": 27})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"B": NOTCH.B[:1]}, "hsv_notch.B: array of shape (1, 2), expected (sections, 2) with sections = 2"),
        ({"A": NOTCH.A[:, 0]}, "hsv_notch.A: array of shape (2, 2), expected (sections <= 4, 2, 2)"),
        ({"A": np.zeros((5, 2, 2))}, "hsv_notch.A: array of shape (5, 2, 2), expected (sections <= 4, 2, 2)"),
        ({"D": "no numbers"}, "hsv_notch.D: "),
        ({"G": None}, "hsv_notch.G: "),
    ],
)
def test_arrays_of_other_shapes_are_refused_by_name(changes, message):
    with pytest.raises(ParameterError, match=re.escape(message)) as refused:
        Struct("hsv_notch", **NOTCH.values | changes)
    assert "\n" not in str(refused.value)


def test_a_complex_array_is_refused_where_the_core_has_real_numbers():
    sensors = components("case1", duration=1.0).plant.data.sensors
    for struct, name in ((sensors, "noise"), (NOTCH, "D")):
        values = struct.values | {name: getattr(struct, name).astype(complex)}
        with pytest.raises(ParameterError, match=rf"{struct.kind}\.{name}: array of complex128, expected float64"):
            Struct(struct.kind, **values)


def test_what_the_core_writes_to_is_never_a_copy():
    memory = components("case1", duration=1.0).plant.memory()
    for wrong in (memory.actuators.astype(np.float32), memory.actuators.tolist(), np.asfortranarray(memory.actuators)):
        with pytest.raises(ParameterError, match=r"hsv_plant_memory\.actuators: expected an array that the core can"):
            Struct("hsv_plant_memory", **memory.values | {"actuators": wrong})


def test_data_are_pickled_and_point_to_arrays_of_their_own():
    copied = pickle.loads(pickle.dumps(NOTCH))
    assert copied.pointer != NOTCH.pointer
    assert copied.pointer.sections == 2 and np.array_equal(copied.A, NOTCH.A)
    parts = pickle.loads(pickle.dumps(components("case1_hard_sensors", duration=1.0)))
    before = parts.plant.step(parts.plant.initial.input).state
    assert np.array_equal(parts.plant._memory.command, parts.plant.initial.input) and np.isfinite(before).all()


def test_the_instructions_are_those_of_the_processor_or_fewer(monkeypatch):
    instruction_set.cache_clear()
    monkeypatch.setenv("HSV_CORE", "sse2")
    assert (instruction_set(), lanes()) == ("sse2", 1)
    instruction_set.cache_clear()
    monkeypatch.setenv("HSV_CORE", "mmx")
    with pytest.raises(ParameterError, match="HSV_CORE = 'mmx': expected one of sse2"):
        instruction_set()
    monkeypatch.undo()
    instruction_set.cache_clear()


NUMBERS = (np.nan, 2**80, -1, np.zeros(0), np.zeros(3), np.zeros((2, 2)), np.zeros((5, 9, 9)), np.zeros(9, complex))
WRONG = (*NUMBERS, None, "", "text", [], {}, object(), np.full((2, 2), "x"), b"bytes")


def test_ten_thousand_random_parameter_sets_are_filled_or_refused_in_one_line():
    random = np.random.default_rng(11)
    parts = components("case1_active", duration=1.0)
    flight = flight_struct(parts, History.empty(51))
    data, tube, plan = parts.plant.data, parts.controller.kernel, parts.nominal_trajectory
    known = [NOTCH, data, plan.data, plan.data.polytope, plan.reference.data, tube, tube.effectiveness]
    known += [data.actuators, data.sensors, flight]
    refused = 0
    for _ in range(10_000):
        source = known[random.integers(len(known))]
        names = [*source.values]
        changes = {names[random.integers(len(names))]: WRONG[random.integers(len(WRONG))] for _ in range(2)}
        try:
            Struct(source.kind, **source.values | changes)
        except ParameterError as error:
            refused += 1
            assert "\n" not in str(error) and str(error).startswith("hsv_")
    assert refused > 5000


def test_flights_are_refused_that_the_memory_or_the_history_has_no_room_for():
    flight = flight_struct(components("case1", duration=1.0), History.empty(10))
    assert fly([flight], loop_memory(1), 0, 10) == 10
    for flights, memory, stop in (
        ([flight], loop_memory(1), 11),
        ([flight] * 3, loop_memory(1), 10),
        ([], loop_memory(1), 10),
        ([flight], loop_memory(1)[:64], 10),
        ([flight], np.zeros(10**6, np.uint8)[1:], 10),
    ):
        with pytest.raises(ValueError, match="expected"):
            fly(flights, memory, 0, stop)


def test_numbers_of_another_length_are_refused():
    vehicle, two, five = load_vehicle().coupled(), np.zeros(2), np.eye(5)
    for call in (
        lambda: solve(np.eye(3), np.ones((5, 1))),
        lambda: derivative(two, two, vehicle),
        lambda: jacobian(np.zeros(9), np.zeros(3), vehicle),
        lambda: ellipsoid_level(five, np.zeros(3)),
        lambda: ellipsoid_level(five[:, :2], np.zeros(5)),
        lambda: components("case1", duration=1.0).plant.step(np.zeros(1)),
    ):
        with pytest.raises(ValueError, match=r"array of shape .* expected"):
            call()


@pytest.mark.parametrize("number", [0.0, 0.5, -3.0, 1e300, -1e300, np.nan, np.inf])
def test_numbers_of_a_fault_that_are_no_numbers_of_steps_are_defined(number):
    """What no path of the library admits: a period below a step, and numbers that do not fit into an integer."""
    rows = np.zeros(2, dtype("hsv_fault"))
    rows["stop"], rows["cycle"] = 1e9, [[number, 2.0], [3.0, number]]
    rows["occurrence"], rows["code"], rows["channel"] = lib.PERIODIC, lib.DELAY, 1
    rows["parameter"][:, 0] = number
    memory = np.zeros(2, dtype("hsv_fault_memory"))
    faults = Struct("hsv_faults", rows=rows, memory=memory, period=0.02)
    for k in range(200):
        command = np.array([0.3, 0.1])
        lib.hsv_apply_command_faults(faults.pointer, k, 1, doubles(command))
        assert command.tolist() in ([0.3, 0.1], [0.3, 0.0])
    rows["channel"] = [7, -1]  # no input of the vehicle
    faults = Struct("hsv_faults", rows=rows, memory=memory, period=0.02)
    lib.hsv_apply_command_faults(faults.pointer, 201, 1, doubles(command))


@pytest.mark.parametrize("number", [-1.0, 0.5, 2.0, 1e300, -1e300, np.nan])
def test_an_unknown_structure_of_a_vehicle_is_that_of_the_paper(number):
    vehicle = load_vehicle().coupled()
    x, u = np.array([26000.0, 2400.0, 0.03, 0.03, 0, 0.5, 0, 0.2, 0]), np.array([0.3, 0.1])
    expected = derivative(x, u, vehicle)
    assert np.array_equal(derivative(x, u, vehicle._replace(structure=number)), expected)
