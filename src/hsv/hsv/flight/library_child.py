"""Child process of a shared library, which loads the library and flies the loop with it.

Two processes: the first waits for the second, which does all that, to crash, tells the parent of it, and forks another
one. It never loads the library itself, so that the next one starts afresh, and at once.

:mod:`hsv.control.library_process` starts it as ``python3 -m hsv.flight.library_child LIBRARY CONNECTION MEMORY``;
the last two are file descriptors.
"""

from __future__ import annotations

import os
import select
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from typing import Any, NoReturn

import numpy as np

from hsv.base.errors import HsvError, ProcessError
from hsv.control.controller import call_step_function
from hsv.control.library import CBlock, LibraryController, load_block
from hsv.control.library_process import SharedMemory, use_in_this_process
from hsv.flight.closed_loop import Components, fly_into
from hsv.flight.history import History


class LoadedLibrary:
    """A library in this process, and what its parent can request."""

    def __init__(self, path: Path, memory: SharedMemory) -> None:
        """Write flights to the ``memory``, which the parent shares."""
        self._path = path
        self._memory = memory
        self._load = cache(load_block)

    @contextmanager
    def sharing(self, numbers: int) -> Iterator[np.ndarray]:
        """Yield memory (numbers) that the parent shares."""
        yield self._memory.numbers(numbers)

    def request(self, name: str, *arguments: Any, kept: Mapping[str, Any] | None = None, **_: Any) -> Any:
        """Do what is requested, by the name of the method."""
        return getattr(self, name)(*arguments, **(kept or {}))

    def describe(self, symbol: str) -> CBlock:
        """Load the library, where it is not loaded yet, and return its block.

        Raises:
            ParameterError: There is none; what is wrong is named.
        """
        return self._load(self._path, symbol)

    def fly(self, rows: int, **parts: Any) -> int:
        """Fly, write so many steps at most to the shared memory, and return how many were flown.

        Args:
            rows: The steps that there is room for.
            parts: Of :class:`hsv.flight.closed_loop.Components`.

        Raises:
            ControllerError: The library's function returned an error.
        """
        components = Components(**parts)
        assert isinstance(components.controller, LibraryController)
        components.controller = components.controller.loaded(self.describe(components.controller.symbol).address)
        return fly_into(History.over(self._memory.numbers(rows * History.numbers()), rows), components)

    def step(
        self, symbol: str, k: int, given: np.ndarray, state: np.ndarray, parameters: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Call the library's function; return the wanted input (2) and the state after it.

        Raises:
            RunError: It returned an error.
        """
        wanted = call_step_function(self.describe(symbol).address, k, given, state, parameters)
        return wanted, state

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns that flies with the library."""
        return function(*arguments)


def main() -> None:
    """Do what is requested until the parent has ended."""
    # Ctrl-C is for the parent, which ends its child.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    path, connection, memory = Path(sys.argv[1]), Connection(int(sys.argv[2])), SharedMemory(int(sys.argv[3]))
    connection.send(None)
    with suppress(ConnectionError):
        while True:
            pid = os.fork()
            if pid == 0:
                serve(LoadedLibrary(path, memory), connection)
            code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
            end = f"crashed ({signal.Signals(-code).name})" if code < 0 else f"ended its process with exit code {code}"
            connection.send(ProcessError(end))


def serve(library: LoadedLibrary, connection: Connection[Any, Any]) -> NoReturn:
    """Do what is requested until the parent has ended, or the library ends this process."""
    use_in_this_process(lambda path: library)
    Thread(target=_end_with_parent, args=(connection.fileno(),), daemon=True).start()
    kept: dict[str, Any] = {}
    while True:
        try:
            name, arguments, news = connection.recv()
        except EOFError:
            os._exit(1)
        if news is not None:
            kept |= news
        try:
            answer = library.request(name, *arguments, kept=None if news is None else kept)
        except HsvError as error:
            answer = error
        connection.send(answer)


def _end_with_parent(connection: int) -> None:
    """Wait for the parent to end, and end; a step that goes on for ever would not see it."""
    ended = select.poll()
    ended.register(connection, select.POLLHUP)
    ended.poll()
    os._exit(1)


if __name__ == "__main__":
    main()
