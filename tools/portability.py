"""Prepare environments with other processors, Pythons and packages, before the tests of "make test-portability".

Each environment has a folder below ``.portability`` with wheels at their pinned versions. For aarch64, Debian's Python
and a cross compiler for the core are unpacked there but not installed: nothing outside the checkout changes. An
environment that cannot be prepared is reported in one line; the tests use the others.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CACHE = ROOT / ".portability"
PACKAGES = ("cffi", "numpy", "pint", "pydantic", "pyyaml", "scipy", "tomli-w")
"""Packages that a simulated flight imports."""
LIBRARY = ROOT / "src" / "hsv"
"""Folder of the library, with the core that the set-up compiled for this machine."""


class MissingError(Exception):
    """An environment cannot be prepared; the message states in one line what is missing."""


@dataclass(frozen=True)
class Environment:
    """A Python that can simulate flights: its start command, and its folders of packages in the form of PYTHONPATH."""

    command: list[str]
    packages: str
    library: str = str(LIBRARY)
    """Folder of the library, with a core compiled for the processor."""

    @classmethod
    def read(cls, name: str) -> Environment | None:
        """Return a prepared environment, or None if there is none."""
        path = CACHE / name / "environment.json"
        return cls(**json.loads(path.read_text())) if path.is_file() else None


def own() -> Environment:
    """Return the environment of the project: the interpreter that its virtual environment uses, and its packages."""
    folders = [entry for entry in sys.path if entry.endswith(("site-packages", "dist-packages"))]
    return Environment([os.path.realpath(sys.executable)], os.pathsep.join(folders))


def nehalem(folder: Path) -> Environment:
    """Return the environment of the project on an emulated x86-64 processor without AVX and FMA."""
    if platform.machine() != "x86_64":
        raise MissingError(f"this machine is {platform.machine()}, expected x86_64: its programs run on no Nehalem")
    return Environment([emulator("x86_64"), "-cpu", "Nehalem", *own().command], own().packages)


def aarch64(folder: Path) -> Environment:
    """Return an emulated aarch64 environment: Debian's Python of the project's version, pinned wheels, and a core."""
    version = f"3.{sys.version_info.minor}"
    root = unpack("aarch64", "aarch64-root", f"python{version}", "libstdc++6")
    command = [emulator("aarch64"), "-L", str(root), str(root / "usr/bin" / f"python{version}")]
    compiler = unpack(platform.machine(), "aarch64-compiler", "gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross")
    variables = {
        "CC": f"{compiler}/usr/bin/aarch64-linux-gnu-gcc --sysroot={compiler}",
        "LD_LIBRARY_PATH": str(compiler / "usr/lib" / f"{platform.machine()}-linux-gnu"),
    }
    library = compiled(folder, variables)
    return Environment(command, install(folder, version, "aarch64", "constraints.txt"), library)


def zig(folder: Path) -> Environment:
    """Return the environment of the project with a core that zig cc, clang with LLVM's run-time library, compiled."""
    version = f"3.{sys.version_info.minor}"
    compiler = install(folder, version, platform.machine(), "constraints.txt", "ziglang")
    variables = {"CC": f"{compiler}/ziglang/zig cc", "ZIG_GLOBAL_CACHE_DIR": str(folder / "cache")}
    return Environment(own().command, own().packages, compiled(folder, variables))


def compiled(folder: Path, variables: dict[str, str]) -> str:
    """Compile the library with other environment ``variables``; return its folder."""
    library = folder / "library"
    build = [sys.executable, "setup.py", "--quiet", "build", f"--build-base={folder / 'build'}"]
    run("the core does not compile", [*build, f"--build-lib={library}"], cwd=LIBRARY, variables=variables)
    return str(library)


def python_3_12(folder: Path, pins: str = "constraints.txt") -> Environment:
    """Return an environment with a Python 3.12 of this machine and wheels pinned by the file ``pins``."""
    return Environment([python312()], install(folder, "3.12", platform.machine(), pins))


ENVIRONMENTS: dict[str, Callable[[Path], Environment]] = {
    "nehalem": nehalem,
    "aarch64": aarch64,
    "zig": zig,
    "python-3.12": python_3_12,
    "numpy-1.26": lambda folder: python_3_12(folder, "constraints-jazzy.txt"),
}


def run(failure: str, command: list[str], cwd: Path = ROOT, variables: dict[str, str] | None = None) -> str:
    """Run a command and return its standard output.

    Raises:
        MissingError: The command fails; the message is ``failure`` with the last error line of the output.
    """
    env = os.environ | (variables or {})
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    if done.returncode:
        lines = (done.stdout + done.stderr).strip().splitlines() or [f"exit code {done.returncode}"]
        errors = [line for line in lines if line.startswith(("E:", "ERROR:"))]
        raise MissingError(f"{failure}: {(errors or lines)[-1]}")
    return done.stdout


def python312() -> str:
    """Return the path of a Python 3.12 of this machine, found on the PATH or in the folders of pyenv and uv."""
    places = (".pyenv/versions/3.12*/bin/python3.12", ".local/share/uv/python/*/bin/python3.12")
    known = sorted(str(path) for place in places for path in Path.home().glob(place))
    for command in filter(shutil.which, (sys.executable, "python3.12", *known)):
        probe = "import os, sys; print(os.path.realpath(sys.executable) if sys.version_info[:2] == (3, 12) else '')"
        # A shim of pyenv may exist without its version.
        if path := subprocess.run([command, "-c", probe], capture_output=True, text=True).stdout.strip():
            return path
    raise MissingError("no Python 3.12 on the PATH, in ~/.pyenv/versions or ~/.local/share/uv/python")


def emulator(machine: str) -> str:
    """Return the path of the QEMU emulator for ``machine``: the installed one, or Debian's, unpacked."""
    found = shutil.which(f"qemu-{machine}") or shutil.which(f"qemu-{machine}-static")
    return found or str(unpack(platform.machine(), "qemu", "qemu-user-static") / f"usr/bin/qemu-{machine}-static")


def unpack(machine: str, name: str, *packages: str) -> Path:
    """Unpack Debian packages for ``machine`` and their dependencies into the folder ``name`` of the cache; return it.

    The package sources and keys of the system are used with separate lists and archives: nothing is installed.
    """
    folder, architecture = CACHE / name, {"x86_64": "amd64", "aarch64": "arm64"}[machine]
    if folder.is_dir():
        return folder
    if not all(map(shutil.which, ("apt-get", "dpkg"))):
        raise MissingError(f"no {' and '.join(packages)} for {machine}: expected a system with apt-get and dpkg")
    apt = CACHE / f"apt-{architecture}"
    for part in ("lists/partial", "archives/partial"):
        (apt / part).mkdir(parents=True, exist_ok=True)
    (apt / "status").touch()
    options = [f"APT::Architecture={architecture}", f"APT::Architectures={architecture}", "APT::Sandbox::User=root"]
    options += ["APT::Install-Recommends=false", f"Dir::State={apt}", f"Dir::State::status={apt}/status"]
    options += [f"Dir::Cache={apt}", f"Dir::State::lists={apt}/lists", f"Dir::Cache::archives={apt}/archives"]
    command = ["apt-get", "--quiet", *(word for option in options for word in ("-o", option))]
    # Errors are ignored: a source that does not answer may not be needed.
    subprocess.run([*command, "update"], capture_output=True)
    failure = f"apt-get has no {' and '.join(packages)} for {architecture}"
    run(failure, [*command, "install", "--assume-yes", "--download-only", *packages])
    partial = folder.with_suffix(".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    for archive in sorted((apt / "archives").glob("*.deb")):
        run("a package cannot be unpacked", ["dpkg", "--extract", str(archive), str(partial)])
    shutil.rmtree(apt)
    return partial.rename(folder)


def install(folder: Path, version: str, machine: str, constraints: str, *names: str) -> str:
    """Install wheels for a Python version and machine, by default of :data:`PACKAGES`; return their folder."""
    packages = folder / "packages"
    # pip takes wheels of exactly the named platforms, here from glibc 2.12 to the 2.36 of Debian 12.
    platforms = [f"--platform=manylinux_2_{minor}_{machine}" for minor in range(36, 11, -1)]
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--quiet"]
    command += ["--target", str(packages), "--only-binary=:all:", f"--python-version={version}", "--no-compile"]
    # pip would check the requirements of the wheels against its own Python; the pins were resolved for the other one.
    command += ["--ignore-requires-python", *platforms, f"--platform=manylinux2014_{machine}"]
    failure = f"pip has no wheels for Python {version} on {machine} under {constraints}"
    run(failure, [*command, "--constraint", constraints, *(names or PACKAGES)])
    return str(packages)


def main() -> int:
    """Prepare every environment anew; return the exit code, 1 if an environment cannot be prepared."""
    code = 0
    for name, prepare in ENVIRONMENTS.items():
        shutil.rmtree(folder := CACHE / name, ignore_errors=True)
        try:
            environment = prepare(folder)
        except MissingError as missing:
            print(f"make test-portability: {name}: {missing}", file=sys.stderr, flush=True)
            code = 1
            continue
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "environment.json").write_text(json.dumps(asdict(environment)) + "\n")
        print(f"{name}: prepared", flush=True)
    return code


if __name__ == "__main__":
    sys.exit(main())
