"""Blocks of code on pages of the documentation: fenced ones, and indented ones as most pages have them."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]

PAGES = sorted(
    subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
)
"""All pages of the repository, from its root."""

_FENCED = re.compile(r"^```(\S*)[^\n]*\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_INDENTED = re.compile(r"(?:^    .*\n)(?:^    .*\n|^\n(?=    ))*", re.MULTILINE)
_FILE = re.compile(r"# (\S+\.(?:toml|py))\n")


class Block(NamedTuple):
    """A block: its language, empty if none is named, and what it holds."""

    language: str
    text: str

    @property
    def first_line(self):
        """Its first line, without a remark behind ``#``."""
        return re.sub(r"\s+#\s.*$", "", self.text.partition("\n")[0])

    @property
    def file(self):
        """Name of the file that the page tells to save it as: that in its first line."""
        return match[1] if (match := _FILE.match(self.text)) else None


def blocks(page, language=""):
    """Return the fenced blocks of a page, in order, all or those of one language."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return [found for found in map(Block._make, _FENCED.findall(text)) if language in ("", found.language)]


def indented(page):
    """Return the indented blocks of a page, in order, without their indentation."""
    text = _FENCED.sub("", (ROOT / page).read_text(encoding="utf-8"))
    return [Block("", re.sub("^    ", "", match[0], flags=re.MULTILINE)) for match in _INDENTED.finditer(text)]
