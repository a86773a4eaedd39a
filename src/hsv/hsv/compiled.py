"""Compiled functions: by numba when it is needed, else as they were compiled ahead of time.

To import numba and to prepare it for its first function takes more processor time than twenty flights of Case 1.
``python -m hsv.warm``, which the set-up runs, therefore also writes a library of the functions that commands and nodes
call from Python, for the types of arguments with which they call them (:mod:`hsv.ahead_of_time`). A function of
:func:`njit` that is called with such arguments is taken from there, and numba is not imported
(:mod:`hsv.precompiled`). With any other arguments, without that library, after a change of a source or on another kind
of processor it is numba's, as with its own ``njit``. Both are compiled from the same source with the same options, and
a test compares the bits of flights. What numba compiles it keeps, for each state of the sources apart.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache, update_wrapper
from importlib import import_module
from typing import Any, TypeVar, cast

from hsv.precompiled import entry_for, state_of_sources

EXTENSIONS = ("hsv.lane_overloads", "hsv.simulation.foreign_call")
"""Modules that tell numba of our types and functions; to import them is to import numba."""

ENABLED = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0"
"""Whether functions are compiled; tests and debuggers look through those that are not."""

Function = TypeVar("Function", bound=Callable[..., Any])

instead: Callable[[CompiledFunction, tuple[Any, ...], dict[str, Any]], Any] | None = None
"""If set, called in place of every compiled function: with the function, its arguments and its named arguments."""


for_a_library = False
"""Set where functions are compiled for the library alone: without that by which Python calls them."""


class CompiledFunction:
    """A function that is compiled; in functions compiled by numba it stands for what numba makes of it."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self.name = f"{function.__module__}.{function.__qualname__}"
        # Numba looks at these two, too, to decide whether it inlines the function.
        self.targetoptions = options
        self._dispatcher: Any = None

    def __reduce__(self) -> str:
        return self.py_func.__qualname__

    @property
    def dispatcher(self) -> Any:
        """What numba makes of the function; numba is imported."""
        if self._dispatcher is None:
            compile_with = import_module("numba").njit
            for name in EXTENSIONS:
                import_module(name)
            # The wrapper by which C would call it takes a tenth of the time to compile, and nobody does.
            options = self.targetoptions | {"no_cfunc_wrapper": True}
            if for_a_library:
                options["no_cpython_wrapper"] = True
            elif not _keeps_code():
                options["cache"] = False
            try:
                self._dispatcher = compile_with(**options)(self.py_func)
            except RuntimeError:  # there is no folder to keep what is compiled in
                self._dispatcher = compile_with(**options | {"cache": False})(self.py_func)
        return self._dispatcher

    @property
    def _numba_type_(self) -> Any:
        return self.dispatcher._numba_type_

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Return what the function returns."""
        if instead is not None:
            return instead(self, arguments, named)
        if self._dispatcher is None and not named:
            # Once numba is there for it, it decides by the types of the arguments faster.
            entry = entry_for(self.name, arguments)
            if entry:
                return entry(*arguments)
        return self.dispatcher(*arguments, **named)

    def compiled_for(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """Return what is called in the end with arguments of the types of these, which are all of them."""
        if instead is not None:
            return self
        if self._dispatcher is None:
            entry = entry_for(self.name, arguments)
            if entry:
                return entry
        numba = import_module("numba")
        defaults = self.py_func.__defaults__ or ()
        first = len(arguments) - len(defaults)
        kinds = [
            numba.types.Omitted(given) if i >= first and given is defaults[i - first] else numba.typeof(given)
            for i, given in enumerate(arguments)
        ]
        return cast(Callable[..., Any], self.dispatcher.compile(tuple(kinds)))


@cache
def _keeps_code() -> bool:
    """Have numba keep what it compiles in a folder for this state of the sources, and return whether it does.

    It notices a change of the file that a function is in, and none of a file that it calls functions of. Where a source
    was changed since this process began, what it compiles may be of the one before, and is not kept.
    """
    from hsv.kept_library import numba_folder  # not for what is taken from the library

    state = state_of_sources()
    folder = numba_folder(state) if state else None
    if folder:
        import_module("numba").config.CACHE_DIR = str(folder)
    return folder is not None


def njit(**options: Any) -> Callable[[Function], Function]:
    """Return a decorator for functions that are compiled, with the options of numba's ``njit``."""

    def decorate(function: Function) -> Function:
        return cast(Function, CompiledFunction(function, options)) if ENABLED else function

    return decorate


def njit_in_flight(**options: Any) -> Callable[[Function], Function]:
    """Return the decorator of a function that is compiled, and that fills arrays but makes none.

    Where nothing is allocated nobody need count who holds an array. Counting takes an atomic instruction for each array
    of each call, which were half of the compiled loop's time.

    Args:
        **options: Of :func:`numba.njit`.
    """
    return njit(cache=True, _nrt=False, **options)


class Bound:
    """A compiled function whose arguments are looked at in the first call, and not in every one.

    To find out which types its arguments have takes longer than many a function takes where there are large tuples
    among them. Whoever calls this answers for it that all arguments, none left out, are always of the types of those of
    the first call, arrays of the same order in memory too.
    """

    __slots__ = ("_call", "_function")

    def __init__(self, function: CompiledFunction) -> None:
        self._function = function
        self._call: Callable[..., Any] | None = None

    def __call__(self, *arguments: Any) -> Any:
        """Return what the function returns."""
        if self._call is None:
            self._call = self._function.compiled_for(arguments)
        return self._call(*arguments)

    def __reduce__(self) -> tuple[Any, ...]:
        return Bound, (self._function,)


def bound(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of :func:`njit` as a :class:`Bound` one; as it is where compilation is switched off."""
    return Bound(function) if isinstance(function, CompiledFunction) else function
