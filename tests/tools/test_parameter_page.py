"""The page of parameters is made from the tables that the nodes declare."""

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_parameter_page_is_up_to_date():
    made = runpy.run_path(str(ROOT / "tools" / "parameter_page.py"))["reference"]()
    page = (ROOT / "docs" / "parameters.md").read_text(encoding="utf-8")
    assert page == made, "run: python3 tools/parameter_page.py"


def test_metric_page_is_up_to_date():
    made = runpy.run_path(str(ROOT / "tools" / "metric_page.py"))["page"]()
    page = (ROOT / "docs" / "metrics.md").read_text(encoding="utf-8")
    assert page == made, "run: python3 tools/metric_page.py"
