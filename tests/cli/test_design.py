"""Where ``hsv design`` writes, and what it does not write over."""

import pytest

from hsv.design.inputs import find_inputs
from hsv.design.verification.verifier import load_subject, verify


@pytest.fixture
def small(tmp_path):
    """An input that takes seconds: four vertices on a grid, one nominal gain, short flights."""
    text = find_inputs("baseline_single_k").read_text()
    for old, new in (
        ('representation = "tensor_product"', 'representation = "grid"'),
        ("altitude_vertices = 4", "altitude_vertices = 2"),
        ("velocity_vertices = 5", "velocity_vertices = 2"),
        ('duration = "200 s"', 'duration = "8 s"'),
        ('fault_start = "100 s"', 'fault_start = "4 s"'),
        ("share = 1.0", "share = 0.5"),
    ):
        assert text.count(old) >= 1
        text = text.replace(old, new)
    (tmp_path / "inputs").mkdir()
    path = tmp_path / "inputs" / "small.toml"
    path.write_text(text)
    return path


def test_a_design_is_written_to_the_current_folder(hsv, small, tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    certificate = here / "small.certificate.json"
    certificate.write_text("an older one")
    ran = hsv("design", str(small), "--force")
    assert ran.code == 0, ran.err
    assert sorted(path.name for path in here.iterdir()) == ["small.certificate.json", "small.yaml"]
    assert [path.name for path in small.parent.iterdir()] == ["small.toml"]
    assert all(claim.ok for made in verify(load_subject(here / "small.yaml"), quick=True).values() for claim in made)


@pytest.mark.parametrize("name", ["baseline.yaml", "baseline.certificate.json"])
def test_a_file_that_exists_is_kept_and_named_before_anything_is_computed(hsv, tmp_path, name):
    (tmp_path / name).write_text("mine")
    for words in (("baseline",), ("adjustable", "--out", "baseline.yaml")):
        ran = hsv("design", *words)
        assert (ran.code, ran.out) == (2, "")
        assert ran.error == f"out = '{name}': exists, expected a new file, or --force to write over it"
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "mine")]
