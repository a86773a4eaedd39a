"""A design that cannot be used: the file to blame is named."""

import pytest

from hsv.control.design import find_design
from hsv.flight.scenario import scenario_text


@pytest.fixture
def wrong(tmp_path):
    """A design with a wrong value, and a scenario that flies it."""
    text = find_design("baseline").read_text()
    (tmp_path / "wrong.yaml").write_text(text.replace("period: 0.02", "period: 1"))
    (tmp_path / "mine.toml").write_text(scenario_text("case1").replace('"baseline"', '"wrong.yaml"'))


@pytest.mark.parametrize("words", ["verify wrong.yaml", "montecarlo mine.toml --samples 2 --seed 1"])
def test_a_wrong_value_names_its_file(hsv, wrong, words):
    ran = hsv(*words.split())
    assert ran.code == 2
    assert (
        ran.error.removeprefix("scenario 'mine': ")
        == "wrong.yaml: parameter period = 1: expected double from 0.0001 to 1 s (write 1.0)"
    )


def test_a_missing_design_is_named_not_its_certificate(hsv):
    ran = hsv("verify", "nope.yaml")
    assert ran.code == 2
    assert ran.error.startswith("design = 'nope.yaml': no such file, expected the path of a .yaml file, a name in ")


def test_a_file_that_is_no_yaml_is_refused_with_what_was_expected(hsv, tmp_path):
    (tmp_path / "inputs.yaml").write_text("name: a: b\n")
    ran = hsv("certify", "inputs.yaml")
    assert ran.code == 2
    assert ran.error.startswith("design 'inputs.yaml': ") and ran.error.endswith(", expected ROS 2 parameters in YAML")


def test_a_missing_certificate_is_named(hsv, tmp_path):
    (tmp_path / "alone.yaml").write_text(find_design("baseline").read_text())
    ran = hsv("verify", "alone.yaml")
    assert ran.code == 2 and ran.error.startswith("alone.certificate.json: cannot be read")
