"""Compiled functions whose arguments are looked at once, and not in every call."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from numba import typeof, types


def bound(function: Any, *arguments: Any) -> Callable[..., Any]:
    """Return what numba calls in the end when ``function`` is called with arguments such as these, compiled now.

    To find out which types its arguments have takes numba 1 to 5 us in every call where there are large tuples among
    them, longer than many a function takes. What is returned does not ask: whoever calls it answers for it that all
    arguments, none left out, are of the types of these, arrays of the same order in memory too.

    Args:
        function: Compiled by :func:`numba.njit`; where compilation is switched off, it is returned as it is.
        arguments: All of them, also those that are as by default.
    """
    if not hasattr(function, "py_func"):
        return function
    defaults = function.py_func.__defaults__ or ()
    first = len(arguments) - len(defaults)
    kinds = [
        types.Omitted(given) if i >= first and given is defaults[i - first] else typeof(given)
        for i, given in enumerate(arguments)
    ]
    made = _Bound(function, tuple(kinds))
    made.compile()
    return made


class _Bound:
    """A compiled function for arguments of some types; in another process it is compiled when it is first called."""

    __slots__ = ("_entry", "_function", "_kinds")

    def __init__(self, function: Any, kinds: tuple[Any, ...]) -> None:
        self._function, self._kinds = function, kinds
        self._entry: Callable[..., Any] | None = None

    def compile(self) -> Callable[..., Any]:
        """Return what is called in the end."""
        entry: Callable[..., Any] = self._function.compile(self._kinds)
        self._entry = entry
        return entry

    def __call__(self, *arguments: Any) -> Any:
        return (self._entry or self.compile())(*arguments)

    def __reduce__(self) -> tuple[Any, ...]:
        function = self._function.py_func
        return _bound_to, (function.__module__, function.__name__, self._kinds)


def _bound_to(module: str, name: str, kinds: tuple[Any, ...]) -> _Bound:
    return _Bound(getattr(import_module(module), name), kinds)
