"""Random numbers that are functions of seed, step, stream and draw, compiled: the same on every processor.

The generator is Philox4x64-10 (Salmon, Moraes, Dror and Shaw 2011): a block of four words is a function of a counter
and a key, with no state. The key is (seed, 0), the counter (step, stream, draw, 0), so that the numbers of any step are
known without those before it, in whatever order steps, blocks and flights are computed. Every flight has a seed of its
own; numpy's ``Philox(counter=c, key=k)`` begins with the block of c + 1.

A stream belongs to one channel of one named block, and is written down in :data:`STREAMS`: it is never the place of
something in a list, so that what is added to a flight leaves the noise of the rest as it was.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.elementary import logarithm, sine_cosine
from hsv.parameters import Parameter

STREAMS_A_BLOCK = 256
"""Streams that a named block has, from a multiple of this number on; its channels are counted from there."""

STREAMS = {
    name: STREAMS_A_BLOCK * block
    for name, block in {
        "turbulence_longitudinal": 1,
        "turbulence_vertical": 2,
        "density": 3,
        "sensor_noise": 16,
        "sensor_constants": 17,
        "sensor_drop_out": 18,
        "sensor_fault_noise": 19,
        "sensor_fault_drop_out": 20,
        "fault_occurrence": 32,
        "link_loss": 48,
        "link_delay": 49,
        "link_corruption": 50,
    }.items()
}
"""First stream of each block. A number that was given once stays, for flights are repeated by it."""

SEED_PARAMETER = Parameter("seed", 0, "key of all random numbers of the flight", "", 0, 2**53)
"""Up to 2^53, which every file format that a flight goes through keeps."""

_MULTIPLIER_0, _MULTIPLIER_1 = 0xD2E7470EE14C6C93, 0xCA5A826395121157
_WEYL_0, _WEYL_1 = 0x9E3779B97F4A7C15, 0xBB67AE8584CAA73B
_HALF_WORD = 0xFFFFFFFF
_ROUNDS = 10
_TO_UNIT = 1.0 / 2.0**53
_TWO_PI = 6.283185307179586

LARGEST = float(np.sqrt(106.0 * 0.6931471805599453))
"""No normal number is larger: Box and Muller take the logarithm of 2^-53 at least. 8.57."""


@njit_in_flight(error_model="numpy")
def _product(a: Any, b: Any) -> Any:
    """Return the high and the low word of the product of two unsigned words of 64 bits."""
    half, shift = np.uint64(_HALF_WORD), np.uint64(32)
    a_low, a_high = a & half, a >> shift
    b_low, b_high = b & half, b >> shift
    low = a_low * b_low
    middle = a_high * b_low + (low >> shift)
    other = a_low * b_high + (middle & half)
    return a_high * b_high + (middle >> shift) + (other >> shift), a * b


@njit_in_flight(error_model="numpy")
def philox(c_0: Any, c_1: Any, c_2: Any, c_3: Any, k_0: Any, k_1: Any) -> Any:
    """Return the four words of the counter (``c_0`` ... ``c_3``) under the key (``k_0``, ``k_1``), all uint64."""
    a, b, c, d = np.uint64(c_0), np.uint64(c_1), np.uint64(c_2), np.uint64(c_3)
    key_0, key_1 = np.uint64(k_0), np.uint64(k_1)
    for _ in range(_ROUNDS):
        high_0, low_0 = _product(np.uint64(_MULTIPLIER_0), a)
        high_1, low_1 = _product(np.uint64(_MULTIPLIER_1), c)
        a, b, c, d = high_1 ^ b ^ key_0, low_1, high_0 ^ d ^ key_1, low_0
        key_0 += np.uint64(_WEYL_0)
        key_1 += np.uint64(_WEYL_1)
    return a, b, c, d


@njit_in_flight(error_model="numpy")
def uniforms(seed: int, step: int, stream: int, draw: int = 0) -> tuple[float, float]:
    """Return two independent numbers, each uniform on the multiples of 2^-53 in [0, 1)."""
    a, b, _, _ = philox(step, stream, draw, 0, seed, 0)
    return (a >> np.uint64(11)) * _TO_UNIT, (b >> np.uint64(11)) * _TO_UNIT


@njit_in_flight(error_model="numpy")
def normals(seed: int, step: int, stream: int, draw: int = 0) -> tuple[float, float]:
    """Return two independent standard normal numbers (Box and Muller 1958), at most 8.6 in magnitude."""
    first, second = uniforms(seed, step, stream, draw)
    # In (0, 1], which has a logarithm.
    radius = np.sqrt(-2.0 * logarithm(first + _TO_UNIT))
    sin, cos = sine_cosine(_TWO_PI * second)
    return radius * cos, radius * sin
