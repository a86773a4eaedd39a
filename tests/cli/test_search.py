"""hsv worst and hsv rare on the command line."""

from pathlib import Path

import pytest
from searches import required


def test_the_worst_flight_flies_alone_with_the_printed_fingerprint(hsv):
    command = ("worst", "case1", "--of", "tube_level", "--budget", "33", "--workers", "1")
    ran = hsv(*command, "--json").json
    assert ran["flights"] == 33 and not ran["broken"] and Path(ran["page"]).is_file()
    alone = hsv("simulate", ran["scenario"], "--json").json
    assert alone["fingerprint"] == ran["worst"]["fingerprint"]
    replayed = hsv("montecarlo", "replay", ran["result"], "--flight", str(ran["worst"]["flight"]), "--json").json
    assert replayed["identical"] and replayed["fingerprint"] == alone["fingerprint"]
    again = hsv(*command).out
    assert f"fingerprint {alone['fingerprint']}" in again and "corner of the worse signs" in again
    assert "HSV search" in (page := Path(ran["page"]).read_text(encoding="utf-8"))
    assert f'flight</th><th scope="col" class="number">{ran["worst"]["flight"]}</th>' in page


def test_wrong_searches_are_refused_in_one_line(hsv, tmp_path):
    required(tmp_path, "0.5 deg")
    for words, expected in (
        (("worst", "case1", "--of", "tube_level", "--budget", "20"), "budget = 20: expected at least 32 flights"),
        (("worst", "case1"), "scenario 'case1': has no requirement"),
        (("worst", "case1", "--of", "level"), "of = 'level': expected"),
        (("worst", "case1", "--of", "tube_level", "--factor", "fault[0].start=1 s,2 s"), "a search has no grid"),
        (("rare", "required.toml", "--budget", "500"), "budget = 500: expected at least 5500 flights"),
        (("rare", "required.toml", "--budget", "100000000"), "budget = 100000000: expected at most 10000000 flights"),
        (("rare", "case1", "--of", "tube_level"), "of = 'tube_level': a metric, expected a requirement"),
    ):
        ran = hsv(*words)
        assert ran.code == 2 and expected in ran.error and "\n" not in ran.error


@pytest.mark.long
def test_the_probability_is_on_the_page_with_its_interval_and_what_was_not_measured(hsv, tmp_path):
    required(tmp_path, "0.49 deg", duration="4 s", fault=[])
    ran = hsv("rare", "required.toml", "--budget", "5500", "--workers", "1", "--json").json
    page = Path(ran["page"]).read_text(encoding="utf-8")
    assert ran["method"] == "subset simulation" and f"broken with probability {ran['probability']:.3g}, 95 %" in page
    assert "Not measured: failures in a region" in page
