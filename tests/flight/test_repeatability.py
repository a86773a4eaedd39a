"""Controllers whose flights are repeatable byte for byte, and controllers whose flights are not."""

import random
from types import SimpleNamespace

import numpy as np
import pytest
from c_libraries import step_function
from steady_controllers import OfTheProcess, Steady

from hsv.base.errors import RunError
from hsv.control.controller import StepKernel
from hsv.flight import repeatability
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.repeatability import findings, under_load
from hsv.flight.scenario import load_scenario

STEPS = 100


class NotReset(Steady):
    """Keeps its integral from one flight to the next."""

    def reset(self):
        pass


class Random(Steady):
    """Adds random noise from step 30 on."""

    def more(self, inputs):
        return 1e-9 * random.random() if inputs.step >= 30 else 0.0


class Shared(Steady):
    """Shares one integral between all instances."""

    everybodys = SimpleNamespace(integral=0.0)

    def __init__(self):
        self.memory = self.everybodys

    def __deepcopy__(self, memo):
        return type(self)()


class Failing(Steady):
    """Fails in the second flight of a process."""

    flights = 0

    def reset(self):
        super().reset()
        Failing.flights += 1

    def more(self, inputs):
        return np.nan if inputs.step == 12 and self.flights > 1 else 0.0


class Compiled(Steady):
    """Counts steps in its state."""

    outside = 0.0

    def __init__(self):
        self.kernel = StepKernel(step_function("counting"), np.zeros(1), np.array([0.0, self.outside]))


class CompiledStatic(Compiled):
    """Counts steps outside its state, in its parameters."""

    outside = 1.0


def scenario(controller):
    name = controller if isinstance(controller, str) else f"{controller.__module__}:{controller.__name__}"
    return load_scenario("case1", {"controller": name, "duration": "2 s", "fault": []})


@pytest.fixture
def found(monkeypatch):
    """Return a function that returns the differences by check; no processes are started for load."""
    monkeypatch.setattr(repeatability, "under_load", lambda *_: repeatability.Finding("under load", 0, ""))

    def differing(controller):
        return {f.check: f.difference for f in findings(scenario(controller)) if f.difference}

    return differing


@pytest.mark.parametrize("controller", [Steady, Compiled, "tube_mpc"])
def test_one_that_keeps_its_state_to_itself_is_the_same_in_every_way(found, controller):
    assert found(controller) == {}


def test_one_that_is_not_reset_is_found_with_its_first_step(found):
    assert found(NotReset).keys() == {"after a reset"}
    assert found(NotReset)["after a reset"].startswith("u_unsaturated from step 0 on: [")


def test_one_that_draws_numbers_is_found_from_the_step_on_in_which_it_does(found):
    differing = found(Random)
    assert differing.keys() == {"flown twice", "after a reset", "from a copied state"}
    assert differing["flown twice"].startswith("u_unsaturated from step 30 on: [")
    assert differing["from a copied state"].startswith("the controller: u_unsaturated from step 30 on: [")


@pytest.mark.parametrize("controller", [Shared, CompiledStatic])
def test_one_that_shares_its_state_is_found_beside_its_copy(found, controller):
    differing = found(controller)["from a copied state"]
    assert differing.startswith(f"its copy: u_unsaturated from step {STEPS // 2} on: [")


def test_a_failure_in_a_later_flight_is_a_difference_and_one_in_the_first_an_error(found, monkeypatch):
    monkeypatch.setattr(Failing, "flights", 0)
    assert "Failing, step 12: answered" in found(Failing)["flown twice"]
    with pytest.raises(RunError, match="Failing, step 12"):
        found(Failing)


@pytest.mark.long
def test_several_flights_at_a_time_in_several_processes_are_compared():
    flown = scenario(OfTheProcess)
    finding = under_load(flown, fly(assemble_flight(flown)))
    assert finding.flights >= 4
    assert finding.difference.startswith("u_unsaturated from step 0 on: [")
