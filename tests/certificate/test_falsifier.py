"""A falsifier of designs: every field of certificate and design file is changed, swapped, removed; fields are added.

Each falsification must be noticed by a check, refused when it is read, or concern a field that is declared in
:data:`hsv.certificate.checks.STATED`. Consistent lies, with all that follows from them, must be noticed, too.
"""

import copy
from collections import Counter
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import pytest
from marking import long

from hsv.base.errors import HsvError
from hsv.certificate.checks import STATED, Subject, field_checks, gathered, leaves, load_subject
from hsv.certificate.coverage import only_share
from hsv.certificate.tolerances import PARAMETERS, TOLERANCES, entry_size
from hsv.certificate.verification import QUICK, RECOMPUTED, Tube
from hsv.control.design import ControlDesign, TubeSet
from hsv.control.design_file import find_design
from hsv.flight.assembly import uncovered_of
from hsv.flight.corners import corners
from hsv.flight.flown_checks import flight_checks
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import Vehicle

DESIGNS = sorted(path.stem for path in Path(__file__).parents[2].glob("offline_design/*.toml"))
PARTS = {**QUICK, **RECOMPUTED, "flights": partial(flight_checks, seed=3, number=8)}
DECLARED = 20
"""Largest number of declared fields."""


class Falsifier:
    """The honest checks of a design, and the falsifications of it that no check notices."""

    def __init__(self, name, parts=PARTS):
        self.subject, self.parts = load_subject(find_design(name)), parts
        self.missed, self.table = [], Counter()

    @cached_property
    def honest(self):
        """Names of failing checks, and the part that covers each field; a design for a share of W fails once."""
        checks = {name: list(gathered(name, partial(part, self.subject))) for name, part in self.parts.items()}
        failing = {check.name for made in checks.values() for check in made if not check.ok}
        assert failing <= ({"share of W"} if only_share(self.subject.certificate) else set())
        covering = {field: name for name, made in checks.items() for check in made for field in check.fields}
        return failing, covering, [check for made in checks.values() for check in made]

    def noticed(self, subject, field=""):
        failing, covering, made = self.honest
        others = [] if self.parts is PARTS else set(leaves(self.subject.certificate)) - covering.keys()
        if any(not check.ok for check in gathered("fields", partial(field_checks, subject, made, others))):
            return True
        first = covering.get(field, "")
        for name in sorted(self.parts, key=lambda name: (name != first, name == "flights")):
            if any(not c.ok and c.name not in failing for c in gathered(name, partial(self.parts[name], subject))):
                return True
        return False

    def try_(self, what, field, build, *given):
        """Count whether the falsification ``build(*given)`` is noticed or refused."""
        self.table["tried"] += 1
        try:
            if self.noticed(build(*given), field):
                self.table["noticed"] += 1
            elif field in STATED:
                self.table["declared"] += 1
            else:
                self.missed.append(f"{what} {field}")
        except HsvError:
            self.table["refused"] += 1

    def with_certificate(self, change, *given):
        certificate = copy.deepcopy(self.subject.certificate)
        change(certificate, *given)
        return Subject(self.subject.design, certificate)

    def with_parameters(self, changed):
        """Return the design with parameters, and the digests of both files that belong to them."""
        design = ControlDesign.from_parameters(changed | {"design.hash": ""})
        return Subject(design, {**self.subject.certificate, "parameters_sha256": design.digest})


def place(certificate, field):
    """Return the table or list that contains a field, and the field's key in it; keys may contain dots."""
    if field in certificate:
        return certificate, field
    key, _, inside = field.partition(".")
    return place(certificate[int(key) if isinstance(certificate, list) else key], inside)


def other(value, draw):
    """Return another value of the same kind: for a number, one that differs by 1 % and by 1e-6."""
    if isinstance(value, list) and value:
        entry = int(draw.integers(len(value)))
        return [*value[:entry], other(value[entry], draw), *value[entry + 1 :]]
    if isinstance(value, bool) or value is None:
        return not value
    if isinstance(value, int):
        return value + 1
    return value * 1.01 + 1e-6 if isinstance(value, float) else "other"


def set_in(certificate, field, value):
    table, key = place(certificate, field)
    table[key] = value


def walk_certificate(falsifier, draw, every=1):
    """Change and remove fields, swap those that have the same shape, and add one to every table."""
    _, covering, _ = falsifier.honest
    fields = [f for f in leaves(falsifier.subject.certificate) if f in covering or f in STATED or every == 1]
    fields = fields[int(draw.integers(every)) :: every]
    for field in fields:
        table, key = place(falsifier.subject.certificate, field)
        value = table[key]
        changed = 2.0 * value if field.startswith("model.accuracy") and type(value) is float else other(value, draw)
        falsifier.try_("change", field, falsifier.with_certificate, set_in, field, changed)
        falsifier.try_("remove", field, falsifier.with_certificate, remove, field)
        twins = [k for k in table if k != key and shape(table[k]) == shape(value)] if isinstance(table, dict) else []
        if twins and shape(value):
            twin = twins[int(draw.integers(len(twins)))]
            if differ(table[twin], value):
                falsifier.try_("swap", field, falsifier.with_certificate, swap, field, twin)
    tables = list({field.rpartition(".")[0] for field in fields})
    for table in sorted(table for table in tables if "vehicle.vehicle" not in table):
        falsifier.try_("add", f"{table}.x", falsifier.with_certificate, add, table)


def shape(value):
    """Return the shape of an array; an empty one if the value is a number, a text or a list of unequal rows."""
    try:
        return np.shape(value)
    except ValueError:
        return ()


def differ(a, b):
    """Return whether two values of the same shape differ, beyond rounding if they are numbers."""
    flat = [np.ravel(each).tolist() for each in (a, b)]
    if not all(isinstance(value, int | float) for each in flat for value in each):
        return a != b
    return not np.allclose(*flat, rtol=1e-3, atol=0.0)


def remove(certificate, field):
    table, key = place(certificate, field)
    del table[key]


def swap(certificate, field, twin):
    table, key = place(certificate, field)
    table[key], table[twin] = table[twin], table[key]


def add(certificate, field):
    table = certificate
    for key in field.split(".") if field else ():
        table = table[int(key) if isinstance(table, list) else key]
    table["x"] = 1.0


def walk_design(falsifier, draw, every=1):
    """Change an entry of each parameter by ten tolerances, swap two entries, and leave the parameter out."""
    values = falsifier.subject.design.to_parameters()
    for name in sorted(values)[int(draw.integers(every)) :: every]:
        if name == "design.hash" or (every > 1 and name.startswith(("model.a", "model.b", "scheduling", "input"))):
            continue
        value = values[name]
        left = {k: v for k, v in values.items() if k != name}
        falsifier.try_("remove", name, falsifier.with_parameters, left)
        if name not in PARAMETERS:
            falsifier.try_("change", name, falsifier.with_parameters, values | {name: other(value, draw)})
            continue
        array = np.array(value)
        size = np.resize(entry_size(name, falsifier.subject.certificate), array.shape or 1)
        entry = int(draw.integers(array.size)) if array.size else 0
        if array.size:
            changed = array.reshape(-1).copy()
            changed[entry] += 10.0 * TOLERANCES[PARAMETERS[name]].allowed(changed, size)[entry]
            changed = changed.tolist() if array.shape else float(changed[0])
            falsifier.try_("change", name, falsifier.with_parameters, values | {name: changed})
        if array.size > 1 and differ(swapped := [*value[1:], value[0]], value):
            falsifier.try_("swap", name, falsifier.with_parameters, values | {name: swapped})


def scaled(subject, share):
    """Return ``subject`` with W times ``share`` and everything that follows from W, in both files."""
    design, certificate = subject.design, copy.deepcopy(subject.certificate)
    tube, inside = certificate["tube"], certificate["tube"]["invariant_set"]
    for channel in tube["disturbance"]["channels"].values():
        channel |= {side: share * channel[side] for side in ("lower", "upper")}
    for name, power in {"centre": 1, "Q": 2, "half_width": 1, "feedback_half_range": 1}.items():
        inside[name] = (share**power * np.array(inside[name])).tolist()
    inside["counter_examples"]["half_range"] = (share * np.array(inside["counter_examples"]["half_range"])).tolist()
    bounds = Tube(Subject(design, certificate), design, "tube").tightened()
    plan = tube["tightening"]["plan"]
    tube["tightening"] |= {"lower": bounds[0].tolist(), "upper": bounds[1].tolist()}
    plan["margin_to_lower"] = (np.array(plan["lowest"][:2]) - bounds[0]).tolist()
    plan["margin_to_upper"] = (bounds[1] - np.array(plan["highest"][:2])).tolist()
    n = len(design.tube.centre)
    found = TubeSet(share * design.tube.centre, design.tube.shape / share**2, np.array(inside["half_width"][:n]))
    limits = replace(design.plan_bounds, input_minimum=bounds[0], input_maximum=bounds[1])
    return rehashed(replace(design, tube=found, plan_bounds=limits), certificate)


def rehashed(design, certificate):
    return Subject(design, certificate | {"parameters_sha256": design.digest})


def smaller_inflation(subject):
    lie = scaled(subject, 0.48)
    lie.certificate["inputs"]["disturbance"]["inflation"] *= 0.48
    return lie


def milder_flights(subject):
    """W is half of what it is, and the measured bounds, too; the named flights are the nominal one."""
    lie = scaled(subject, 0.5)
    measured = lie.certificate["tube"]["disturbance"]["measured"]
    for side in ("lower", "upper"):
        measured[side] = (0.5 * np.array(measured[side])).tolist()
        measured[f"{side}_flight"] = [0] * len(measured[side])
    return lie


def share_of_the_set(subject):
    lie = scaled(subject, 0.5)
    lie.certificate["inputs"]["disturbance"]["share"] = 0.5
    lie.certificate["tube"]["flights"] |= {"outside": 129, "worst_ratio": 1.82}
    return lie


def other_vehicle(**changes):
    def lie(subject):
        certificate = copy.deepcopy(subject.certificate)
        certificate["inputs"]["vehicle"] |= {f"vehicle.{name}": value for name, value in changes.items()}
        vehicle = Vehicle.from_parameters(certificate["inputs"]["vehicle"])
        flights = {"flights": len(corners(vehicle.uncertainty))}
        certificate["tube"]["flights"] |= flights
        certificate["tube"]["disturbance"] |= flights
        return rehashed(replace(subject.design, vehicle=vehicle.digest), certificate)

    return lie


LIES = {
    "inputs.disturbance.inflation": smaller_inflation,
    "tube.disturbance.measured.lower": milder_flights,
    "share of W": share_of_the_set,
    "inputs.vehicle.vehicle.name": other_vehicle(**{"uncertainty.names": [], "uncertainty.bounds": []}),
}


@pytest.mark.parametrize("check", [long(name) if name.startswith("tube") else name for name in LIES])
def test_a_consistent_lie_is_noticed(check):
    lie = LIES[check](load_subject(find_design("winged_cone")))
    failing = [
        c.name
        for name, part in PARTS.items()
        if name != "flights"
        for c in gathered(name, partial(part, lie))
        if not c.ok
    ]
    if check.startswith("tube"):
        # W is rounded outward, which shows this lie even before the flights do.
        failing = [c.name for c in gathered("flights", partial(PARTS["flights"], lie)) if not c.ok]
    assert any(name.startswith(check) for name in failing)


def test_a_narrower_range_of_the_vehicle_is_noticed():
    lie = other_vehicle(altitude_range=[33223.2, 34300.0])(load_subject(find_design("winged_cone")))
    failing = [c.name for name, part in QUICK.items() for c in gathered(name, partial(part, lie)) if not c.ok]
    assert "inputs.vehicle.vehicle.name" in failing


def test_a_shorter_region_is_another_true_statement_and_longer_flights_are_not_covered():
    subject = load_subject(find_design("baseline"))
    certificate = copy.deepcopy(subject.certificate)
    certificate["inputs"]["disturbance"]["duration"] = 120.0
    assert uncovered_of(load_scenario("case1"), subject.design, certificate) == [
        "duration: 200 s; the certificate is for 120 s at most"
    ]


def test_at_most_twenty_fields_are_declared():
    assert len(STATED) <= DECLARED and all(reason for reason in STATED.values())


def test_a_sample_of_falsifications_is_noticed():
    """The sample is of the fields that quick parts cover."""
    falsifier, draw = Falsifier("winged_cone", QUICK), np.random.default_rng(4)
    walk_certificate(falsifier, draw, every=4)
    walk_design(falsifier, draw, every=4)
    assert falsifier.missed == [] and falsifier.table["noticed"] > 40


@pytest.mark.long
@pytest.mark.parametrize("name", DESIGNS)
def test_every_falsification_is_noticed(name):
    falsifier, draw = Falsifier(name), np.random.default_rng(7)
    walk_certificate(falsifier, draw)
    walk_design(falsifier, draw)
    print(name, dict(falsifier.table))
    assert falsifier.missed == []
