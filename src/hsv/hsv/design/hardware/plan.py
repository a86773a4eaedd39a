"""Data of the nominal trajectory for the effects of hardware: the nominal vehicle's flight of the declared region."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.design.certified import CertifiedDesign
from hsv.design.disturbance import CHANNELS, Record, acceleration_channels, scheduled, widened
from hsv.design.error_system import tube_errors
from hsv.design.region import Region, incomplete_share, measure, record
from hsv.design.tube_problem import channel_model, known_actuators
from hsv.model.lpv.actuated import respond, sampled_actuators
from hsv.model.signals import N_RIGID
from hsv.model.trim import trim

_ACCELERATED, _REMAINING = [1, 2, 4], [0, 3]
"""Rigid states that the held accelerations explain, and those in which something remains."""

_EXPLAINED, _RESIDUAL = [0, 1, 2], [5, 6]
"""Their channels in the structured set."""


@dataclass(frozen=True)
class Plan:
    """A plan (k rows); its bounds are inflated like those of the design.

    ``states`` x_r + x_n (k, 5) and ``inputs`` u_r + u_n (k, 2); ``record`` of the flight.
    """

    subject: CertifiedDesign
    record: Record

    @classmethod
    def of(cls, subject: CertifiedDesign) -> Plan:
        """Fly the nominal vehicle over the declared region of ``subject``."""
        inputs = subject.inputs
        return cls(subject, record(Region(subject.design, inputs, incomplete_share(inputs)).fly({})))

    @property
    def states(self) -> np.ndarray:
        """x_r + x_n (k, 5)."""
        return np.asarray((self.record.reference + self.record.deviation)[:, :N_RIGID])

    @property
    def inflation(self) -> float:
        """Inflation of bounds."""
        return float(self.subject.inputs.disturbance.inflation)

    @property
    def half_width(self) -> np.ndarray:
        """Half-widths (5) of the rigid states in the certified set."""
        return np.array(self.subject.certificate["tube"]["invariant_set"]["half_width"][:N_RIGID])

    def largest(self) -> np.ndarray:
        """Return the largest magnitude (5) of the rigid states."""
        return np.asarray(self.inflation * np.abs(self.states).max(axis=0))

    def change(self, steps: np.ndarray) -> np.ndarray:
        """Return the largest change of each rigid state (5) over the given number of steps (5)."""
        pairs = [(self.states[n:, i], self.states[: len(self.states) - n, i]) for i, n in enumerate(steps)]
        return np.array([self.inflation * np.abs(later - before).max() for later, before in pairs])

    def scheduling(self, errors: np.ndarray) -> np.ndarray:
        """Return the widening (7) of the structured set that errors (2) of altitude and velocity cause.

        The nominal model is scheduled with the measurement, so its prediction of x_n is off by
        [A(p + error) - A(p)] x_n + [B(p + error) - B(p)] u_n. Both ends of both errors are looked at.
        """
        polytope, points = self.subject.design.polytope, self.record.state[:, :2]
        here = scheduled(polytope, points)
        ends = [scheduled(polytope, points + np.multiply(signs, errors)) for signs in product((-1.0, 1.0), repeat=2)]
        columns = acceleration_channels(self.subject.vehicle, self.subject.design.period)
        inverse = np.linalg.inv(columns[_ACCELERATED])
        largest = np.zeros(len(CHANNELS))
        for k, row in enumerate(np.column_stack((self.record.deviation, self.record.nominal_input))):
            # Where the plan has come to rest there is nothing to be wrong about.
            if not np.abs(row).max() > 0.0:
                continue
            for there in ends:
                off = ((there[k] - here[k]) @ row)[:N_RIGID]
                accelerations = inverse @ off[_ACCELERATED]
                largest[_EXPLAINED] = np.maximum(largest[_EXPLAINED], np.abs(accelerations))
                remains = off[_REMAINING] - columns[_REMAINING] @ accelerations
                largest[_RESIDUAL] = np.maximum(largest[_RESIDUAL], np.abs(remains))
        return self.inflation * largest

    def remeasured(self, equipment: Mapping[str, Any]) -> np.ndarray:
        """Return by how much flights with ``equipment``, flat parameters of sensors, leave the structured set (7).

        Noise moves the elevator, and the model does not explain all of the response. The rest is measured as the set
        is: in flights of the nominal vehicle and 32 corners, inflated.

        Raises:
            DesignError: A flight is lost or limited.
        """
        subject, inputs = self.subject, self.subject.inputs
        region = Region(subject.design, inputs, incomplete_share(inputs), equipment)
        model = channel_model(subject.design, subject.vehicle)
        found = measure(region, model, region.screening()).channels
        bounds = subject.disturbance
        lower, upper = widened(found.lower, found.upper, self.inflation)
        return np.maximum(np.maximum(bounds.lower - lower, upper - bounds.upper), 0.0)

    def actuators(self, design: ControlDesign) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (k, a) of the actuators that ``design`` knows as the plan and its lag move them, no error.

        And the commands (k, 2) that move them: the plan's, and the feedback to its lag.
        """
        sampled = sampled_actuators(known_actuators(design), design.period)
        model = channel_model(design, self.subject.vehicle)
        at_rest = trim(self.subject.vehicle.decoupled, *self.record.state[0, :2]).input
        rows = self.record
        e, feedback = model.errors(rows)
        late = (
            tube_errors(rows.state, rows.deviation, rows.reference, model.notch, sampled, rows.actuator - rows.plan) - e
        )
        driven = respond(sampled, rows.plan - at_rest)[0]
        return driven + late[:, late.shape[1] - driven.shape[1] :], rows.plan - at_rest + feedback
