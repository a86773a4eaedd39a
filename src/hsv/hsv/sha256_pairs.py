"""SHA-256 of two arrays at a time with the SHA instructions of x86-64: the digests of :mod:`hashlib`.

FIPS 180-4. Each instruction computes two rounds of a digest and waits for the two before; the processor meanwhile
computes those of the other digest, so that two arrays take hardly longer than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from hsv.compiled import ENABLED, njit_in_flight


def _has_instructions() -> bool:
    chosen: str | None = vars(config)["CPU_FEATURES"]
    return "+sha" in chosen.split(",") if chosen is not None else bool(binding.get_host_cpu_features().get("sha"))


AVAILABLE = ENABLED and _has_instructions()
"""Whether the processor that numba compiles for has these instructions."""

BLOCK_NUMBERS = 8
"""Numbers of a block of 64 bytes."""

_INITIAL = (0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19)
"""H(0), section 5.3.3: a ... h."""

_ORDER = (5, 4, 1, 0, 7, 6, 3, 2)
"""Order of a ... h in the two registers of the instructions: f e b a, and h g d c."""

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
_WORDS = ir.VectorType(_WORD, 4)

_intrinsic: Any = intrinsic
"""Without the first argument, which numba puts in."""


def digests(arrays: Sequence[np.ndarray]) -> list[bytes]:
    """Return the SHA-256 of each of two ``arrays``, contiguous, of float64; only where it is :data:`AVAILABLE`.

    Of little-endian bytes, every NaN as the same one.
    """
    state, sizes = initial(2), [array.size for array in arrays]
    first, second = (array.ctypes.data for array in arrays)
    absorb(state, first, second, sizes[0] // BLOCK_NUMBERS, sizes[1] // BLOCK_NUMBERS)
    return finished(
        state, sizes, [array.reshape(-1)[array.size // BLOCK_NUMBERS * BLOCK_NUMBERS :] for array in arrays]
    )


def initial(count: int) -> np.ndarray:
    """Return the states (count, 8) of digests of nothing."""
    return np.array([[_INITIAL[i] for i in _ORDER]] * count, np.uint32)


def finished(state: np.ndarray, sizes: Sequence[int], tails: Sequence[np.ndarray]) -> list[bytes]:
    """Return the digests of an even number of arrays, whose whole blocks the ``state`` has taken.

    Args:
        state: Of each (arrays, 8); it is changed.
        sizes: Of each, numbers.
        tails: Of each, the numbers after its last whole block.
    """
    # Padding: the remaining numbers, a 1 bit, zeros, and the length in bits, big-endian; one block or two.
    ends = np.zeros((len(sizes), 2 * BLOCK_NUMBERS), "<u8")
    blocks = [1 if size % BLOCK_NUMBERS < BLOCK_NUMBERS - 1 else 2 for size in sizes]
    for end, size, tail, last in zip(ends, sizes, tails, blocks, strict=True):
        left = size % BLOCK_NUMBERS
        end[:left] = tail[:left].view(np.uint64)
        end[left] = 0x80
        end[last * BLOCK_NUMBERS - 1] = np.uint64(64 * size).byteswap()
    # The length is never taken for a NaN: it is a multiple of 64, so its exponent bits are not all ones.
    for i in range(0, len(sizes), 2):
        absorb(state[i : i + 2], ends[i].ctypes.data, ends[i + 1].ctypes.data, blocks[i], blocks[i + 1])
    return [own[np.argsort(_ORDER)].astype(">u4").tobytes() for own in state]


@njit_in_flight(nogil=True)
def absorb(state: np.ndarray, first: int, second: int, blocks_of_first: int, blocks_of_second: int) -> None:
    """Take blocks at two addresses, whose memory the caller keeps, into the ``state`` (2, 8)."""
    both = min(blocks_of_first, blocks_of_second)
    for block in range(both):
        _absorb_block(state, first, second, block, 2)
    for block in range(both, blocks_of_first):
        _absorb_block(state[:1], first, first, block, 1)
    for block in range(both, blocks_of_second):
        _absorb_block(state[1:], second, second, block, 1)


@_intrinsic
def _absorb_block(typing_context: Any, state: Any, first: Any, second: Any, block: Any, count: Any) -> Any:
    """Take one block of each array, of which there are one or two (``count``), into the state."""
    arrays = count.literal_value if isinstance(count, types.IntegerLiteral) else 0
    if not arrays:
        return None

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        data = context.make_array(state)(context, builder, arguments[0]).data
        offset = builder.mul(arguments[3], ir.Constant(_PLACE, BLOCK_NUMBERS))
        slots, words = [], []
        for i, address in enumerate(arguments[1 : 1 + arrays]):
            place = builder.gep(builder.inttoptr(address, _DOUBLE.as_pointer()), [offset])
            words.append([_four_words(builder, place, 2 * k) for k in range(4)])
            starts = (ir.Constant(_PLACE, 8 * i), ir.Constant(_PLACE, 8 * i + 4))
            slots.append([builder.bitcast(builder.gep(data, [s]), _WORDS.as_pointer()) for s in starts])
        before = [[builder.load(slot, align=4) for slot in own] for own in slots]
        for own, old, new in zip(slots, before, _rounds(builder, before, words), strict=True):
            for slot, a, b in zip(own, old, new, strict=True):
                builder.store(builder.add(a, b), slot, align=4)
        return context.get_dummy_value()

    return types.none(state, types.uintp, types.uintp, types.intp, count), generate


def _four_words(builder: Any, place: Any, number: int) -> Any:
    """Return four big-endian words: two numbers from the one at ``place`` on, one NaN for all."""
    start = builder.gep(place, [ir.Constant(_PLACE, number)])
    numbers = builder.load(builder.bitcast(start, ir.VectorType(_DOUBLE, 2).as_pointer()), align=8)
    bits = builder.bitcast(numbers, ir.VectorType(_PLACE, 2))
    nan = int(np.array(np.nan).view(np.uint64))
    unknown = builder.fcmp_unordered("uno", numbers, numbers)
    known = builder.select(unknown, ir.Constant(bits.type, [nan] * 2), bits)
    return _call(builder, "bswap.v4i32", builder.bitcast(known, _WORDS))


def _rounds(builder: Any, states: list[list[Any]], words: list[list[Any]]) -> list[list[Any]]:
    """Return the working variables after the 64 rounds of a block, section 6.2.2, before they are added to its state.

    Args:
        builder: Writes the instructions.
        states: f e b a and h g d c of each array.
        words: The 16 of the block of each array, four in a vector.
    """
    after = [list(state) for state in states]
    for i in range(0, 64, 4):
        for own, w in zip(after, words, strict=True):
            if i >= 16:
                partial = builder.add(_call(builder, "x86.sha256msg1", w[-4], w[-3]), _picked(builder, w, (1, 2, 3, 4)))
                w.append(_call(builder, "x86.sha256msg2", partial, w[-1]))
            added = builder.add(w[i // 4], ir.Constant(_WORDS, _CONSTANTS[i : i + 4]))
            for _ in range(2):
                # The instruction uses the two lower words; the old f e b a becomes the new h g d c.
                own[:] = _call(builder, "x86.sha256rnds2", own[1], own[0], added), own[0]
                added = _picked(builder, [added, added], (2, 3, 2, 3))
    return after


def _picked(builder: Any, vectors: list[Any], places: tuple[int, ...]) -> Any:
    """Return words of the last two ``vectors``, counted through both."""
    return builder.shuffle_vector(vectors[-2], vectors[-1], ir.Constant(_WORDS, places))


def _call(builder: Any, name: str, *vectors: Any) -> Any:
    kind = ir.FunctionType(_WORDS, [_WORDS] * len(vectors))
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}"), vectors)
