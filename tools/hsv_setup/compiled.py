"""The stage that compiles the numerical code ahead of its first use.

Five nodes that start at once on two cores should not each compile it. When any of the compiled sources changes, all
that was compiled goes, numba's caches and the library of what is called without numba (:mod:`hsv.ahead_of_time`). The
library for the present sources may have been built before (:mod:`hsv.kept_library`).
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from hsv_setup.console import Stage
from hsv_setup.environment import PYTHON
from hsv_setup.paths import LOG, ROOT, STAMPS, fingerprint, read_stamp, write_stamp

_LIBRARY = ROOT / "src" / "hsv" / "hsv"
_PROGRAM = _LIBRARY / "warm.py"
_INDEX = _LIBRARY / "__pycache__" / "ahead_of_time.json"
_STAMP = STAMPS / "compiled"


def _sources() -> list[Path]:
    """Return what defines compiled functions, and what the library was made of: modules with their constants, too."""
    try:
        made_of = [str(name) for name in json.loads(_INDEX.read_text())["sources"]]
    except (OSError, ValueError, LookupError, TypeError):  # there is none, or it is damaged
        made_of = []
    modules = (path for path in _LIBRARY.rglob("*.py") if not path.name.startswith("."))  # no locks of editors
    defining = {path for path in modules if any(word in path.read_text() for word in ("numba", "njit"))}
    return sorted(defining | {path for name in made_of if (path := _LIBRARY / name).exists()})


def _caches() -> list[Path]:
    """Return what was compiled, with what was left half written where that was cut off."""
    library = [path for pattern in ("*.so*", "json*") for path in _INDEX.parent.glob(f"{_INDEX.stem}.{pattern}")]
    return [*_LIBRARY.rglob("*.nb[ic]*"), *library]


def _key() -> str:
    parts: list[str | bytes] = [read_stamp(STAMPS / "identity"), read_stamp(STAMPS / "environment")]
    for path in _sources():
        parts += [str(path.relative_to(_LIBRARY)), path.read_bytes()]
    return fingerprint(*parts)


def is_current() -> bool:
    """Return whether the compiled caches fit the sources, or there is nothing to compile."""
    return not _PROGRAM.exists() or (read_stamp(_STAMP) == _key() and bool(_caches()))


def warm(env: Mapping[str, str], stage: Stage) -> None:
    """Compile everything that is outdated once, as `python -m hsv.warm` does it.

    Raises:
        SetupError: the numerical code does not compile.
    """
    if is_current():
        return
    for path in _caches():
        path.unlink()
    for folder in _INDEX.parent.glob("numba-*"):
        shutil.rmtree(folder, ignore_errors=True)  # a process may be compiling into it
    paths = [str(_LIBRARY.parent), *filter(None, [env.get("PYTHONPATH")])]
    stage.run([PYTHON, "-m", "hsv.warm"], {**env, "PYTHONPATH": os.pathsep.join(paths)})
    write_stamp(_STAMP, _key())


def outcome() -> str:
    """Return what there is, in words; without a library compiled ahead of time all works, but starts slowly."""
    lacking = "" if _INDEX.exists() or not _PROGRAM.exists() else f", nothing ahead of time (see {LOG.name}/setup)"
    return f"byte code and numerical code are ready{lacking}"
