"""Which program this is: workers on other machines must have the same one."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from hsv.base.errors import CampaignError

_ASKED = f"__import__({__name__!r}, fromlist=['program']).program()"
"""What a worker is asked: nothing of ours need be there for the question to arrive."""

_DIGITS = 12


@cache
def program() -> str:
    """Return the version of the library, with the beginning of the SHA-256 of its sources."""
    digest = hashlib.sha256()
    folder = Path(__file__).parents[2]
    for path in sorted(folder.rglob("*.py")):
        digest.update(f"{path.relative_to(folder).as_posix()}\n".encode() + path.read_bytes())
    return f"hsv {version('hsv')}, sources {digest.hexdigest()[:_DIGITS]}"


def check_workers(client: Any, address: str) -> None:
    """Refuse the scheduler at ``address`` where one of its workers has another program, or none.

    Raises:
        CampaignError: Names the worker, and what it has.
    """
    for worker, answer in sorted(client.run(eval, _ASKED, on_error="return").items()):
        if answer == program():
            continue
        has = answer
        if isinstance(answer, Exception):
            has = "no hsv" if isinstance(answer, ModuleNotFoundError) and answer.name == "hsv" else "another hsv"
        raise CampaignError(f"scheduler = {address!r}: worker {worker} has {has}, expected {program()}, as here")
