"""The commands printed in the documentation: lines of indented blocks, and inline code that is a complete command."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROGRAMS = ("cd", "fastdds", "hsv", "hsv-paper", "make", "mkdir", "plotjuggler", "python3", "ros2", "source", "sudo")
_BLOCK = re.compile(r"^    (\S.*)$", re.MULTILINE)
_SPAN = re.compile(r"`([^`\n]+)`")
_PLACEHOLDER = re.compile(r"\b(?!UTC)[A-Z]{3,}\b|\.\.\.$")
"""A placeholder, which makes a line a syntax description instead of a command."""


def printed(page):
    """Return the distinct commands of a page in order, without comments that begin with ``#``."""
    text = re.sub(r"^```.*?^```", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    found = [(match.start(), _without_remark(match.group(1))) for match in _BLOCK.finditer(text)]
    # The mere name of a command, such as `hsv run`, does not count.
    spans = [match for match in _SPAN.finditer(text) if not _PLACEHOLDER.search(match.group(1))]
    found += [(match.start(), match.group(1)) for match in spans if _whole(match.group(1).split())]
    commands = [command for _, command in sorted(found) if _program(command) in PROGRAMS]
    return list(dict.fromkeys(commands))


def the_printed(page, beginning):
    """Return the one command of ``page`` with this ``beginning``."""
    [command] = [command for command in printed(page) if command.startswith(beginning)]
    return command


def _whole(words):
    return len(words) > (3 if words[0] == "ros2" else 2) and not words[2].startswith("-")


def _without_remark(line):
    return re.sub(r"\s+#\s.*$", "", line)


def _program(command):
    whole = command.count("'") % 2 == 0 and not command.endswith("\\")  # else it continues in the next line
    words = shlex.split(command, comments=False) if whole else command.split()
    while words and re.fullmatch(r"[A-Z_]+=\S*", words[0]):
        words.pop(0)
    return words[0] if words else ""
