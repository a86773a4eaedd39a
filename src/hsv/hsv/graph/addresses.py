"""Addresses of the live view, and the programs and pages of this machine that may connect."""

from __future__ import annotations

import socket

from hsv.base.errors import ParameterError, reason

HOST = "127.0.0.1"
"""The only address on which the servers accept connections."""

LAST_PORT = 65535

_NAMES = (HOST, "localhost")


def origins(port: int) -> list[str]:
    """Return the origins of the page that is served on ``port``, as browsers name them."""
    return [f"http://{name}:{port}" for name in _NAMES]


def ports(first: int) -> tuple[int, int]:
    """Return the ports of Foxglove's server and of the page: ``first`` and the next one, or with 0 any two free ones.

    Raises:
        ParameterError: One of them is none, or in use.
    """
    if not 0 <= first < LAST_PORT:
        raise ParameterError(f"live-port = {first}: expected 1 to {LAST_PORT - 1}, or 0 for any free ones")
    chosen = (first, first + 1 if first else 0)
    for port in chosen:
        with socket.socket() as tried:
            # What has just been left is free: the servers take it, too.
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                tried.bind((HOST, port))
            except OSError as error:
                raise ParameterError(
                    f"live-port = {first}: port {port}: {reason(error).lower()}, expected two free ports, this and the "
                    "next, or 0 for any"
                ) from None
    return chosen
