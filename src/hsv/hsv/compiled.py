"""How the functions of a flight are compiled."""

from __future__ import annotations

from typing import Any

from numba import njit


def njit_in_flight(**options: Any) -> Any:
    """Return the decorator of a function that is compiled, and that fills arrays but makes none.

    Where nothing is allocated nobody need count who holds an array. Counting takes an atomic instruction for each array
    of each call, which were half of the compiled loop's time.

    Args:
        **options: Of :func:`numba.njit`.
    """
    compiled: Any = njit
    return compiled(cache=True, _nrt=False, **options)
