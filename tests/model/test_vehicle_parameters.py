import math

import pytest
from published_model import DERIVED, FOOT, INERTIA, PAPER_LIKE, SLUG

from hsv.base.errors import QuantityError
from hsv.model.vehicle import load_vehicle


def test_table_is_converted_to_si():
    vehicle = load_vehicle().coupled()
    assert vehicle.mass == pytest.approx(300 * SLUG, rel=1e-12)
    assert vehicle.moment_of_inertia == pytest.approx(INERTIA * SLUG * FOOT**2, rel=1e-12)
    assert vehicle.reference_area == pytest.approx(17 * FOOT**2, rel=1e-12)
    assert vehicle.gravity == pytest.approx(9.80664, rel=1e-6)
    assert vehicle.thrust_beta_1 == pytest.approx(-3.7693e5 * 4.4482216152605, rel=1e-12)
    assert vehicle.lift_alpha == 4.6773
    assert vehicle.natural_frequency_2 == 19.58


def test_inertial_coupling_is_the_same_in_both_systems_of_units():
    for name, (psi_1, psi_2) in (("derived", DERIVED), ("paper_like", PAPER_LIKE)):
        vehicle = load_vehicle().coupled(name)
        inertia = vehicle.moment_of_inertia
        assert vehicle.inertial_coupling_1**2 / inertia == pytest.approx(psi_1**2 / INERTIA, rel=1e-12)
        assert vehicle.inertial_coupling_2**2 / inertia == pytest.approx(psi_2**2 / INERTIA, rel=1e-12)
    derived = load_vehicle().coupled("derived")
    assert derived.inertial_coupling_1**2 / derived.moment_of_inertia == pytest.approx(0.3230, abs=5e-5)


def test_derived_coupling_is_the_uniform_double_cantilever():
    # psi = 0.5688 sqrt(mass per length) length^1.5; fore body 55 ft, aft body 45 ft, 3 slug/ft.
    for psi, length in zip(DERIVED, (55.0, 45.0), strict=True):
        assert abs(psi) == pytest.approx(0.5688 * math.sqrt(3.0) * length**1.5, rel=1e-3)
    assert tuple(0.25 * psi for psi in DERIVED) == pytest.approx(PAPER_LIKE)


def test_coupling_scale_joins_the_named_sets():
    vehicle = load_vehicle()
    for kappa, name in ((0.25, "paper_like"), (1.0, "derived"), ("0.25", "paper_like")):
        assert vehicle.coupled(kappa) == pytest.approx(vehicle.coupled(name), rel=1e-14)
    assert vehicle.coupled(0.0) == vehicle.decoupled == vehicle.coupled("derived").decoupled()
    assert vehicle.coupled(0.65).inertial_coupling_2 == pytest.approx(0.65 * DERIVED[1] * SLUG**0.5 * FOOT, rel=1e-12)
    assert [vehicle.coupling_scale(name) for name in vehicle.couplings] == [0.25, 1.0]


def test_perturbation_changes_what_it_names_and_nothing_else():
    vehicle = load_vehicle().coupled()
    heavy = vehicle.perturbed({"mass": 0.1, "thrust_beta_7": -0.03})
    assert heavy.mass == 1.1 * vehicle.mass
    assert heavy.thrust_beta_7 == 0.97 * vehicle.thrust_beta_7
    assert heavy._replace(mass=vehicle.mass, thrust_beta_7=vehicle.thrust_beta_7) == vehicle
    assert vehicle.perturbed({}) == vehicle


@pytest.mark.parametrize(
    ("perturbation", "message"),
    [
        ({"mas": 0.1}, "perturbation.mas = 0.1: no such parameter, expected one of mass, moment_of_inertia"),
        ({"mass": float("nan")}, "perturbation.mass = nan: expected a finite relative change"),
    ],
)
def test_a_wrong_perturbation_is_named(perturbation, message):
    with pytest.raises(QuantityError) as caught:
        load_vehicle().coupled().perturbed(perturbation)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("coupling", ["strong", "-0.1", "nan", "inf", -1.0, 2.1, "65000", True, None])
def test_a_coupling_that_is_no_set_and_no_multiple_is_refused(coupling):
    with pytest.raises(QuantityError) as caught:
        load_vehicle().coupled(coupling)
    expected = "expected one of paper_like, derived, or a multiple of derived from 0 to 2, such as 0.65"
    assert str(caught.value) == f"coupling = {coupling!r}: {expected}"
