"""Exact discretisation of actuators, and of linear systems driven through actuators and a delay; commands are held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsv.core import Struct, doubles, lib, vector
from hsv.model.actuators import ActuatorSet
from hsv.model.lpv.linearisation import zero_order_hold
from hsv.model.signals import INPUT_NAMES, N_INPUTS


def actuator_names(actuators: Sequence[ActuatorSet]) -> tuple[str, ...]:
    """Return the names of the states of ``actuators``: a position for each and, if of second order, a rate."""
    return tuple(
        f"{actuator.channel}_{state}" for actuator in actuators for state in ("position", "rate")[: actuator.order]
    )


def actuator_system(actuators: Sequence[ActuatorSet]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return continuous-time A (a, a), B (a, 2), C (2, a), D (2, 2) of all actuators, from commands to positions.

    Position and rate limits are ignored. On a channel without an actuator the position is the command.

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


def sampled_actuators(actuators: Sequence[ActuatorSet], period: float) -> Struct:
    """Return A, B, C, D of ``actuators`` in discrete time, with commands held over a ``period`` (s).

    From the states a (see :func:`actuator_system`) and commands c, A a + B c are exactly the states one period later.
    C a + D c are the mean positions over the period. A vehicle that is slow compared with the period responds to these
    means, so they can be the inputs of the polytopic model.
    """
    A, B, C, D = actuator_system(actuators)
    # Integrators of the positions give their means.
    whole = np.block([[A, np.zeros((len(A), N_INPUTS))], [C, np.zeros((N_INPUTS, N_INPUTS))]])
    transition, entering = zero_order_hold(whole, np.vstack((B, D)), period)
    a = len(A)
    A, B, C, D = transition[:a, :a].copy(), entering[:a], transition[a:, :a] / period, entering[a:] / period
    return Struct("hsv_sampled", A=A, B=B, C=C, D=D)


def respond(actuators: Struct, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the actuator states (k, a) at the start of each period, and the mean positions (k, 2) during it.

    Args:
        actuators: Sampled actuators, initially at rest.
        commands: Deviations from the commands at rest, shape (k, 2).
    """
    states, means = np.empty((len(commands), len(actuators.A))), np.empty((len(commands), N_INPUTS))
    arrays = (doubles(vector(each)) for each in (commands, states, means))
    lib.hsv_respond(actuators.pointer, len(commands), *arrays)
    return states, means


def behind_sampled(A: np.ndarray, B: np.ndarray, actuators: Struct) -> tuple[np.ndarray, np.ndarray]:
    """Return A (r, n + a, n + a) and B (r, n + a, 2) of discrete systems that follow the mean actuator positions.

    The a states of the sampled ``actuators`` come last; ``A`` (r, n, n), ``B`` (r, n, 2).
    """
    (r, n, _), a = A.shape, len(actuators.A)
    whole, inputs = np.zeros((r, n + a, n + a)), np.empty((r, n + a, N_INPUTS))
    whole[:, :n, :n], whole[:, :n, n:], whole[:, n:, n:] = A, B @ actuators.C, actuators.A
    inputs[:, :n], inputs[:, n:] = B @ actuators.D, actuators.B
    return whole, inputs


def held_behind(
    A: np.ndarray, B: np.ndarray, period: float, actuators: Sequence[ActuatorSet] = (), delay: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Discretise dx/dt = A x + B p, in which the actuator positions p follow held commands; return the new A and B.

    Args:
        A: (n, n) state matrix, continuous time.
        B: (n, 2) input matrix, continuous time.
        period: Period of the commands (s).
        actuators: See :func:`actuator_system`; their states follow those of x.
        delay: Delay of all commands (s), which may exceed the period.

    Returns:
        Discrete-time A (n + a + d, n + a + d) and, for the commands, B (n + a + d, 2). The states are the n of x, the
        a of the actuators and d numbers of delayed commands, the newest command first.
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
    # In each period the older command acts for the first ``late`` seconds, the newer one for the rest.
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
