from unittest.mock import Mock

import pytest


@pytest.mark.long
def test_a_figure_is_drawn(hsv_paper, tmp_path):
    ran = hsv_paper("figures", "--only", "4", "--out", "drawn")
    assert ran.code == 0 and ran.err == "about 4 s on one processor\n"
    assert sorted(path.name for path in (tmp_path / "drawn").iterdir()) == ["figure_04.pdf", "figure_04.png"]


@pytest.mark.parametrize(
    ("words", "time"), [("figures --only 4", "4 s"), ("claims", "2 min"), ("sensitivity coupling", "5 min")]
)
def test_the_time_is_estimated_before_anything_is_computed(hsv_paper, monkeypatch, words, time):
    monkeypatch.setattr("hsv_paper.cli.stages", Mock(side_effect=KeyboardInterrupt))
    ran = hsv_paper(*words.split())
    assert (ran.code, ran.err) == (130, f"about {time} on one processor\nhsv: error: interrupted\n")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("figures --only 7", "only = 7: expected one of 2, 3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17"),
        ("sensitivity weather", "sensitivity = 'weather': expected one of coupling, notch, parameters, fault"),
        ("sensitivity coupling --coarseness 0.1", "coarseness = 0.1: expected 1 to 100"),
    ],
)
def test_a_figure_or_study_that_does_not_exist_or_is_too_fine_is_named(hsv_paper, words, message):
    ran = hsv_paper(*words.split())
    assert ran.code == 2 and ran.error.startswith(message)


@pytest.mark.parametrize("words", ["figures --only 4 --out", "sensitivity coupling --out"])
@pytest.mark.parametrize("folder", ["file", "/proc/absent"])
def test_a_folder_that_could_not_be_made_is_refused_before_anything_is_flown(hsv_paper, tmp_path, words, folder):
    (tmp_path / "file").touch()
    ran = hsv_paper(*words.split(), folder)
    assert ran.code == 2 and ran.error.startswith(f"out = {folder!r}: cannot be written, expected a folder")
