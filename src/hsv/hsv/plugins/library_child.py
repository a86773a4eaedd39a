"""Child process that loads a shared library, steps its controller, and calls functions that use it.

There are two processes. The supervisor never loads the library; it forks the worker, which does. If the worker crashes
or exits, the supervisor reports this to the parent and forks a fresh worker.

:mod:`hsv.plugins.library_process` starts the supervisor as
``python3 -m hsv.plugins.library_child LIBRARY CONNECTION MEMORY``; the last two are file descriptors.
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

from hsv.base.errors import HsvError, ProcessError, RunError
from hsv.control.controller import call_step_function
from hsv.plugins.fmu import LoadedFmu
from hsv.plugins.library import load_block
from hsv.plugins.library_answers import CBlock, send_answer
from hsv.plugins.library_process import SharedMemory, use_in_this_process


class LoadedLibrary:
    """A shared library in this process, with the requests that the parent can make."""

    def __init__(self, path: Path, memory: SharedMemory) -> None:
        """Prepare to load the library; ``memory`` is shared with the parent."""
        self._path = path
        self._memory = memory
        self._load = cache(load_block)
        self._fmu: LoadedFmu | None = None

    @contextmanager
    def sharing(self, numbers: int) -> Iterator[np.ndarray]:
        """Yield the shared memory as an array of ``numbers`` values."""
        yield self._memory.numbers(numbers)

    def request(
        self, name: str, answers: type, *arguments: Any, kept: Mapping[str, Any] | None = None, **_: Any
    ) -> Any:
        """Return the result of the method ``name`` with ``arguments`` and the keywords ``kept``; ignore others."""
        return getattr(self, name)(*arguments, **(kept or {}))

    def describe(self, symbol: str) -> CBlock:
        """Load the library on first use and return its block ``symbol``; for an FMU the symbol is empty."""
        if not symbol:
            self._fmu = self._fmu or LoadedFmu(self._path)
            return self._fmu.block
        return self._load(self._path, symbol)

    def copied(self, number: float) -> int:
        """Return the number of a new copy of an FMU's copy ``number``, see :meth:`hsv.plugins.fmu.LoadedFmu.copied`."""
        self.describe("")
        assert self._fmu is not None
        return self._fmu.copied(number)

    def step(self, symbol: str, k: int, inputs: np.ndarray, state: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Call the library's step function; return the unsaturated input (2), then the state after the step."""
        with self._reason():
            u_unsaturated = call_step_function(self.describe(symbol).address, k, inputs, state, parameters)
        return np.concatenate((u_unsaturated, state))

    @contextmanager
    def _reason(self) -> Iterator[None]:
        """In messages of errors raised in this context, replace an FMU's return code by the reason of its failure."""
        try:
            yield
        except RunError as error:
            if self._fmu and self._fmu.failure:
                raise type(error)(str(error).partition("returned ")[0] + self._fmu.failure) from error
            raise

    def call(self, function: Callable[..., Any], *arguments: Any, **kept: Any) -> Any:
        """Return the result of ``function(*arguments, **kept)``, which uses the library in this process."""
        with self._reason():
            return function(*arguments, **kept)


def main() -> None:
    """Supervise workers until the parent has ended."""
    # The parent handles Ctrl-C and ends its child.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    path, connection, memory = Path(sys.argv[1]), Connection(int(sys.argv[2])), SharedMemory(int(sys.argv[3]))
    send_answer(connection.fileno(), None)
    with suppress(ConnectionError):
        while True:
            pid = os.fork()
            if pid == 0:
                serve(LoadedLibrary(path, memory), connection)
            code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
            end = f"crashed ({signal.Signals(-code).name})" if code < 0 else f"ended its process with exit code {code}"
            send_answer(connection.fileno(), ProcessError(end))


def serve(library: LoadedLibrary, connection: Connection[Any, Any]) -> NoReturn:
    """Serve requests until the parent has ended, or the library ends this process."""
    use_in_this_process(library)
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
            answer = library.request(name, object, *arguments, kept=None if news is None else kept)
        except HsvError as error:
            answer = error
        send_answer(connection.fileno(), answer)


def _end_with_parent(connection: int) -> None:
    """End this process when the parent has ended, even during a step that never returns."""
    ended = select.poll()
    ended.register(connection, select.POLLHUP)
    ended.poll()
    os._exit(1)


if __name__ == "__main__":
    main()
