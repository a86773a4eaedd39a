"""The set-up of the bench, run by "make setup". It needs Python 3.11 or 3.12; an error message lists what is missing.

It creates .venv with the pinned packages, with ROS 2 Jazzy if none is sourced, and builds the packages with colcon.
Each completed step writes a stamp file with its inputs, and is skipped as long as these are unchanged.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import time
from importlib.metadata import Distribution
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
PYTHON = str(VENV / "bin" / "python3")
BASE = os.path.realpath(sys.executable)
BUILD, INSTALL, LOG = (ROOT / "ros_ws" / name for name in ("build", "install", "log"))

# For each source of ROS: the file of pinned versions, and the files of requirements, those of the build first.
ROUTES = {
    "wheels": ("constraints.txt", ["requirements-ros.txt", "requirements.txt", "requirements-test.txt"]),
    "jazzy": ("constraints-jazzy.txt", ["requirements.txt", "requirements-test.txt"]),
}
SEARCHED = ["AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "COLCON_PREFIX_PATH", "LD_LIBRARY_PATH", "PYTHONPATH"]
DROPPED = ["VIRTUAL_ENV", "HSV_ROOT", "PYTHONHOME", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "PIP_TARGET"]
DROPPED += ["PIP_USER", "PIP_PREFIX", "PIP_REQUIRE_VIRTUALENV"]
COLCON = "import sys; from colcon_core.command import main; sys.argv[0] = 'colcon'; sys.exit(main())"


class SetupError(Exception):
    """The set-up cannot continue; the message is for the user."""


def clean_environment(route: str) -> dict[str, str]:
    """Return the environment variables without those of a sourced env.sh and of pip's settings for other folders."""
    dropped = DROPPED + SEARCHED if route == "wheels" else DROPPED  # the wheels alone supply ROS packages
    env = {name: value for name, value in os.environ.items() if name not in dropped}
    for name in {"PATH", *SEARCHED} & {*env}:
        env[name] = ":".join(entry for entry in env[name].split(":") if not f"{entry}/".startswith(f"{ROOT}/"))
    return env


def sourced_distribution() -> str:
    """Return the sourced ROS distribution, or ``wheels``: official images set ROS_DISTRO without sourcing anything."""
    env = clean_environment("jazzy")
    return (env.get("AMENT_PREFIX_PATH") and env.get("ROS_DISTRO")) or "wheels"


def missing(route: str, env: dict[str, str]) -> dict[str, str]:
    """Return what the machine lacks, each with the Debian package that provides it, or "" if there is none."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    if version not in ("3.11", "3.12"):
        return {f"Python 3.11 or 3.12 (this is {version}; make setup PYTHON=/path/to/python3 names another)": "python3"}
    found = {}
    if re.search(r"""[\s:;"'$\\]""", str(ROOT)) or not str(ROOT).isascii():
        found[f"a path of ASCII letters, without blanks and : ; \" ' $ \\, for colcon and CMake ({ROOT})"] = ""
    if route == "wheels" and platform.machine() != "x86_64":
        found[f"x86_64, for the ROS 2 wheels (this is {platform.machine()}; source a ROS 2 Jazzy first)"] = ""
    if route == "jazzy" and not (find_spec("rclpy") and find_spec("colcon_core")):
        found[f"rclpy and colcon in {BASE}"] = "ros-jazzy-ros-base ros-dev-tools"
    if not (find_spec("venv") and find_spec("ensurepip")):
        found["Python's venv"] = f"python{version}-venv"
    if not Path(sysconfig.get_path("include"), "Python.h").exists():
        found["Python's header files"] = f"python{version}-dev"
    for program in (env.get("CC", "gcc"), env.get("CXX", "g++")):
        if not shutil.which(program, path=env["PATH"]):
            found[f"a compiler ({program})"] = "g++"
    answer = subprocess.run("cmake --version", shell=True, env=env, capture_output=True, text=True).stdout
    if [int(number) for number in re.findall(r"\d+", answer)[:2]] < [3, 20]:
        found["cmake 3.20 or newer"] = "cmake"
    return found


def read(stamp: Path) -> str:
    """Return the text of a stamp file, or "" if there is none."""
    return stamp.read_text() if stamp.is_file() else ""


class Step:
    """A running command whose output goes to a log file; its start and its duration are printed."""

    def __init__(self, title: str, command: list[str], env: dict[str, str]) -> None:
        print(f"{title} ...", flush=True)
        self._title, self._start = title, time.monotonic()
        self._log = LOG / f"setup-{title.split()[0].lower()}.log"
        LOG.mkdir(parents=True, exist_ok=True)
        with self._log.open("w") as out:
            # The command inherits the lock of the checkout: the next set-up waits even if only the command still runs.
            self._process = subprocess.Popen(command, cwd=ROOT, env=env, stdout=out, stderr=out, close_fds=False)

    def end(self) -> None:
        """Wait for the command; if it fails, raise SetupError with the last line of its output."""
        if self._process.wait():
            last = [line.strip() for line in self._log.read_text().splitlines() if line.strip()][-1:]
            raise SetupError(f"{self._title} failed: {''.join(last)} (more in {self._log.relative_to(ROOT)})")
        print(f"{self._title}: done ({time.monotonic() - self._start:.1f} s)", flush=True)


def make_environment(route: str, env: dict[str, str]) -> None:
    """Create the virtual environment anew; for ROS as wheels, also install uv and a ros2 command."""
    options = ["--clear", *(["--system-site-packages"] if route == "jazzy" else [])]
    Step("Environment", [BASE, "-m", "venv", *options, str(VENV)], env).end()
    if route == "wheels":
        # uv ignores the index in pip's settings. empy is built from source and needs the pinned setuptools first.
        settings = subprocess.run([PYTHON, "-m", "pip", "config", "list"], env=env, capture_output=True, text=True)
        wanted = ["setuptools"] if re.search(r"\.(index-url|no-index)=", settings.stdout) else ["setuptools", "uv"]
        Step("Installer", [PYTHON, "-m", "pip", "install", "--constraint", ROUTES[route][0], *wanted], env).end()
        (program := VENV / "bin" / "ros2").write_text(f'#!/bin/sh\nexec {PYTHON} -S {ROOT}/tools/ros2.py "$@"\n')
        program.chmod(0o755)


def install(title: str, route: str, files: list[str], env: dict[str, str]) -> None:
    """Install the requirements in ``files`` with uv, or with pip if uv is missing or fails."""
    wanted = [f"--constraint={ROUTES[route][0]}", "--no-build-isolation", *(f"--requirement={name}" for name in files)]
    try:
        if (uv := VENV / "bin" / "uv").exists():
            return Step(title, [str(uv), "pip", "install", "--python", PYTHON, "--system-certs", *wanted], env).end()
    except SetupError as error:
        print(f"{error}; pip installs them instead", flush=True)
    Step(f"{title}, by pip", [PYTHON, "-m", "pip", "install", "--use-pep517", *wanted], env).end()


def relocate() -> None:
    """Replace the prefix of the Python with which ROS wheels, if any, were built, in CMake files and ament index."""
    share = VENV / "share"
    for path in [*share.glob("*/cmake/*.cmake"), *share.glob("ament_index/resource_index/parent_prefix_path/*")]:
        before = path.read_text()
        headers = re.sub(r"/opt/python/cp3\d+-cp3\d+/include/python3\.\d+", sysconfig.get_path("include"), before)
        after = re.sub(r"/opt/python/cp3\d+-cp3\d+", str(VENV), headers)
        if after != before:
            path.unlink()  # the file may be a link into uv's cache
            path.write_text(after)


def package_key(folder: Path, identity: str, pins: str) -> str:
    """Return a hash of a build's inputs; for a Python package: setup.py, C sources and the names of its data files."""
    is_python = (folder / "setup.py").exists()
    parts = [identity, *([] if is_python else re.findall(r"(?m)^(?:ros-|numpy=).*", pins))]
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder)
        if re.search(r"(^|/)(\.|build/)|__pycache__|\.egg-info|\.so$", str(name)):
            continue
        matters = not is_python or len(name.parts) == 1 or path.suffix in (".c", ".h") or path.name == "build.py"
        if matters or name.parts[0] != folder.name:
            parts += [str(name), str(path.read_bytes()) if matters else ""]
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def build(route: str, names: list[str], env: dict[str, str]) -> Step:
    """Remove the builds of the packages, which may contain products of deleted files, and start colcon on them."""
    for path in (base / name for base in (BUILD, INSTALL) for name in names):
        shutil.rmtree(path, ignore_errors=True)
    # The number of jobs is set here: colcon's default also limits the load, which is very slow on a busy machine.
    env = {**env, "PATH": f"{VENV}/bin:{env['PATH']}", "MAKEFLAGS": f"-j{min(os.cpu_count() or 1, 8)}"}
    env |= {"AMENT_PREFIX_PATH": str(VENV), "CMAKE_PREFIX_PATH": str(VENV)} if route == "wheels" else {}
    command = [PYTHON, "-c", COLCON, "--log-base", str(LOG), "build", "--symlink-install", "--packages-select", *names]
    command += ["--base-paths", "src", "ros_ws/src", "--build-base", str(BUILD), "--install-base", str(INSTALL)]
    # All files of messages are generated; linking them would take longer than copying.
    command += ["--ament-cmake-args", "-DAMENT_CMAKE_SYMLINK_INSTALL=OFF", "--cmake-args", "-DBUILD_TESTING=OFF"]
    command += ["-DCMAKE_BUILD_TYPE=Release", f"-DPython3_EXECUTABLE={PYTHON}"]
    command += ["-DCPP_MESSAGES=OFF"] if route == "wheels" else []  # the wheels have no rclcpp
    return Step(f"Workspace ({', '.join(names)})", command, env)


def simplify_scripts(name: str) -> None:
    """Write the scripts of a Python package as pip does: those of "setup.py develop" first search all metadata."""
    for info in (BUILD / name).glob("*.egg-info"):
        for entry in Distribution.at(info).entry_points.select(group="console_scripts"):
            # Ctrl-C would print a traceback while Python starts, so it is blocked until hsv.cli.entry unblocks it.
            blocked = "/usr/bin/env -S --block-signal=INT " if entry.module == "hsv.cli.entry" else ""
            # Spawned processes import the script as a module.
            text = f"#!{blocked}{PYTHON}\nimport sys\n\nfrom {entry.module} import {entry.attr}\n\n"
            text += f'if __name__ == "__main__":\n    sys.exit({entry.attr}())\n'
            for script in (INSTALL / name / "bin" / entry.name, INSTALL / name / "lib" / name / entry.name):
                if script.is_file() and "EASY-INSTALL" in script.read_text():
                    script.write_text(text)


def set_up(route: str, env: dict[str, str]) -> None:
    """Run every step of the set-up that is not complete."""
    constraints, files = ROUTES[route]
    pins = (ROOT / constraints).read_text()
    identity = f"{route} {BASE} {sys.version} {ROOT}"  # env.sh reads the route
    contents = "\n".join([identity, pins, *(re.sub(r"\s*#.*", "", (ROOT / name).read_text()) for name in files)])
    installed = read(VENV / "hsv-setup") == contents
    folders = [path.parent for base in ("src", "ros_ws/src") for path in (ROOT / base).glob("*/package.xml")]
    prefixes = filter(None, env.get("AMENT_PREFIX_PATH", "").split(":"))
    if any(Path(prefix, "share/simulation_interfaces").is_dir() for prefix in prefixes):
        folders = [folder for folder in folders if folder.name != "simulation_interfaces"]  # ROS has the full package
    keys = {folder.name: package_key(folder, identity, pins) for folder in sorted(folders)}
    outdated = [name for name, key in keys.items() if read(INSTALL / name / "hsv-setup") != key]
    if (outdated or not installed) and (lacking := missing(route, env)):
        packages = " ".join(dict.fromkeys(filter(None, lacking.values())))
        raise SetupError(f"missing: {', '.join(lacking)}" + (f": sudo apt-get install {packages}" if packages else ""))
    if not installed:
        make_environment(route, env)
        install("Packages for the build", route, files[:1], env)
        relocate()
    for gone in {path.parent for path in INSTALL.glob("*/hsv-setup")} - {INSTALL / name for name in keys}:
        shutil.rmtree(gone)
    building = build(route, outdated, env) if outdated else None
    try:
        if not installed:
            install("Other packages", route, files[1:], env)
            (VENV / "hsv-setup").write_text(contents)
        if building:
            building.end()
    finally:
        for name in outdated:
            if read(BUILD / name / "colcon_build.rc").strip() == "0":
                simplify_scripts(name)
                (INSTALL / name / "hsv-setup").write_text(keys[name])


def main() -> int:
    """Set the bench up, with a lock against a second set-up of this checkout; return the exit code."""
    start, route = time.monotonic(), sourced_distribution()
    if sys.prefix != sys.base_prefix:  # this interpreter is that of a virtual environment
        os.execve(BASE, [BASE, *sys.argv], clean_environment(route))
    if route not in ROUTES:
        sys.exit(f"make setup: ROS_DISTRO={route} is sourced, expected jazzy or no ROS in this shell")
    lock = os.open(ROOT, os.O_RDONLY)
    os.set_inheritable(lock, True)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print("waiting for another set-up of this checkout ...", flush=True)
            fcntl.flock(lock, fcntl.LOCK_EX)
        set_up(route, clean_environment(route))
    except SetupError as error:
        sys.exit(f"make setup: {error}")
    except KeyboardInterrupt:
        print("\nmake setup: interrupted; run it again to go on", file=sys.stderr)
        return 130
    print(f"Set up ({time.monotonic() - start:.1f} s). To use it in this shell: source env.sh")
    return 0


if __name__ == "__main__":
    sys.exit(main())
