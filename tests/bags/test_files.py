from pathlib import Path

from hsv.bags.files import find_files


def files_of(folder: Path, *names: str) -> tuple[list[str], list[str]]:
    for name in names:
        (folder / name).touch()
    found, missing = find_files(folder)
    return [path.name for path in found], missing


def test_files_of_a_split_bag_are_in_order_and_gaps_named(tmp_path: Path) -> None:
    found = files_of(tmp_path, "run_10.mcap", "run_0.mcap", *(f"run_{n}.mcap" for n in range(2, 10)))
    assert found == (["run_0.mcap", *(f"run_{n}.mcap" for n in range(2, 11))], ["run_1.mcap"])


def test_a_number_that_is_a_date_is_no_place_in_a_sequence(tmp_path: Path) -> None:
    assert files_of(tmp_path, "flight_20261122.mcap") == (["flight_20261122.mcap"], [])
    assert files_of(tmp_path, "flight_20261123.mcap") == (["flight_20261122.mcap", "flight_20261123.mcap"], [])
