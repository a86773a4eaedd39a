import os

import pytest
from recorded_flight import record_flight
from waiting import wait_until


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("bags") / "flight", duration=2.0, fault=1.0)


def test_report_writes_the_page_it_is_asked_for(hsv, bag, tmp_path):
    ran = hsv("report", str(bag.path.parent), "--out", "page.html", "--units", "paper")
    assert ran.code == 0 and "page.html" in ran.out
    assert '<html lang="en" data-units="paper">' in (tmp_path / "page.html").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("BAG", "--out", "page.pdf"), "out = 'page.pdf': expected a file that ends in .html"),
        (("BAG", "--out", "nowhere/page.html"), "out = 'nowhere/page.html': cannot be written"),
        (("no_such_bag",), "no_such_bag: does not exist"),
    ],
)
def test_bad_input_of_report_is_refused_in_one_line(hsv, bag, tmp_path, words, said):
    ran = hsv("report", *(str(bag.path) if word == "BAG" else word for word in words))
    assert ran.code == 2 and said in ran.error
    assert not list(tmp_path.glob("*.html"))


def test_view_says_how_to_get_a_viewer_where_there_is_none(hsv, bag, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    ran = hsv("view", str(bag.path))
    assert ran.code == 2
    assert all(name in ran.error for name in ("Foxglove", "Lichtblick", "PlotJuggler", "Rerun", "hsv report"))
    assert "Rerun" not in hsv("view", str(bag.path), "--with", "plotjuggler").error


def test_view_opens_the_viewer_that_is_installed(hsv, bag, monkeypatch, tmp_path):
    program = tmp_path / "plotjuggler"
    program.write_text('#!/bin/sh\necho "$@" > "$0.asked"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}/bin")
    assert hsv("view", str(bag.path.parent)).code == 0
    asked = tmp_path / "plotjuggler.asked"
    wait_until(lambda: asked.exists() and asked.read_text())
    assert f"--datafile {bag.path}" in asked.read_text() and "plotjuggler.xml" in asked.read_text()
