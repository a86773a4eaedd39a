"""Links and pictures of every page of the repository, without a network."""

import re
import subprocess
from pathlib import Path

import page_blocks
import pytest

ROOT = page_blocks.ROOT
PAGES = [ROOT / page for page in page_blocks.PAGES]
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^()\s]+)\)")


def without_code(text):
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.S | re.M)
    return re.sub(r"`[^`\n]*`", "", text)


def anchors(page):
    headings = re.findall(r"^#+ (.*)$", without_code(page.read_text()), flags=re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for target in LINK.findall(without_code(page.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.exists(), f"{target}: no such file"
        assert file.is_relative_to(ROOT), f"{target}: outside the repository"
        if anchor and file.suffix == ".md":
            assert anchor in anchors(file), f"{target}: no such heading"


def test_what_is_where_is_there():
    section = (ROOT / "CONTRIBUTING.md").read_text().partition("## Where is what")[2].partition("\n## ")[0]
    named = [word for word in re.findall(r"`([^`\s]+)`", section) if "/" in word]
    assert len(named) > 10
    folders = (ROOT, ROOT / "src" / "hsv" / "hsv")
    assert [name for name in named if not any((folder / name).exists() for folder in folders)] == []


def test_every_page_of_the_documentation_is_in_a_table_of_contents():
    listed = {"index.md"}
    for index in (ROOT / "docs").rglob("index.md"):
        for block in re.findall(r"```\{toctree\}\n(.*?)```", index.read_text(), flags=re.S):
            entries = [line for line in block.split("\n") if line and not line.startswith(":")]
            for entry in [re.sub(r".*<(.*)>", r"\1", line) for line in entries]:
                listed |= {str(p.relative_to(ROOT / "docs")) for p in index.parent.glob(f"{entry}.md")}
    assert listed >= {str(page.relative_to(ROOT / "docs")) for page in PAGES if page.is_relative_to(ROOT / "docs")}


def test_what_the_commands_of_the_readme_write_is_ignored_by_git():
    written = re.findall(r"--(?:bag|out) ((?!docs/)\w+/[^\s`]+)", (ROOT / "README.md").read_text(encoding="utf-8"))
    written += ["bags/case1_20260101T000000Z", "campaigns/case1.parquet", "tutorial/first", "resilience/report.html"]
    names = [path if Path(path).suffix else f"{path}/" for path in written]
    ignored = subprocess.run(["git", "check-ignore", *names], cwd=ROOT, capture_output=True, text=True).stdout
    assert ignored.splitlines() == names
