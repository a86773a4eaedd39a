"""The gap between certificates and flights, from the output of hsv verify; W over parts of a tube."""

import json
from itertools import pairwise

import numpy as np
import pytest
from marking import long

from hsv.certificate.checks import load_subject
from hsv.control.design_file import find_design
from hsv.flight.flown_checks import OUTPUTS, flight_checks
from hsv_paper.gap import KINDS, bounds, held, needed_rows


@pytest.mark.parametrize("name", [long("tight"), "adjustable"])
def test_bounds_become_smaller_from_the_certificate_to_the_worst_sequence(name):
    subject = load_subject(find_design(name))
    found = bounds(subject, dict.fromkeys(OUTPUTS, 0.0))
    assert list(found) == [kind for kind in KINDS if name == "tight" or kind != "at limited rates"]
    values = list(found.values())
    assert all((a >= b).all() for a, b in pairwise(values))
    if name == "tight":  # its certificate has these bounds, rounded outwards
        assert found["at limited rates"] == pytest.approx(subject.stated("tube.invariant_set.rated.half_range"), 1e-8)


@pytest.mark.parametrize(("name", "degrees"), [("baseline", (0.566, 0.797)), ("derived", (0.686, 0.982))])
def test_constant_disturbances_move_farther_on_the_way_than_in_the_end(name, degrees):
    assert np.degrees(held(load_subject(find_design(name)), 3)) == pytest.approx(degrees, abs=5e-4)


def test_w_grows_faster_than_the_part_of_the_tube():
    rows = needed_rows("baseline", lambda *_: None, 8, 5)
    nominal, everyone = ([float(row["acceleration"]) for row in rows[k::2]] for k in (0, 1))
    assert everyone[0] < 1.0 < 2.0 < everyone[1] and everyone[2] > 2.0 * everyone[1]
    assert all(a <= b for a, b in zip(nominal, everyone, strict=True))


@pytest.mark.parametrize("text", ["", "[]", '{"claims": []}', '{"claims": [{"name": 1}]}'])
def test_other_files_than_those_of_hsv_verify_are_refused(hsv_paper, tmp_path, text):
    (tmp_path / "baseline.json").write_text(text)
    ran = hsv_paper("gap", "baseline.json")
    assert ran.code == 2 and ran.error.startswith("baseline.json: ")
    assert ran.error.endswith("expected the output of hsv verify NAME --json")


@pytest.mark.long
def test_tables_and_figure_of_verified_designs(hsv_paper, tmp_path):
    made = flight_checks(load_subject(find_design("winged_cone")), seed=1, number=16)
    (tmp_path / "winged_cone.json").write_text(json.dumps({"claims": [vars(check) for check in made]}))
    ran = hsv_paper("gap", "winged_cone.json", "--out", "drawn")
    assert ran.code == 0 and "| `winged_cone` | worst flight | " in ran.out
    assert sorted(path.name for path in (tmp_path / "drawn").iterdir()) == ["gap.pdf", "gap.png"]
