"""Hosts emulated on this machine: network namespaces with a shared memory of their own, and a network between them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Self

import pytest
from link_relay import DEVICE

RELAY = Path(__file__).with_name("link_relay.py")

_BOOT = 'mount -t tmpfs tmpfs /dev/shm && hostname "$0" && echo up && exec sleep infinity'
"""Without a shared memory of their own, participants on two hosts would find out that they are on one."""


def missing_capability() -> str:
    """Return what this machine lacks for emulated hosts, empty where it has all."""
    if os.geteuid() != 0:
        return "root, to make network namespaces"
    for tool in ("ip", "unshare", "nsenter"):
        if not shutil.which(tool):
            return f"the command {tool} (Debian: iproute2, util-linux)"
    try:
        os.close(os.open("/dev/net/tun", os.O_RDWR))
    except OSError as error:
        return f"/dev/net/tun, for the network between hosts ({error.strerror})"
    tried = subprocess.run(["unshare", "--net", "--ipc", "--uts", "--mount", "true"], capture_output=True, check=False)
    return "" if tried.returncode == 0 else "the right to make namespaces (a container without CAP_SYS_ADMIN)"


class Hosts:
    """Emulated hosts by name; commands of a host see its network, host name and shared memory only."""

    def __init__(self, names: Sequence[str], delay: float, loss: float, seed: int = 1) -> None:
        """Set up hosts whose packets take ``delay`` (s) to another and are lost with probability ``loss``."""
        # Other test runs on this machine have hosts, too.
        self._namespaces = {name: f"hsv_{os.getpid()}_{name}" for name in names}
        self.addresses = {name: f"10.213.{os.getpid() % 250}.{number}" for number, name in enumerate(names, start=1)}
        self._delay, self._loss, self._seed = delay, loss, seed
        self._relay: subprocess.Popen[str] | None = None
        self._running: dict[str, subprocess.Popen[str]] = {}
        """A process of each host, which keeps its namespaces."""

    def __enter__(self) -> Self:
        try:
            self._set_up()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _set_up(self) -> None:
        for name, namespace in self._namespaces.items():
            _ip("netns", "add", namespace)
            words = ["ip", "netns", "exec", namespace, "unshare", "--ipc", "--uts", "--mount", "sh", "-c", _BOOT, name]
            self._running[name] = booted = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
            assert booted.stdout and booted.stdout.readline() == "up\n"
        pairs = [f"{self._namespaces[name]}={address}" for name, address in self.addresses.items()]
        words = [sys.executable, str(RELAY), str(self._delay), str(self._loss), str(self._seed), *pairs]
        self._relay = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._relay.stdout and self._relay.stdout.readline() == "ready\n"
        for name, namespace in self._namespaces.items():
            for words in (
                ("link", "set", "lo", "up"),
                ("addr", "add", f"{self.addresses[name]}/24", "dev", DEVICE),
                ("link", "set", DEVICE, "up", "multicast", "on"),
                ("route", "add", "224.0.0.0/4", "dev", DEVICE),
            ):
                _ip("-n", namespace, *words)

    def __exit__(self, *_: object) -> None:
        for process in (*filter(None, [self._relay]), *self._running.values()):
            process.kill()
            process.communicate()
        for namespace in self._namespaces.values():
            with suppress(subprocess.CalledProcessError):
                _ip("netns", "delete", namespace)

    def command(self, name: str, *words: str | Path) -> list[str]:
        """Return the words that run a command on a host."""
        there = ["--target", str(self._running[name].pid), "--net", "--ipc", "--uts", "--mount"]
        return ["nsenter", *there, "--", *map(str, words)]


@contextmanager
def emulated_hosts(*names: str, delay: float, loss: float) -> Iterator[Hosts]:
    """Yield emulated hosts, or skip the test and say what this machine lacks for them."""
    if lack := missing_capability():
        pytest.skip(f"no emulated hosts: this machine lacks {lack}")
    with Hosts(names, delay, loss) as hosts:
        yield hosts


def _ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True)
