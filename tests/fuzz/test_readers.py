"""Every reader of files, given mutated files, returns values or a one-line error, and never writes a partial file."""

from __future__ import annotations

import re
import shutil
from contextlib import suppress
from pathlib import Path
from zlib import crc32

import hypothesis
import pyarrow.parquet as pq
import pytest
from changed_bags import changed_bag
from fuzzing import Fuzz
from hypothesis import settings
from hypothesis import strategies as st
from mutations import Mutated, mutated
from node_processes import short_scenario
from recorded_flight import record_flight

from hsv.bags.info import describe
from hsv.bags.reader import Bag
from hsv.bags.recover import recover
from hsv.bags.steps import bag_warnings
from hsv.base.errors import HsvError
from hsv.base.units import parse_quantity
from hsv.certificate.verification import preflight
from hsv.control.design_file import certificate_path, find_design, read_design
from hsv.flight.assembly import uncovered_of
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results, limits, shares, worst_flights
from hsv.flight.scenario import load_scenario, scenario_names, scenario_text
from hsv.model.vehicle import load_vehicle, vehicle_names, vehicle_text


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record_flight(tmp_path_factory.mktemp("flown") / "bag", duration=0.2, fault=0.1).folder


@pytest.fixture(scope="module")
def small_bag(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the same bag without the parameters, which take most of its space."""
    return changed_bag(bag, tmp_path_factory.mktemp("small") / "bag", attachments=None)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("campaign")
    planned = plan(str(short_scenario(folder, duration=1, fault=0)), samples=2)
    run_campaign(planned, ResultStore(folder / "flown.parquet", planned), Executor())
    return Results(folder / "flown.parquet")


def test_a_scenario(fuzz: Fuzz, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"

    def read(given: Mutated) -> None:
        path.write_bytes(given.data)
        scenario = load_scenario(str(path))
        scenario.parameters()
        assert [entry.name for entry in tmp_path.iterdir()] == ["mine.toml"]

    fuzz(mutated(*(scenario_text(name).encode() for name in scenario_names())), read)


def test_a_vehicle(fuzz: Fuzz, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"

    def read(given: Mutated) -> None:
        path.write_bytes(given.data)
        load_vehicle(str(path))

    fuzz(mutated(*(vehicle_text(name).encode() for name in vehicle_names())), read)


@hypothesis.given(st.text("0123456789.e+-*/^() ftsdegradN%", max_size=60))
@settings(max_examples=200, derandomize=True, database=None)
def test_a_quantity(text: str) -> None:
    with suppress(HsvError):
        parse_quantity(text, "m", "altitude")


def test_a_design(fuzz: Fuzz, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"

    def read(given: Mutated) -> None:
        path.write_bytes(given.data)
        read_design(path)

    fuzz(mutated(find_design("adjustable").read_bytes()), read)


def test_a_certificate(fuzz: Fuzz, tmp_path: Path) -> None:
    path = tmp_path / "mine.certificate.json"
    design = find_design("adjustable")
    shutil.copyfile(design, tmp_path / "mine.yaml")
    flown = read_design(design)
    scenario = load_scenario("case2", {"design": str(tmp_path / "mine.yaml")})

    def read(given: Mutated) -> None:
        path.write_bytes(given.data)
        uncovered_of(scenario, flown)
        preflight(flown, str(path))

    fuzz(mutated(certificate_path(design).read_bytes()), read)


def test_a_bag(fuzz: Fuzz, small_bag: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    long = request.node.get_closest_marker("fuzz") is not None
    folder, out = tmp_path / "bag", tmp_path / "recovered"
    shutil.copytree(small_bag, folder)
    (file,) = folder.glob("*.mcap")

    def read(given: Mutated) -> None:
        shutil.rmtree(out, ignore_errors=True)
        file.write_bytes(given.data)
        found = Bag(folder)
        bag_warnings(found)
        if not long and crc32(given.data) % 5:
            return  # the rest takes most of the time
        describe(found)
        try:
            recover(folder, out)
        except HsvError:
            assert not out.exists()
            raise
        assert file.read_bytes() == given.data

    fuzz(mutated(file.read_bytes()), read)


def test_the_metadata_of_a_bag(fuzz: Fuzz, small_bag: Path, tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    shutil.copytree(small_bag, folder)
    original = Bag(folder).topics

    def read(given: Mutated) -> None:
        (folder / "metadata.yaml").write_bytes(given.data)
        assert Bag(folder).topics == original

    fuzz(mutated((folder / "metadata.yaml").read_bytes()), read)


def test_the_attachments_of_a_bag(fuzz: Fuzz, bag: Path) -> None:
    found = Bag(bag)
    found.attachments["certificate.json"] = certificate_path(find_design("baseline")).read_bytes()
    found.media_types["certificate.json"] = "application/json"
    originals = {content: name for name, content in found.attachments.items()}

    def read(given: Mutated) -> None:
        name = originals[given.source]
        found.attachments[name] = given.data
        try:
            describe(found)
        finally:
            found.attachments[name] = given.source

    fuzz(mutated(*originals), read)


def test_the_result_of_a_campaign(fuzz: Fuzz, campaign: Results, tmp_path: Path) -> None:
    path = tmp_path / "mine.parquet"
    rows = pq.read_table(campaign.path).to_pylist()

    def read(given: Mutated) -> None:
        path.write_bytes(given.data)
        found = Results(path)
        limits(found), shares(found), worst_flights(found, 2)
        assert repr([found.row(flight) for flight in range(len(rows))]) == repr(rows)
        assert found.campaign == campaign.campaign and found.envelope.encode() == campaign.envelope.encode()

    fuzz(mutated(campaign.path.read_bytes()), read)


def test_a_duration_beyond_every_double_is_no_traceback(bag: Path) -> None:
    """Found by the fuzz of attachments."""
    found = Bag(bag)
    found.attachments["certificate.json"] = certificate_path(find_design("baseline")).read_bytes()
    [name] = [name for name, content in found.attachments.items() if b"\n    duration: " in content]
    changed = re.sub(rb"(?m)^    duration: .*", b"    duration: " + b"9" * 400, found.attachments[name])
    found.attachments[name] = changed
    assert describe(found)["not_covered"] is None
