"""Every entry of every shipped design is held to its tolerance: ten times that is noticed, without flights."""

import dataclasses

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign, find_design
from hsv.design.results import DESIGNS
from hsv.design.verification.quick import QUICK
from hsv.design.verification.tolerances import PARAMETERS, TOLERANCES, entry_size
from hsv.design.verification.verifier import RECOMPUTED, load_subject

ARRAYS = {
    "model.a": (lambda design: design.polytope.A, "polytopic model"),
    "model.b": (lambda design: design.polytope.B, "polytopic model"),
    "scheduling.altitude.breakpoints": (lambda design: design.altitude_samples[0], "polytopic model"),
    "scheduling.altitude.weights": (lambda design: design.altitude_samples[1], "polytopic model"),
    "scheduling.velocity.breakpoints": (lambda design: design.velocity_samples[0], "polytopic model"),
    "scheduling.velocity.weights": (lambda design: design.velocity_samples[1], "polytopic model"),
    "feedback.gain": (lambda design: design.feedback_gain, "feedback gain"),
    "feedback.tau": (lambda design: design.tau, "adjustable design"),
    "feedback.tau_minimum": (lambda design: design.tau_minimum, "adjustable factor"),
    "nominal.gains": (lambda design: design.nominal_gains, "nominal gains"),
    "nominal.ellipsoids": (lambda design: design.nominal_ellipsoids, "nominal gains"),
    "nominal.input_bound": (lambda design: design.nominal_input_bound, "nominal gains"),
    "nominal.state_scale": (lambda design: design.nominal_state_scale, "nominal gains"),
    "nominal.input_scale": (lambda design: design.nominal_input_scale, "nominal gains"),
    "tube.centre": (lambda design: design.tube.centre, "invariant set"),
    "tube.shape": (lambda design: design.tube.shape, "invariant set"),
    "tube.half_width": (lambda design: design.tube.half_width, "invariant set"),
    "nominal.input_minimum": (lambda design: design.plan_bounds.input_minimum, "invariant set"),
    "nominal.input_maximum": (lambda design: design.plan_bounds.input_maximum, "invariant set"),
    "nominal.region_minimum": (lambda design: design.plan_bounds.region_minimum, "invariant set"),
    "nominal.region_maximum": (lambda design: design.plan_bounds.region_maximum, "invariant set"),
    "input.minimum": (lambda design: design.input_minimum, "inputs"),
    "input.maximum": (lambda design: design.input_maximum, "inputs"),
}
"""Every array of a design, and the part of the checks that has to notice a change of it."""

NUMBERS = ("period", "notch.zero_frequency", "notch.zero_damping", "notch.pole_frequency", "notch.pole_damping")

SAMPLE, SEED = 12, 5
"""Entries of an array that `make test` changes, and how they are drawn; `make test-long` changes all."""


@pytest.fixture(scope="module", params=DESIGNS)
def shipped(request):
    return load_subject(find_design(request.param))


def missed(subject, name, sample=None):
    """Return the entries of an array whose change by ten times their tolerance is not noticed, one after the other."""
    values, part = ARRAYS[name]
    array, checks = values(subject.design), (QUICK | RECOMPUTED)[part]
    size = np.broadcast_to(entry_size(name, subject.certificate), array.shape)
    step = 10.0 * TOLERANCES[PARAMETERS[name]].allowed(array, size)
    draw = np.random.default_rng(SEED)
    step *= draw.choice((-1.0, 1.0), array.shape)
    entries = np.arange(array.size)
    if sample and sample < array.size:
        entries = draw.choice(array.size, sample, replace=False)
    found = []
    for entry in (np.unravel_index(index, array.shape) for index in entries):
        original = array[entry]
        array[entry] += step[entry]
        try:
            # Checks are recomputed one by one, up to the first that fails.
            if all(check.ok for check in checks(subject)):
                found.append(tuple(map(int, entry)))
        except DesignError:
            pass  # a recomputation that breaks down is a refusal too
        array[entry] = original
    return found


def carried(subject):
    return [name for name in ARRAYS if name in subject.design.to_parameters()]


def test_the_walk_and_the_table_know_every_number(shipped):
    numbers = {name for name, value in shipped.design.to_parameters().items() if isinstance(value, float | list)}
    assert numbers == set(carried(shipped)) | set(NUMBERS)
    assert set(PARAMETERS) == set(ARRAYS) | set(NUMBERS)


def test_ten_times_the_tolerance_of_an_entry_is_noticed(shipped):
    for part in (QUICK | RECOMPUTED).values():
        assert [check.name for check in part(shipped) if not check.ok] == []
    assert {name: entries for name in carried(shipped) if (entries := missed(shipped, name, SAMPLE))} == {}


@pytest.mark.long
@pytest.mark.parametrize("name", ARRAYS)
def test_ten_times_the_tolerance_of_every_entry_is_noticed(shipped, name):
    if name in carried(shipped):
        assert missed(shipped, name) == []


@pytest.mark.parametrize("name", NUMBERS)
def test_period_and_notch_are_held_to_their_tolerance(shipped, name):
    values = shipped.design.to_parameters()
    changed = np.array(values[name]) + 10.0 * TOLERANCES[PARAMETERS[name]].allowed(np.array(values[name]))
    design = ControlDesign.from_parameters(values | {name: changed.tolist()})
    assert not all(check.ok for check in QUICK["inputs"](dataclasses.replace(shipped, design=design)))


def test_the_least_entries_are_held_to_the_size_of_their_coordinates(shipped):
    # What is zero but for rounding: seen as 1.5e-17 and 7.4e-16 on two processors (adjustable, model.a[2, 4, 5]).
    A = shipped.design.polytope.A
    original = A[2, 4, 5]
    A[2, 4, 5] = 1.5e-17
    assert all(check.ok for check in RECOMPUTED["polytopic model"](shipped))
    A[2, 4, 5] = original
