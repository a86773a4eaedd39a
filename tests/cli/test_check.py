import pytest

MODULE = """
class Kept:
    PARAMETERS = ()
    steps = 0
    @classmethod
    def from_parameters(cls, values, design):
        return cls()
    def reset(self):
        pass
    def step(self, inputs):
        self.steps += 1
        return inputs.reference_input + [0.0, 1e-9 * self.steps]
"""


@pytest.fixture
def short(tmp_path, monkeypatch):
    """Write a scenario of 2 s with a controller that is not reset; return its name."""
    (tmp_path / "kept.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    text = 'extends = "case1"\nduration = "2 s"\nfault = []\ncontroller = "kept:Kept"\ndesign = ""\n[limits]\n'
    (tmp_path / "short.toml").write_text(text)
    return "short.toml"


@pytest.mark.long
def test_what_differs_is_printed_and_named_with_its_step(hsv, short):
    ran = hsv("check", short)
    assert ran.code == 1
    assert ran.error.startswith("kept:Kept, after a reset: u_unsaturated from step 0 on: [")
    lines = [line.split() for line in ran.out.splitlines()]
    assert ["flown", "twice", "2", "the", "same"] in lines
    assert ["from", "a", "copied", "state", "2", "the", "same"] in lines


@pytest.mark.parametrize(
    ("part", "expected"),
    [
        ("nix", "controller = 'nix': expected one of "),
        ("nowhere:Class", "controller = 'nowhere:Class': cannot be loaded"),
        ("nowhere.toml", "cannot be read"),
    ],
)
def test_what_cannot_be_checked_is_one_line(hsv, part, expected):
    ran = hsv("check", part)
    assert ran.code == 2 and expected in ran.error
