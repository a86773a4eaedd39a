"""Byte code of everything that a process of the bench imports, written by the set-up.

Python writes it at the first import, but not where PYTHONDONTWRITEBYTECODE is set, as in many containers, nor for
another user than the one who set the bench up: there, every node would compile a thousand modules at every start, four
of its five seconds of processor time. What is up to date is left as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hsv_setup.console import Stage
from hsv_setup.paths import ROOT, STAMPS, VENV, fingerprint, read_stamp, write_stamp

SOURCES = (ROOT / "src", ROOT / "ros_ws" / "src", ROOT / "tools")
"""Packages of the workspace are installed as links to these; ament compiles the generated messages itself."""

_STAMP = STAMPS / "bytecode"

# Some packages bring templates and samples for other versions of Python: what does not compile is left out.
_COMPILE = """
import compileall, re, sys
for path in sys.argv[2:]:
    compileall.compile_dir(path, quiet=2, workers=0, rx=re.compile(sys.argv[1]))
"""

# Byte code that is good for a content. What Python writes by itself is good for a size and a whole second: after a
# change within the same second it would be that of the source before, and what is compiled of it is kept.
_COMPILE_SOURCES = """
import compileall, py_compile, sys
mode = py_compile.PycInvalidationMode.CHECKED_HASH
for path in sys.argv[1:]:
    compileall.compile_dir(path, quiet=2, workers=0, force=True, invalidation_mode=mode)
"""

_OWN_TESTS = "site-packages/.*/tests?/"
"""Directories of installed packages that no process of the bench imports: a quarter of all that is installed."""


def compile_packages(python: Path, env: Mapping[str, str], stage: Stage) -> None:
    """Compile what pip has installed into the virtual environment, on all cores.

    Raises:
        SetupError: the interpreter does not run.
    """
    stage.run([python, "-c", _COMPILE, _OWN_TESTS, *VENV.glob("lib/python3*/site-packages")], env)


def compile_sources(python: Path, env: Mapping[str, str], stage: Stage) -> None:
    """Compile the bench's own modules.

    Raises:
        SetupError: the interpreter does not run.
    """
    stage.run([python, "-c", _COMPILE_SOURCES, *SOURCES], env)
    write_stamp(_STAMP, _key())


def sources_are_current() -> bool:
    """Return whether no module of the bench has changed since :func:`compile_sources`."""
    return read_stamp(_STAMP) == _key()


def _key() -> str:
    parts: list[str | bytes] = [read_stamp(STAMPS / "identity")]
    for path in sorted(path for folder in SOURCES for path in folder.rglob("*.py") if not path.name.startswith(".")):
        parts += [str(path.relative_to(ROOT)), path.read_bytes()]
    return fingerprint(*parts)
