"""Digests of two arrays at a time are those of the standard library."""

import hashlib
import os
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

from hsv.sha256_pairs import AVAILABLE, digests
from hsv.simulation.fingerprint import fingerprint, fingerprints

with_instructions = pytest.mark.skipif(not AVAILABLE, reason="this processor has no SHA instructions")


def expected(array):
    return hashlib.sha256(np.where(np.isnan(array), np.nan, array).astype("<f8").tobytes()).digest()


def random_bits(rng, size):
    """Return numbers of which some are infinite, some NaN, some subnormal."""
    bits = rng.integers(0, 2**64, size, np.uint64)
    exponents = np.uint64(0x7FF) << np.uint64(52)
    bits[rng.random(size) < 0.1] |= exponents
    bits[rng.random(size) < 0.1] &= ~exponents
    return bits.view(float)


@with_instructions
def test_arrays_of_every_length_to_eight_blocks():
    rng = np.random.default_rng(0)
    for pair in pairwise(random_bits(rng, size) for size in range(64)):
        assert digests(pair) == [expected(array) for array in pair]


@with_instructions
def test_arrays_of_any_lengths_in_any_order():
    rng = np.random.default_rng(1)
    for sizes in rng.integers(0, 5000, (20, 2)):
        pair = [random_bits(rng, int(size)) for size in sizes]
        assert digests(pair) == [expected(array) for array in pair]
        assert digests(pair[::-1]) == digests(pair)[::-1]


@with_instructions
def test_a_length_whose_bits_fill_more_than_two_bytes():
    pair = [np.arange(250025.0), np.arange(2.0**18 + 7)]
    assert digests(pair) == [expected(array) for array in pair]


@with_instructions
def test_rows_of_which_some_are_left_out():
    histories = np.random.default_rng(2).normal(size=(2, 40, 25))
    flown = [histories[0][:40], histories[1][:13]]
    assert digests(flown) == [expected(rows) for rows in flown]


@pytest.mark.parametrize("flights", [0, 1, 2, 5])
def test_fingerprints_of_several_flights_are_those_of_each(flights):
    rng = np.random.default_rng(flights)
    flown = [random_bits(rng, 25 * int(rows)).reshape(-1, 25) for rows in rng.integers(1, 30, flights)]
    assert fingerprints(flown) == [fingerprint(rows) for rows in flown]


def test_without_these_instructions_the_standard_library_digests(tmp_path):
    code = """
import numpy as np
from hsv.sha256_pairs import AVAILABLE
from hsv.simulation.fingerprint import fingerprint, fingerprints
flown = [np.random.default_rng(i).normal(size=(9 * i + 3, 25)) for i in range(3)]
assert not AVAILABLE
assert fingerprints(flown) == [fingerprint(rows) for rows in flown]
"""
    environment = {**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
