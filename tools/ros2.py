"""A small `ros2` command with `run` and `pkg`, for ROS 2 installed as wheels, which contain no `ros2`.

Packages and executables are found as by the real command: a package is a file
share/ament_index/resource_index/packages/NAME below a prefix in AMENT_PREFIX_PATH, and its executables are the
executable files below lib/NAME there. If a real `ros2` is on PATH, this command runs it instead.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

# Text in the replacements of other checkouts on PATH, which distinguishes them from the real command.
_SIGNATURE = "tools/ros2.py"
_FULL_TOOLS = "needs the full ROS 2 command-line tools (apt package ros-jazzy-ros-base)"


def real_command() -> str | None:
    """Return a `ros2` on PATH that is not this replacement, or None."""
    for path in (Path(directory, "ros2") for directory in os.get_exec_path()):
        if path.is_file() and os.access(path, os.X_OK) and _SIGNATURE.encode() not in path.read_bytes()[:4096]:
            return str(path)
    return None


def prefixes() -> dict[str, Path]:
    """Return the installation prefix of every package in the ament index; the first on the path wins."""
    found: dict[str, Path] = {}
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        for marker in Path(prefix).glob("share/ament_index/resource_index/packages/[!.]*"):
            found.setdefault(marker.name, Path(prefix))
    return found


def executables(package: str) -> list[Path]:
    """Return the executables of a package, sorted by path; exit with a message if there is no such package."""
    if package not in (known := prefixes()):
        sys.exit(f"Package '{package}' not found")
    found = []
    for directory, subdirectories, names in os.walk(known[package] / "lib" / package):
        subdirectories[:] = [name for name in subdirectories if not name.startswith(".")]
        found += [path for path in (Path(directory, name) for name in names) if os.access(path, os.X_OK)]
    return sorted(found)


def run(options: argparse.Namespace) -> None:
    """Replace this process by the executable, which then receives the signals and sets the exit code."""
    paths = [path for path in executables(options.package_name) if path.name == options.executable_name]
    if not paths:
        sys.exit("No executable found")
    if len(paths) > 1:
        sys.exit("Multiple executables found:" + "".join(f"\n- {path}" for path in paths))
    try:
        os.execv(paths[0], [str(paths[0]), *options.argv])
    except OSError as error:
        sys.exit(f"{paths[0]}: {error.strerror}")


def list_packages(options: argparse.Namespace) -> None:
    """Print all packages."""
    print("\n".join(sorted(prefixes())))


def list_executables(options: argparse.Namespace) -> None:
    """Print the executables of one package, or of all."""
    for name in [options.package_name] if options.package_name else sorted(prefixes()):
        for path in executables(name):
            print(f"{name} {path.name}")


def print_prefix(options: argparse.Namespace) -> None:
    """Print the installation prefix of a package, or its share directory."""
    if (prefix := prefixes().get(options.package_name)) is None:
        sys.exit("Package not found")
    print(prefix / "share" / options.package_name if options.share else prefix)


def main(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    # A reader that closes the pipe early, such as "| head", is no error.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    if real := real_command():
        os.execv(real, [real, *arguments])
    parser = argparse.ArgumentParser(
        prog="ros2",
        description="Run the executables of ROS 2 packages. (The wheels bring no ros2 command; this is the bench's.)",
        epilog=f"Example: ros2 run hsv_plant plant. Anything else {_FULL_TOOLS}.",
    )
    parser.set_defaults(carry_out=lambda options: parser.print_help())
    commands = parser.add_subparsers(metavar="command")
    start = commands.add_parser("run", help="run a package's executable")
    start.add_argument("package_name")
    start.add_argument("executable_name")
    start.add_argument("argv", nargs=argparse.REMAINDER, help="arguments of the executable")
    start.set_defaults(carry_out=run)
    verbs = commands.add_parser("pkg", help="list packages and what is in them").add_subparsers(required=True)
    verbs.add_parser("list", help="list all packages").set_defaults(carry_out=list_packages)
    listing = verbs.add_parser("executables", help="list executables")
    listing.add_argument("package_name", nargs="?")
    listing.set_defaults(carry_out=list_executables)
    place = verbs.add_parser("prefix", help="print where a package is installed")
    place.add_argument("--share", action="store_true", help="print the share directory of the package")
    place.add_argument("package_name")
    place.set_defaults(carry_out=print_prefix)
    words = [word for word in arguments[:2] if not word.startswith("-")]
    if (words and words[0] not in commands.choices) or (words[:1] == ["pkg"] and {*words[1:]} - verbs.choices.keys()):
        print(f"ros2 {' '.join(words if words[0] == 'pkg' else words[:1])} {_FULL_TOOLS}", file=sys.stderr)
        return 2
    options = parser.parse_args(arguments)
    options.carry_out(options)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
