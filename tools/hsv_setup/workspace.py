"""The stage that builds the packages of src/ and ros_ws/src with colcon, those that need it only.

Packages are built with --symlink-install: a changed Python module is live at once. What needs a build is a changed
interface, CMakeLists.txt, package.xml, setup.py or setup.cfg, a changed source or header in C, or a file that was added
or removed outside the Python modules (launch files and other data are linked one by one).
"""

from __future__ import annotations

import configparser
import os
import shutil
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from hsv_setup.console import SetupError, Stage
from hsv_setup.environment import PYTHON
from hsv_setup.paths import BUILD, INSTALL, LOG, ROOT, VENV, fingerprint, read_stamp, write_stamp
from hsv_setup.routes import Route

BASE_PATHS = ("src", "ros_ws/src")
# Read from the sources at build time; everything else of a Python package is a link to the source.
_READ = ("package.xml", "setup.py", "setup.cfg", "core/build.py", "*.c", "*.h")
# Generated code is compiled against these.
_BINARY_INTERFACE = ("ros-", "numpy=")
_JOBS_AT_MOST = 8
_MADE = ("__pycache__", ".egg-info", "build")
_COLCON = "import sys; from colcon_core.command import main; sys.argv[0] = 'colcon'; sys.exit(main())"


@dataclass(frozen=True)
class Package:
    """A package of the workspace."""

    name: str
    path: Path
    is_python: bool

    @property
    def stamp(self) -> Path:
        """The file that says what the package was last built from."""
        return BUILD / self.name / "hsv-setup"

    @property
    def exit_code(self) -> Path:
        """The file in which colcon leaves the exit code of the package's last build."""
        return BUILD / self.name / "colcon_build.rc"

    def key(self, route: Route) -> str:
        """Return a fingerprint of everything that makes a build necessary."""
        parts: list[str | bytes] = [route.name]
        for path in self._files():
            name = path.relative_to(self.path)
            read = not self.is_python or any(map(name.match, _READ))
            if read or name.parts[0] != self.name:
                parts.append(str(name))
            if read:
                parts.append(path.read_bytes())
        if self.is_python:
            parts.append(Path(__file__).read_bytes())  # writes the scripts
        else:
            pins = (ROOT / route.constraints).read_text().splitlines()
            parts += [line for line in pins if line.startswith(_BINARY_INTERFACE)]
        return fingerprint(*parts)

    def _files(self) -> Iterator[Path]:
        for path in sorted(self.path.rglob("*")):
            made = any(part.startswith(".") or part.endswith(_MADE) for part in path.relative_to(self.path).parts)
            if path.is_file() and not made:
                yield path

    def is_current(self, route: Route) -> bool:
        """Return whether the installed package is what the sources would give."""
        installed = INSTALL / self.name / "share" / self.name / "package.xml"
        return installed.exists() and read_stamp(self.stamp) == self.key(route)


def packages() -> list[Package]:
    """Return the packages of the workspace, by name.

    Raises:
        SetupError: a package.xml cannot be read.
    """
    found = []
    for base in BASE_PATHS:
        for manifest in sorted((ROOT / base).glob("*/package.xml")):
            try:
                tree = ElementTree.parse(manifest)
            except ElementTree.ParseError as error:
                raise SetupError(f"{manifest.relative_to(ROOT)}: {error}") from error
            name = tree.findtext("name") or manifest.parent.name
            found.append(Package(name, manifest.parent, tree.findtext("export/build_type") == "ament_python"))
    return sorted(found, key=lambda package: package.name)


def outdated(route: Route) -> list[Package]:
    """Return the packages that have to be built."""
    return [package for package in packages() if not package.is_current(route)]


def removed() -> list[str]:
    """Return the names of installed packages whose sources are gone."""
    names = {package.name for package in packages()}
    markers = INSTALL.glob("*/share/colcon-core/packages/*")
    return sorted(marker.name for marker in markers if marker.name not in names)


@contextmanager
def building(route: Route, wanted: Sequence[Package], env: Mapping[str, str], stage: Stage) -> Iterator[None]:
    """Build packages beside what is done in the block, and take away what removed ones left behind.

    Raises:
        SetupError: colcon failed.
    """
    for name in removed():
        shutil.rmtree(INSTALL / name)
        shutil.rmtree(BUILD / name, ignore_errors=True)
    if not wanted:
        yield
        return
    keys = {package: package.key(route) for package in wanted}
    for package in wanted:
        package.stamp.unlink(missing_ok=True)
        package.exit_code.unlink(missing_ok=True)
        # Neither "develop" nor CMake takes away what was made of files that no longer exist, such as a message.
        shutil.rmtree(BUILD / package.name, ignore_errors=True)
        shutil.rmtree(INSTALL / package.name, ignore_errors=True)
    # Named here, because colcon's own choice also limits by load and crawls on a busy machine.
    jobs = f"-j{min(os.cpu_count() or 1, _JOBS_AT_MOST)}"
    own = {"PATH": f"{PYTHON.parent}{os.pathsep}{env['PATH']}", "MAKEFLAGS": jobs}
    if route.wheels:
        # The virtual environment is the ament prefix under the workspace.
        own.update(AMENT_PREFIX_PATH=str(VENV), CMAKE_PREFIX_PATH=str(VENV))
    command: list[str | Path] = [PYTHON, "-c", _COLCON, "--log-base", LOG, "build", "--symlink-install"]
    command += ["--base-paths", *BASE_PATHS, "--build-base", BUILD, "--install-base", INSTALL]
    command += ["--packages-select", *(package.name for package in wanted)]
    # Of interfaces all is generated; their links would be made by a process each, which takes longer than copies.
    command += ["--ament-cmake-args", "-DAMENT_CMAKE_SYMLINK_INSTALL=OFF"]
    command += ["--cmake-args", "-DCMAKE_BUILD_TYPE=Release", "-DBUILD_TESTING=OFF", f"-DPython3_EXECUTABLE={PYTHON}"]
    try:
        with stage.running(
            command, {**env, **own}, lambda log: f"{log.count('Finished <<<')} of {len(wanted)} packages"
        ):
            yield
    finally:
        for package, key in keys.items():
            _simplify_scripts(package)
            if read_stamp(package.exit_code).strip() == "0":
                write_stamp(package.stamp, key)


def _simplify_scripts(package: Package) -> None:
    """Write the scripts of a Python package as pip writes them.

    Those of "develop" first search the metadata of all packages, which takes longer than Python's own start. The script
    of :mod:`hsv.cli.entry` starts with Ctrl-C held back, which would else be a traceback of Python's own start, and is
    let through as soon as it can be answered.
    """
    entry_points = configparser.ConfigParser(delimiters=("=",))
    entry_points.optionxform = str  # type: ignore[assignment, method-assign]
    entry_points.read(BUILD / package.name / f"{package.name}.egg-info" / "entry_points.txt")
    for name, entry_point in entry_points["console_scripts"].items() if "console_scripts" in entry_points else ():
        module, function = entry_point.split(":")
        held = "/usr/bin/env -S --block-signal=INT " if module == "hsv.cli.entry" else ""
        for folder in ("bin", f"lib/{package.name}"):
            script = INSTALL / package.name / folder / name
            if script.is_file() and "EASY-INSTALL" in script.read_text():
                # Processes that are spawned import the script as a module.
                start = f"#!{held}{PYTHON}\nimport sys\n\nfrom {module} import {function}\n\n"
                script.write_text(f'{start}if __name__ == "__main__":\n    sys.exit({function}())\n')
