"""Libraries of :mod:`hsv.ahead_of_time`, in their place and in the user's cache.

To compile one takes two cores half a minute. So the last ones are kept in ``$XDG_CACHE_HOME/hsv``, which is
``~/.cache/hsv`` where that is not set: another checkout of the same commit, or an earlier commit that is checked out
again, takes what was built before.
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

from hsv.precompiled import INDEX, PACKAGE, digest, processor

_MOST_KEPT = 8
"""Each takes some 1.5 MB."""


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


def keep() -> None:
    """Keep the installed library in the cache, unless that has no place for it; all but the last ones leave it."""
    with suppress(OSError, RuntimeError):  # a RuntimeError where the user has no home
        index = json.loads(INDEX.read_text())
        kept = _kept()
        kept.mkdir(parents=True, exist_ok=True)
        _replace(kept / index["library"], INDEX.with_name(index["library"]).read_bytes())
        _replace(kept / INDEX.name, json.dumps(index).encode())
        by_age = sorted(kept.parent.glob(f"*/{INDEX.name}"), key=lambda path: path.stat().st_mtime_ns)
        for oldest in by_age[:-_MOST_KEPT]:
            shutil.rmtree(oldest.parent)


def restored() -> bool:
    """Install the library that was built of these sources on such a machine, if the cache has it; return whether."""
    try:
        path = _kept() / INDEX.name
        index = json.loads(path.read_text())
        library = path.with_name(index["library"]).read_bytes()
        if hashlib.sha256(library).hexdigest() != index["contents"]:
            return False
        install(index, library)
    except (OSError, RuntimeError, ValueError, LookupError, TypeError):
        return False
    with suppress(OSError):
        os.utime(path)
    return True


def _kept() -> Path:
    """Return the folder in the cache for a library of these sources, made and used on such a machine."""
    files = (path.relative_to(PACKAGE) for path in PACKAGE.rglob("*") if path.is_file())
    sources = sorted(str(path) for path in files if "__pycache__" not in path.parts)  # scenarios say what is called
    compilers = [version("numba"), version("llvmlite"), sys.version, *platform.libc_ver()]
    words = [processor(), *compilers, digest(sources), *sources]
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(cache, "hsv", hashlib.sha256("\n".join(words).encode()).hexdigest()[:32])


def _replace(path: Path, content: bytes) -> None:
    """Write a file that others may be reading: they keep the old one."""
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    with temporary.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)
