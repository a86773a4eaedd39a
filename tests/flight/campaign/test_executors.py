import logging
import os
import re
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest
from batches import begin_and_never_end, end_of_the_third, length_of
from distributed import LocalCluster
from waiting import wait_until

from hsv.base.errors import CampaignError, RunError
from hsv.flight.campaign.executors import make_executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore


@pytest.mark.long
def test_a_worker_killed_in_mid_campaign_loses_and_doubles_nothing(planned, results, out):
    campaign, killed = planned(), []

    with make_executor(2) as workers:
        pids = workers.pids()
        assert len(set(pids)) == 2

        def progress(done):
            if done and not killed:
                killed.append(pids[0])
                os.kill(killed[0], signal.SIGKILL)

        assert (
            run_campaign(campaign, ResultStore(out, campaign), workers, progress=progress).flights == campaign.samples
        )
    assert killed
    assert out.read_bytes() == results.path.read_bytes()


@pytest.mark.parametrize("address", ["nonsense", "nowhere://x", "tcp://127.0.0.1", "tcp://h:99999", "inproc://x"])
def test_an_address_that_is_none_is_refused_at_once(monkeypatch, address):
    # The address is refused without contact; waiting for an answer would outlast the tests.
    monkeypatch.setattr("hsv.flight.campaign.executors.ANSWER", 1e6)
    with (
        pytest.raises(CampaignError, match=f"^scheduler = '{address}': .*expected an address"),
        make_executor(0, address),
    ):
        pass


@pytest.mark.parametrize("answer", [None, b"", b"\x01"], ids=["absent", "mute", "of another kind"])
def test_a_scheduler_that_does_not_answer_is_named_once(monkeypatch, capfd, answer):
    waited, links = [], []
    monkeypatch.setattr("hsv.flight.campaign.executors.ANSWER", 1.5)
    monkeypatch.setattr("hsv.flight.campaign.executors.QUIET_TIME", 0.1)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        if answer is not None:
            silent.listen()
            Thread(target=lambda: (links.append(silent.accept()[0]), links[0].sendall(answer)), daemon=True).start()
        address = f"127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(CampaignError, match=f"'{address}': no answer"), make_executor(0, address, waited.append):
            pass
    assert waited == [f"waiting for the scheduler {address}"]
    assert capfd.readouterr().err == ""


@pytest.fixture
def cluster():
    """Return a new scheduler without workers."""
    with LocalCluster(
        n_workers=0, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
    ) as started:
        yield started


@pytest.mark.long
def test_a_worker_that_does_not_answer_is_reported_and_refused(monkeypatch, cluster):
    monkeypatch.setattr("hsv.flight.campaign.executors.QUIET_TIME", 0.5)
    monkeypatch.setattr("hsv.flight.campaign.executors.WORKERS", 2.0)
    waited = []
    cluster.scale(1)
    wait_until(lambda: cluster.scheduler.workers and cluster.workers)
    (worker,) = cluster.workers.values()
    os.kill(worker.pid, signal.SIGSTOP)
    try:
        with (
            pytest.raises(CampaignError, match="a worker does not answer"),
            make_executor(0, cluster.scheduler_address, waited.append),
        ):
            pass
    finally:
        os.kill(worker.pid, signal.SIGCONT)
    assert waited[-1] == "waiting for the answers of all workers"


@pytest.mark.long
def test_workers_that_do_not_come_are_waited_for_a_while_and_not_silently(monkeypatch, cluster):
    monkeypatch.setattr("hsv.flight.campaign.executors.WORKERS", 0.5)
    waited = []
    with (
        pytest.raises(CampaignError, match=r"no workers after 0\.5 s"),
        make_executor(0, cluster.scheduler_address, waited.append),
    ):
        pass
    assert waited == ["waiting for the scheduler's workers"]


@pytest.mark.long
def test_a_lost_scheduler_is_a_failed_run_that_goes_on_later(planned, cluster, out):
    campaign, store = planned(samples=320), ResultStore(out, planned(samples=320))
    cluster.scale(1)

    def lose(done):
        if done:
            cluster.close()

    with make_executor(0, cluster.scheduler_address) as workers, pytest.raises(RunError, match="the scheduler is lost"):
        run_campaign(campaign, store, workers, progress=lose)
    with store.opened() as finished:
        assert finished


@contextmanager
def dask_worker(address, folder, environment, *flags):
    """Start a worker as one does by hand on another machine."""
    module = "-m", "distributed.cli.dask_worker"
    command = [sys.executable, *flags, *module, "--nthreads", "1", "--no-dashboard", address]
    popen = subprocess.Popen(command, env=environment, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        popen.terminate()
        popen.wait()


@pytest.mark.long
def test_a_worker_without_the_program_or_with_another_one_is_refused_by_its_address(cluster, tmp_path):
    other = tmp_path / "other" / "hsv"
    (other / "flight" / "campaign").mkdir(parents=True)
    (other / "flight" / "campaign" / "executors.py").write_text("def program():\n    return 'hsv 0.0.1, sources 0'\n")
    (other / "__init__.py").touch()
    path = os.pathsep.join((str(other.parent), os.environ.get("PYTHONPATH", "")))
    address = cluster.scheduler_address
    # With -I, Python does not search the workspace's folders.
    for flags, has in (["-I"], "no hsv"), ([], "hsv 0.0.1, sources 0"):
        expected = rf"^scheduler = '{address}': worker tcp://127\.0\.0\.1:\d+ has {has}, expected hsv .*, as here$"
        with (
            dask_worker(address, tmp_path, os.environ | {"PYTHONPATH": path}, *flags),
            pytest.raises(CampaignError, match=expected),
            make_executor(0, address),
        ):
            pass
        wait_until(lambda: not cluster.scheduler.workers)


@pytest.mark.long
def test_a_batch_that_ends_its_worker_is_named_and_ends_the_campaign_and_not_the_executor():
    before = dict(os.environ)
    with make_executor(2) as workers:
        with pytest.raises(RunError, match=r"^campaign: flight 3: the worker process ended; what is finished is kept$"):
            list(workers.fly(end_of_the_third, "", range(4), "flight {}".format))
        assert dict(workers.fly(length_of, "text", range(2))) == dict.fromkeys(range(2), b"4")
        pids = workers.pids()
    assert dict(os.environ) == before and not any(map(alive, pids))


def test_a_campaign_with_a_long_text_is_interrupted_while_batches_wait(tmp_path):
    """On Python 3.11 the pool's pipe, filled by texts of waiting batches, once blocked the end for ever."""
    with pytest.raises(KeyboardInterrupt), make_executor(2) as workers:
        for batch in range(4):
            workers._submit(begin_and_never_end, f"{tmp_path} {'x' * 1_000_000}", batch)
        wait_until(lambda: len([*tmp_path.iterdir()]) == 2)
        raise KeyboardInterrupt


@pytest.mark.long
def test_a_stopped_worker_is_reported_and_waited_for(monkeypatch):
    monkeypatch.setattr("hsv.flight.campaign.executors.QUIET_TIME", 0.5)
    notices = []

    def go_on(words):
        notices.append(words)
        for pid in workers.pids():
            os.kill(pid, signal.SIGCONT)

    with make_executor(2, notice=go_on) as workers:
        for pid in workers.pids():
            os.kill(pid, signal.SIGSTOP)
        assert dict(workers.fly(length_of, "text", range(3))) == dict.fromkeys(range(3), b"4")
    assert re.fullmatch(r"waiting for batch 0 and 2 more: stopped worker process \d+, \d+", notices[0])


def alive(pid):
    """Return whether a process runs; one that has ended but not been waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
