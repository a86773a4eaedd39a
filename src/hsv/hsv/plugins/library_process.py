"""Child processes that load and step shared libraries or FMUs, so that a crash of a library is contained.

One child serves one library file and many flights. The first request starts it; after a crash, or when the file has
changed, the next request starts a new one. The child runs :mod:`hsv.plugins.library_child`, which calls the library.
"""

from __future__ import annotations

import atexit
import fcntl
import mmap
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import numpy as np

from hsv.base.errors import ProcessError
from hsv.plugins.library_answers import CBlock, receive_answer

NO_PROGRESS = 20.0
"""Time (s) without progress after which a child is ended, while it loads the library or steps it."""

Answer = TypeVar("Answer")

_POLL = 0.5
"""Interval (s) at which progress is checked."""


class SharedMemory:
    """Memory that two processes share, behind a file descriptor."""

    def __init__(self, descriptor: int | None = None) -> None:
        """Use the memory behind a file ``descriptor``, by default new memory."""
        if descriptor is None:
            descriptor = os.memfd_create("hsv_library", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
            # A library that cut the memory off would crash this process.
            fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK)
        self.descriptor = descriptor
        self._mapped = np.empty(0)

    def numbers(self, count: int) -> np.ndarray:
        """Return the first ``count`` 64-bit floats of the memory as an array; the memory grows as needed."""
        if len(self._mapped) < count:
            if os.fstat(self.descriptor).st_size < 8 * count:
                os.truncate(self.descriptor, 8 * count)
            # Mapped once: every page of a new mapping costs time when it is first written.
            self._mapped = np.frombuffer(mmap.mmap(self.descriptor, 8 * count))
        return self._mapped[:count]


class LibraryProcess:
    """The child process of one library file; it answers one request at a time."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lock = threading.RLock()
        self._child: subprocess.Popen[bytes] | None = None
        self._connection: Connection[Any, Any]
        self._file: tuple[int, ...] = ()
        self._blocks: dict[str, CBlock] = {}
        self._memory = SharedMemory()

    def describe(self, symbol: str) -> CBlock:
        """Return the description of the block ``symbol`` of the library.

        Raises:
            OSError: The file cannot be read.
            ParameterError: There is no such block, or it is wrong.
            ProcessError: The child crashed or hangs.
        """
        with self._lock:
            self._renew()
            if symbol not in self._blocks:
                self._blocks[symbol] = self.request("describe", CBlock, symbol)
            return self._blocks[symbol]

    def request(
        self,
        name: str,
        answers: type[Answer],
        *arguments: Any,
        kept: Mapping[str, Any] | None = None,
        begun: Callable[[], int] = lambda: 1,
    ) -> Answer:
        """Return the reply of the child to a request, see :class:`hsv.plugins.library_child.LoadedLibrary`.

        Args:
            name: Name of the request.
            answers: Type of the reply.
            arguments: Arguments of the request.
            kept: Keyword arguments that the child stores; an object that it already has is not sent again.
            begun: Returns the number of steps that the child has begun. If it does not change for :data:`NO_PROGRESS`,
                the child is taken to hang; there is no time limit while it is 0.

        Raises:
            OSError: The file cannot be read.
            ProcessError: The child crashed or hangs.
            HsvError: Raised in the child.
        """
        with self._lock:
            self._renew()
            if self._child is None:
                self._start()
            while self._connection.poll():
                self._receive()  # the child crashed between requests
            news = None
            if kept is not None:
                news = {key: value for key, value in kept.items() if value is not self._kept.get(key)}
                self._kept |= news
            try:
                self._connection.send((name, arguments, news))
                self._wait(begun)
                answer = self._receive()
            except BaseException:
                # A late reply would be mistaken for the reply to the next request.
                self.end()
                raise
        if isinstance(answer, Exception):
            raise answer
        if not isinstance(answer, answers):
            raise ProcessError("wrote an answer of its own")
        return answer

    @contextmanager
    def sharing(self, numbers: int) -> Iterator[np.ndarray]:
        """Yield the memory shared with the child as an array of ``numbers`` floats; other threads' requests wait."""
        with self._lock:
            yield self._memory.numbers(numbers)

    def end(self) -> None:
        """End the child process; the next request starts another one."""
        if self._child is not None:
            with suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)
            self._child.wait()
            self._connection.close()
            self._folder.cleanup()
            self._child = None

    def _renew(self) -> None:
        """End the child if the library file has changed since it was started."""
        status = self._path.stat()
        file = (status.st_dev, status.st_ino, status.st_mtime_ns, status.st_size)
        if file != self._file:
            self.end()
            self._file, self._blocks = file, {}

    def _start(self) -> None:
        self._connection, theirs = Pipe()
        descriptors = (theirs.fileno(), self._memory.descriptor)
        # The child unpacks FMUs in this folder; this process removes it, as a killed child cannot.
        self._folder = TemporaryDirectory(prefix="hsv_library_")
        # Output of the library goes to stderr, not into the output of a command.
        self._child = subprocess.Popen(
            [sys.executable, "-P", "-m", "hsv.plugins.library_child", self._path, *map(str, descriptors)],
            stdin=subprocess.DEVNULL,
            stdout=2,
            pass_fds=descriptors,
            env={**os.environ, "TMPDIR": self._folder.name},
            process_group=0,
        )
        theirs.close()
        # No time limit: the imports may be slow on a busy machine.
        self._connection.poll(None)
        self._receive()

    def _receive(self) -> Any:
        try:
            answer = receive_answer(self._connection.fileno(), NO_PROGRESS)
        except (EOFError, ConnectionError):
            self.end()
            raise ProcessError("its process has ended") from None
        except ProcessError:
            self.end()
            raise
        if answer is None or isinstance(answer, ProcessError):
            self._kept: dict[str, Any] = {}
        return answer

    def _wait(self, begun: Callable[[], int]) -> None:
        last, since = begun(), time.monotonic()
        while not self._connection.poll(_POLL):
            now = begun()
            if now != last:
                last, since = now, time.monotonic()
            elif now and time.monotonic() - since > NO_PROGRESS:
                self.end()
                raise ProcessError(f"no answer for {NO_PROGRESS:g} s")


_children: dict[Path, LibraryProcess] = {}


@atexit.register
def _end_children() -> None:
    for child in _children.values():
        child.end()


# A forked process inherits the connections, but not the children.
os.register_at_fork(after_in_child=_children.clear)

_in_this_process: Any = None


def use_in_this_process(library: Any) -> None:
    """Make :func:`library_user` return ``library``, a :class:`hsv.plugins.library_child.LoadedLibrary`; for a child."""
    global _in_this_process
    _in_this_process = library


def library_user(path: Path) -> Any:
    """Return the child process of the library at ``path``, or the loaded library if this process is the child."""
    return _in_this_process or _children.get(path) or _children.setdefault(path, LibraryProcess(path))
