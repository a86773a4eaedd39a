"""The generator against its authors' vectors and numpy's; its normal numbers against their distribution."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from hsv.core import lib
from hsv.core.arithmetic import normals, philox, uniforms

WORD = 2**64 - 1


def words(text):
    return tuple(int(word, 16) for word in text.split())


@pytest.mark.parametrize(
    ("counter_and_key", "expected"),
    [
        ("0 0 0 0 0 0", "16554d9eca36314c db20fe9d672d0fdc d7e772cee186176b 7e68b68aec7ba23b"),
        (
            "ffffffffffffffff " * 6,
            "87b092c3013fe90b 438c3c67be8d0224 9cc7d7c69cd777b6 a09caebf594f0ba0",
        ),
        (
            "243f6a8885a308d3 13198a2e03707344 a4093822299f31d0 082efa98ec4e6c89 452821e638d01377 be5466cf34e90c6c",
            "a528f45403e61d95 38c72dbd566e9788 a5a1610e72fd18b5 57bd43b5e52b7fe6",
        ),
    ],
)
def test_known_answers_of_the_authors(counter_and_key, expected):
    # kat_vectors of Random123, the generator's authors' own library.
    given = words(counter_and_key)
    assert philox(given[:4], given[4:]) == words(expected)


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[st.integers(0, WORD)] * 4), st.tuples(*[st.integers(0, WORD)] * 2))
def test_block_is_the_one_that_numpy_begins_with_at_the_counter_before(counter, key):
    value = sum(word << 64 * place for place, word in enumerate(counter))
    before = (value - 1) % 2**256
    reference = np.random.Philox(
        counter=np.array([(before >> 64 * place) & WORD for place in range(4)], np.uint64),
        key=np.array(key, np.uint64),
    )
    assert philox(counter, key) == tuple(reference.random_raw(4).tolist())


def test_uniforms_are_the_words_of_seed_step_stream_and_draw():
    first, second, _, _ = philox((7, 300, 2, 0), (41, 0))
    assert uniforms(41, 7, 300, 2) == ((first >> 11) / 2**53, (second >> 11) / 2**53)


def test_normals_are_those_of_box_and_muller():
    for step in range(200):
        first, second = uniforms(5, step, 9)
        radius = math.sqrt(-2.0 * math.log(first + 2.0**-53))
        expected = radius * math.cos(2.0 * math.pi * second), radius * math.sin(2.0 * math.pi * second)
        assert normals(5, step, 9) == pytest.approx(expected, rel=1e-14, abs=1e-15)


def test_normals_are_distributed_as_such_and_independent():
    drawn = np.array([normals(3, step, 17) for step in range(20000)])
    for column in drawn.T:
        assert stats.kstest(column, "norm").pvalue > 1e-3
    size = len(drawn)
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 4.0 / math.sqrt(size)
    assert abs(np.corrcoef(drawn[:-1, 0], drawn[1:, 0])[0, 1]) < 4.0 / math.sqrt(size)


@pytest.mark.parametrize("other", [(2, 0, 0, 0), (1, 1, 0, 0), (1, 0, 1, 0), (1, 0, 0, 1)])
def test_each_of_seed_step_stream_and_draw_makes_other_numbers(other):
    drawn = {uniforms(*case) for case in ((1, 0, 0, 0), other)}
    assert len(drawn) == 2


def test_each_block_keeps_the_256_streams_that_it_was_given_once():
    streams = {
        256: lib.TURBULENCE_FORWARD,
        512: lib.TURBULENCE_UP,
        768: lib.DENSITY_VARIATION,
        4096: lib.SENSOR_NOISE_STREAM,
        4352: lib.SENSOR_CONSTANTS,
        4608: lib.SENSOR_LOSS,
        4864: lib.SENSOR_FAULT_NOISE,
        5120: lib.SENSOR_FAULT_LOSS,
        8192: lib.FAULT_OCCURRENCE,
        12288: lib.LINK_LOSS,
        12544: lib.LINK_DELAY,
        12800: lib.LINK_CORRUPTION,
    }
    assert [*streams] == [*streams.values()]
    assert np.diff([*streams]).min() >= 256
