"""The part of the `ros2` command that the bench needs where ROS 2 is installed as wheels, which have none.

Packages and executables are found by the rule of the real one: a package is a file
share/ament_index/resource_index/packages/NAME below a prefix in AMENT_PREFIX_PATH, its executables are the executable
files below lib/NAME there. Where a real `ros2` is on PATH, this one hands over to it.
"""

from __future__ import annotations

import argparse
import os
import shlex
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

# Tells the stand-ins of other checkouts on PATH from the real command.
_SIGNATURE = "tools/ros2.py"
_FULL_TOOLS = "needs the full ROS 2 command-line tools (apt package ros-jazzy-ros-base)"


class RefusedError(Exception):
    """The command cannot be carried out; the message is all that is printed."""


def real_command() -> str | None:
    """Return a `ros2` on PATH that is not this replacement, or None."""
    for directory in os.get_exec_path():
        path = Path(directory, "ros2")
        if not os.access(path, os.X_OK) or path.is_dir():
            continue
        with path.open("rb") as file:
            if _SIGNATURE.encode() not in file.read(4096):
                return str(path)
    return None


def prefixes() -> dict[str, Path]:
    """Return the installation prefix of every package in the ament index; the first on the path wins."""
    found: dict[str, Path] = {}
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        index = Path(prefix, "share", "ament_index", "resource_index", "packages")
        if index.is_dir():
            for marker in index.iterdir():
                if not marker.name.startswith("."):
                    found.setdefault(marker.name, Path(prefix))
    return found


def executables(package: str) -> list[Path]:
    """Return the executables of a package, sorted by path.

    Raises:
        RefusedError: there is no such package.
    """
    prefix = prefixes().get(package)
    if prefix is None:
        raise RefusedError(f"Package '{package}' not found")
    return sorted(_executables_below(prefix / "lib" / package))


def _executables_below(folder: Path) -> Iterator[Path]:
    for directory, subdirectories, names in os.walk(folder):
        subdirectories[:] = [name for name in subdirectories if not name.startswith(".")]
        for name in names:
            path = Path(directory, name)
            if os.access(path, os.X_OK):
                yield path


def run(package: str, executable: str, arguments: Sequence[str], prefix: str | None) -> None:
    """Replace this process by the executable, so that signals and the exit code are its own.

    Raises:
        RefusedError: the package or the executable does not exist, or the name is ambiguous.
    """
    paths = [path for path in executables(package) if path.name == executable]
    if not paths:
        raise RefusedError("No executable found")
    if len(paths) > 1:
        raise RefusedError("Multiple executables found:" + "".join(f"\n- {path}" for path in paths))
    command = [*shlex.split(prefix or ""), str(paths[0]), *arguments]
    try:
        os.execvp(command[0], command)
    except OSError as error:
        raise RefusedError(f"{command[0]}: {error.strerror}") from error


def list_executables(package: str | None, full_path: bool) -> None:
    """Print the executables of one package, or of all.

    Raises:
        RefusedError: there is no such package.
    """
    for name in [package] if package else sorted(prefixes()):
        for path in executables(name):
            print(path if full_path else f"{name} {path.name}")


def print_prefix(package: str, share: bool) -> None:
    """Print where a package is installed.

    Raises:
        RefusedError: there is no such package.
    """
    prefix = prefixes().get(package)
    if prefix is None:
        raise RefusedError("Package not found")
    print(prefix / "share" / package if share else prefix)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ros2",
        description="Run the executables of ROS 2 packages. (The wheels bring no ros2 command; this is the bench's.)",
        epilog=f"Example: ros2 run hsv_plant plant. Anything else {_FULL_TOOLS}.",
    )
    commands = parser.add_subparsers(dest="command", metavar="command")
    start = commands.add_parser("run", help="run a package's executable")
    start.add_argument("--prefix", help="command that goes before the executable, e.g. 'gdb -ex run --args'")
    start.add_argument("package_name")
    start.add_argument("executable_name")
    start.add_argument("argv", nargs=argparse.REMAINDER, help="arguments of the executable")

    package = commands.add_parser("pkg", help="list packages and what is in them")
    verbs = package.add_subparsers(dest="verb", metavar="verb", required=True)
    listing = verbs.add_parser("executables", help="list executables")
    listing.add_argument("package_name", nargs="?")
    listing.add_argument("--full-path", action="store_true", help="print whole paths")
    place = verbs.add_parser("prefix", help="print where a package is installed")
    place.add_argument("--share", action="store_true", help="print the share directory of the package")
    place.add_argument("package_name")
    verbs.add_parser("list", help="list all packages")
    return parser


def _asks_for_more(arguments: Sequence[str]) -> str | None:
    """Return the command, as typed, that only the full tools have, or None."""
    words = [word for word in arguments[:2] if not word.startswith("-")]
    if not words or words[0] == "run":
        return None
    if words[0] == "pkg" and (len(words) < 2 or words[1] in ("executables", "prefix", "list")):
        return None
    return "ros2 " + (" ".join(words) if words[0] == "pkg" else words[0])


def main(arguments: Sequence[str]) -> int:
    """Carry out one command line; return the exit code."""
    # A listing cut short by "| head" is no error.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    real = real_command()
    if real is not None:
        os.execv(real, [real, *arguments])
    more = _asks_for_more(arguments)
    if more is not None:
        print(f"{more} {_FULL_TOOLS}", file=sys.stderr)
        return 2
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        if options.command == "run":
            run(options.package_name, options.executable_name, options.argv, options.prefix)
        elif options.command == "pkg" and options.verb == "executables":
            list_executables(options.package_name, options.full_path)
        elif options.command == "pkg" and options.verb == "prefix":
            print_prefix(options.package_name, options.share)
        elif options.command == "pkg":
            print("\n".join(sorted(prefixes())))
        else:
            parser.print_help()
    except RefusedError as refusal:
        print(refusal, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
