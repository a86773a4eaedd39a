"""What :func:`hsv.simulation.foreign.call_step` is in compiled functions: a call of the function at an address."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from hsv.simulation.foreign import call_step


@intrinsic
def _called(typing_context: Any, function: Any, step: Any, inputs: Any, outputs: Any, state: Any, par: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.IntType(32), [ir.IntType(64), *[pointer] * 4])
        address, number, *arrays = arguments
        pointers = [builder.inttoptr(array, pointer) for array in arrays]
        return builder.call(builder.inttoptr(address, kind.as_pointer()), [number, *pointers])

    return types.int32(*[types.int64] * 6), generate


@overload(call_step, strict=False)
def _call(function: Any, step: Any, inputs: Any, outputs: Any, state: Any, parameters: Any) -> Any:
    call: Any = _called
    return lambda function, step, inputs, outputs, state, parameters: call(
        function, step, inputs, outputs, state, parameters
    )
