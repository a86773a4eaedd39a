"""Linear systems behind actuators and a delay, discretised exactly: what the controller commands is held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsv.core import Data, doubles, lib, vector
from hsv.model.actuators import ActuatorSet
from hsv.model.lpv.linearisation import zero_order_hold
from hsv.model.signals import INPUT_NAMES, N_INPUTS


def actuator_names(actuators: Sequence[ActuatorSet]) -> tuple[str, ...]:
    """Return the names of the states of ``actuators``, a position and, of the second order, a rate each."""
    return tuple(
        f"{actuator.channel}_{state}" for actuator in actuators for state in ("position", "rate")[: actuator.order]
    )


def actuator_system(actuators: Sequence[ActuatorSet]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return A (a, a), B (a, 2), C (2, a), D (2, 2) of all actuators in continuous time, from commands to positions.

    Limits are left out. A channel without an actuator passes its command.

    Args:
        actuators: Actuators of order 1 or 2, at most one per channel.
    """
    states = sum(actuator.order for actuator in actuators)
    A, B = np.zeros((states, states)), np.zeros((states, N_INPUTS))
    C, D = np.zeros((N_INPUTS, states)), np.eye(N_INPUTS)
    first = 0
    for actuator in actuators:
        channel, w = INPUT_NAMES.index(actuator.channel), actuator.natural_frequency
        if actuator.order == 1:
            A[first, first], B[first, channel] = -w, w
        else:
            A[first, first + 1] = 1.0
            A[first + 1, first : first + 2] = -w * w, -2.0 * actuator.damping_ratio * w
            B[first + 1, channel] = w * w
        C[channel, first], D[channel, channel] = 1.0, 0.0
        first += actuator.order
    return A, B, C, D


@dataclass(frozen=True, eq=False)
class SampledActuators(Data):
    """Actuators over a period, commands held: a+ = A a + B c exactly, and C a + D c is where they are on average.

    A (a, a), B (a, 2), C (2, a), D (2, 2). To a vehicle that answers slowly the average is all that counts, so that
    behind it the hull of the vertices of a polytopic model stays what it is.
    """

    KIND = "hsv_sampled"
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


def sampled_actuators(actuators: Sequence[ActuatorSet], period: float) -> SampledActuators:
    """Return ``actuators``, see :func:`actuator_system`, sampled at ``period`` (s)."""
    A, B, C, D = actuator_system(actuators)
    # The actuators, with integrators of their positions.
    whole = np.block([[A, np.zeros((len(A), N_INPUTS))], [C, np.zeros((N_INPUTS, N_INPUTS))]])
    transition, entering = zero_order_hold(whole, np.vstack((B, D)), period)
    a = len(A)
    return SampledActuators(
        *(
            np.ascontiguousarray(block)
            for block in (transition[:a, :a], entering[:a], transition[a:, :a] / period, entering[a:] / period)
        )
    )


def respond(actuators: SampledActuators, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the states (k, a) before each period and the mean positions (k, 2) over it, for ``commands`` (k, 2).

    They start from zero: commands are deviations from where the actuators rest.
    """
    states, means = np.empty((len(commands), len(actuators.A))), np.empty((len(commands), N_INPUTS))
    given = (doubles(vector(each)) for each in (commands, states, means))
    lib.hsv_respond(actuators.pointer, len(commands), *given)
    return states, means


def held_behind(
    A: np.ndarray, B: np.ndarray, period: float, actuators: Sequence[ActuatorSet] = (), delay: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the discrete (A, B) of dx/dt = A x + B p, where p are the positions of actuators and commands are held.

    Args:
        A: (n, n), continuous time.
        B: (n, 2).
        period: Period of the commands (s).
        actuators: See :func:`actuator_system`; their states follow the n.
        delay: Delay (s) of all commands; delayed ones follow the actuators' states, the newest first.

    Returns:
        A (n + a + d, n + a + d) and B (n + a + d, 2), of a states of actuators and d commands under way.
    """
    from scipy.linalg import expm  # see hsv.model.lpv.linearisation

    n = len(A)
    A_a, B_a, C, D = actuator_system(actuators)
    whole = np.block([[A, B @ C], [np.zeros((len(A_a), n)), A_a]])
    inputs = np.vstack((B @ D, B_a))
    if delay == 0.0:
        return zero_order_hold(whole, inputs, period)
    waiting = int(np.ceil(delay / period - 1e-12))
    late = delay - (waiting - 1) * period
    # The older command acts for the first ``late`` seconds of a period, the newer one for the rest.
    states = len(whole)
    transition, newer = zero_order_hold(whole, inputs, period - late)
    older = transition @ zero_order_hold(whole, inputs, late)[1]
    held, entering = (
        np.zeros((states + N_INPUTS * waiting, width)) for width in (states + N_INPUTS * waiting, N_INPUTS)
    )
    held[:states, :states] = expm(whole * period)
    commands = np.arange(states, states + N_INPUTS * waiting).reshape(waiting, N_INPUTS)
    held[:states, commands[-1]] = older
    if waiting > 1:
        held[:states, commands[-2]] = newer
    else:
        entering[:states] = newer
    entering[commands[0]] = np.eye(N_INPUTS)
    for row, before in zip(commands[1:], commands[:-1], strict=True):
        held[row, before] = 1.0
    return held, entering
