"""Exported tables hold what the bag holds, with units in the header."""

from __future__ import annotations

import csv
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pyarrow import parquet
from scipy.io import loadmat

from hsv.bags.export import Format, export
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError
from hsv.control.linear_model import linearise

STATE, TUBE, FAULTS = "/hsv/state", "/hsv/tube_status", "/hsv/actuator"


@pytest.fixture
def bag(kit: SimpleNamespace, tmp_path: Path) -> Bag:
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


def test_csv(bag: Bag, tmp_path: Path) -> None:
    files = export(bag, [STATE, TUBE, FAULTS], Format.csv, tmp_path / "out")
    assert [file.name for file in files] == [
        "hsv_state.csv",
        "hsv_tube_status.csv",
        "hsv_actuator.csv",
        "incomplete.txt",
    ]
    assert "no topic /clock, /hsv/measurement, /hsv/forces" in files[3].read_text()
    with files[0].open() as stream:
        rows = list(csv.DictReader(stream))
    columns = bag.columns(STATE)
    assert [float(row["altitude [m]"]) for row in rows] == pytest.approx(columns["altitude"], rel=0, abs=0, nan_ok=True)
    rate = [float(row["elastic_rate_2 [kg^0.5 m/s]"]) for row in rows]
    assert rate == pytest.approx(columns["elastic_rate_2"], rel=0, abs=0, nan_ok=True)
    assert [int(row["header.stamp [ns]"]) for row in rows] == columns["header.stamp"].tolist()
    with files[1].open() as stream:
        rows = list(csv.DictReader(stream))
    # Of sequences that grow, what is not there is not a number.
    assert rows[2]["error[6] [rad s]"] == "nan" and float(rows[3]["error[6] [rad s]"]) == 6.0
    assert float(rows[0]["error[1] [m/s]"]) == 1.0 and "tau[0]" in rows[0]
    with files[2].open() as stream:
        rows = list(csv.DictReader(stream))
    assert rows[0]["active"] == "[]" and '"channel": "elevator_deflection"' in rows[10]["active"]


def test_parquet(bag: Bag, tmp_path: Path) -> None:
    file, _ = export(bag, [STATE], Format.parquet, tmp_path / "out")
    table = parquet.read_table(file)
    np.testing.assert_array_equal(table["pitch_rate [rad/s]"].to_numpy(), bag.columns(STATE)["pitch_rate"])


def test_npz(bag: Bag, tmp_path: Path) -> None:
    (file,) = export(bag, [STATE, FAULTS], Format.npz, tmp_path / "deep" / "out.npz")
    with np.load(file) as data:
        np.testing.assert_array_equal(
            data["hsv_state.elastic_coordinate_1 [kg^0.5 m]"], bag.columns(STATE)["elastic_coordinate_1"]
        )
        assert data["hsv_actuator.active"][0] == "[]"
        assert "no topic /clock" in str(data["incomplete"])


def test_mat(bag: Bag, tmp_path: Path) -> None:
    (file,) = export(bag, [STATE, FAULTS], Format.mat, tmp_path / "out.mat")
    data = loadmat(file, simplify_cells=True)
    np.testing.assert_array_equal(data["hsv_state"]["elastic_rate_1"], bag.columns(STATE)["elastic_rate_1"])
    assert data["hsv_state"]["units"]["elastic_rate_1"] == "kg^0.5 m/s"
    assert data["hsv_actuator"]["active"][0] == "[]" and "no topic /clock" in data["incomplete"]


@pytest.mark.parametrize("form", [*Format])
def test_the_first_column_is_the_simulated_time_in_seconds(bag: Bag, tmp_path: Path, form: Format) -> None:
    target = tmp_path / f"out.{form}"
    file = export(bag, [STATE], form, target)[0]
    first = {
        Format.csv: lambda: [float(row["time [s]"]) for row in csv.DictReader(file.open())],
        Format.parquet: lambda: parquet.read_table(file)["time [s]"].to_pylist(),
        Format.npz: lambda: np.load(file)["hsv_state.time [s]"],
        Format.mat: lambda: loadmat(file, simplify_cells=True)["hsv_state"]["time"],
    }[form]()
    np.testing.assert_allclose(first, np.arange(20) * 0.02, rtol=1e-12)


@pytest.mark.long
@pytest.mark.skipif(not shutil.which("octave-cli"), reason="needs Octave: apt-get install octave")
def test_octave_reads_a_bag_and_a_linear_model(bag: Bag, tmp_path: Path) -> None:
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


def test_refuses(bag: Bag, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no topic /hsv/nowhere"):
        export(bag, ["/hsv/nowhere"], Format.csv, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    (tmp_path / "there").mkdir()
    with pytest.raises(RecordingError, match="exists already"):
        export(bag, [STATE], Format.csv, tmp_path / "there")
