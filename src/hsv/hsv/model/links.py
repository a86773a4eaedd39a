"""Communication links in the loop, whose payloads may arrive late, be lost or be corrupted; see ``core/links.h``.

One link leads from the sensors to filter, nominal trajectory and controller, the other from the controller to the fault
injector. In every step each link transmits one message, for which the loop waits; only its payload can be late or lost.
The receiver uses the most recently sent of the payloads that have arrived. Payloads sent before the flight equal the
first one (sensors) or the input of the trim (controller).

In a corrupted payload one of the 64 bits of one number is flipped. The receiver detects this by a checksum, if there is
one, or if the number is not finite or beyond ``LARGEST`` of ``core.h``; the payload is then lost.

The computing time of the controller is split: whole periods delay the command link; the rest is the time within a
period at which the actuators receive the command, see :func:`computation`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.core import Struct, doubles, lib, vector

MEASUREMENT_LINK, COMMAND_LINK = "measurement", "command"

_CHANNELS = {MEASUREMENT_LINK: 0, COMMAND_LINK: 1}
"""Index of each link in the streams of random numbers."""


def _parameters(link: str) -> tuple[Parameter, ...]:
    where, longest = f"link.{link}", float(lib.MAX_DELAY)
    return (
        Parameter(f"{where}.delay", 0.0, "age of a payload, control periods", "", 0.0, longest, whole=True),
        Parameter(
            f"{where}.jitter", 0.0, "largest additional random delay, control periods", "", 0.0, longest, whole=True
        ),
        Parameter(f"{where}.loss", 0.0, "probability that a payload is lost: the last one is held", "", 0.0, 1.0),
        Parameter(
            f"{where}.burst",
            0.0,
            "mean number of consecutive losses; 0: independent losses",
            "",
            0.0,
            1e6,
            needs=f"{where}.loss",
        ),
        Parameter(f"{where}.corruption", 0.0, "probability that a bit of a payload is flipped", "", 0.0, 1.0),
        Parameter(
            f"{where}.checksum", False, "true: a corrupted payload is detected and lost", needs=f"{where}.corruption"
        ),
    )


COMPUTATION_PARAMETER = Parameter(
    "link.computational_delay", 0.0, "delay from the measurement to the resulting command", "s", 0.0, 1.0
)
MEASUREMENT_LINK_PARAMETERS = _parameters(MEASUREMENT_LINK)
COMMAND_LINK_PARAMETERS = _parameters(COMMAND_LINK)


def computation(values: Mapping[str, object], period: float) -> tuple[int, float]:
    """Return the computing time of the controller as whole periods and the remaining fraction of a period."""
    time = validate((COMPUTATION_PARAMETER,), values)[COMPUTATION_PARAMETER.name]
    periods = round(time / period, 9)  # without the rounding error of the division
    whole = math.floor(periods)
    return whole, periods - whole


def measurement_link(values: Mapping[str, object]) -> Struct:
    """Return the link from the sensors, given values of :data:`MEASUREMENT_LINK_PARAMETERS`."""
    return _link(MEASUREMENT_LINK, values, 0)


def command_link(values: Mapping[str, object], period: float) -> Struct:
    """Return the link from the controller; its delay includes the whole periods of :func:`computation`."""
    return _link(COMMAND_LINK, values, computation(values, period)[0])


def _link(name: str, values: Mapping[str, object], computing: int) -> Struct:
    v = validate(_parameters(name), values)
    delay, jitter, loss, burst, corruption, checksum = v.values()
    # A two-state Gilbert channel with the given mean burst length and loss rate (Gilbert 1960).
    least = max(1.0, loss / (1.0 - loss)) if loss < 1.0 else 1.0
    if burst and burst < least:
        raise ParameterError(f"parameter link.{name}.burst = {burst}: expected 0, or at least {least:.6g}")
    bursts = burst > 0.0 and loss < 1.0
    return Struct(
        "hsv_link",
        channel=_CHANNELS[name],
        delay=int(delay) + computing,
        jitter=int(jitter),
        loss=loss,
        loss_after_arrival=loss / (burst * (1.0 - loss)) if bursts else loss,
        loss_after_loss=1.0 - 1.0 / burst if bursts else loss,
        corruption=corruption,
        checksum=checksum,
        ideal=not (delay or computing or jitter or loss or corruption),
    )


def link_state(link: Struct, size: int, before: np.ndarray | None = None) -> np.ndarray:
    """Return the initial state of a ``link``.

    Args:
        link: The link.
        size: Number of values in a payload.
        before: Payload, shape (size,), sent before the flight; None: equal to the first payload of the flight.
    """
    memory = np.zeros(lib.ACCEPTED + size * (link.delay + link.jitter + 2))
    if before is not None:
        lib.hsv_fill_link(doubles(memory), len(memory), doubles(vector(before)), size)
    return memory
