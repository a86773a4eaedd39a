"""Pages of the documentation that are made when it is built: the reference, and files of the repository."""

from __future__ import annotations

import os
import pkgutil
import re
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS, MESSAGES = ROOT / "docs", ROOT / "ros_ws" / "src" / "hsv_msgs"
_INCLUDE = re.compile(r"```\{include\} (\S+)\n```\n")
_LINK = re.compile(r"\]\(([^()\s#]+)")
_WHOLE_LINK = re.compile(r"\[([^\[\]]+)\]\(([^()\s#]+)\)")


def commands() -> str:
    """Return all commands and their options in Markdown, written by typer from what their ``--help`` prints."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "command_line.py")
        program.write_text(
            "from hsv.cli.entry import COMMANDS\nfrom hsv.cli.main import application\n\napp = application(COMMANDS)\n"
        )
        words = ["-m", "typer", str(program), "utils", "docs", "--name", "hsv"]
        text = subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True).stdout
    # Lists of commands have the beginnings of sentences alone, which stand whole under each command.
    text = re.sub(r"^\*\*Commands\*\*:\n\n(\* .*\n)+\n?", "", text, flags=re.MULTILINE)
    return re.sub(r"^# `hsv`$", "## `hsv`", text, flags=re.MULTILINE)


def messages() -> str:
    """Return the definitions of all our messages and services in Markdown, comments included."""
    text = []
    for kind, title in (("msg", "Messages"), ("srv", "Services")):
        text.append(f"## {title}\n")
        for file in sorted((MESSAGES / kind).glob(f"*.{kind}")):
            text.append(f"### {file.stem}\n\n```text\n{file.read_text(encoding='utf-8')}```\n")
    return "\n".join(text)


def modules_of(package: str) -> list[str]:
    """Return the names of all modules of ``package``, of its packages too; of a module, none."""
    paths = getattr(import_module(package), "__path__", ())
    return sorted(module.name for module in pkgutil.walk_packages(paths, f"{package}."))


def included() -> dict[Path, str]:
    """Return the pages that only include a file of the repository, by that file and by the folder of a README."""
    found = {}
    for page in DOCS.rglob("*.md"):
        if match := _INCLUDE.fullmatch(page.read_text(encoding="utf-8")):
            file = (page.parent / match[1]).resolve()
            for path in (file, *([file.parent] if file.name == "README.md" else [])):
                found[path] = page.relative_to(DOCS).with_suffix("").as_posix()
    return found


def text_of(page: str, source: str, files: dict[Path, str]) -> str:
    """Return the text of a page with links as the site has them, where a folder or text without a page is no link.

    Args:
        page: Name of the page, from the folder of the documentation, without suffix.
        source: Text of the page's file, or the inclusion of another file as its only line.
        files: Pages by file, see :func:`included`.
    """
    file = DOCS / f"{page}.md"
    if match := _INCLUDE.fullmatch(source):
        file = (file.parent / match[1]).resolve()
        source = file.read_text(encoding="utf-8")

    def link(match: re.Match[str]) -> str:
        target = (file.parent / match[1]).resolve()
        if not target.exists():
            return match[0]  # an address, or no link at all
        place = DOCS / f"{files[target]}.md" if target in files else target
        return "](" + Path(os.path.relpath(place, (DOCS / page).parent)).as_posix()

    def without_page(match: re.Match[str]) -> str:
        target = (file.parent / match[2]).resolve()
        elsewhere = target.is_dir() or (target.suffix == ".md" and not target.is_relative_to(DOCS))
        return match[1] if elsewhere and target not in files else match[0]

    return _LINK.sub(link, _WHOLE_LINK.sub(without_page, source))
