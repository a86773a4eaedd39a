"""Pages of the documentation that are files of the repository, and links that hold in both."""

from __future__ import annotations

import os
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
_INCLUDE = re.compile(r"```\{include\} (\S+)\n```\n")
_LINK = re.compile(r"\]\(([^()\s#]+)")
_WHOLE_LINK = re.compile(r"\[([^\[\]]+)\]\(([^()\s#]+)\)")


def included() -> dict[Path, str]:
    """Return the files of the repository that are pages, with the names of the pages: those that hold nothing else."""
    found = {}
    for page in DOCS.rglob("*.md"):
        if match := _INCLUDE.fullmatch(page.read_text(encoding="utf-8")):
            found[(page.parent / match[1]).resolve()] = page.relative_to(DOCS).with_suffix("").as_posix()
    return found


def text_of(page: str, source: str, files: dict[Path, str]) -> str:
    """Return the text of a page with links as the site has them, where a folder or text without a page is no link.

    Args:
        page: Its name, from the folder of the documentation, without suffix.
        source: What its file holds; the text is that of the file it includes, if it holds nothing else.
        files: What :func:`included` has found.
    """
    file = DOCS / f"{page}.md"
    if match := _INCLUDE.fullmatch(source):
        file = (file.parent / match[1]).resolve()
        source = file.read_text(encoding="utf-8")

    def page_file(target: Path) -> Path:
        return target / "README.md" if target.is_dir() else target

    def link(match: re.Match[str]) -> str:
        target = (file.parent / match[1]).resolve()
        if not target.exists():
            return match[0]  # an address, or no link at all
        known = page_file(target)
        place = DOCS / f"{files[known]}.md" if known in files else target
        return "](" + Path(os.path.relpath(place, (DOCS / page).parent)).as_posix()

    def without_page(match: re.Match[str]) -> str:
        target = (file.parent / match[2]).resolve()
        elsewhere = target.is_dir() or (target.suffix == ".md" and not target.is_relative_to(DOCS))
        return match[1] if elsewhere and page_file(target) not in files else match[0]

    return _LINK.sub(link, _WHOLE_LINK.sub(without_page, source))
