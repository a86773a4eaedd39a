import dataclasses

import pytest

from hsv.control.design import find_design, read_design, write_design
from hsv.control.export import controller_files, step_bounds

BASELINE = read_design(find_design("baseline"))


def test_it_writes_source_numbers_and_headers_and_prints_the_cost_of_a_step(hsv, tmp_path):
    ran = hsv("export-controller", "baseline", "--out", "new/controller", "--json")
    assert ran.code == 0
    folder = tmp_path / "new" / "controller"
    texts = controller_files(BASELINE)
    assert {path.name: path.read_text() for path in folder.iterdir()} == texts
    assert {row["path"]: row["size_bytes"] for row in ran.json["written"]} == {
        f"new/controller/{name}": (folder / name).stat().st_size for name in texts
    }
    bounds = {name: dataclasses.asdict(bound) for name, bound in step_bounds(BASELINE).items()}
    assert ran.json["most_in_a_step"] == bounds
    assert bounds["nominal_trajectory"]["multiplications"] > 1000


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("nothing", "--out", "new"), "design = 'nothing': no such file"),
        (("tubeless.yaml", "--out", "new"), "tube.shape: empty, expected a design with a tube"),
        (("baseline", "--out", "full"), "out = 'full': holds notes.txt, expected a new folder"),
        (("baseline", "--out", "full/notes.txt"), "out = 'full/notes.txt': cannot be written"),
        (("baseline", "--out", "full/controller.c"), "out = 'full/controller.c': cannot be written"),
        (("baseline",), "out, fmu: missing, expected --out FOLDER, --fmu FILE or both"),
        (("baseline", "--fmu", "full/notes.txt"), "fmu = 'full/notes.txt': exists, expected a new file"),
    ],
)
def test_wrong_input_is_one_line(hsv, tmp_path, words, expected):
    write_design(tmp_path / "tubeless.yaml", dataclasses.replace(BASELINE, tube=None), "for this test")
    (tmp_path / "full").mkdir()
    for name in ("controller.c", "notes.txt"):
        (tmp_path / "full" / name).touch()
    ran = hsv("export-controller", *words)
    assert ran.code == 2
    assert expected in ran.error
    assert not (tmp_path / "new").exists()
    assert (tmp_path / "full" / "controller.c").read_text() == ""
