"""The documentation builds without a warning and can be searched; make docs and make test-long install its tools."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.long
def test_the_documentation_builds_without_a_warning(tmp_path):
    for tool in ("sphinx", "myst_parser", "furo"):
        pytest.importorskip(tool, reason=f"{tool} is not installed: make docs installs it")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", str(ROOT / "docs")]
    built = subprocess.run([*command, str(tmp_path / "site")], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    assert (tmp_path / "site" / "claims.html").is_file()
    index = (tmp_path / "site" / "searchindex.js").read_text(encoding="utf-8")
    search = json.loads(index.removeprefix("Search.setIndex(").removesuffix(")"))

    def found(word):
        hits = [table.get(word, []) for table in (search["terms"], search["titleterms"])]
        return {search["docnames"][i] for hit in hits for i in (hit if isinstance(hit, list) else [hit])}

    # Written by hand, and generated from the commands, from the messages and from docstrings.
    assert "explanation/tube" in found("ellipsoid")
    assert "reference/commands" in found("montecarlo")
    assert "reference/messages" in found("fuel_equivalence_ratio")
    assert "fly" in {entry[4] for entry in search["objects"]["hsv.api"]}
