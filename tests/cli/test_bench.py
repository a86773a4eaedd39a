import json


def test_bench_measures_the_groups_it_is_asked_for(hsv):
    ran = hsv("bench", "--only", "in_process", "--scale", "0.05", "--json")
    assert ran.code == 0
    figures = {figure["name"]: figure for figure in ran.json["figures"]}
    assert figures["in_process"]["limit"] == 1.1
    assert figures["in_process"]["ratio"] > 0.5
    assert len(figures["in_process"]["ours"]) == len(figures["in_process"]["theirs"]) == 2


def test_bench_names_an_unknown_group(hsv):
    ran = hsv("bench", "--only", "everything")
    assert ran.code == 2
    assert "only = 'everything'" in ran.error


def test_a_part_does_not_replace_the_table_of_a_whole_run(hsv, tmp_path):
    ran = hsv("bench", "--only", "mcap", "--out", tmp_path / "page.md")
    assert ran.code == 2
    assert "expected no --only" in ran.error


def test_a_run_is_held_against_one_that_was_kept(hsv, tmp_path):
    words = ("bench", "--only", "in_process", "--scale", "0.05")
    kept = hsv(*words, "--json").json
    # Of a machine on which the loop was twice as fast beside C.
    for figure in kept["figures"]:
        figure["ratio"], figure["spread"] = figure["ratio"] / 2.0, [value / 2.0 for value in figure["spread"]]
    path = tmp_path / "before.json"
    path.write_text(json.dumps(kept))
    ran = hsv(*words, "--compare", path)
    assert ran.code == 1
    assert "SLOWER by" in ran.out and "as before: 0 of 2" in ran.out
    assert hsv(*words, "--compare", tmp_path / "none.json").code == 2
