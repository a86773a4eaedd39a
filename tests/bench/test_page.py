"""The page of the documentation with the table of a run and of all runs."""

import pytest

from hsv.base.errors import QuantityError
from hsv.bench.figure import Figure
from hsv.bench.page import HISTORY, TABLE, Page


def measured(name, ours):
    return Figure(name, "ours", "theirs", "s", (ours,), (1.0,), "most", 1.5, note="noted")


def marked(marks, text=""):
    begin, end = marks
    return f"{begin}\n{text}\n{end}\n"


def test_the_table_of_a_run_replaces_the_one_before_and_adds_a_row_to_that_of_all(tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text(f"# Before\n{marked(TABLE, 'old')}Between\n{marked(HISTORY)}After\n")
    commits = iter(("a1", "a1", "b2", "b2"))
    monkeypatch.setattr("hsv.bench.page.commit", lambda: next(commits))
    for ours in (1.7, 1.4, 1.3, 1.2):
        Page(page).write("a machine", [measured("graph", ours)], {"jsbsim": "not installed"})
    text = page.read_text()
    assert text.startswith("# Before\n") and "\nBetween\n" in text and text.endswith("\nAfter\n")
    assert "old" not in text
    assert text.count("| ours | theirs | 1") == 1 and "| ours | theirs | 1.2 s" in text
    assert "at most 1.5, as promised; noted" in text
    assert "a machine" in text and "Not measured: jsbsim, not installed." in text
    # A commit that is measured anew has its last figures; columns that were not measured are empty.
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if "cores |" in line]
    assert [(row[1], row[3:]) for row in rows] == [("a1", ["", "1.4", "", "", ""]), ("b2", ["", "1.2", "", "", ""])]


@pytest.mark.parametrize("text", ["nothing", marked(TABLE), marked(HISTORY), f"{TABLE[1]}{TABLE[0]}{marked(HISTORY)}"])
def test_a_page_without_marks_is_refused(tmp_path, text):
    page = tmp_path / "page.md"
    page.write_text(text)
    with pytest.raises(QuantityError, match="expected a page with the marks"):
        Page(page)
