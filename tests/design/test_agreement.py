import dataclasses

from hsv.control.tolerances import PARAMETERS
from hsv.design.agreement import deviations


def test_a_design_agrees_with_itself(subject):
    found = deviations(subject.design, subject)
    assert {d.parameter for d in found} == set(PARAMETERS) & set(subject.design.to_parameters())
    assert all(d.ok and d.scaled == 0.0 for d in found)


def test_a_deviation_is_counted_in_scaled_coordinates_and_named(subject):
    gains = subject.design.nominal_gains.copy()
    scale = 0.1 / 0.02  # elevator over angle of attack
    expected = float(gains[2, 1, 2])
    gains[2, 1, 2] += 0.01 * max(scale, abs(expected))
    changed = dataclasses.replace(subject.design, nominal_gains=gains)
    worst = max(deviations(changed, subject), key=lambda d: d.scaled)
    assert (worst.parameter, worst.index, worst.ok) == ("nominal.gains", (2, 1, 2), False)
    assert abs(worst.scaled - 0.01) < 1e-9
    assert str(worst).startswith(f"nominal.gains[2, 1, 2] = {float(gains[2, 1, 2])!r}: expected {expected!r}")
    slightly = subject.design.nominal_gains.copy()
    slightly[:, :, 5:] += 1e-9  # zero; a share of the size is what counts
    assert all(d.ok for d in deviations(dataclasses.replace(subject.design, nominal_gains=slightly), subject))
