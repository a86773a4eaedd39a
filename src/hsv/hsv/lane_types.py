"""Lanes as a type of numbers for numba: how it holds them, and the instructions of arithmetic and comparison.

See :mod:`hsv.lanes`, which is for those who write compiled functions.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin, lower_cast, lower_getattr_generic
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import NativeValue, models, register_model, typeof_impl, unbox

from hsv.lane_arrays import LaneArray, LaneRecord, kind_of_array, kind_of_record

REGISTER = 8 if binding.get_host_cpu_features().get("avx512f") else 4
"""Numbers that a vector register of this processor holds."""

WIDTH = 2 * REGISTER
"""Lanes of flights side by side, of two registers: while one waits for its last result, the other one is computed."""


class LanesType(types.Type):
    """A number a lane."""

    def __init__(self, count: int) -> None:
        self.count = count
        super().__init__(f"Lanes({count})")

    def can_convert_from(self, _context: Any, other: Any) -> Any:
        """A number is one in all lanes."""
        return Conversion.promote if isinstance(other, types.Float | types.Integer) else None

    def unify(self, _context: Any, other: Any) -> Any:
        """A variable that is a number here and lanes there is lanes."""
        return self if isinstance(other, types.Float | types.Integer) else None


class MaskType(types.Type):
    """A truth value a lane."""

    def __init__(self, count: int) -> None:
        self.count = count
        super().__init__(f"Mask({count})")

    def can_convert_from(self, _context: Any, other: Any) -> Any:
        """A truth value is one in all lanes."""
        return Conversion.promote if isinstance(other, types.Boolean) else None

    def unify(self, _context: Any, other: Any) -> Any:
        """A variable that is a truth value here and a mask there is a mask."""
        return self if isinstance(other, types.Boolean) else None


class LaneArrayType(types.Type):
    """A :class:`LaneArray`; nothing is counted: the caller keeps it."""

    def __init__(self, ndim: int, count: int, split: bool) -> None:
        self.ndim, self.count, self.split = ndim, count, split
        super().__init__(kind_of_array(ndim, count, split))


class LaneRecordType(types.Type):
    """A :class:`LaneRecord`."""

    def __init__(self, fields: tuple[str, ...], count: int) -> None:
        self.fields, self.count = fields, count
        super().__init__(kind_of_record(fields, count))


DOUBLE, WORD = ir.DoubleType(), ir.IntType(64)


def vector_of(kind: Any, count: int) -> Any:
    """Return the type of a vector of ``count`` elements of a ``kind``."""
    return ir.VectorType(kind, count)


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, vector_of(DOUBLE, kind.count))


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, vector_of(ir.IntType(1), kind.count))


@register_model(LaneArrayType)
class _LaneArrayModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        shape = types.UniTuple(types.intp, kind.ndim)
        super().__init__(
            manager, kind, [("data", types.CPointer(types.float64)), ("shape", shape), ("stride", types.intp)]
        )


@register_model(LaneRecordType)
class _LaneRecordModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [("data", types.CPointer(types.float64))])


@typeof_impl.register(LaneArray)
def _type_of_array(value: LaneArray, _context: Any) -> Any:
    return LaneArrayType(len(value.shape), value.lanes, value.split)


@typeof_impl.register(LaneRecord)
def _type_of_record(value: LaneRecord, _context: Any) -> Any:
    return LaneRecordType(value.fields, value.array.shape[-1])


def _struct(context: Any, builder: Any, kind: Any, value: Any = None) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value=value)


def _attribute(c: Any, value: Any, name: str, kind: Any) -> Any:
    found = c.pyapi.object_getattr_string(value, name)
    native = c.unbox(kind, found).value
    c.pyapi.decref(found)
    return native


@unbox(LaneArrayType)
def _unbox_array(kind: Any, value: Any, c: Any) -> NativeValue:
    made = _struct(c.context, c.builder, kind)
    made.data = c.builder.inttoptr(_attribute(c, value, "address", types.uintp), made.data.type)
    made.shape = _attribute(c, value, "shape", types.UniTuple(types.intp, kind.ndim))
    made.stride = _attribute(c, value, "stride", types.intp)
    return NativeValue(made._getvalue(), is_error=cgutils.is_not_null(c.builder, c.pyapi.err_occurred()))


@unbox(LaneRecordType)
def _unbox_record(kind: Any, value: Any, c: Any) -> NativeValue:
    made = _struct(c.context, c.builder, kind)
    made.data = c.builder.inttoptr(_attribute(c, value, "address", types.uintp), made.data.type)
    return NativeValue(made._getvalue(), is_error=cgutils.is_not_null(c.builder, c.pyapi.err_occurred()))


def in_all_lanes(builder: Any, value: Any, count: int) -> Any:
    """Return a vector with the same ``value`` in all elements."""
    undefined = ir.Constant(vector_of(value.type, count), ir.Undefined)
    first = builder.insert_element(undefined, value, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, undefined, ir.Constant(vector_of(ir.IntType(32), count), [0] * count))


@lower_cast(types.Float, LanesType)
@lower_cast(types.Integer, LanesType)
def _lanes_of_number(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return in_all_lanes(builder, context.cast(builder, value, given, types.float64), wanted.count)


@lower_cast(types.Boolean, MaskType)
def _mask_of_truth(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return in_all_lanes(builder, context.cast(builder, value, given, types.boolean), wanted.count)


def _common(kind: type, plain: Any, arguments: Sequence[Any]) -> Any:
    """Return the ``kind`` among the arguments where all are that or ``plain``."""
    found = [a for a in arguments if isinstance(a, kind)]
    fits = bool(found) and all(isinstance(a, (kind, *plain)) for a in arguments)
    return found[0] if fits else None


def lanes_among(arguments: Sequence[Any]) -> Any:
    """Return the type of lanes among types, where all others are of numbers; ``None`` elsewhere."""
    return _common(LanesType, (types.Float, types.Integer), arguments)


def mask_among(arguments: Sequence[Any]) -> Any:
    """Return the mask among types, where all others are of truth values; ``None`` elsewhere."""
    return _common(MaskType, (types.Boolean,), arguments)


def _operation(
    function: Any, operands: int, emit: Callable[..., Any], among: Callable[..., Any] = lanes_among, result: Any = None
) -> None:
    """Let ``function`` take lanes; ``emit`` writes the instruction, of ``result`` or of what is taken."""

    class _Template(AbstractTemplate):
        key = function

        def generic(self, arguments: Any, keywords: Any) -> Any:
            kind = among(arguments) if len(arguments) == operands and not keywords else None
            return signature(result(kind.count) if result else kind, *[kind] * operands) if kind else None

    # Not as a decorator: it asks for the function's module, and ufuncs of NumPy 1 have none.
    infer_global(function, types.Function(_Template))
    kind = MaskType if among is mask_among else LanesType

    @lower_builtin(function, *[kind] * operands)
    def _lowered(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
        return emit(builder, *arguments)


def _called(name: str) -> Callable[..., Any]:
    def emit(builder: Any, value: Any) -> Any:
        kind = ir.FunctionType(value.type, [value.type])
        intrinsic_name = f"llvm.{name}.v{value.type.count}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, intrinsic_name), [value])

    return emit


def _compared(sign: str) -> Callable[..., Any]:
    def emit(builder: Any, a: Any, b: Any) -> Any:
        return builder.fcmp_unordered(sign, a, b) if sign == "!=" else builder.fcmp_ordered(sign, a, b)

    return emit


for _names, _instruction in (
    (("add", "iadd"), "fadd"),
    (("sub", "isub"), "fsub"),
    (("mul", "imul"), "fmul"),
    (("truediv", "itruediv"), "fdiv"),
):
    for _name in _names:
        _operation(
            getattr(operator, _name),
            2,
            lambda builder, a, b, instruction=_instruction: getattr(builder, instruction)(a, b),
        )
for _name, _symbol in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">="), ("eq", "=="), ("ne", "!=")):
    _operation(getattr(operator, _name), 2, _compared(_symbol), result=MaskType)
for _name, _instruction in (("and_", "and_"), ("or_", "or_"), ("iand", "and_"), ("ior", "or_")):
    _operation(
        getattr(operator, _name),
        2,
        lambda builder, a, b, instruction=_instruction: getattr(builder, instruction)(a, b),
        mask_among,
    )
_operation(operator.neg, 1, lambda builder, a: builder.fneg(a))
_operation(abs, 1, _called("fabs"))
_operation(np.sqrt, 1, _called("sqrt"))
# As numba's of two numbers, and Python's: the second only where it is less, or larger.
_operation(min, 2, lambda builder, a, b: builder.select(builder.fcmp_ordered("<", b, a), b, a))
_operation(max, 2, lambda builder, a, b: builder.select(builder.fcmp_ordered(">", b, a), b, a))
_operation(
    math.isfinite,
    1,
    lambda builder, a: builder.fcmp_ordered(
        "!=", _called("fabs")(builder, a), ir.Constant(a.type, [math.inf] * a.type.count)
    ),
    result=MaskType,
)


@infer_getattr
class _LanesAttributes(AttributeTemplate):
    key = LanesType

    def resolve_real(self, kind: Any) -> Any:
        return kind


@lower_getattr_generic(LanesType)
def _lower_real(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    return value


@infer_getattr
class _RecordAttributes(AttributeTemplate):
    key = LaneRecordType

    def generic_resolve(self, kind: Any, name: str) -> Any:  # type: ignore[override]
        return LanesType(kind.count) if name in kind.fields else None


@lower_getattr_generic(LaneRecordType)
def _lower_field(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    data = _struct(context, builder, kind, value).data
    place = builder.gep(data, [ir.Constant(WORD, kind.fields.index(name) * kind.count)])
    load = load_lanes(builder, place, kind.count)
    # Nothing writes to a record: it need not be read once more after each store.
    load.set_metadata("invariant.load", builder.module.add_metadata([]))
    return load


def load_lanes(builder: Any, place: Any, count: int) -> Any:
    """Return the lanes at an address."""
    load = builder.load(builder.bitcast(place, vector_of(DOUBLE, count).as_pointer()))
    load.align = 8
    return load


def place_of(context: Any, builder: Any, kind: Any, array: Any, indices: Sequence[Any]) -> tuple[Any, Any]:
    """Return the address of the first lane of an element, and the stride of the lanes."""
    made = _struct(context, builder, kind, array)
    flat = indices[0]
    for axis in range(1, kind.ndim):
        flat = builder.mul(flat, builder.extract_value(made.shape, axis))
        if axis < len(indices):
            flat = builder.add(flat, indices[axis])
    if not kind.split:
        flat = builder.mul(flat, ir.Constant(WORD, kind.count))
    return builder.gep(made.data, [flat]), made.stride


def _row_type(kind: Any) -> Any:
    return LaneArrayType(kind.ndim - 1, kind.count, kind.split)


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        array, index = arguments
        if not isinstance(array, LaneArrayType):
            return None
        if isinstance(index, types.Integer):
            return signature(LanesType(array.count) if array.ndim == 1 else _row_type(array), array, types.intp)
        if isinstance(index, types.BaseTuple) and len(index) == array.ndim:
            return signature(LanesType(array.count), array, types.UniTuple(types.intp, array.ndim))
        return None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        array, index, value = arguments
        if not isinstance(array, LaneArrayType) or lanes_among((LanesType(array.count), value)) is None:
            return None
        if isinstance(index, types.Integer) and array.ndim == 1:
            return signature(types.none, array, types.intp, LanesType(array.count))
        if isinstance(index, types.BaseTuple) and len(index) == array.ndim:
            return signature(types.none, array, types.UniTuple(types.intp, array.ndim), LanesType(array.count))
        return None


def _indices(builder: Any, kind: Any, index: Any) -> list[Any]:
    return [index] if isinstance(kind, types.Integer) else cgutils.unpack_tuple(builder, index)


@lower_builtin(operator.getitem, LaneArrayType, types.Integer)
@lower_builtin(operator.getitem, LaneArrayType, types.BaseTuple)
def _get(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
    kind, index = called.args
    indices = _indices(builder, index, arguments[1])
    place, stride = place_of(context, builder, kind, arguments[0], indices)
    if len(indices) < kind.ndim:
        whole, row = _struct(context, builder, kind, arguments[0]), _struct(context, builder, called.return_type)
        row.data, row.stride = place, whole.stride
        row.shape = cgutils.pack_array(builder, cgutils.unpack_tuple(builder, whole.shape)[1:], WORD)
        return row._getvalue()
    if not kind.split:
        return load_lanes(builder, place, kind.count)
    value = ir.Constant(vector_of(DOUBLE, kind.count), ir.Undefined)
    for lane in range(kind.count):
        number = builder.load(builder.gep(place, [builder.mul(stride, ir.Constant(WORD, lane))]))
        value = builder.insert_element(value, number, ir.Constant(ir.IntType(32), lane))
    return value


@lower_builtin(operator.setitem, LaneArrayType, types.Integer, LanesType)
@lower_builtin(operator.setitem, LaneArrayType, types.BaseTuple, LanesType)
def _set(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
    kind, index = called.args[:2]
    place, stride = place_of(context, builder, kind, arguments[0], _indices(builder, index, arguments[1]))
    if kind.split:
        for lane in range(kind.count):
            number = builder.extract_element(arguments[2], ir.Constant(ir.IntType(32), lane))
            builder.store(number, builder.gep(place, [builder.mul(stride, ir.Constant(WORD, lane))]))
    else:
        builder.store(arguments[2], builder.bitcast(place, arguments[2].type.as_pointer())).align = 8
    return context.get_dummy_value()


@infer_global(len)
class _Len(AbstractTemplate):
    def generic(self, arguments: Any, keywords: Any) -> Any:
        return signature(types.intp, *arguments) if isinstance(arguments[0], LaneArrayType) else None


@lower_builtin(len, LaneArrayType)
def _length(context: Any, builder: Any, called: Any, arguments: Any) -> Any:
    return builder.extract_value(_struct(context, builder, called.args[0], arguments[0]).shape, 0)
