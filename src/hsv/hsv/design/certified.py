"""A certified design, read from its parameter file and its certificate, and the plan of its nominal vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from hsv.certificate.checks import Subject, load_subject
from hsv.control.design import ControlDesign
from hsv.design.disturbance import DisturbanceSet, widened
from hsv.design.inputs import CertifiedInputs, inputs_from_report
from hsv.design.region import Region, incomplete_share, measure
from hsv.design.sets.invariant_set import InvariantSet
from hsv.design.tube_problem import tube_problem
from hsv.flight.disturbance import ChannelModel, scheduled
from hsv.flight.flight import Flight
from hsv.model.lpv.actuated import respond, sampled_actuators
from hsv.model.lpv.linearisation import acceleration_channels
from hsv.model.signals import ACCELERATED, CHANNELS, N_RIGID, REMAINING


@dataclass(frozen=True)
class CertifiedDesign(Subject):
    """A design and its certificate, with the sets that the certificate states."""

    @cached_property
    def inputs(self) -> CertifiedInputs:
        """The design inputs in the certificate, validated."""
        return inputs_from_report(self.certificate["inputs"])

    @property
    def disturbance(self) -> DisturbanceSet:
        """The disturbance set W in the certificate."""
        return DisturbanceSet.from_report(self.certificate["tube"]["disturbance"]["channels"])

    @property
    def lag_feedback(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Minimum and maximum, shape (2,) each, of the feedback due to the actuators' lag; None: ideal actuators."""
        lag = self.certificate["tube"]["tightening"].get("lag_feedback")
        return (np.array(lag["lower"]), np.array(lag["upper"])) if lag else None

    def invariant_set(self) -> InvariantSet:
        """Return the invariant set in the certificate, with the error system of the design file."""
        problem = tube_problem(self.design, self.vehicle, self.disturbance)
        return InvariantSet.from_report(problem, self.certificate["tube"]["invariant_set"])


def load_certified(path: Path) -> CertifiedDesign:
    """Return the design in the parameter file at ``path``, with its certificate.

    Raises:
        DesignError: One of the two files is missing or malformed.
    """
    return CertifiedDesign(**vars(load_subject(path)))


@dataclass(frozen=True)
class Plan:
    """The plan (nominal trajectory) of ``flight``, a simulation of the nominal vehicle; k rows, one for each step.

    Methods that return bounds multiply them by :attr:`inflation`, like the bounds of the disturbance set.
    """

    subject: CertifiedDesign
    flight: Flight

    @classmethod
    def of(cls, subject: CertifiedDesign) -> Plan:
        """Return the plan from a flight of the nominal vehicle in the design's region; errors: :meth:`Region.fly`."""
        inputs = subject.inputs
        return cls(subject, Region(subject.design, inputs, incomplete_share(inputs)).fly({}))

    @property
    def states(self) -> np.ndarray:
        """Rigid states of the nominal trajectory, x_r + x_n (k, 5), SI."""
        return np.asarray((self.flight.reference + self.flight.history.deviation)[:, :N_RIGID])

    @property
    def inflation(self) -> float:
        """Factor on all measured bounds, from the design inputs."""
        return float(self.subject.inputs.disturbance.inflation)

    @property
    def half_width(self) -> np.ndarray:
        """Half-widths, shape (5,), of the certified invariant set in the rigid states, SI."""
        return np.array(self.subject.certificate["tube"]["invariant_set"]["half_width"][:N_RIGID])

    def largest(self) -> np.ndarray:
        """Return the largest magnitude of each rigid state along the plan, shape (5,), inflated, SI."""
        return np.asarray(self.inflation * np.abs(self.states).max(axis=0))

    def change(self, steps: np.ndarray) -> np.ndarray:
        """Return the largest change of rigid state i of the plan over ``steps[i]`` steps, for each i, inflated, SI."""
        pairs = [(self.states[n:, i], self.states[: len(self.states) - n, i]) for i, n in enumerate(steps)]
        return np.array([self.inflation * np.abs(later - before).max() for later, before in pairs])

    def scheduling(self, errors: np.ndarray) -> np.ndarray:
        """Return by how much errors of measured altitude and velocity, up to ``errors`` (m, m/s), widen the set W.

        The nominal model is scheduled with the measured altitude and velocity. An error in them changes the next x_n
        by [A(p + error) - A(p)] x_n + [B(p + error) - B(p)] u_n. The result, shape (7,), is the largest magnitude in
        each channel over the plan and the errors' four sign combinations, inflated; 0 for lost elevator and filter.
        """
        polytope, h = self.subject.design.polytope, self.flight.history
        points = h.state[:, :2]
        here = scheduled(polytope, points)
        signs = product((-1.0, 1.0), repeat=2)
        ends = np.array([scheduled(polytope, points + np.multiply(each, errors)) for each in signs])
        rows = np.column_stack((h.deviation, h.nominal_input))
        off = np.einsum("skij,kj->ski", ends - here, rows)[..., :N_RIGID]
        columns = acceleration_channels(self.subject.vehicle, self.subject.design.period)
        accelerations = off[..., ACCELERATED] @ np.linalg.inv(columns[ACCELERATED]).T
        remains = off[..., REMAINING] - accelerations @ columns[REMAINING].T
        largest = np.zeros(len(CHANNELS))
        largest[:3], largest[5:] = np.abs(accelerations).max(axis=(0, 1)), np.abs(remains).max(axis=(0, 1))
        return self.inflation * largest

    def remeasured(self, equipment: Mapping[str, Any]) -> np.ndarray:
        """Return by how much disturbances with ``equipment`` exceed the certified bounds, shape (7,); 0 if they do not.

        Sensor errors move the elevator, and the polytopic model predicts the response only in part. Disturbances are
        measured in flights of the nominal vehicle and of 32 corners, and inflated. ``equipment``: sensor parameters.

        Raises:
            DesignError: A flight diverges or saturates an input.
        """
        subject, inputs = self.subject, self.subject.inputs
        region = Region(subject.design, inputs, incomplete_share(inputs), equipment)
        model = ChannelModel(subject.design, subject.vehicle)
        found = measure(region, model, region.screening()).channels
        bounds = subject.disturbance
        lower, upper = widened(found.lower, found.upper, self.inflation)
        return np.maximum(np.maximum(bounds.lower - lower, upper - bounds.upper), 0.0)

    def actuators(self, design: ControlDesign) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (k, a) and the commands (k, 2) of the actuators of ``design`` along the plan, SI.

        They are those for zero tube error: the commands are the plan plus the feedback due to the actuators' lag behind
        it. Both arrays are deviations from the rest position before the flight.
        """
        model = ChannelModel(design, self.subject.vehicle)
        commands = self.flight.plan - model.at_rest(self.flight)
        driven = respond(sampled_actuators(design.actuator_sets, design.period), commands)[0]
        late, feedback = model.lag(self.flight)
        return driven + late[:, -driven.shape[1] :], commands + feedback
