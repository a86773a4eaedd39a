"""Libraries of :mod:`hsv.ahead_of_time`, in their place and in the user's cache.

To compile one takes two cores half a minute. So the last ones are kept in ``$XDG_CACHE_HOME/hsv``, which is
``~/.cache/hsv`` where that is not set: another checkout of the same sources, or earlier ones that are checked out
again, take what was built before. Each is in a folder of its own, as the library and its index, which begins with a
line of its digest.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import platform
import shutil
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from hsv.precompiled import INDEX, digest, processor

_MOST_KEPT = 8
"""A library takes about a megabyte; what numba has compiled of a state of the sources, seven."""


def install(index: Mapping[str, Any], library: bytes) -> None:
    """Put a library and its index where :mod:`hsv.precompiled` looks for them, and remove the one before.

    Raises:
        OSError: There is no place for it, or it cannot be loaded.
    """
    INDEX.parent.mkdir(parents=True, exist_ok=True)
    target = INDEX.with_name(index["library"])
    try:
        before = str(json.loads(INDEX.read_text())["library"])
    except (OSError, ValueError, LookupError, TypeError):
        before = target.name
    _replace(target, library)
    try:
        ctypes.PyDLL(str(target))  # whatever is missing in it is an OSError here
    except OSError:
        target.unlink()
        raise
    _replace(INDEX, json.dumps(index).encode())
    if before != target.name:
        INDEX.with_name(before).unlink(missing_ok=True)


def keep(state: str) -> None:
    """Keep the installed library in the cache, unless that has no place for it; all but the last ones leave it.

    Args:
        state: Of the sources that it was compiled from, see :func:`hsv.precompiled.state_of_sources`.
    """
    # A RuntimeError where the user has no home; the others where what is installed is damaged.
    with suppress(OSError, RuntimeError, ValueError, LookupError, TypeError):
        index = INDEX.read_bytes()
        described = json.loads(index)
        if not _is_of_these_sources(described):
            return
        name = described["library"]
        kept = _kept(state)
        kept.mkdir(parents=True, exist_ok=True)
        _replace(kept / name, INDEX.with_name(name).read_bytes())
        _replace(kept / INDEX.name, hashlib.sha256(index).hexdigest().encode() + b"\n" + index)
        folders = [path for path in kept.parent.iterdir() if path.is_dir()]
        for oldest in sorted(folders, key=lambda path: path.stat().st_mtime_ns)[:-_MOST_KEPT]:
            shutil.rmtree(oldest)


def restored(state: str) -> bool:
    """Install the library that was built of sources in this state on such a machine; return whether there is one."""
    try:
        kept = _kept(state)
        written, _, content = (kept / INDEX.name).read_bytes().partition(b"\n")
        if hashlib.sha256(content).hexdigest().encode() != written:
            return False
        index = json.loads(content)
        library = (kept / index["library"]).read_bytes()
        if hashlib.sha256(library).hexdigest() != index["contents"]:
            return False
        if not _is_of_these_sources(index):
            return False
        install(index, library)
    except (OSError, RuntimeError, ValueError, LookupError, TypeError):
        return False
    with suppress(OSError):
        os.utime(kept)
    return True


def numba_folder(state: str) -> Path | None:
    """Return where numba keeps what it compiles of sources in this state: beside them, else in the user's cache.

    Returns:
        ``None`` where neither can be written to.
    """
    for place in (lambda: INDEX.parent, _cache):
        with suppress(OSError, RuntimeError):  # a RuntimeError where the user has no home
            folder = place() / f"numba-{state[:16]}"
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK | os.X_OK):
                return folder
    return None


def _is_of_these_sources(index: Mapping[str, Any]) -> bool:
    return bool(index["digest"] == digest(index["sources"]))


def _cache() -> Path:
    """Return the project's folder in the user's cache.

    Raises:
        RuntimeError: The user has no home.
    """
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    cache = given if given.is_absolute() else Path.home() / ".cache"  # as the XDG specification has it
    return cache / "hsv"


def _kept(state: str) -> Path:
    """Return the folder in the cache for a library of such sources, made and used on such a machine."""
    words = [processor(), version("numba"), version("llvmlite"), sys.version, *platform.libc_ver(), state]
    return _cache() / hashlib.sha256("\n".join(words).encode()).hexdigest()[:32]


def _replace(path: Path, content: bytes) -> None:
    """Write a file that others may be reading: they keep the old one."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
