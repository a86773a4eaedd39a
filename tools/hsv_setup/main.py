"""The stages of "make setup", each done only when something it depends on has changed."""

from __future__ import annotations

import argparse
import fcntl
import os
import signal
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from types import FrameType

from hsv_setup import bytecode, checks, completion, environment, interpreter, routes, workspace
from hsv_setup.console import SetupError, Stage
from hsv_setup.paths import ROOT

_INTERRUPTED = 130


def main(arguments: Sequence[str]) -> int:
    """Run the set-up; return the exit code."""
    parser = argparse.ArgumentParser(prog="tools/setup.py", description="Set the bench up (what make setup runs).")
    parser.add_argument("--check", action="store_true", help="only check that the machine has what is needed")
    options = parser.parse_args(arguments)
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        _set_up(os.environ, options.check)
    except SetupError as error:
        print(f"\nmake setup: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nmake setup: interrupted; run it again to continue from the last finished stage", file=sys.stderr)
        return _INTERRUPTED
    return 0


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _set_up(environ: Mapping[str, str], only_check: bool) -> None:
    start = time.monotonic()
    route = routes.choose(environ)
    env = routes.clean_environment(route, environ)
    python = interpreter.find(env, with_ros=not route.wheels)
    if only_check or python is None:
        checks.require(route, python, env)
        return
    with _alone():
        incomplete = not environment.is_current(route, python)
        if incomplete:
            checks.require(route, python, env)
            packages = Stage(f"[1/3] Python {python.version_text} environment and packages", "packages")
            environment.install_for_build(route, python, env, packages)
        wanted = workspace.outdated(route)
        rebuilding = bool(wanted or workspace.removed())
        with ExitStack() as beside:
            if rebuilding:
                checks.require(route, python, env)
                built = Stage("[2/3] Workspace", "build")
                # Neither the other packages nor byte code need the workspace, and one core each is enough.
                beside.enter_context(workspace.building(route, wanted, env, built))
            if incomplete:
                environment.install_rest(route, env, packages)
                packages.done("installed in .venv")
            if not bytecode.sources_are_current():
                written = Stage("[3/3] Byte code", "bytecode")
                completion.write(environment.PYTHON, env, written)
                bytecode.compile_sources(environment.PYTHON, env, written)
                written.done("is up to date")
        if rebuilding:
            built.done(f"built {', '.join(package.name for package in wanted) or 'nothing, removed old packages'}")
    print(f"Set up ({time.monotonic() - start:.1f} s). To use it in this shell: source env.sh", flush=True)


@contextmanager
def _alone() -> Iterator[None]:
    """Let one set-up at a time work on this checkout."""
    lock = os.open(ROOT, os.O_RDONLY)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print("another make setup works on this checkout; waiting for it ...", flush=True)
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)
