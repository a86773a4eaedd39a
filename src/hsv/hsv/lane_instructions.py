"""Instructions of lanes beside arithmetic and comparison: what :mod:`hsv.lane_overloads` is made of."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from hsv.lane_arrays import BLOCK
from hsv.lane_types import (
    DOUBLE,
    REGISTER,
    WIDTH,
    WORD,
    LanesType,
    MaskType,
    in_all_lanes,
    lanes_among,
    load_lanes,
    mask_among,
    place_of,
    vector_of,
)

_intrinsic: Any = intrinsic
"""Without the first argument, which numba puts in."""

SUMS, PART = (12, REGISTER) if REGISTER == 8 else (6, WIDTH)
"""How many weighted sums are computed at a time, and in how many lanes.

Each addition waits for the one before it in its sum, so there are as many sums as there are registers for. With AVX-512
a multiplication can read its factor from memory, for one register. For two registers the factor is loaded by an
instruction of its own, which on Zen 4 takes the place of an addition or a multiplication.
"""
assert BLOCK % SUMS == 0


@_intrinsic
def all_of(typing_context: Any, mask: Any) -> Any:
    """Tell whether a mask holds in all lanes."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(mask.count))
        return builder.icmp_unsigned("==", bits, ir.Constant(bits.type, (1 << mask.count) - 1))

    return types.boolean(mask), generate


@_intrinsic
def select(typing_context: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return lanes, or a mask, of two by a mask."""
    kind = lanes_among((LanesType(mask.count), a, b)) or mask_among((mask, a, b))

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        return builder.select(*arguments)

    return kind(mask, kind, kind), generate


@_intrinsic
def one_lane(typing_context: Any, value: Any, index: Any) -> Any:
    """Return a lane of lanes or of a mask."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        return builder.extract_element(*arguments)

    return (types.boolean if isinstance(value, MaskType) else types.float64)(value, types.intp), generate


@_intrinsic
def with_lane(typing_context: Any, value: Any, index: Any, number: Any) -> Any:
    """Return lanes with another number in one."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        lanes, place, new = arguments
        return builder.insert_element(lanes, new, place)

    return value(value, types.intp, types.float64), generate


def _beginning(context: Any, builder: Any, kind: Any, array: Any, start: Any) -> Any:
    """Return the address of :data:`REGISTER` numbers of a contiguous array, from the flat index ``start`` on."""
    data = builder.gep(context.make_array(kind)(context, builder, array).data, [start])
    return builder.bitcast(data, vector_of(DOUBLE, REGISTER).as_pointer())


@_intrinsic
def neighbours(typing_context: Any, array: Any, start: Any) -> Any:
    """Return :data:`REGISTER` numbers of a contiguous array of float64 as lanes, from the flat index ``start`` on."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        load = builder.load(_beginning(context, builder, called.args[0], *arguments))
        load.align = 8
        return load

    return LanesType(REGISTER)(array, types.intp), generate


@_intrinsic
def write_sums(typing_context: Any, weights: Any, rows: Any, total: Any, first: Any, part: Any) -> Any:
    """Write :data:`SUMS` numbers of :func:`hsv.lanes.weighted_sum`, from ``first`` on, in lanes from ``part`` on."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        given, matrix, written, column, lane = arguments
        numbers = context.make_array(called.args[1])(context, builder, matrix)
        count, size = cgutils.unpack_tuple(builder, numbers.shape)
        kind = vector_of(DOUBLE, PART)
        sums = [cgutils.alloca_once_value(builder, ir.Constant(kind, [0.0] * PART)) for _ in range(SUMS)]
        with cgutils.for_range(builder, count) as row:
            place, _ = place_of(context, builder, called.args[0], given, [row.index])
            weight = load_lanes(builder, builder.gep(place, [lane]), PART)
            start = builder.gep(numbers.data, [builder.add(builder.mul(row.index, size), column)])
            for i, total_so_far in enumerate(sums):
                number = builder.load(builder.gep(start, [ir.Constant(WORD, i)]))
                product = builder.fmul(weight, in_all_lanes(builder, number, PART))
                builder.store(builder.fadd(builder.load(total_so_far), product), total_so_far)
        for i, found in enumerate(sums):
            index = builder.add(column, ir.Constant(WORD, i))
            place, _ = place_of(context, builder, called.args[2], written, [index])
            target = builder.bitcast(builder.gep(place, [lane]), kind.as_pointer())
            builder.store(builder.load(found), target).align = 8
        return context.get_dummy_value()

    return types.none(weights, rows, total, types.intp, types.intp), generate


@_intrinsic
def write_neighbours(typing_context: Any, array: Any, start: Any, value: Any) -> Any:
    """Write lanes to :data:`REGISTER` numbers of a contiguous array of float64, from the flat index ``start`` on."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        given, place, lanes = arguments
        builder.store(lanes, _beginning(context, builder, called.args[0], given, place)).align = 8
        return context.get_dummy_value()

    return types.none(array, types.intp, LanesType(REGISTER)), generate


@_intrinsic
def powers_of_two(typing_context: Any, whole: Any) -> Any:
    """Return 2 to the power of lanes, whole numbers from -1022 to 1023."""

    def generate(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        kind = vector_of(WORD, whole.count)
        # Through 32 bits: AVX2 has no conversion to 64.
        exponent = builder.sext(builder.fptosi(arguments[0], vector_of(ir.IntType(32), whole.count)), kind)
        biased = builder.add(exponent, ir.Constant(kind, [1023] * whole.count))
        return builder.bitcast(builder.shl(biased, ir.Constant(kind, [52] * whole.count)), arguments[0].type)

    return whole(whole), generate
