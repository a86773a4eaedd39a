"""The command hsv margins."""

import json


def test_margins_of_a_scenario_with_its_page_and_worst_corner(hsv, tmp_path):
    words = ("case1_robust", "--corners", "--flown", "--out", tmp_path / "m.html", "--worst", tmp_path / "worst.toml")
    ran = hsv("margins", *map(str, words), "--json")
    assert ran.code == 0
    found = json.loads(ran.out)
    elevator = found["loops"]["vertices"][1]
    assert elevator["name"] == "elevator" and 0.89 < elevator["disk"]["margin"] < 0.91
    assert found["corners"]["coupled vehicle"]["count"] == 1025
    assert all(border["agrees"] for border in found["flown"])
    page = (tmp_path / "m.html").read_text()
    assert "<svg" in page and "disk margin 0.900, which guarantees 8.4 dB" in page
    assert hsv("margins", str(tmp_path / "worst.toml")).code == 0


def test_wrong_words_are_one_line(hsv):
    for words, text in (
        (("nonsense",), "expected a scenario or a design"),
        (("case1_qp",), "no margins: nominal.law = 'qp'"),
        (("baseline", "--worst", "w.toml"), "worst: expected with a scenario and --corners only"),
    ):
        ran = hsv("margins", *words)
        assert ran.code == 2 and text in ran.err and ran.err.count("\n") == 1
