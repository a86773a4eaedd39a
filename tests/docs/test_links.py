"""Links and pictures of all pages of the repository, checked offline; the equation map; the build of the site."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import page_blocks
import pytest
import yaml

import hsv
from hsv.core import lib
from hsv.pages.fly import FIELDS, SCENARIOS

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
        if anchor and file.name == "fly.md":
            name, *settings = anchor.split("&")
            assert name in SCENARIOS, f"{target}: no flight of the page"
            assert {setting.split("=")[0] for setting in settings} <= {"fault", "size", "at", *FIELDS}
        elif anchor and file.suffix == ".md":
            assert anchor in anchors(file), f"{target}: no such heading"


def test_what_is_where_is_there():
    section = (ROOT / "CONTRIBUTING.md").read_text().partition("## Where is what")[2].partition("\n## ")[0]
    named = [word for word in re.findall(r"`([^`\s]+)`", section) if "/" in word]
    assert len(named) > 10
    folders = (ROOT, ROOT / "src" / "hsv" / "hsv")
    assert [name for name in named if not any((folder / name).exists() for folder in folders)] == []


def test_the_hosted_workflow_builds_the_site_and_tests_with_a_full_installation():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))["jobs"]
    commands = " ".join(step.get("run", "") for job in jobs.values() for step in job["steps"])
    assert "make docs" in commands and "make test-ros" in commands


def test_the_nightly_workflow_runs_what_takes_too_long_for_every_push():
    workflow = (ROOT / ".github" / "workflows" / "nightly.yml").read_text(encoding="utf-8")
    [job] = yaml.safe_load(workflow)["jobs"].values()
    targets = job["strategy"]["matrix"]["target"]
    assert targets == ["test-long", "fuzz", "test-portability", "coverage"]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert all(f"\n{target}: setup ##" in makefile for target in targets)


def test_what_the_commands_of_the_readme_write_is_ignored_by_git():
    written = re.findall(r"--(?:bag|out) ((?!docs/)\w+/[^\s`]+)", (ROOT / "README.md").read_text(encoding="utf-8"))
    written += ["bags/case1_20260101T000000Z", "campaigns/case1.parquet", "tutorial/first", "resilience/report.html"]
    names = [path if Path(path).suffix else f"{path}/" for path in written]
    ignored = subprocess.run(["git", "check-ignore", *names], cwd=ROOT, capture_output=True, text=True).stdout
    assert ignored.splitlines() == names


@pytest.mark.long
def test_the_documentation_builds_without_a_warning(tmp_path):
    for tool in ("sphinx", "myst_parser", "furo", "ziglang"):
        pytest.importorskip(tool, reason=f"{tool} is not installed: make docs installs it")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", str(ROOT / "docs")]
    built = subprocess.run([*command, str(tmp_path / "site")], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    assert (tmp_path / "site" / "claims.html").is_file()
    assert "wasm-unsafe-eval" in (tmp_path / "site" / "fly.html").read_text(encoding="utf-8")


SOURCES = Path(hsv.__file__).parent
TEXT = (Path(__file__).parents[2] / "docs" / "equations.md").read_text()


def found(name):
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            thing = import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            thing = getattr(thing, part)
        return thing
    raise AssertionError(f"{name}: no such module")


def test_every_name_on_the_page_exists():
    names = set(re.findall(r"`(hsv\.[\w.]+)`", TEXT))
    assert len(names) > 30
    for name in names:
        assert found(name) is not None
    for name in re.findall(r"`(hsv_\w+)`", TEXT):
        assert hasattr(lib, name)
    for name, header in re.findall(r"`(\w+)` of `(core/\w+\.h)`", TEXT):
        assert f"{name}(" in (SOURCES / header).read_text(encoding="utf-8")


def test_every_numbered_equation_of_the_paper_is_on_the_page():
    rows = [line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| (")]
    numbers = {int(number) for row in rows for number in re.findall(r"\((\d+)\)", row)}
    assert numbers == set(range(1, 55))


@pytest.mark.parametrize("number", range(1, 55))
def test_one_search_finds_every_equation_where_it_is_computed(number):
    [*rows] = [line for line in TEXT.splitlines() if line.startswith("| (") and f"({number})" in line.split("|")[1]]
    named = {name.rpartition(".")[0] for row in rows for name in re.findall(r"`(hsv\.[\w.]+)`", row)}
    modules = {
        name if Path(SOURCES, *name.split(".")[1:]).with_suffix(".py").is_file() else name.rpartition(".")[0]
        for name in named
    }
    headers = [SOURCES / header for row in rows for header in re.findall(r"`(core/\w+\.h)`", row)]
    paths = [*headers, *(Path(SOURCES, *name.split(".")[1:]).with_suffix(".py") for name in modules)]
    texts = [path.read_text(encoding="utf-8") for path in paths]
    assert any(re.search(rf"eq\. {number}\b", text) for text in texts), sorted(modules)
