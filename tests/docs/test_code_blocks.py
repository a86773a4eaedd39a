"""The Python code on pages of the documentation runs, block after block, as a reader would type it."""

import re
import sys
from pathlib import Path

import matplotlib
import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = ["python.md"]
MODULES = {"python.md": ("mine", "class Mine")}
"""Pages that tell to put a block into a module: its name, and what the block has in it."""


@pytest.mark.parametrize("page", PAGES)
def test_code_of_the_page_runs(page, tmp_path, monkeypatch):
    matplotlib.use("agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert blocks
    module, mark = MODULES[page]
    [own] = [block for block in blocks if mark in block]
    Path(f"{module}.py").write_text(own, encoding="utf-8")
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)
    sys.modules.pop(module, None)
    assert {path.name for path in tmp_path.glob("*.png")} == set(re.findall(r'savefig\("(.*?)"\)', "".join(blocks)))
    assert names["flight"].status.name == "FINISHED"
