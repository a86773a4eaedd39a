"""Exported tables hold what the bag holds, with units in the header."""

from __future__ import annotations

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pyarrow import parquet

from hsv.bags.export import Format, export
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError

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


def test_refuses(bag: Bag, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no topic /hsv/nowhere"):
        export(bag, ["/hsv/nowhere"], Format.csv, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    (tmp_path / "there").mkdir()
    with pytest.raises(RecordingError, match="exists already"):
        export(bag, [STATE], Format.csv, tmp_path / "there")
