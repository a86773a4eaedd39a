import json
import signal
import subprocess
import sys
import time
from contextlib import ExitStack

import numpy as np
import pytest
from full_disk import files_no_larger_than
from pyarrow import parquet
from waiting import wait_until

from hsv.base.errors import CampaignError
from hsv.flight.campaign import run, table
from hsv.flight.campaign.executors import SerialExecutor
from hsv.flight.campaign.run import capacity, run_campaign
from hsv.flight.campaign.sample_runner import SampleRunner
from hsv.flight.campaign.store import ResultStore, read_result
from hsv.flight.campaign.summary import Results
from hsv.flight.campaign.table import CAMPAIGN, DIGEST, fly_batch


class Counting(SerialExecutor):
    """Flies here and notes what."""

    def __init__(self):
        self.flown = []

    def fly(self, job, text, batches):
        for batch, content in super().fly(job, text, batches):
            if job is fly_batch:
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
    assert executor.flown == list(range(campaign.batches))
    assert out.read_bytes() == results.path.read_bytes()
    assert sorted(path.name for path in out.parent.iterdir()) == [out.name]


DRIVER = """
import sys
from pathlib import Path
from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.executors import SerialExecutor
from hsv.flight.campaign.store import ResultStore
campaign = Campaign.from_text(Path(sys.argv[1]).read_text())
print("ready", flush=True)
sys.stdin.readline()
run_campaign(campaign, ResultStore(Path(sys.argv[2]), campaign), SerialExecutor())
"""


def test_a_killed_process_loses_no_finished_batch(planned, tmp_path, out):
    campaign = planned(samples=800)
    (tmp_path / "campaign.json").write_text(campaign.text)
    process = subprocess.Popen(
        [sys.executable, "-c", DRIVER, str(tmp_path / "campaign.json"), str(out)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    process.stdout.readline()
    process.stdin.write("go\n")
    process.stdin.flush()
    store = ResultStore(out, campaign)

    def finished_batches():
        assert process.poll() is None
        return len(list(store.folder.glob("*.parquet")))

    wait_until(lambda: finished_batches() >= 3, [process.pid], finished_batches, pause=lambda _: time.sleep(0.005))
    process.send_signal(signal.SIGKILL)
    process.wait()
    with store.opened() as finished:
        assert finished
    executor = Counting()
    run_campaign(campaign, store, executor)
    assert set(executor.flown) == set(range(campaign.batches)) - finished
    assert np.array_equal(Results(out).column("flight"), np.arange(800))


def test_a_finished_campaign_is_not_flown_again(planned, results):
    executor = Counting()
    assert run_campaign(planned(), ResultStore(results.path, planned()), executor) == 0
    assert executor.flown == []


@pytest.mark.parametrize("change", [{"seed": 4}, {"samples": 45}, {"scale": 0.5}, {"commit": "later"}])
def test_another_campaign_does_not_mix_with_one_that_is_there(planned, results, out, change):
    other = planned(**change)
    with pytest.raises(CampaignError, match="holds another campaign"):
        run_campaign(other, ResultStore(results.path, other), SerialExecutor())
    with pytest.raises(KeyboardInterrupt):
        run_campaign(planned(), ResultStore(out, planned()), SerialExecutor(), progress=interrupted_at(8))
    with pytest.raises(CampaignError, match="holds another campaign"):
        run_campaign(other, ResultStore(out, other), SerialExecutor())
    assert run_campaign(other, ResultStore(out, other), SerialExecutor(), restart=True) == other.samples


def test_two_processes_do_not_fly_the_same_campaign(planned, out):
    with (
        ResultStore(out, planned()).opened(),
        pytest.raises(CampaignError, match="in use"),
        ResultStore(out, planned()).opened(),
    ):
        pass


def test_restart_leaves_a_campaign_alone_that_is_being_flown(planned, results, out):
    campaign, refused = planned(), []

    def restart_from_elsewhere(done):
        if 0 < done < campaign.samples:
            with pytest.raises(CampaignError, match="in use") as error, ResultStore(out, campaign).opened(restart=True):
                pass
            refused.append(error)

    run_campaign(campaign, ResultStore(out, campaign), SerialExecutor(), progress=restart_from_elsewhere)
    assert refused
    assert out.read_bytes() == results.path.read_bytes()
    assert list(out.parent.iterdir()) == [out]


def test_a_lock_left_by_a_killed_process_stops_nobody(planned, out):
    out.with_name(out.name + ".lock").touch()
    with ResultStore(out, planned()).opened():
        pass


def damage(path, how):
    content = path.read_bytes()
    if how == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    else:
        parquet.write_table(parquet.read_table(path).slice(1), path)


@pytest.mark.parametrize("how", ["truncated", "empty", "a row short"])
def test_a_damaged_batch_is_flown_again_and_strangers_are_left_out(planned, results, out, how):
    campaign = planned(samples=44)
    with pytest.raises(KeyboardInterrupt):
        run_campaign(campaign, ResultStore(out, campaign), SerialExecutor(), progress=interrupted_at(32))
    store = ResultStore(out, campaign)
    first = store.folder / "00000000.parquet"
    (store.folder / "foo.parquet").write_text("nothing")
    damage(first, how)
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
        run_campaign(campaign, store, SerialExecutor(), progress=spoil)
    assert run_campaign(campaign, store, SerialExecutor()) == len(campaign.flights(1))
    assert out.read_bytes() == results.path.read_bytes()


@pytest.mark.parametrize("flights", [0, 32, 44])
def test_a_full_disk_is_one_error_and_what_is_finished_is_kept(planned, results, out, flights):
    campaign = planned()
    with ExitStack() as disk:

        def fill_the_disk(done):
            if done == flights:
                disk.enter_context(files_no_larger_than(20_000))

        with pytest.raises(CampaignError, match=r"cannot be written \(File too large\); finished batches are kept"):
            run_campaign(campaign, ResultStore(out, campaign), SerialExecutor(), progress=fill_the_disk)
    assert not list(out.parent.rglob("*.unfinished"))
    assert run_campaign(campaign, ResultStore(out, campaign), SerialExecutor()) == campaign.samples - flights
    assert out.read_bytes() == results.path.read_bytes()


def rewritten(path, campaign=None, without=()):
    """Write a result file again as another version might have."""
    table = parquet.read_table(path)
    metadata = {key: value for key, value in parquet.read_metadata(path).metadata.items() if key.startswith(b"hsv.")}
    del metadata[DIGEST]  # as a version had it that made none
    if campaign:
        metadata[CAMPAIGN] = json.dumps(json.loads(metadata[CAMPAIGN]) | campaign).encode()
    metadata = {key: value for key, value in metadata.items() if key.decode() not in without}
    kept = [name for name in table.column_names if name not in without]
    parquet.write_table(table.select(kept).replace_schema_metadata(metadata), path)


@pytest.mark.parametrize(
    ("campaign", "without", "expected"),
    [
        ({"wind": 3.0, "commit": "abc"}, (), "written by commit abc, which this version does not read"),
        ({"method": "grid"}, (), "written by commit test.*'grid'"),
        ({"factors": [{"name": "wind", "unit": "1", "low": 0.0, "high": 1.0}]}, (), "factor 'wind'"),
        ({}, ("tube_level",), "has no column 'tube_level', written by commit test"),
        ({}, ("hsv.envelope",), "has no envelope .* written by commit test"),
    ],
)
def test_a_result_of_another_version_is_refused_with_its_commit(results, out, campaign, without, expected):
    out.write_bytes(results.path.read_bytes())
    rewritten(out, campaign, without)
    with pytest.raises(CampaignError, match=rf"^{out}: .*{expected}"):
        Results(out)


def test_a_flipped_bit_in_the_rows_or_beside_them_is_damage(results, out):
    data = results.path.read_bytes()
    column = parquet.read_metadata(results.path).row_group(0).column(0)
    page = column.data_page_offset + column.total_compressed_size // 2
    for at in (page, data.rindex(b'"samples": 44') + 12):
        out.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        with pytest.raises(CampaignError, match=f"^{out}: damaged"):
            Results(out).column("flight")


def test_what_is_no_result_of_a_campaign_is_refused(tmp_path):
    (tmp_path / "text.parquet").write_text("nothing")
    for name in ("text.parquet", "missing.parquet"):
        with pytest.raises(CampaignError, match=name):
            read_result(tmp_path / name)


def test_what_is_to_come_is_expected_from_the_first_batches_which_are_kept(planned, results, out):
    flown, told = [], []

    class Watched(SerialExecutor):
        cores = 2

        def fly(self, job, text, batches):
            flown.append((job.__name__, list(batches)))
            return super().fly(job, text, flown[-1][1])

    def stop(needed):
        told.append(needed)
        raise KeyboardInterrupt

    campaign = planned(samples=132)
    with pytest.raises(KeyboardInterrupt):
        run_campaign(campaign, ResultStore(out, campaign), Watched(), expect=stop)
    run_campaign(campaign, ResultStore(out, campaign), Watched(), expect=told.append)
    # One batch a core from all over the campaign; both are there when it is told, and are not flown again.
    assert flown == [
        *(("time_flight", [0, 1]), ("fly_batch", [0, 2, 1, 3, 4])),
        *(("time_flight", [0, 1]), ("fly_batch", [1, 3, 4])),
    ]
    all_, rest = told
    assert (all_.flights, all_.cores, rest.flights) == (132, 2, 68)
    assert all_.wall_time > 0.0 and rest.wall_time > 0.0
    assert all_.bytes > 132 * 8 * 30


def test_what_takes_is_told_by_whole_batches_in_turn(planned):
    campaign = planned(samples=100)
    one, all_ = (capacity(campaign, missing, 1, 0.5) for missing in ([3], range(4)))
    assert (one.flights, one.wall_time, all_.flights, all_.wall_time) == (4, 2.0, 100, 50.0)
    # A batch is not divided, but the last one is smaller.
    assert capacity(campaign, range(4), 2, 0.5).wall_time == 32.0


def test_the_space_that_is_told_holds_the_batches_and_the_result(planned, out):
    campaign, told, kept = planned(samples=132), [], []
    store = ResultStore(out, campaign)

    def weigh(done):
        kept.append(sum(file.stat().st_size for file in store.folder.glob("*.parquet")))

    run_campaign(campaign, store, SerialExecutor(), expect=told.append, progress=weigh)
    needed = kept[-1] + out.stat().st_size
    assert told[0].bytes == pytest.approx(needed, rel=0.1)
    # As it is told before the first batch.
    assert capacity(campaign, range(campaign.batches), 1, 0.5).bytes == pytest.approx(needed, rel=0.1)


def test_where_batches_take_long_what_is_to_come_is_told_before(planned, out, monkeypatch):
    monkeypatch.setattr(run, "_LATE", 0.0)
    campaign, told = planned(), []
    run_campaign(
        campaign,
        ResultStore(out, campaign),
        SerialExecutor(),
        expect=lambda needed: told.append(("expected", needed.flights)),
        progress=lambda done: told.append(("done", done)),
    )
    assert told == [("expected", 44), ("done", 0), ("done", 32), ("done", 44)]


def test_a_flight_that_takes_long_is_timed_by_a_piece_of_it(planned, monkeypatch):
    flown = []
    fly_piece = SampleRunner.fly_piece

    def watched(runner, steps):
        flown.append(steps)
        return fly_piece(runner, steps)

    monkeypatch.setattr(SampleRunner, "fly_piece", watched)
    campaign = planned(samples=4)
    for slow, very_slow, pieces in ((1e9, 1e9, [1, 50]), (1e-9, 1e9, [1, 50, 150]), (1e-9, 1e-9, [1, 50])):
        monkeypatch.setattr(table, "_SLOW", slow)
        monkeypatch.setattr(table, "_VERY_SLOW", very_slow)
        monkeypatch.setattr(table, "_PIECE", 50)
        table._flight_time.cache_clear()
        flown.clear()
        first, second = (float(table.time_flight(campaign.text, core)) for core in (0, 1))
        assert first == second > 0.0
        assert flown == pieces
    table._flight_time.cache_clear()
