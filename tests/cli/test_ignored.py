"""What a command would ignore is refused, by one line that says with what it has an effect."""

from __future__ import annotations

from pathlib import Path

import pytest

BASELINE = Path(__file__).parents[2] / "offline_design" / "baseline.yaml"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "case1", "--live-port", "9000"), "live-port = 9000: expected with --live"),
        (("prepare", "case1", "--live-port", "9000"), "live-port = 9000: expected with --live"),
        (("verify", str(BASELINE), "--corners"), "corners: expected with --scenario"),
        (("linearise", "--reading", "printed"), "reading = 'printed': expected with model ECM"),
        (("montecarlo", "fly", "case1", "--corners", "--samples", "4"), "samples = 4: expected no --samples with"),
        (("montecarlo", "case1", "--scheduler", "tcp://127.0.0.1:9", "--workers", "2"), "workers = 2: expected no"),
        (("montecarlo", "replay", "a.parquet", "--flight", "0", "--bag", "b"), "bag = 'b': expected with --over-dds"),
        (("topic", "--once"), "once: expected with a topic"),
    ],
)
def test_an_option_without_effect_is_refused(hsv, words, message) -> None:
    ran = hsv(*words)
    assert ran.code == 2
    assert ran.error.startswith(message)


def test_a_duration_between_two_steps_is_refused(hsv, tmp_path) -> None:
    (tmp_path / "flight.toml").write_text('extends = "case1"\nfault = []\nduration = "20.01 s"\n')
    ran = hsv("simulate", "flight.toml")
    assert ran.code == 2
    assert "duration = 20.01 s: expected a whole number of periods, 0.02 s each" in ran.error
