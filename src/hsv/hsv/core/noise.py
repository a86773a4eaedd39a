"""Random numbers that are functions of seed, step, stream and draw (Philox4x64-10), see ``core/noise.h``.

The streams of the blocks are in ``core/core.h``.
"""

from __future__ import annotations

import numpy as np

from hsv.base.parameters import Parameter
from hsv.core import ffi, lib

SEED_PARAMETER = Parameter("seed", 0, "key of all random numbers of the flight", "", 0, 2**53)
"""Up to 2^53, which every file format that a flight goes through keeps."""

LARGEST = float(np.sqrt(106.0 * 0.6931471805599453))
"""The greatest normal number, 8.57: Box and Muller take the logarithm of 2^-53 at least."""


def philox(counter: tuple[int, int, int, int], key: tuple[int, int]) -> tuple[int, int, int, int]:
    """Return the four words of the ``counter`` under the ``key``."""
    words = ffi.new("uint64_t[4]")
    lib.hsv_philox(counter, key, words)
    return tuple(words)


def uniforms(seed: int, step: int, stream: int, draw: int = 0) -> tuple[float, float]:
    """Return two independent numbers, each uniform on the multiples of 2^-53 in [0, 1)."""
    pair = ffi.new("double[2]")
    lib.hsv_uniforms(seed, step, stream, draw, pair)
    return pair[0], pair[1]


def normals(seed: int, step: int, stream: int, draw: int = 0) -> tuple[float, float]:
    """Return two independent standard normal numbers (Box and Muller 1958)."""
    pair = ffi.new("double[2]")
    lib.hsv_normals(seed, step, stream, draw, pair)
    return pair[0], pair[1]
