"""hsv worst and hsv rare on the command line."""

from pathlib import Path


def test_the_worst_flight_flies_alone_with_the_printed_fingerprint(hsv):
    command = ("worst", "case1", "--of", "tube_level", "--budget", "33", "--workers", "1")
    ran = hsv(*command, "--json").json
    assert ran["flights"] == 33 and not ran["broken"] and Path(ran["page"]).is_file()
    alone = hsv("simulate", ran["scenario_file"], "--json").json
    assert alone["fingerprint"] == ran["worst"]["fingerprint"]
    replayed = hsv("montecarlo", "replay", ran["result"], "--flight", str(ran["worst"]["flight"]), "--json").json
    assert replayed["identical"] and replayed["fingerprint"] == alone["fingerprint"]
    again = hsv(*command).out
    assert f"fingerprint {alone['fingerprint']}" in again and "corner of the worse signs" in again


def test_wrong_searches_are_refused_in_one_line(hsv, tmp_path):
    row = '[[requirement]]\nname = "a"\nsignal = "pitch_rate"\nat_most = "1 deg/s"\nalways = true\n'
    (tmp_path / "required.toml").write_text(f'extends = "case1"\ntitle = "required"\n{row}', encoding="utf-8")
    for words, expected in (
        (("worst", "case1", "--of", "tube_level", "--budget", "20"), "budget = 20: expected at least 32 flights"),
        (("worst", "case1"), "scenario 'case1': has no requirement"),
        (("worst", "case1", "--of", "level"), "of = 'level': expected"),
        (("worst", "case1", "--of", "tube_level", "--factor", "fault[0].start=1 s,2 s"), "a search has no grid"),
        (("rare", "required.toml", "--budget", "500"), "budget = 500: expected at least 5500 flights"),
        (("rare", "case1", "--of", "tube_level"), "of = 'tube_level': a metric, expected a requirement"),
    ):
        ran = hsv(*words)
        assert ran.code == 2 and expected in ran.error and "\n" not in ran.error
