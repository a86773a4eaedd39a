import dataclasses

from hsv.design.sets.sampling import sample


def test_no_sequence_leaves_the_set_and_the_seed_decides(found):
    first = sample(found, 4000, 600, seed=5)
    assert 0.9 < first["worst_level"] <= 1.0
    assert first == sample(found, 4000, 600, seed=5)
    assert first != sample(found, 4000, 600, seed=6)


def test_a_set_that_is_too_small_is_found_out(found):
    assert sample(dataclasses.replace(found, Q=0.5 * found.Q), 4000, 600, seed=5)["worst_level"] > 1.0
