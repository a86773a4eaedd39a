import base64
import gzip
import html
import re
import subprocess

import numpy as np
import pytest
from changed_bags import changed_bag

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import supply
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError
from hsv.base.units import UnitSystem
from hsv.flight.metrics import METRICS, spaced
from hsv.pages.engine import Numbers
from hsv.pages.flights import reported_runs
from hsv.pages.report import report_page, sentence, write_report

EMBEDDED = re.compile(r'<script type="application/[^>]*>.*?</script>', re.DOTALL)


@pytest.fixture(scope="module")
def page(quiet, loud):
    return report_page(reported_runs([quiet, loud]))


def words(page):
    """Return the text that a reader sees, without scripts, style and tags."""
    page = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page)))


def test_the_page_refers_to_nothing_outside_itself(page):
    shell = EMBEDDED.sub("", page)
    addresses = re.findall(r'(?:src|href|action|poster)="([^"]*)"', shell)
    assert addresses and all(address.startswith("#") for address in addresses)
    assert "@import" not in shell and not re.search(r"url\((?!#)", shell)
    assert "default-src 'none'" in shell


def test_every_link_has_its_section(page):
    for name in re.findall(r'href="#([^"]*)"', page):
        assert f'id="{name}"' in page


def test_verdict_limits_and_metrics_are_those_of_the_run(quiet):
    (run,) = reported_runs([quiet])
    seen = words(report_page([run]))
    over = sum(not verdict.kept for verdict in run.verdicts.values())
    assert over, "20 s are too short to reach the end error that is asked for"
    assert f"✗ {over} of {len(run.scenario.limits)} limits violated" in seen
    assert seen.count("limits violated") == len(UnitSystem)
    for name in run.metrics:
        assert spaced(name) in seen and METRICS[name].meaning in seen
    assert seen.count("✓ within ") + seen.count("✗ over ") == len(run.scenario.limits)


def test_the_verdict_has_its_numbers_in_the_units_shown(quiet):
    (run,) = reported_runs([quiet])
    metric, paper = (
        re.search(rf'<span class="{units}">([^<]+)</span>', sentence([run]))[1] for units in ("metric", "paper")
    )
    value = re.compile(r"altitude end error (\S+) (m|ft) \(limit")
    (metres, m), (feet, ft) = (value.search(said).groups() for said in (metric, paper))
    assert (m, ft) == ("m", "ft") and float(metres) == pytest.approx(0.3048 * float(feet), rel=0.01)
    assert float(metres) == pytest.approx(run.metrics["altitude_end_error"], rel=0.01)


def test_a_required_disk_margin_is_judged_by_the_attached_certificate(quiet, tmp_path):
    scenario = tmp_path / "required.toml"
    for required, words_of_it, mark in ((0.6, "at the vertices 0.640 (limit 0.6)", "✓"), (0.7, "(limit 0.7)", "✗")):
        scenario.write_text(f'extends = "case1"\nlimits = {{ disk_margin = {required} }}\n')
        bag = Bag(quiet.path)
        supply(bag, None, str(scenario))
        (run,) = reported_runs([bag])
        assert run.good == (mark == "✓") and f"{mark} " in (seen := words(report_page([run]))) and words_of_it in seen
        del bag.attachments["certificate.json"]
        assert "disk margin not judged: hsv margins case1" in str(sentence(reported_runs([bag]))).lower()


def test_what_happened_is_told_and_escaped(page):
    seen = words(page)
    assert "tube_mpc: <b>unusual</b>" in seen and "<b>unusual" not in page
    assert "command of fuel equivalence ratio limited" in seen
    assert "outside in" in seen and "inside throughout" in seen


def listed(page):
    return re.findall(r"<th scope=\"row\"><code>([^<]+)</code>", page)


def test_only_parameters_that_differ_between_the_runs_are_listed(page):
    assert sorted(listed(page)) == ["input.maximum", "tube.half_width", "tube.shape"]


def test_a_single_run_lists_the_parameters_that_differ_from_their_defaults(quiet, loud):
    seen, changed = (listed(report_page(reported_runs([bag]))) for bag in (quiet, loud))
    (run,) = reported_runs([quiet])
    assert re.search(r"fault\.stops.*?<td>never</td>", report_page([run]), re.DOTALL)
    assert {"duration", "fault.channels", "fault.starts"} <= {*seen}
    assert not [name for name in seen if name.startswith(("vehicle.lift", "model.", "tube.", "input."))]
    assert sorted({*changed} - {*seen}) == ["input.maximum", "tube.half_width", "tube.shape"]
    for part in run.parameters.values():
        part |= {name: ["parker" * 100] for name in part.keys() & {"vehicle.name", "design.name"}}
    assert "vehicle.name" in listed(report_page([run]))


def test_numbers_come_back_bit_for_bit():
    rng = np.random.default_rng(1)
    arrays = [rng.normal(size=1000), np.array([0.0, -0.0, np.nan, np.inf, -1e-40]), np.linspace(0.0, 200.0, 10_001)]
    numbers = Numbers()
    for array in arrays:
        numbers.add(array)
    packed, offset = np.frombuffer(gzip.decompress(base64.b64decode(numbers.packed())), "<u4"), 0
    for array in arrays:
        np.testing.assert_array_equal(packed[offset : offset + len(array)], array.astype("<f4").view("<u4"))
        offset += len(array)


def test_it_opens_with_the_verdict_and_a_picture_before_any_table(page, quiet):
    assert page.index('class="lead') < page.index('class="picture"') < page.index("<table")
    (run,) = reported_runs([quiet])
    said = words(report_page([run]))
    level = quiet.columns("/hsv/tube_status")["level"].max()
    assert "elevator deflection: loss of effectiveness 0.9 from 8 s" in said
    assert f"inside throughout, largest level {level:.4g}" in said


def test_a_rigid_vehicle_has_a_tube_and_no_elastic_modes(bags):
    from recorded_flight import record_flight

    bag = record_flight(bags / "rigid", "winged_cone", duration=2.0, fault=1.0)
    page = report_page(reported_runs([bag]))
    assert "inside throughout" in words(page) and 'id="plot-level"' in page
    assert 'id="elastic"' not in page and 'id="vehicle" class="rigid"' in page


@pytest.mark.long
def test_without_attachments_there_is_a_page_but_no_verdict(quiet, tmp_path):
    writer = BagWriter(tmp_path / "bare", quiet.topics.values())
    for topic in quiet.topics:
        for time, data in quiet.messages(topic):
            writer.write(topic, time, data)
    writer.close()
    seen = words(report_page(reported_runs([Bag(tmp_path / "bare")])))
    assert "no limits to judge by" in seen and "No scenario is attached" in seen
    assert "None are attached to the bag" in seen


def test_a_bag_without_a_flight_is_refused(quiet, tmp_path):
    topics = quiet.topics.values()
    BagWriter(tmp_path / "empty", topics).close()
    with pytest.raises(RecordingError, match="no complete step"):
        reported_runs([Bag(tmp_path / "empty")])
    BagWriter(tmp_path / "partial", [t for t in topics if t.name != "/hsv/nominal"]).close()
    with pytest.raises(RecordingError, match="no topic /hsv/nominal"):
        reported_runs([Bag(tmp_path / "partial")])


def test_what_a_bag_names_is_one_word_of_a_shell_and_shown_as_escapes(quiet, tmp_path):
    custom = {
        "title": "\x1b[31m\x07\u202e",
        "commit": "main; touch PWNED #\ntouch PWNED2",
        "scenario": "case1; touch PWNED3",
    }
    bag = changed_bag(quiet.path, tmp_path / "a bag; $(touch PWNED4)", custom_data=custom)
    write_report([Bag(bag)], tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert not {"\x1b", "\x07", "\u202e"} & {*page}
    assert r"\x1b[31m\x07\u202e" in page
    [block] = re.findall(r'<section id="repeat">.*?<code>(.*?)</code>', page, re.DOTALL)
    (tmp_path / "block.sh").write_text("hsv() { :; }; make() { :; }; source() { :; }\n" + html.unescape(block))
    subprocess.run(["bash", "block.sh"], cwd=tmp_path, check=False)
    assert not [*tmp_path.glob("PWNED*")] and "git checkout" not in block
    known = changed_bag(quiet.path, tmp_path / "known", custom_data={"commit": "0123abc-dirty"})
    write_report([Bag(known)], tmp_path / "report.html")
    assert "git checkout 0123abc\n" in (tmp_path / "report.html").read_text()
