import os

import pytest
from recorded_flight import record_flight
from waiting import wait_until

from hsv.pages.airframe.scene_file import scene_path


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("bags") / "flight", duration=2.0, fault=1.0)


def test_report_writes_the_page_it_is_asked_for(hsv, bag, tmp_path):
    ran = hsv("report", str(bag.path.parent), "--out", "page.html", "--units", "paper")
    assert ran.code == 0 and "page.html" in ran.out
    assert '<html lang="en" data-units="paper">' in (tmp_path / "page.html").read_text()


def test_view_says_how_to_get_a_viewer_where_there_is_none(hsv, bag, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    ran = hsv("view", str(bag.path))
    assert ran.code == 2
    assert all(name in ran.error for name in ("Foxglove", "Lichtblick", "PlotJuggler", "Rerun", "hsv report"))


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """Return a function that installs a program which records its arguments, and returns them after its start."""

    def install(name):
        program = tmp_path / name
        program.write_text('#!/bin/sh\necho "$@" > "$0.asked"\n')
        program.chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}/bin")

        def arguments():
            written = tmp_path / f"{name}.asked"
            wait_until(lambda: written.exists() and written.read_text())
            return written.read_text()

        return arguments

    return install


def test_view_opens_the_viewer_that_is_installed(hsv, bag, asked):
    arguments = asked("plotjuggler")
    assert hsv("view", str(bag.path.parent)).code == 0
    assert arguments() == f"--datafile {bag.path}\n"


def test_view_with_3d_opens_a_copy_with_pictures_that_is_made_once(hsv, bag, asked):
    arguments = asked("foxglove-studio")
    ran = hsv("view", str(bag.path.parent))
    scene = scene_path(bag)
    assert ran.code == 0 and arguments() == f"{scene}\n" and "foxglove.json" in ran.out
    made = scene.stat().st_mtime_ns
    assert hsv("view", str(bag.path.parent)).code == 0 and scene.stat().st_mtime_ns == made
    # The copy in the folder is not a bag, and hsv info still works.
    assert hsv("info", str(bag.path.parent)).code == 0


def test_export_of_a_scene_is_of_every_topic(hsv, bag, tmp_path):
    assert hsv("export", str(bag.path), "--scene", "--out", "scene.mcap").code == 0
    assert (tmp_path / "scene.mcap").stat().st_size > bag.path.stat().st_size


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("export BAG --scene --topic /hsv/state", "topic: expected with a table"),
        ("export BAG --scene --csv", "choose --csv, --parquet, --npz, --scene"),
        ("export BAG --scene --exaggeration=-1", "from 0 to 150"),
        ("export BAG --csv --exaggeration 10", "exaggeration: expected with --scene"),
        ("report BAG --out page.pdf", "out = 'page.pdf': expected a file that ends in .html"),
        ("report BAG --out nowhere/page.html", "out = 'nowhere/page.html': cannot be written"),
    ],
)
def test_wrong_words_are_refused_in_one_line(hsv, bag, tmp_path, words, said):
    ran = hsv(*words.replace("BAG", str(bag.path)).split())
    assert ran.code == 2 and said in ran.error
    assert not list(tmp_path.iterdir())
