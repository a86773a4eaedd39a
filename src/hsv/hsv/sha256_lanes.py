"""SHA-256 of as many arrays at a time as this processor has lanes of 32 bits, each with the digest it has alone.

FIPS 180-4, compiled for vectors of words: of AVX-512 a rotation is one instruction, and so is each of the functions of
three words. Elsewhere it computes the same, but a library that uses a processor's own instructions is as fast.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from hsv.compiled import ENABLED

LANES = 16
"""Arrays that are digested at a time."""

WORTHWHILE = ENABLED and bool(binding.get_host_cpu_features().get("avx512f"))
"""Whether it is faster here than one array after the other by :mod:`hashlib`."""

_NUMBERS = 8
"""Numbers of a block of 64 bytes."""

_INITIAL = (0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19)
"""H(0), section 5.3.3."""

_CONSTANTS = (
    *(0x428A2F98, 0x71374491, 0xB5C0FBCF, 0xE9B5DBA5, 0x3956C25B, 0x59F111F1, 0x923F82A4, 0xAB1C5ED5),
    *(0xD807AA98, 0x12835B01, 0x243185BE, 0x550C7DC3, 0x72BE5D74, 0x80DEB1FE, 0x9BDC06A7, 0xC19BF174),
    *(0xE49B69C1, 0xEFBE4786, 0x0FC19DC6, 0x240CA1CC, 0x2DE92C6F, 0x4A7484AA, 0x5CB0A9DC, 0x76F988DA),
    *(0x983E5152, 0xA831C66D, 0xB00327C8, 0xBF597FC7, 0xC6E00BF3, 0xD5A79147, 0x06CA6351, 0x14292967),
    *(0x27B70A85, 0x2E1B2138, 0x4D2C6DFC, 0x53380D13, 0x650A7354, 0x766A0ABB, 0x81C2C92E, 0x92722C85),
    *(0xA2BFE8A1, 0xA81A664B, 0xC24B8B70, 0xC76C51A3, 0xD192E819, 0xD6990624, 0xF40E3585, 0x106AA070),
    *(0x19A4C116, 0x1E376C08, 0x2748774C, 0x34B0BCB5, 0x391C0CB3, 0x4ED8AA4A, 0x5B9CCA4F, 0x682E6FF3),
    *(0x748F82EE, 0x78A5636F, 0x84C87814, 0x8CC70208, 0x90BEFFFA, 0xA4506CEB, 0xBEF9A3F7, 0xC67178F2),
)
"""K, section 4.2.2."""

_WORD, _PLACE, _DOUBLE = ir.IntType(32), ir.IntType(64), ir.DoubleType()
_WORDS = ir.VectorType(_WORD, LANES)

_intrinsic: Any = intrinsic
"""Without the first argument, which numba puts in."""


def digests(arrays: Sequence[np.ndarray]) -> list[bytes]:
    """Return the SHA-256 of each of at most :data:`LANES` ``arrays``, contiguous, of float64.

    Of little-endian bytes, every NaN as the same one.
    """
    state = np.repeat(np.array(_INITIAL, np.uint32)[:, None], LANES, axis=1)
    sizes = np.array([array.size for array in arrays])
    _absorb_all(state, [array.ctypes.data for array in arrays], sizes // _NUMBERS)
    # What is left of each, a bit that ends it, and its length in bits, big-endian: in one block or in two.
    ends = np.zeros((len(arrays), 2 * _NUMBERS), "<u8")
    left = sizes % _NUMBERS
    last = np.where(left < _NUMBERS - 1, 1, 2)
    for end, array, size, rest, blocks in zip(ends, arrays, sizes, left, last, strict=True):
        end[:rest] = array.reshape(-1)[size - rest :].view(np.uint64)
        end[rest] = 0x80
        end[blocks * _NUMBERS - 1] = np.uint64(64 * size).byteswap()
    # None of these numbers is NaN: lengths are whole multiples of 64, so that the exponent has zeros.
    _absorb_all(state, [end.ctypes.data for end in ends], last)
    return [column.astype(">u4").tobytes() for column in state.T[: len(arrays)]]


def _absorb_all(state: np.ndarray, addresses: Sequence[int], blocks: np.ndarray) -> None:
    """Take into the ``state`` (8, lanes) so many ``blocks`` (arrays) of what lies at ``addresses``."""
    done = 0
    for until in np.unique(blocks[blocks > 0]).tolist():
        going = np.flatnonzero(blocks >= until)
        # Where an array has ended, or is none, there is another one, for nothing: all lanes read what may be read.
        reading = np.full(LANES, addresses[going[0]], np.uint64)
        reading[going] = np.array(addresses, np.uint64)[going]
        before = state.copy()
        _absorb(state, reading, done, until)
        ended = np.setdiff1d(np.arange(LANES), going)
        state[:, ended] = before[:, ended]
        done = until


@njit(cache=True, nogil=True)
def _absorb(state: np.ndarray, addresses: np.ndarray, start: int, stop: int) -> None:
    """Take blocks ``start`` ... ``stop`` - 1 at each of the ``addresses`` (lanes) into the ``state`` (8, lanes)."""
    for block in range(start, stop):
        _absorb_block(state, addresses, block)


@_intrinsic
def _absorb_block(typing_context: Any, state: Any, addresses: Any, block: Any) -> Any:
    """Take one block of each lane into the state."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        states = context.make_array(state)(context, builder, arguments[0]).data
        places = context.make_array(addresses)(context, builder, arguments[1]).data
        offset = builder.mul(arguments[2], ir.Constant(_PLACE, _NUMBERS))
        rows = []
        for lane in range(LANES):
            address = builder.load(builder.gep(places, [ir.Constant(_PLACE, lane)]))
            place = builder.gep(builder.inttoptr(address, _DOUBLE.as_pointer()), [offset])
            rows.append(_block_words(builder, place))
        slots = [
            builder.bitcast(builder.gep(states, [ir.Constant(_PLACE, i * LANES)]), _WORDS.as_pointer())
            for i in range(len(_INITIAL))
        ]
        before = [builder.load(slot, align=4) for slot in slots]
        after = _rounds(builder, before, _transposed(builder, rows))
        for slot, old, new in zip(slots, before, after, strict=True):
            builder.store(builder.add(old, new), slot, align=4)
        return context.get_dummy_value()

    return types.none(state, addresses, types.intp), generate


def _block_words(builder: Any, place: Any) -> Any:
    """Return the 16 big-endian words of the 8 numbers at a ``place``, one NaN for all."""
    numbers = builder.load(builder.bitcast(place, ir.VectorType(_DOUBLE, _NUMBERS).as_pointer()), align=8)
    bits = builder.bitcast(numbers, ir.VectorType(_PLACE, _NUMBERS))
    unknown = builder.fcmp_unordered("uno", numbers, numbers)
    nan = int(np.array(np.nan).view(np.uint64))
    known = builder.select(unknown, ir.Constant(bits.type, [nan] * _NUMBERS), bits)
    return _call(builder, "bswap", builder.bitcast(known, ir.VectorType(_WORD, 2 * _NUMBERS)))


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Return the columns of a square matrix of words whose ``rows`` are vectors: blocks off the diagonal, exchanged."""
    size, step = len(rows), 1
    index = ir.VectorType(_WORD, size)
    while step < size:
        upper = ir.Constant(index, [size + j - step if j & step else j for j in range(size)])
        lower = ir.Constant(index, [size + j if j & step else j + step for j in range(size)])
        exchanged = list(rows)
        for i in range(size):
            if not i & step:
                a, b = rows[i], rows[i + step]
                exchanged[i], exchanged[i + step] = (builder.shuffle_vector(a, b, way) for way in (upper, lower))
        rows, step = exchanged, 2 * step
    return rows


def _rounds(builder: Any, state: list[Any], words: list[Any]) -> list[Any]:
    """Return the working variables after the 64 rounds of a block, section 6.2.2, before they are added to its state.

    Args:
        builder: Writes the instructions.
        state: a ... h.
        words: The 16 of the block.
    """
    add, xor = builder.add, builder.xor
    a, b, c, d, e, f, g, h = state
    w = list(words)
    for t, constant in enumerate(_CONSTANTS):
        if t >= len(words):
            early, late = w[t - 15], w[t - 2]
            sigma_0 = _sum(builder, early, (7, 18), shifted=3)
            sigma_1 = _sum(builder, late, (17, 19), shifted=10)
            w.append(add(add(w[t - 16], sigma_0), add(w[t - 7], sigma_1)))
        choice = builder.or_(builder.and_(e, f), builder.and_(builder.not_(e), g))
        majority = xor(b, builder.and_(xor(a, b), xor(b, c)))
        first = add(add(h, add(_in_all(constant), w[t])), add(choice, _sum(builder, e, (6, 11, 25))))
        second = add(_sum(builder, a, (2, 13, 22)), majority)
        a, b, c, d, e, f, g, h = add(first, second), a, b, c, add(d, first), e, f, g
    return [a, b, c, d, e, f, g, h]


def _sum(builder: Any, word: Any, rotated: Sequence[int], shifted: int = 0) -> Any:
    """Return the exclusive or of a word ``rotated`` to the right by each of some bits, and ``shifted``."""
    terms = [_call(builder, "fshr", word, word, _in_all(bits)) for bits in rotated]
    if shifted:
        terms.append(builder.lshr(word, _in_all(shifted)))
    return builder.xor(terms[0], builder.xor(terms[1], terms[2]))


def _in_all(word: int) -> Any:
    return ir.Constant(_WORDS, [word] * LANES)


def _call(builder: Any, name: str, *vectors: Any) -> Any:
    kind = vectors[0].type
    function: Callable[..., Any] = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(kind, [kind] * len(vectors)), f"llvm.{name}.v{kind.count}i32"
    )
    return builder.call(function, vectors)
