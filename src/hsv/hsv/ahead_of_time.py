"""Compiles functions ahead of time, for :mod:`hsv.precompiled`: a library that is called without numba.

While functions are called from Python in :func:`recording`, where they are not compiled, it is noted with which types
of arguments. For each of these, numba compiles an entry that takes the arguments from a tuple of Python's objects,
calls the function as compiled functions do, and returns an object. The entries become one shared library, with
``run_time.c``.
"""

from __future__ import annotations

import ctypes
import gc
import hashlib
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from multiprocessing import active_children, get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import cfunc, config, njit, typeof, types
from numba.core import cgutils
from numba.core.caching import IndexDataCacheFile
from numba.core.errors import NumbaError, TypingError
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

from hsv import compiled
from hsv.compiled import EXTENSIONS, CompiledFunction
from hsv.interruption import end_with_parent, uninterrupted
from hsv.kept_library import install
from hsv.lane_types import LaneArrayType, LaneRecordType
from hsv.library_code import compile_without_machine_code, object_of
from hsv.precompiled import (
    INDEX,
    PACKAGE,
    NotAheadOfTimeError,
    Result,
    digest,
    processor,
    state_of_sources,
    types_of,
)
from hsv.threads import ctrl_c_held_back

_WORD = ir.IntType(64)
_TUPLE: Any = types.BaseTuple
_RUN_TIME = PACKAGE / "run_time.c"
_OWN = ("hsv.ahead_of_time", "hsv.compiled", "hsv.lane_instructions", "hsv.lane_types", "hsv.precompiled")
"""Modules that say how functions are compiled and called."""

_IN_ORDER = {"C": 0x1, "F": 0x2, "A": 0}
_ALIGNED = 0x100
"""Flags of an array in numpy's C interface."""

_nothing = ctypes.c_char()
# To be linked here as well, where entries are not called.
for _name in ("hsv_array", "hsv_lanes"):
    binding.add_symbol(_name, ctypes.addressof(_nothing))

Compiled = tuple[bytes, Result] | None
"""Object file of an entry and what it returns, or nothing where that cannot be handed over."""

Calls = dict[tuple[str, tuple[str, ...]], Callable[[], Compiled]]
"""What returns an entry, by the function's name and the types of arguments as the index names them."""


class SourcesChangedError(RuntimeError):
    """Sources are not those of which functions were compiled."""


@contextmanager
def recording(processes: int = 0) -> Iterator[Calls]:
    """Yield the calls from Python within the block that can be compiled ahead of time.

    These run as Python, and what they call in turn. Calls that need lanes or instructions of the processor, which
    Python lacks, are skipped and return ``None``. Other calls are compiled by numba. Other ``processes``, if any,
    compile the entries meanwhile, and the block ends when they have.
    """
    calls: Calls = {}
    noted = False

    def call(function: CompiledFunction, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
        nonlocal noted
        if noted:
            return function.py_func(*arguments, **named)
        try:
            # Functions that are made in a function share its name.
            key = None if named or "<locals>" in function.name else (function.name, types_of(arguments))
        except NotAheadOfTimeError:
            key = None
        if key is None:
            return function.dispatcher(*arguments, **named)
        if key not in calls:
            compile_entry = partial(_entry_if_any, function, tuple(map(typeof, arguments)), _symbol(len(calls)))
            calls[key] = _submitted(pool, compile_entry) if pool else compile_entry
        if any("LaneArray(" in kind or "LaneRecord(" in kind for kind in key[1]):
            return None
        noted = True
        try:
            with np.errstate(all="ignore"):  # as in compiled functions
                return function.py_func(*arguments)
        except NotImplementedError:  # numba's answer where Python calls an instruction of the processor
            return None
        finally:
            noted = False

    with _compiling(processes) as pool:
        compiled.instead = call
        try:
            yield calls
        finally:
            compiled.instead = None


@contextmanager
def _compiling(processes: int) -> Iterator[ProcessPoolExecutor | None]:
    """Yield a pool of so many processes, ``None`` for none; at the end wait for what they compile, not after Ctrl-C."""
    if not processes:
        yield None
        return
    with TemporaryDirectory() as folder:
        context = get_context("spawn")
        start = _compile_for_the_library, (context.Lock(), folder, os.getpid())
        pool = ProcessPoolExecutor(processes, context, *start)
        try:
            yield pool
            pool.shutdown()
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in active_children():
                process.terminate()
                process.join()  # what it writes is in the folder, which is removed now
            raise
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


@uninterrupted
def _submitted(pool: ProcessPoolExecutor, compile_entry: Callable[[], Compiled]) -> Callable[[], Compiled]:
    """Return what waits for the entry, and raises BrokenExecutor where the processes have ended.

    Not before: within the block that is recorded it could be taken for an error of what is recorded.
    """
    try:
        with ctrl_c_held_back():  # a process begins here, and is ended by this one
            return pool.submit(compile_entry).result
    except BrokenExecutor as error:
        lost: Future[Compiled] = Future()
        lost.set_exception(error)
        return lost.result


def _compile_for_the_library(lock: Any, folder: str, parent: int) -> None:
    """Let this process compile for the library alone, and keep in ``folder`` what the others need as well.

    It saves only while it has the ``lock``: of two functions with different arguments that are saved at the same time,
    one could be taken for the other, as numba's index of a function has no lock.
    """
    end_with_parent(parent)
    gc.freeze()
    # To look for garbage as often as Python does takes a sixth of the time; the process ends soon.
    gc.set_threshold(100_000, 50, 1000)
    compiled.for_a_library = True
    compile_without_machine_code()
    settings: Any = config
    settings.CACHE_DIR = folder
    file: Any = IndexDataCacheFile
    save = file.save

    def alone(*arguments: Any) -> None:
        with lock:
            save(*arguments)

    file.save = alone


def build(calls: Calls) -> int:
    """Compile ``calls`` into the library that :mod:`hsv.precompiled` takes functions from; return for how many it did.

    Left out is what returns something else than numbers, arrays and tuples of them. An older library is replaced.

    Raises:
        SourcesChangedError: One was changed meanwhile; the library would be of the old one.
        OSError, subprocess.CalledProcessError: There is no C compiler to link with, or no place for the library.
    """
    functions: dict[str, list[tuple[tuple[str, ...], str, Result]]] = {}
    objects = []
    for number, ((name, key), compile_entry) in enumerate(calls.items()):
        entry = compile_entry()
        if entry is None:
            continue
        compiled_entry, result = entry
        objects.append(compiled_entry)
        functions.setdefault(name, []).append((key, _symbol(number), result))
    linked = _linked(objects)
    contents = hashlib.sha256(linked).hexdigest()
    sources = _sources()
    index = {
        "processor": processor(),
        "sources": sources,
        "digest": digest(sources),
        "library": f"{INDEX.stem}.{contents[:16]}.so",
        "contents": contents,
        "functions": functions,
    }
    if state_of_sources() is None:
        raise SourcesChangedError("sources were changed meanwhile; run it again")
    install(index, linked)
    return sum(map(len, functions.values()))


def _sources() -> list[str]:
    """Return the modules with compiled functions or their constants (in capitals), and those that compile or call."""
    modules = {name: vars(module) for name, module in sys.modules.items() if name.startswith("hsv.")}
    holding = {
        name: values
        for name, values in modules.items()
        if any(isinstance(value, CompiledFunction) and value.__module__ == name for value in values.values())
    }
    constants = {name for values in holding.values() for name in values if name.lstrip("_").isupper()}
    files = [
        Path(values["__file__"])
        for name, values in modules.items()
        if name in holding or name in (*EXTENSIONS, *_OWN) or not constants.isdisjoint(values)
    ]
    return sorted({str(path.relative_to(PACKAGE)) for path in (*files, _RUN_TIME)})


def _symbol(number: int) -> str:
    """Return the name of an entry in the library."""
    return f"hsv_{number}"


def _entry_if_any(function: CompiledFunction, arguments: tuple[Any, ...], symbol: str) -> Compiled:
    try:
        code, result = _entry(function, arguments)
    except NumbaError:
        return None
    return object_of(code, symbol), result


def _entry(function: CompiledFunction, arguments: tuple[Any, ...]) -> tuple[str, Result]:
    """Return the code of the entry to a function, and what it returns.

    Raises:
        NumbaError: It returns something else than can be handed over.
    """
    kinds: Any = types.Tuple(arguments)
    nogil = function.targetoptions.get("nogil")
    # What is inlined elsewhere cannot be called with a tuple of arguments.
    inlined = "inline" in function.targetoptions
    called = njit(**{**function.targetoptions, "inline": "never"})(function.py_func) if inlined else function.dispatcher
    results: list[Result] = []

    def from_objects(context: Any, builder: Any, python: Any, _kind: Any, address: Any) -> Any:
        return _from_object(context, builder, python, kinds, builder.inttoptr(address, python.pyobj))

    def to_be_object(kind: Any) -> Any:
        results.append(_result(kind))
        return types.int64(kind)

    def to_object(context: Any, builder: Any, python: Any, kind: Any, value: Any) -> Any:
        return builder.ptrtoint(_to_object(context, builder, python, kind, value), _WORD)

    def is_refused(_context: Any, builder: Any, python: Any) -> Any:
        return cgutils.is_not_null(builder, python.err_occurred())

    def fail(_context: Any, builder: Any, python: Any) -> Any:
        _raise(builder, python, "RuntimeError", f"{function.name} raised an error")
        return _WORD(0)

    def release_lock(_context: Any, builder: Any, python: Any) -> Any:
        return builder.ptrtoint(python.save_thread(), _WORD) if nogil else _WORD(0)

    def take_lock(context: Any, builder: Any, python: Any, _kind: Any, thread: Any) -> Any:
        if nogil:
            python.restore_thread(builder.inttoptr(thread, python.voidptr))
        return context.get_dummy_value()

    arguments_of, object_of = _with_argument(kinds, from_objects), _with_argument(to_be_object, to_object)
    refused, failed = _without_argument(types.boolean, is_refused), _without_argument(types.int64, fail)
    released, taken = _without_argument(types.int64, release_lock), _with_argument(types.void, take_lock)

    @cfunc(types.int64(types.int64))
    def entry(objects: int) -> Any:
        values = arguments_of(objects)
        if refused():
            return 0
        thread = released()
        try:
            returned = called(*values)
        except Exception:
            taken(thread)
            return failed()
        taken(thread)
        return object_of(returned)

    return entry.inspect_llvm(), results[-1]


def _without_argument(returned: Any, generate: Callable[..., Any]) -> Any:
    """Return a function for compiled functions.

    Args:
        returned: Type of what it returns.
        generate: Makes its code, of context, builder and Python's interface, and returns the value.
    """

    def typed(_context: Any) -> Any:
        return returned(), lambda context, builder, *_: generate(context, builder, context.get_python_api(builder))

    made: Any = intrinsic(typed)
    return made


def _with_argument(returned: Any, generate: Callable[..., Any]) -> Any:
    """Return the same with an argument, of which ``generate`` is given type and value as well.

    ``returned``: returns the signature, for the type of the argument.
    """

    def typed(_context: Any, given: Any) -> Any:
        def code(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            return generate(context, builder, context.get_python_api(builder), given, values[0])

        return returned(given), code

    made: Any = intrinsic(typed)
    return made


def _raise(builder: Any, python: Any, error: str, text: str) -> None:
    # The variable is a pointer; where numba itself links, it is what that points to.
    variable = python.get_c_object(f"PyExc_{error}")
    python.err_set_string(builder.load(builder.bitcast(variable, python.pyobjptr)), text)


def _from_object(context: Any, builder: Any, python: Any, kind: Any, given: Any) -> Any:
    """Return the value of an object as a type of numba's; one of another type leaves an error of Python's."""
    if isinstance(kind, _TUPLE):
        # Where there are fewer elements, or it is no tuple, None takes their place.
        none, size = python.borrow_none(), len(kind)
        elements = [python.tuple_getitem(given, i) for i in range(size)]
        with builder.if_then(builder.icmp_signed("!=", python.tuple_size(given), _WORD(size)), likely=False):
            _raise(builder, python, "TypeError", f"expected a tuple of {size}, or as many arguments")
        found = [builder.select(cgutils.is_null(builder, element), none, element) for element in elements]
        values = [_from_object(context, builder, python, *each) for each in zip(kind, found, strict=True)]
        return context.make_tuple(builder, kind, values)
    if isinstance(kind, types.Array):
        return _array_of(context, builder, kind, given)
    if isinstance(kind, LaneArrayType | LaneRecordType):
        return _lanes_of(context, builder, kind, given)
    if isinstance(kind, types.NoneType):
        with builder.if_then(builder.icmp_unsigned("!=", given, python.borrow_none()), likely=False):
            _raise(builder, python, "TypeError", "expected None")
        return context.get_dummy_value()
    if isinstance(kind, types.Boolean):
        return builder.icmp_signed("==", python.object_istrue(given), ir.IntType(32)(1))
    return python.float_as_double(given) if kind == types.float64 else python.long_as_longlong(given)


def _array_of(context: Any, builder: Any, kind: Any, given: Any) -> Any:
    flags = _ALIGNED | _IN_ORDER[kind.layout]
    asked = [_WORD(value) for value in (kind.ndim, np.dtype(str(kind.dtype)).num, flags)]
    checked = ir.FunctionType(_WORD.as_pointer(), [given.type, *[_WORD] * 3])
    array = builder.call(cgutils.get_or_insert_function(builder.module, checked, "hsv_array"), [given, *asked])

    def word(pointer: Any, index: int) -> Any:
        return builder.load(builder.gep(pointer, [_WORD(index)]))

    # A head, then data, number of axes, shape and strides.
    data, _, shape, strides = (word(array, object.__basicsize__ // 8 + field) for field in range(4))
    lengths, steps = (builder.inttoptr(address, _WORD.as_pointer()) for address in (shape, strides))
    element = context.get_data_type(kind.dtype)
    made = context.make_array(kind)(context, builder)
    populate_array(
        made,
        data=builder.inttoptr(data, element.as_pointer()),
        shape=[word(lengths, axis) for axis in range(kind.ndim)],
        strides=[word(steps, axis) for axis in range(kind.ndim)],
        itemsize=_WORD(context.get_abi_sizeof(element)),
        meminfo=None,
    )
    return made._getvalue()


def _lanes_of(context: Any, builder: Any, kind: Any, given: Any) -> Any:
    axes = kind.ndim if isinstance(kind, LaneArrayType) else 0
    words = cgutils.alloca_once(builder, _WORD, axes + 2)
    name = context.insert_const_string(builder.module, kind.name)
    read = ir.FunctionType(ir.VoidType(), [given.type, name.type, _WORD, words.type])
    builder.call(cgutils.get_or_insert_function(builder.module, read, "hsv_lanes"), [given, name, _WORD(axes), words])
    address, stride, *lengths = (builder.load(builder.gep(words, [_WORD(i)])) for i in range(axes + 2))
    made = cgutils.create_struct_proxy(kind)(context, builder)
    made.data = builder.inttoptr(address, made.data.type)
    if axes:
        made.shape, made.stride = cgutils.pack_array(builder, lengths, _WORD), stride
    return made._getvalue()


def _result(kind: Any) -> Result:
    """Return the description of a value that is returned.

    Raises:
        TypingError: It cannot be handed over.
    """
    if isinstance(kind, types.Array) and kind.layout == "C":
        return Result(str(kind.dtype))
    if isinstance(kind, types.Tuple | types.UniTuple) and len(kind):
        return Result(elements=tuple(map(_result, kind)))
    if kind in (types.none, types.float64, types.complex128, types.int64, types.boolean):
        return Result()
    raise TypingError(f"returns {kind}")


def _to_object(context: Any, builder: Any, python: Any, kind: Any, value: Any) -> Any:
    """Return a new object for a value; of an array a tuple of its memory, the address of its data, and its shape."""
    if isinstance(kind, _TUPLE):
        values = [builder.extract_value(value, index) for index in range(len(kind))]
        return _tuple(python, [_to_object(context, builder, python, *each) for each in zip(kind, values, strict=True)])
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        context.nrt.incref(builder, kind, value)
        pointers = [builder.ptrtoint(pointer, _WORD) for pointer in (array.meminfo, array.data)]
        lengths = [builder.extract_value(array.shape, axis) for axis in range(kind.ndim)]
        return _tuple(python, [python.long_from_longlong(word) for word in (*pointers, *lengths)])
    if kind == types.complex128:
        number = context.make_complex(builder, kind, value)
        return python.complex_from_doubles(number.real, number.imag)
    if kind == types.float64:
        return python.float_from_double(value)
    if kind == types.boolean:
        return python.bool_from_bool(context.cast(builder, value, kind, types.boolean))
    return python.make_none() if kind == types.none else python.long_from_longlong(value)


def _tuple(python: Any, elements: Any) -> Any:
    made = python.tuple_new(len(elements))
    for index, element in enumerate(elements):
        python.tuple_setitem(made, index, element)
    return made


def _linked(objects: Sequence[bytes]) -> bytes:
    """Return the shared library of object files."""
    with TemporaryDirectory() as folder:
        target = Path(folder, "library.so")
        files = [Path(folder, f"{number}.o") for number in range(len(objects))]
        for file, content in zip(files, objects, strict=True):
            file.write_bytes(content)
        compiler = shlex.split(os.environ.get("CC") or "cc")
        # Python's functions are those of the process that loads it.
        command: list[str | Path] = [*compiler, "-O2", "-shared", "-fPIC", "-o", target, *files, _RUN_TIME]
        subprocess.run(command, check=True, capture_output=True, text=True)
        return target.read_bytes()
