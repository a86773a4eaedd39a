import pytest


@pytest.mark.long
def test_a_figure_is_drawn(hsv_paper, tmp_path):
    ran = hsv_paper("figures", "--only", "4", "--out", "drawn")
    assert ran.code == 0 and ran.err == "about 4 s on one processor\n"
    assert sorted(path.name for path in (tmp_path / "drawn").iterdir()) == ["figure_04.pdf", "figure_04.png"]
    assert not (tmp_path / "bags").exists()


def test_a_figure_that_is_none_of_the_paper_s_is_named(hsv_paper):
    ran = hsv_paper("figures", "--only", "7")
    assert ran.code == 2
    assert ran.error == "only = 7: expected one of 2, 3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("weather",), "sensitivity = 'weather': expected one of coupling, sampling, notch, parameters"),
        (("coupling", "--coarseness", "0.1"), "coarseness = 0.1: expected 1 to 100"),
    ],
)
def test_a_study_that_does_not_exist_or_is_too_fine_is_named(hsv_paper, words, message):
    ran = hsv_paper("sensitivity", *words)
    assert ran.code == 2
    assert ran.error.startswith(message)


@pytest.mark.parametrize("words", ["figures --only 4 --out", "sensitivity coupling --out", "limits --out"])
@pytest.mark.parametrize("folder", ["file", "/proc/absent"])
def test_a_folder_that_could_not_be_made_is_refused_before_anything_is_flown(hsv_paper, tmp_path, words, folder):
    (tmp_path / "file").touch()
    ran = hsv_paper(*words.split(), folder)
    name = words.rpartition("--")[2]
    assert ran.code == 2
    assert ran.error == f"{name} = {folder!r}: cannot be written, expected a folder or the name of a new one"
