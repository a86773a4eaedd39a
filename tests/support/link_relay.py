"""The network between emulated hosts: carries IP packets between namespaces with a delay and losses.

Run as a process, ``python link_relay.py DELAY LOSS SEED NAMESPACE=ADDRESS...``, until its standard input ends. Not
every kernel emulates networks itself.
"""

from __future__ import annotations

import ctypes
import fcntl
import heapq
import os
import random
import selectors
import socket
import struct
import sys
import time
from contextlib import suppress
from itertools import count
from pathlib import Path

DEVICE = "hsv0"
"""Name of the network device in every namespace."""

_TUNSETIFF, _TUN_WITHOUT_HEADER = 0x400454CA, 0x1001
_NEW_NETWORK = 0x40000000
_LARGEST = 65536


def open_device(namespace: str) -> int:
    """Return the descriptor of a new TUN device in a network namespace; packets to and from it are read and written."""
    setns = ctypes.CDLL(None, use_errno=True).setns
    with Path("/proc/self/ns/net").open() as home, Path("/var/run/netns", namespace).open() as there:
        if setns(there.fileno(), _NEW_NETWORK):
            raise OSError(ctypes.get_errno(), f"setns {namespace}")
        try:
            descriptor = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
            fcntl.ioctl(descriptor, _TUNSETIFF, struct.pack("16sH", DEVICE.encode(), _TUN_WITHOUT_HEADER))
        finally:
            setns(home.fileno(), _NEW_NETWORK)
    return descriptor


def relay(delay: float, loss: float, seed: int, hosts: dict[str, str]) -> None:
    """Carry packets until standard input ends; each takes ``delay`` (s), and is lost with probability ``loss``."""
    chance = random.Random(seed)
    devices = {namespace: open_device(namespace) for namespace in hosts}
    address = {socket.inet_aton(hosts[namespace]): device for namespace, device in devices.items()}
    flying: list[tuple[float, int, int, bytes]] = []
    numbers = count()
    waiting = selectors.DefaultSelector()
    for device in (*devices.values(), sys.stdin.fileno()):
        waiting.register(device, selectors.EVENT_READ)
    print("ready", flush=True)
    while True:
        pause = max(flying[0][0] - time.monotonic(), 0.0) if flying else None
        for key, _ in waiting.select(pause):
            if key.fd == sys.stdin.fileno():
                return
            for packet in _packets(key.fd):
                goal = packet[16:20]
                # What goes to nobody in particular is for all others.
                targets = [address[goal]] if goal in address else [d for d in devices.values() if d != key.fd]
                for target in targets:
                    if chance.random() >= loss:
                        heapq.heappush(flying, (time.monotonic() + delay, next(numbers), target, packet))
        while flying and flying[0][0] <= time.monotonic():
            _, _, target, packet = heapq.heappop(flying)
            with suppress(OSError):  # the device is down, or its queue full: lost, as on a wire
                os.write(target, packet)


def _packets(device: int) -> list[bytes]:
    """Return the IPv4 packets that have arrived at a device."""
    found = []
    while True:
        try:
            packet = os.read(device, _LARGEST)
        except BlockingIOError:
            return found
        except OSError:
            return found  # not up yet
        if packet[0] >> 4 == 4:
            found.append(packet)


if __name__ == "__main__":
    seconds, share, number, *pairs = sys.argv[1:]
    relay(float(seconds), float(share), int(number), dict(pair.split("=") for pair in pairs))
