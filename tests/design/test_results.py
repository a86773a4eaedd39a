from pathlib import Path

from hsv.design.results import results

PAGE = Path(__file__).parents[2] / "offline_design" / "results.md"


def test_table_of_results_is_that_of_the_certificates():
    page = PAGE.read_text(encoding="utf-8")
    assert page == results(), "run: python -m hsv.design.results > offline_design/results.md"
