"""Exported tables have the values of the bag, with units in the header."""

import csv
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from changed_bags import changed_bag
from pyarrow import parquet
from scipy.io import loadmat

from hsv.bags.export import Format, _matlab_names, export
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError
from hsv.control.linear_model import linearise

STATE, TUBE, FAULTS = "/hsv/state", "/hsv/tube_status", "/hsv/actuator"


@pytest.fixture
def bag(kit, tmp_path):
    kinds = {STATE: "VehicleState", TUBE: "TubeStatus", FAULTS: "Actuator"}
    writer = BagWriter(tmp_path / "bag", [kit.topic(t, f"hsv_msgs/msg/{k}") for t, k in kinds.items()])
    fault = kit.messages.fault(0.1)
    for k in range(20):
        time = k * 20_000_000
        writer.write(STATE, time, kit.messages.stamped("hsv_msgs/msg/VehicleState", time, k))
        error = np.arange(5 if k < 3 else 7, dtype=np.float64)
        writer.write(TUBE, time, kit.messages.stamped("hsv_msgs/msg/TubeStatus", time, k, error=error))
        active = [fault] * (k > 9)
        writer.write(FAULTS, time, kit.messages.stamped("hsv_msgs/msg/Actuator", time, k, active=active))
    writer.close()
    return Bag(tmp_path / "bag")


def test_what_does_not_fit_into_a_table(bag, tmp_path):
    files = export(bag, [STATE, TUBE, FAULTS], Format.csv, tmp_path / "out")
    names = ["hsv_state.csv", "hsv_tube_status.csv", "hsv_actuator.csv", "incomplete.txt"]
    assert [file.name for file in files] == names
    assert "no topic /clock, /hsv/measurement, /hsv/forces" in files[3].read_text()
    rows = list(csv.DictReader(files[1].open()))
    # Where a sequence grows, missing entries of earlier rows are NaN.
    assert rows[2]["error[6] [rad s]"] == "nan" and float(rows[3]["error[6] [rad s]"]) == 6.0
    assert float(rows[0]["error[1] [m/s]"]) == 1.0 and "tau[0]" in rows[0]
    rows = list(csv.DictReader(files[2].open()))
    assert rows[0]["active"] == "[]" and '"channel": "elevator_deflection"' in rows[10]["active"]


@pytest.mark.parametrize("form", [*Format])
def test_tables_have_what_the_bag_has_with_units_and_the_time_first(bag, tmp_path, form):
    file = export(bag, [STATE], form, tmp_path / f"out.{form}")[0]

    def column(name, unit):
        match form:
            case Format.csv:
                return [float(row[f"{name} [{unit}]"]) for row in csv.DictReader(file.open())]
            case Format.parquet:
                return parquet.read_table(file)[f"{name} [{unit}]"].to_numpy()
            case Format.npz:
                return np.load(file)[f"hsv_state.{name} [{unit}]"]
        state = loadmat(file, simplify_cells=True)["hsv_state"]
        assert state["units"][name] == unit
        return state[name]

    np.testing.assert_allclose(column("time", "s"), np.arange(20) * 0.02, rtol=1e-12)
    np.testing.assert_array_equal(column("elastic_rate_2", "kg^0.5 m/s"), bag.columns(STATE)["elastic_rate_2"])
    np.testing.assert_array_equal(column("altitude", "m"), bag.columns(STATE)["altitude"])


@pytest.mark.long
@pytest.mark.skipif(not shutil.which("octave-cli"), reason="needs Octave: apt-get install octave")
def test_octave_reads_a_bag_and_a_linear_model(bag, tmp_path):
    export(bag, [STATE], Format.mat, tmp_path / "bag.mat")
    model = linearise(model="ECM")
    model.save(tmp_path / "model.mat")
    program = r"""
        bag = load("bag.mat"); model = load("model.mat");
        printf("%s %.17g %s\n", bag.hsv_state.units.altitude, bag.hsv_state.time(end), model.states{5});
        printf("%.17g\n", [model.A(2, 3), model.B(5, 2), size(model.C), model.operating_input'])"""
    command = ["octave-cli", "--quiet", "--no-init-file", "--eval", program]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    first, *numbers = done.stdout.splitlines()
    assert first == "m 0.38 filtered_pitch_rate"
    expected = [model.A[1, 2], model.B[4, 1], 11.0, 11.0, *model.operating_input]
    assert [float(number) for number in numbers] == expected


def test_refuses(bag, tmp_path):
    with pytest.raises(RecordingError, match="no topic /hsv/nowhere"):
        export(bag, ["/hsv/nowhere"], Format.csv, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    (tmp_path / "there").mkdir()
    with pytest.raises(RecordingError, match="exists already"):
        export(bag, [STATE], Format.csv, tmp_path / "there")


def test_names_of_structures_are_those_that_matlab_reads():
    names = ["_veh_hsv_state", "7_state", "hsv_state", "hsv_state", "hsv state", "x" * 80, "x" * 90, "incomplete"]
    found = _matlab_names(names)
    assert found[:5] == ["x_veh_hsv_state", "x7_state", "hsv_state", "hsv_state_2", "hsv_state_3"]
    assert len({*found, "incomplete"}) == len(names) + 1
    assert all(re.fullmatch("[A-Za-z][A-Za-z0-9_]{0,62}", name) for name in found)


def test_a_bag_in_a_namespace_with_an_underscore_is_exported_for_matlab(bag, tmp_path):
    moved = changed_bag(bag.path, tmp_path / "moved", lambda topic: replace(topic, name=f"/_veh{topic.name}"))
    [file] = export(Bag(moved), [f"/_veh{STATE}"], Format.mat, tmp_path / "bag.mat")
    assert len(loadmat(file, simplify_cells=True)["x_veh_hsv_state"]["time"]) == len(bag.times(STATE))
