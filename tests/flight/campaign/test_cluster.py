"""Workers over SSH, and a campaign across emulated hosts of which one is cut off."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from hosts import Hosts, emulated_hosts
from waiting import output_of, wait_until

from hsv.base.errors import CampaignError
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.cluster import Host, address_for, cluster, read_host, read_hosts, read_ssh

FLIGHTS = 20_000

COUNTED = "import sys; from distributed import Client; print(len(Client(sys.argv[1]).nthreads()))"
"""Prints the number of workers of the scheduler at an address."""


def test_hosts_are_names_for_ssh_with_a_number_of_workers(tmp_path):
    assert read_host("worker-1") == Host("worker-1", 0)
    assert read_host(" me@10.0.0.7*8 ") == Host("me@10.0.0.7", 8)
    file = tmp_path / "hosts"
    file.write_text("# ours\nworker-1\n\nme@worker-2*4   # the old one\n")
    assert read_hosts(file) == [Host("worker-1", 0), Host("me@worker-2", 4)]


@pytest.mark.parametrize("text", ["", "a b", "a*", "a*0", "a*x", "-oProxyCommand=x", "*2"])
def test_what_is_no_host_is_refused(tmp_path, text):
    with pytest.raises(CampaignError, match=r"expected NAME or NAME\*WORKERS, as in worker-1\*8"):
        read_host(text)
    (tmp_path / "hosts").write_text(f"good\n{text or 'b c'}\n")
    with pytest.raises(CampaignError, match=r"hosts, line 2: host = "):
        read_hosts(tmp_path / "hosts")


def test_a_missing_list_of_hosts_is_named(tmp_path):
    with pytest.raises(CampaignError, match=r"hosts = '.*/none': .*expected a list of hosts"):
        read_hosts(tmp_path / "none")


def test_the_address_is_that_of_the_way_to_a_host():
    assert address_for("me@127.0.0.1") == "127.0.0.1"
    with pytest.raises(CampaignError, match=r"host = 'no\.such\.host\.invalid': no way there .*expected --address"):
        address_for("no.such.host.invalid")


def test_ssh_is_a_command_with_options():
    assert read_ssh("sh -p 2222 -i 'a key'") == ["sh", "-p", "2222", "-i", "a key"]


@pytest.mark.parametrize("text", ["", " ", "''", "/", "no_such_command -p 22", "sh 'open"])
def test_what_is_no_command_is_refused_before_anything_starts(text):
    refused = pytest.raises(CampaignError, match=r"^ssh = .*: expected a command of this machine, with options, as in")
    with refused, cluster([Host("far", 1)], "127.0.0.1", 8786, "python", text):
        pass


def test_a_taken_port_or_a_foreign_address_is_refused():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(CampaignError, match=f"port = {port}: in use"), cluster([], "127.0.0.1", port, "", "sh"):
            pass
    # Of the documentation's range: no machine has it.
    foreign = pytest.raises(CampaignError, match=r"does not start .*expected an address of this machine")
    with foreign, cluster([], "192.0.2.1", port, "", "sh"):
        pass


def test_workers_that_end_are_said_once_and_tried_again(monkeypatch, tmp_path):
    monkeypatch.setattr("hsv.flight.campaign.cluster.AGAIN_AFTER", 0.0)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    said = []
    tries = tmp_path / "tries"
    ssh = f"sh -c 'echo tried >> {tries}; echo no route; exit 255'"

    def tried() -> int:
        return len(tries.read_text().splitlines()) if tries.exists() else 0

    with cluster([Host("far", 1)], "127.0.0.1", port, "python", ssh, said.append) as look:
        wait_until(lambda: tried() > 2, progress=tried, pause=lambda _: look())
    assert said == ["far: no workers (no route), trying again every 0 s"]


class SshHosts:
    """Emulated hosts with ssh servers, and the command that reaches them."""

    def __init__(self, hosts: Hosts, folder: Path) -> None:
        server = shutil.which("sshd", path=f"{os.environ['PATH']}:/usr/sbin")
        if not (server and shutil.which("ssh")):
            pytest.skip("no sshd and ssh (Debian: openssh-server, openssh-client)")
        key = folder / "key"
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
        Path("/run/sshd").mkdir(exist_ok=True)
        options = [f"AuthorizedKeysFile={key}.pub", "StrictModes=no", "PidFile=none", "UsePAM=no"]
        words = [server, "-D", "-p", "2222", "-h", key, *(word for option in options for word in ("-o", option))]
        self.servers = [
            subprocess.Popen(hosts.command(name, *words), stderr=subprocess.DEVNULL) for name in ("near", "far")
        ]
        self.command = (
            f"ssh -i {key} -p 2222 -o StrictHostKeyChecking=no -o UserKnownHostsFile=/dev/null -o LogLevel=ERROR"
        )


@pytest.mark.long
def test_a_campaign_across_hosts_survives_that_one_is_cut_off_twice(tmp_path):
    batches = plan("case1", method="uniform", samples=FLIGHTS, seed=1).batches
    campaign = ["hsv", "montecarlo", "case1", "--samples", str(FLIGHTS), "--no-page"]
    here = subprocess.Popen([*campaign, "--out", tmp_path / "here.parquet"], stdout=subprocess.DEVNULL)
    output_of(here)
    assert here.returncode == 0
    with emulated_hosts("home", "near", "far", delay=0.005, loss=0.01) as hosts:
        reached = SshHosts(hosts, tmp_path)
        started = list(reached.servers)
        try:
            names = [hosts.addresses[name] + "*1" for name in ("near", "far")]
            words = hosts.command("home", "hsv", "cluster", *names, "--ssh", reached.command)
            with (tmp_path / "said").open("w") as said:
                started.append(running := subprocess.Popen(words, stdout=said, stderr=subprocess.STDOUT))
            address = f"tcp://{hosts.addresses['home']}:8786"
            wait_until(lambda: address in (tmp_path / "said").read_text(), [running.pid])
            words = hosts.command("home", *campaign, "--out", tmp_path / "there.parquet", "--scheduler", address)
            started.append(flying := subprocess.Popen(words, stdout=subprocess.DEVNULL))

            def parts() -> int:
                return len(list(tmp_path.glob("there.parquet.parts/*.parquet")))

            def flown(share: float) -> bool:
                assert flying.poll() is None
                return parts() >= share * batches

            def workers() -> int:
                asked = hosts.command("home", sys.executable, "-c", COUNTED, address)
                return int(subprocess.run(asked, capture_output=True, text=True, check=True).stdout)

            for share in (0.1, 0.5):
                wait_until(lambda share=share: flown(share), [flying.pid], parts)
                hosts.cut("far")
                # Dask takes 30 s to notice; the other worker flies on.
                wait_until(lambda: workers() == 1, [flying.pid], parts)
                hosts.join("far")
                wait_until(lambda: workers() == 2, [flying.pid], parts)
            output_of(flying)
            assert flying.returncode == 0
            assert f"{hosts.addresses['far']}: no workers" in (tmp_path / "said").read_text()
            running.send_signal(signal.SIGINT)
            output_of(running)
        finally:
            for process in started:
                process.kill()
                process.wait()
    assert (
        len({hashlib.sha256((tmp_path / f"{name}.parquet").read_bytes()).hexdigest() for name in ("here", "there")})
        == 1
    )
