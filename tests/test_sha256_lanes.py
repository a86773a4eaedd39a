"""Digests side by side are those of the standard library."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from hsv.sha256_lanes import LANES, digests
from hsv.simulation.fingerprint import fingerprint, fingerprints


def expected(array):
    return hashlib.sha256(np.where(np.isnan(array), np.nan, array).astype("<f8").tobytes()).digest()


def random_bits(rng, size):
    """Return numbers of which some are infinite, some NaN, some subnormal."""
    bits = rng.integers(0, 2**64, size, np.uint64)
    exponents = np.uint64(0x7FF) << np.uint64(52)
    bits[rng.random(size) < 0.1] |= exponents
    bits[rng.random(size) < 0.1] &= ~exponents
    return bits.view(float)


@pytest.mark.parametrize("shortest", range(0, 64, LANES))
def test_arrays_of_every_length_to_eight_blocks(shortest):
    rng = np.random.default_rng(shortest)
    arrays = [random_bits(rng, shortest + i) for i in range(LANES)]
    assert digests(arrays) == [expected(array) for array in arrays]


@pytest.mark.parametrize("count", [1, 2, LANES - 1, LANES])
def test_as_many_as_there_are_of_any_lengths_in_any_order(count):
    rng = np.random.default_rng(count)
    arrays = [random_bits(rng, int(size)) for size in rng.integers(0, 5000, count)]
    assert digests(arrays) == [expected(array) for array in arrays]
    assert digests(arrays[::-1]) == digests(arrays)[::-1]


def test_a_length_whose_bits_fill_more_than_two_bytes():
    arrays = [np.arange(250025.0), np.arange(2.0**18), np.arange(2.0**18 + 7)]
    assert digests(arrays) == [expected(array) for array in arrays]


def test_rows_of_which_some_are_left_out():
    histories = np.random.default_rng(2).normal(size=(LANES, 40, 25))
    flown = [history[: 40 - i] for i, history in enumerate(histories)]
    assert digests(flown) == [expected(rows) for rows in flown]


def test_fingerprints_of_several_flights_are_those_of_each():
    rng = np.random.default_rng(4)
    flown = [random_bits(rng, 25 * int(rows)).reshape(-1, 25) for rows in rng.integers(1, 30, 2 * LANES + 3)]
    assert fingerprints(flown) == [fingerprint(rows) for rows in flown]
    assert fingerprints([]) == []


def test_the_same_compiled_for_a_processor_without_wide_vectors(tmp_path):
    code = """
import hashlib
import numpy as np
from hsv.sha256_lanes import LANES, digests
arrays = [np.random.default_rng(i).normal(size=9 * i + 3) for i in range(LANES)]
assert digests(arrays) == [hashlib.sha256(array.tobytes()).digest() for array in arrays]
"""
    environment = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
