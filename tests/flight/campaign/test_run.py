"""Campaigns complete in spite of interruption, damaged files, full disks and crashing flights."""

import json
import subprocess
import sys
from contextlib import ExitStack

import numpy as np
import pytest
from c_libraries import build_probe
from full_disk import files_no_larger_than
from pyarrow import parquet

from hsv.base.errors import CampaignError
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.sample_runner import CAMPAIGN, DIGEST, SampleRunner
from hsv.flight.campaign.store import ResultStore, read_result, result_digest
from hsv.flight.campaign.summary import Results, shares, worst_flights
from hsv.graph.campaign_replay import replay_in_process
from hsv.pages.campaign import write_campaign_page
from hsv.plugins.library import library_place


class Counting(Executor):
    """An executor that flies in this process and notes the batches."""

    def __init__(self):
        self.flown = []

    def fly(self, job, text, batches, *label):
        for batch, content in super().fly(job, text, batches):
            self.flown.append(batch)
            yield batch, content


def interrupted_at(flights):
    def progress(done):
        if done >= flights:
            raise KeyboardInterrupt

    return progress


def test_interrupted_twice_and_resumed_gives_the_same_file_and_flies_nothing_twice(planned, results, out):
    campaign, executor = planned(), Counting()
    for flights in (8, 24):
        with pytest.raises(KeyboardInterrupt):
            run_campaign(campaign, ResultStore(out, campaign), executor, progress=interrupted_at(flights))
        assert not out.exists()
    run_campaign(campaign, ResultStore(out, campaign), executor)
    assert executor.flown == list(range(len(campaign.batches)))
    assert out.read_bytes() == results.path.read_bytes()
    assert sorted(path.name for path in out.parent.iterdir()) == [out.name]


def test_another_campaign_does_not_mix_with_one_that_is_there(planned, results, out):
    other = planned(seed=4)
    with pytest.raises(CampaignError, match="holds another campaign"):
        run_campaign(other, ResultStore(results.path, other), Executor())
    with pytest.raises(KeyboardInterrupt):
        run_campaign(planned(), ResultStore(out, planned()), Executor(), progress=interrupted_at(8))
    with pytest.raises(CampaignError, match="holds another campaign"):
        run_campaign(other, ResultStore(out, other), Executor())
    assert run_campaign(other, ResultStore(out, other), Executor(), restart=True).flights == other.samples


def test_a_damaged_batch_is_flown_again_and_strangers_are_left_out(planned, results, out):
    campaign = planned(samples=44)
    with pytest.raises(KeyboardInterrupt):
        run_campaign(campaign, ResultStore(out, campaign), Executor(), progress=interrupted_at(32))
    store = ResultStore(out, campaign)
    first = store.folder / "00000000.parquet"
    (store.folder / "foo.parquet").write_text("nothing")
    parquet.write_table(parquet.read_table(first).slice(1), first)
    executor = Counting()
    run_campaign(campaign, store, executor)
    assert executor.flown == [0, 1]
    assert out.read_bytes() == results.path.read_bytes()


def test_a_batch_damaged_inside_is_named_and_flown_the_next_time(planned, results, out):
    campaign, store = planned(), ResultStore(out, planned())

    def spoil(done):
        if done == campaign.samples:
            path = store.folder / "00000001.parquet"
            content = bytearray(path.read_bytes())
            content[4:2000] = bytes(1996)
            path.write_bytes(content)

    with pytest.raises(CampaignError, match=r"00000001\.parquet: damaged"):
        run_campaign(campaign, store, Executor(), progress=spoil)
    assert run_campaign(campaign, store, Executor()).flights == len(campaign.flights(1))
    assert out.read_bytes() == results.path.read_bytes()


def test_a_full_disk_is_one_error_and_what_is_finished_is_kept(planned, results, out):
    campaign, flights = planned(), 32
    with ExitStack() as disk:

        def fill_the_disk(done):
            if done == flights:
                disk.enter_context(files_no_larger_than(20_000))

        with pytest.raises(CampaignError, match=r"cannot be written \(File too large\); finished batches are kept"):
            run_campaign(campaign, ResultStore(out, campaign), Executor(), progress=fill_the_disk)
    assert not list(out.parent.rglob("*.unfinished"))
    assert run_campaign(campaign, ResultStore(out, campaign), Executor()).flights == campaign.samples - flights
    assert out.read_bytes() == results.path.read_bytes()


def rewritten(path, campaign=None, without=()):
    """Write a result file again, as another version might have written it."""
    table = parquet.read_table(path)
    metadata = {key: value for key, value in parquet.read_metadata(path).metadata.items() if key.startswith(b"hsv.")}
    if campaign:
        metadata[CAMPAIGN] = json.dumps(json.loads(metadata[CAMPAIGN]) | campaign).encode()
    metadata = {key: value for key, value in metadata.items() if key.decode() not in without}
    metadata[DIGEST] = result_digest(metadata)
    kept = [name for name in table.column_names if name not in without]
    parquet.write_table(table.select(kept).replace_schema_metadata(metadata), path)


@pytest.mark.parametrize(
    ("campaign", "without", "expected"),
    [
        ({"wind": 3.0, "commit": "abc"}, (), "written by commit abc, which this version does not read"),
        ({"factors": [{"name": "wind", "unit": "1", "low": 0.0, "high": 1.0}]}, (), "factor 'wind'"),
        ({}, ("tube_level",), "has no column 'tube_level', written by commit unknown"),
        ({}, ("hsv.envelope",), "has no envelope .* written by commit unknown"),
    ],
)
def test_a_result_of_another_version_is_refused_with_its_commit(results, out, campaign, without, expected):
    out.write_bytes(results.path.read_bytes())
    rewritten(out, campaign, without)
    with pytest.raises(CampaignError, match=rf"^{out}: .*{expected}"):
        Results(out)


def test_what_is_no_result_of_a_campaign_is_refused(tmp_path):
    (tmp_path / "text.parquet").write_text("nothing")
    for name in ("text.parquet", "missing.parquet"):
        with pytest.raises(CampaignError, match=name):
            read_result(tmp_path / name)


SCENARIO = """
title = "a library that crashes"
design = ""
controller = "probe.so:probe"
duration = "1 s"
[initial]
altitude = "85500 ft"
velocity = "7900 ft/s"
[probe]
{settings}
"""


@pytest.fixture(scope="module")
def fly(tmp_path_factory):
    """Return a function that plans and flies a campaign with a C library and its settings."""
    folder = tmp_path_factory.mktemp("probe")
    build_probe(folder)

    def fly(name, settings, samples):
        (folder / f"{name}.toml").write_text(SCENARIO.format(settings=settings))
        altitudes = {"initial.altitude": ("25950 m", "26350 m")}
        campaign = plan(str(folder / f"{name}.toml"), samples=samples, scale=0.0, factors=altitudes)
        out = folder / f"{name}.parquet"
        run_campaign(campaign, ResultStore(out, campaign), Executor())
        return Results(out, trust=True)

    return fly


def test_a_flight_that_crashes_is_recorded_and_the_others_are_flown(fly, tmp_path):
    good = fly("good", "", 34)
    altitudes = good.column("sample_initial.altitude")
    *_, second, highest = np.sort(altitudes)
    crashed = fly("crashed", f'crash_above = "{(second + highest) / 2.0} m"', 34)
    [flight] = np.flatnonzero(crashed.crashed)
    assert flight == np.argmax(altitudes)
    assert crashed.row(flight)["crashed"].endswith("probe.so:probe, step 0: crashed (SIGSEGV)")
    assert crashed.row(flight)["end_time"] is None and not crashed.row(flight)["diverged"]
    ours, others = (parquet.read_table(results.path).to_pylist() for results in (crashed, good))
    assert ours[:flight] + ours[flight + 1 :] == others[:flight] + others[flight + 1 :]
    assert shares(crashed)[0].within == 33 and shares(good)[0].within == 34
    first, second, *_ = worst_flights(crashed)
    assert (first.flight, first.limit) == (flight, "crashed") and second.limit != "crashed"
    repeated = replay_in_process(crashed, flight)
    assert not repeated.differing and repeated.repeated["crashed"] == crashed.row(flight)["crashed"]
    write_campaign_page(crashed, tmp_path / "page.html")
    assert "crashed" in (tmp_path / "page.html").read_text()


def test_results_of_two_libraries_are_not_mixed(fly):
    campaign = fly("mixed", "", 2).campaign
    build_probe(library_place(campaign.scenario.controller)[0].parent, "-DSTATE_SIZE=3")
    with pytest.raises(CampaignError, match=r"not the library that the campaign began with, expected the one of SHA-"):
        SampleRunner(campaign)


def test_a_campaign_is_flown_and_summarised_without_pandas(short, tmp_path):
    # The import takes longer than 50 flights, in each worker process; pyarrow imports pandas for many conversions.
    program = """
import sys
from pathlib import Path
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.summary import Results
from hsv.pages.campaign import campaign_page

campaign, out = plan(sys.argv[1], samples=2), Path(sys.argv[2])
run_campaign(campaign, ResultStore(out, campaign), Executor())
campaign_page(Results(out))
sys.exit("pandas" in sys.modules)
"""
    command = [sys.executable, "-c", program, short, str(tmp_path / "flown.parquet")]
    assert subprocess.run(command).returncode == 0
