"""The stage that makes the virtual environment and installs the pinned packages into it."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from hsv_setup.bytecode import compile_packages
from hsv_setup.console import SetupError, Stage
from hsv_setup.interpreter import Interpreter
from hsv_setup.paths import BUILD, INSTALL, ROOT, STAMPS, VENV, fingerprint, read_stamp, write_stamp
from hsv_setup.relocate import relocate
from hsv_setup.routes import Route

PYTHON = VENV / "bin" / "python3"
_UV = VENV / "bin" / "uv"
_IDENTITY, _CONTENTS, _ROUTE = STAMPS / "identity", STAMPS / "environment", STAMPS / "route"
_HERE = Path(__file__).parent


def identity(route: Route, python: Interpreter) -> str:
    """Return what an environment cannot outlive: its interpreter, its place, its route."""
    return fingerprint(route.name, python.executable, python.version_text, str(ROOT))


def contents(route: Route) -> str:
    """Return a fingerprint of all that decides what is installed."""
    installer = ["requirements-setup.txt"] if route.wheels else []
    files = [ROOT / name for name in (*route.requirements, *installer, route.constraints)]
    files += [_HERE / "environment.py", _HERE / "bytecode.py", _HERE / "relocate.py"]
    return fingerprint(*(path.read_bytes() for path in files))


def is_current(route: Route, python: Interpreter) -> bool:
    """Return whether the environment is complete and what the checkout asks for."""
    made_for = read_stamp(_IDENTITY) == identity(route, python)
    return made_for and read_stamp(_CONTENTS) == contents(route) and PYTHON.exists()


def install_for_build(route: Route, python: Interpreter, env: Mapping[str, str], stage: Stage) -> None:
    """Make the environment, or bring the existing one up to date, as far as the workspace needs it to be built.

    Raises:
        SetupError: venv or pip failed.
    """
    # Without a contents stamp an installation was interrupted: pip may have left half a package behind.
    if read_stamp(_IDENTITY) != identity(route, python) or not _CONTENTS.is_file():
        _discard()
        option = ["--system-site-packages"] if route.system_site_packages else []
        stage.run([python.executable, "-m", "venv", *option, VENV], env)
        write_stamp(_IDENTITY, identity(route, python))
        write_stamp(_ROUTE, route.name)
    _CONTENTS.unlink(missing_ok=True)

    if route.wheels:
        _install_installer(route, env, stage)
        # First, because empy comes as source only and is built with this pinned setuptools, not with the newest.
        _install(route, ["setuptools"], env, stage)
    _install(route, ["--requirement", route.requirements[0]], env, stage)
    if route.wheels:
        relocate(VENV, python.include, _numpy_include(env))
        _install_ros2_command()


def install_rest(route: Route, env: Mapping[str, str], stage: Stage) -> None:
    """Install what else there is; of what is there nothing changes, so that the workspace may be built meanwhile.

    Raises:
        SetupError: pip failed.
    """
    for name in route.requirements[1:]:
        _install(route, ["--requirement", name], env, stage)
    write_stamp(_CONTENTS, contents(route))


def _install_installer(route: Route, env: Mapping[str, str], stage: Stage) -> None:
    """Install uv, which installs in a fifth of pip's time; where there is none for this machine, pip installs.

    It does not read pip's settings, so it is not used where these name an index.
    """
    settings = subprocess.run([PYTHON, "-m", "pip", "config", "list"], env=dict(env), capture_output=True, text=True)
    if not re.search(r"^\S+\.(index-url|no-index)=", settings.stdout, re.MULTILINE):
        with suppress(SetupError):
            _install_by_pip(route, ["--requirement", "requirements-setup.txt"], env, stage)
            return
    _remove_installer(env, stage)  # of an earlier set-up


def _remove_installer(env: Mapping[str, str], stage: Stage) -> None:
    if _UV.exists():
        stage.run([PYTHON, "-m", "pip", "--disable-pip-version-check", "uninstall", "--yes", "uv"], env)


def _install(route: Route, wanted: Sequence[str], env: Mapping[str, str], stage: Stage) -> None:
    # Like pip, trust the certificates of the system.
    uv: list[str | Path] = [_UV, "pip", "install", "--python", PYTHON, "--system-certs"]
    if route.wheels and _UV.exists():
        try:
            stage.run([*uv, "--constraint", route.constraints, "--no-build-isolation", *wanted], env)
        except SetupError:
            _remove_installer(env, stage)  # it would fail again
            _install_by_pip(route, wanted, env, stage)
    else:
        _install_by_pip(route, wanted, env, stage)
    compile_packages(PYTHON, env, stage)


def _install_by_pip(route: Route, wanted: Sequence[str], env: Mapping[str, str], stage: Stage) -> None:
    pip: list[str | Path] = [PYTHON, "-m", "pip", "--disable-pip-version-check", "--no-input", "install"]
    # Compiled afterwards, on all cores.
    pip += ["--no-compile", "--progress-bar", "off", "--constraint", route.constraints]
    stage.run([*pip, "--use-pep517", "--no-build-isolation", *wanted], env, _pip_progress)


def _discard() -> None:
    # What was built against the old environment goes with it.
    for path in (VENV, BUILD, INSTALL):
        shutil.rmtree(path, ignore_errors=True)


def _pip_progress(log: str) -> str:
    if "\nInstalling collected packages" in log:
        return "installing"
    return f"{len(re.findall('^Collecting ', log, re.MULTILINE))} packages found"


def _numpy_include(env: Mapping[str, str]) -> str:
    command = [str(PYTHON), "-c", "import numpy; print(numpy.get_include())"]
    return subprocess.run(command, env=dict(env), capture_output=True, text=True, check=True).stdout.strip()


def _install_ros2_command() -> None:
    """Put the `ros2` replacement on the environment's PATH.

    It is started through a shell script because a #! line allows no spaces in a path, and without site-packages (-S)
    because it needs none and starts twice as fast.
    """
    command = VENV / "bin" / "ros2"
    command.unlink(missing_ok=True)
    program = ROOT / "tools" / "ros2.py"
    command.write_text(f'#!/bin/sh\nexec {shlex.quote(str(PYTHON))} -S {shlex.quote(str(program))} "$@"\n')
    command.chmod(0o755)
