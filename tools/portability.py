"""Prepare other processors, Pythons and packages to fly on: what "make test-portability" runs before its tests.

Below ``.portability`` each environment has a folder of its own with wheels at their pinned versions. For another
machine there are also Debian's Python, the libraries under it, and a cross compiler for the core, unpacked and not
installed: nothing outside the checkout changes, and no rights are needed. What cannot be had is named, a line each; the
tests fly on the rest.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hsv_setup.interpreter import Interpreter, probe
from hsv_setup.paths import ROOT, fingerprint, read_stamp, write_stamp

CACHE = ROOT / ".portability"
PACKAGES = ("cffi", "numpy", "pint", "pydantic", "pyyaml", "scipy", "tomli-w")
"""Packages that a flight in one process imports."""
LIBRARY = ROOT / "src" / "hsv"
"""The sources of the library, and beside them its core, compiled for this machine by the set-up."""

_DEBIAN_MACHINES = {"x86_64": "amd64", "aarch64": "arm64"}


class MissingError(Exception):
    """An environment cannot be had; one line says what is missing."""


@dataclass(frozen=True)
class Environment:
    """A Python that can fly: the command that starts it, and its folders of packages, as PYTHONPATH has them."""

    command: list[str]
    packages: str
    library: str = str(LIBRARY)
    """Folder of the library, with a core that the processor can run."""

    @classmethod
    def read(cls, name: str) -> Environment | None:
        """Return a prepared environment, or None where there is none."""
        path = CACHE / name / "environment.json"
        return cls(**json.loads(path.read_text())) if path.is_file() else None


def nehalem(folder: Path) -> Environment:
    """Return the project's own environment on an x86-64 processor without AVX and FMA."""
    if platform.machine() != "x86_64":
        raise MissingError(f"this machine is {platform.machine()}, expected x86_64: its programs run on no Nehalem")
    usual = own()
    return Environment([emulator("x86_64"), "-cpu", "Nehalem", *usual.command], usual.packages)


def aarch64(folder: Path) -> Environment:
    """Return Debian's Python for aarch64, of the project's version, under the project's pins, with a core for it."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    root = CACHE / "aarch64-root"
    unpack_packages("aarch64", root, f"python{version}", "libstdc++6")
    command = [emulator("aarch64"), "-L", str(root), str(root / "usr/bin" / f"python{version}")]
    return Environment(command, install(folder, version, "aarch64", "constraints.txt"), cross_compile(folder))


def python_3_12(folder: Path) -> Environment:
    """Return Python 3.12 of this machine, under the pins of the project."""
    return Environment([python312().executable], install(folder, "3.12", platform.machine(), "constraints.txt"))


def numpy_1_26(folder: Path) -> Environment:
    """Return Python 3.12 of this machine, under the pins for an installed ROS 2 Jazzy."""
    return Environment([python312().executable], install(folder, "3.12", platform.machine(), "constraints-jazzy.txt"))


ENVIRONMENTS: dict[str, Callable[[Path], Environment]] = {
    "nehalem": nehalem,
    "aarch64": aarch64,
    "python-3.12": python_3_12,
    "numpy-1.26": numpy_1_26,
}


def own() -> Environment:
    """Return the project's own environment: its interpreter, outside the virtual environment, and its packages."""
    folders = [entry for entry in sys.path if entry.endswith(("site-packages", "dist-packages"))]
    return Environment([os.path.realpath(sys.executable)], os.pathsep.join(folders))


def python312() -> Interpreter:
    """Return a CPython 3.12 of this machine.

    Raises:
        MissingError: There is none on the PATH or where pyenv and uv put theirs.
    """
    home = Path.home()
    known = [*home.glob(".pyenv/versions/3.12*/bin/python3.12"), *home.glob(".local/share/uv/python/*/bin/python3.12")]
    for command in (sys.executable, "python3.12", *map(str, sorted(known, reverse=True))):
        found = probe(command, os.environ)
        if found is not None and found.version[:2] == (3, 12):
            return found
    raise MissingError("no Python 3.12 on the PATH, in ~/.pyenv/versions or ~/.local/share/uv/python")


def emulator(machine: str) -> str:
    """Return the program that runs programs of ``machine``: the installed one, or Debian's, unpacked.

    Raises:
        MissingError: Neither is there.
    """
    for name in (f"qemu-{machine}", f"qemu-{machine}-static"):
        if installed := shutil.which(name):
            return installed
    folder = CACHE / "qemu"
    unpack_packages(platform.machine(), folder, "qemu-user-static")
    return str(folder / "usr/bin" / f"qemu-{machine}-static")


def unpack_packages(machine: str, folder: Path, *names: str) -> None:
    """Unpack Debian packages for ``machine``, and all that they depend on, into ``folder``.

    The system's sources and keys are used, with lists and archives of our own: it neither learns of the other
    architecture nor of the packages.

    Raises:
        MissingError: There is no apt, or its sources have no such packages.
    """
    if folder.is_dir():
        return
    if not all(map(shutil.which, ("apt-get", "dpkg"))):
        raise MissingError(f"no {' and '.join(names)} for {machine}: expected a system with apt-get and dpkg")
    architecture = _DEBIAN_MACHINES[machine]
    apt = CACHE / f"apt-{architecture}"
    for part in ("lists/partial", "archives/partial"):
        (apt / part).mkdir(parents=True, exist_ok=True)
    (apt / "status").touch()
    options = {
        "APT::Architecture": architecture,
        "APT::Architectures": architecture,
        "APT::Install-Recommends": "false",
        # Debian's packages may be fetched by a user of their own, who has no access here.
        "APT::Sandbox::User": "root",
        "Dir::State": apt,
        "Dir::State::status": apt / "status",
        "Dir::State::lists": apt / "lists",
        "Dir::Cache": apt,
        "Dir::Cache::archives": apt / "archives",
    }
    command = ["apt-get", "--quiet", *(part for key, value in options.items() for part in ("-o", f"{key}={value}"))]
    # A source that does not answer need not be the one that has them.
    updated = _run([*command, "update"])
    done = _run([*command, "install", "--assume-yes", "--download-only", *names])
    if done.returncode:
        reason = _last_line(updated if updated.returncode else done)
        raise MissingError(f"apt-get has no {' and '.join(names)} for {architecture}: {reason}")
    partial = folder.with_suffix(".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    for archive in sorted((apt / "archives").glob("*.deb")):
        _run(["dpkg", "--extract", str(archive), str(partial)]).check_returncode()
    shutil.rmtree(apt)
    partial.rename(folder)


def install(folder: Path, version: str, machine: str, constraints: str) -> str:
    """Install the wheels that a flight imports, for another Python or machine; return their folder.

    Raises:
        MissingError: pip finds no wheel of a pinned version.
    """
    packages = folder / "packages"
    shutil.rmtree(packages, ignore_errors=True)
    # pip takes wheels of exactly the platforms that are named: glibc 2.17 to that of Debian 12.
    platforms = [f"manylinux_2_{minor}_{machine}" for minor in range(36, 16, -1)] + [f"manylinux2014_{machine}"]
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--quiet"]
    command += ["--target", str(packages), "--only-binary", ":all:", "--python-version", version, "--no-compile"]
    # It would compare what the wheels require with the Python that it runs on; the pins were resolved for the other.
    command += ["--ignore-requires-python"]
    command += [part for name in platforms for part in ("--platform", name)]
    done = _run([*command, "--constraint", str(ROOT / constraints), *PACKAGES])
    if done.returncode:
        raise MissingError(
            f"pip has no wheels for Python {version} on {machine} under {constraints}: {_last_line(done)}"
        )
    return str(packages)


def cross_compile(folder: Path) -> str:
    """Build the library with a core for aarch64, by Debian's cross compiler; return its folder.

    Raises:
        MissingError: There is no such compiler, or it does not compile the core.
    """
    compiler = CACHE / "aarch64-compiler"
    unpack_packages(platform.machine(), compiler, "gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross")
    variables = {
        "CC": f"{compiler}/usr/bin/aarch64-linux-gnu-gcc --sysroot={compiler}",
        "LD_LIBRARY_PATH": str(compiler / "usr/lib" / f"{platform.machine()}-linux-gnu"),
    }
    base, library = folder / "build", folder / "library"
    command = [sys.executable, "setup.py", "--quiet", "build", "--build-base", str(base), "--build-lib", str(library)]
    done = _run(command, cwd=LIBRARY, env=os.environ | variables)
    if done.returncode:
        raise MissingError(f"the core does not compile for aarch64: {(done.stdout + done.stderr).splitlines()[-1]}")
    return str(library)


def prepare(name: str) -> Environment:
    """Return environment ``name``, prepared again if the pins, the library or this program have changed.

    Raises:
        MissingError: Says what is missing for it.
    """
    folder = CACHE / name
    stamp, described = folder / "made-for", folder / "environment.json"
    pins = [(ROOT / lock).read_bytes() for lock in ("constraints.txt", "constraints-jazzy.txt")]
    files = [LIBRARY / "setup.py", *sorted(LIBRARY.glob("hsv/**/*.py")), *sorted(LIBRARY.glob("hsv/**/*.[ch]"))]
    sources = [path.read_bytes() for path in files if path.is_file()]  # not the locks of editors
    key = fingerprint(str(ROOT), sys.version, Path(__file__).read_bytes(), *pins, *sources)
    found = Environment.read(name)
    if found and read_stamp(stamp) == key and shutil.which(found.command[0]):
        return found
    shutil.rmtree(folder, ignore_errors=True)
    environment = ENVIRONMENTS[name](folder)
    folder.mkdir(parents=True, exist_ok=True)
    described.write_text(json.dumps(asdict(environment)) + "\n")
    write_stamp(stamp, key)
    return environment


def _run(command: list[str], **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, **options)


def _last_line(done: subprocess.CompletedProcess[str]) -> str:
    lines = [line for line in (done.stdout + done.stderr).splitlines() if line.startswith(("E:", "ERROR:"))]
    return lines[-1] if lines else f"exit code {done.returncode}"


def main() -> int:
    """Prepare every environment; return 1 if one is missing."""
    code = 0
    for name in ENVIRONMENTS:
        start = time.monotonic()
        try:
            prepare(name)
        except MissingError as missing:
            print(f"make test-portability: {name}: {missing}", file=sys.stderr, flush=True)
            code = 1
        else:
            print(f"{name}: prepared ({time.monotonic() - start:.1f} s)", flush=True)
    return code


if __name__ == "__main__":
    sys.exit(main())
