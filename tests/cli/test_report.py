import json

import pytest
from recorded_flight import record_flight


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("bags") / "flight", duration=2.0, fault=1.0)


def test_report_writes_the_page_it_is_asked_for(hsv, bag, tmp_path):
    ran = hsv("report", str(bag.path.parent), "--out", "page.html", "--units", "paper")
    assert ran.code == 0 and "page.html" in ran.out
    assert '<html lang="en" data-units="paper">' in (tmp_path / "page.html").read_text()


def test_export_of_a_scene_is_of_every_topic_and_writes_a_layout(hsv, bag, tmp_path):
    assert hsv("export", str(bag.path), "--scene", "--out", "scene.mcap").code == 0
    assert json.loads((tmp_path / "layout_foxglove.json").read_text())["configById"]
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
