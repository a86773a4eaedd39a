import pytest


@pytest.mark.long
def test_a_figure_is_drawn_with_its_page(hsv_paper, tmp_path):
    ran = hsv_paper("figures", "--only", "4", "--out", "drawn")
    assert ran.code == 0 and ran.err == "about 4 s on one processor\n"
    assert sorted(path.name for path in (tmp_path / "drawn").iterdir()) == [
        "figure_04.md",
        "figure_04.pdf",
        "figure_04.png",
    ]
    assert not (tmp_path / "bags").exists()


def test_a_figure_that_is_none_of_the_paper_s_is_named(hsv_paper):
    ran = hsv_paper("figures", "--only", "7")
    assert ran.code == 2
    assert ran.error == "only = 7: expected one of 2, 3, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17"


@pytest.mark.long
def test_the_fault_study_flies_the_controllers_of_other_scenarios_beside(hsv_paper, tmp_path):
    (tmp_path / "mine.toml").write_text('extends = "case1_integral_heavy"\ntitle = "with integral action"\n')
    ran = hsv_paper("sensitivity", "fault", "--with", "mine.toml", "--coarseness", "33", "--out", "plots", "--json")
    assert ran.code == 0
    assert ran.json["tables"][0][-1]["controller"] == "with integral action"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("weather",), "sensitivity = 'weather': expected one of coupling, sampling, notch, parameters"),
        (("coupling", "--coarseness", "0.1"), "coarseness = 0.1: expected 1 to 100"),
        (
            ("coupling", "--with", "case1"),
            "with = 'case1': study coupling flies its own controllers, expected study fault",
        ),
        (("fault", "--with", "nowhere"), "scenario 'nowhere': expected a"),
        (
            ("fault", "--with", "none.toml"),
            "scenario 'none.toml': fault: of nothing, expected one, of elevator_deflection",
        ),
    ],
)
def test_what_a_study_cannot_fly_is_named(hsv_paper, tmp_path, words, message):
    (tmp_path / "none.toml").write_text('extends = "case1"\nfault = []\n')
    ran = hsv_paper("sensitivity", *words)
    assert ran.code == 2
    assert ran.error.startswith(message)


@pytest.mark.parametrize(
    "words",
    ["sensitivity coupling --flights", "claims --flights", "figures --only 4 --out", "sensitivity coupling --out"],
)
@pytest.mark.parametrize("folder", ["file", "/proc/absent"])
def test_a_folder_that_could_not_be_made_is_refused_before_anything_is_flown(hsv_paper, tmp_path, words, folder):
    (tmp_path / "file").touch()
    ran = hsv_paper(*words.split(), folder)
    name = words.rpartition("--")[2]
    assert ran.code == 2
    assert ran.error == f"{name} = {folder!r}: cannot be written, expected a folder or the name of a new one"
