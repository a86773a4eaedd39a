"""Flights side by side that are read while they are flown: only a piece of their histories is in memory at a time.

What a campaign keeps of a flight is read from its history four times: for the fingerprint, the level in the tube,
metrics and envelope. The history of several flights is larger than the caches near a processor, a piece of it is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from hsv.campaign.tube_levels import TubeLevels, worst_level
from hsv.compiled import bound, njit_in_flight
from hsv.lane_types import WIDTH
from hsv.lanes import LaneArray, with_lane
from hsv.sha256_pairs import AVAILABLE, BLOCK_NUMBERS, absorb, finished, initial
from hsv.simulation.closed_loop import Components, fly_loop
from hsv.simulation.curves import read_flight
from hsv.simulation.fingerprint import fingerprint, written
from hsv.simulation.flight import fault_start, times
from hsv.simulation.history import ACTUATOR, BESIDE, FLOWN, Q_F, U_N, U_UNSATURATED, X_N, U, X
from hsv.simulation.metrics import CURVES, FlightCurves, FlightData
from hsv.simulation.side_by_side import FlightGroup, LaneHistory, lane_loop
from hsv.vehicle.dynamics import N_STATES

PIECE = 17 * BLOCK_NUMBERS
"""Rows of a piece, which are whole blocks of a digest.

The pieces of 8 lanes take half of a second-level cache of 512 KiB, those of 16 lanes half of one of 1 MiB. Were the
bytes of a piece a multiple of 4096, the same row of all lanes would compete for a few lines of the first-level cache.
"""


class FlightReading(NamedTuple):
    """What is read of a flight: curves, last state (9), worst level in the tube where there is one, fingerprint."""

    curves: FlightCurves
    last: np.ndarray
    level: float | None
    fingerprint: str | None

    @classmethod
    def of(cls, data: FlightData, level: float | None, fingerprint: str | None) -> Self:
        """Return the reading of a flight whose whole history is in memory."""
        return cls(data.flight_curves, data.state[-1], level, fingerprint)


class FlightReader:
    """Flies flights of one campaign side by side, and reads them."""

    def __init__(self, steps: int, levels: TubeLevels) -> None:
        """Make room for flights of so many control periods."""
        self._rows, self._levels = steps + 1, levels
        # Where Python's own digest is computed afterwards, the whole history is one piece.
        self._history = LaneHistory(PIECE if AVAILABLE else self._rows)
        self._curves = np.empty((WIDTH, CURVES, self._rows))
        self._saturated = np.empty((WIDTH, self._rows, 2), bool)
        # All that is passed has the same types, for all flights that are taken.
        self._fly_and_read = bound(_fly_and_read)

    @staticmethod
    def takes(components: Sequence[Components]) -> bool:
        """Tell whether a :class:`FlightGroup` takes flights, and they have one reference and one set of gains."""
        shared = {(id(own.nominal_trajectory.reference), id(own.controller.kernel)) for own in components}
        return FlightGroup.takes(components) and len(shared) == 1

    def read(self, components: Sequence[Components]) -> list[FlightReading]:
        """Fly ``components``, which are taken; what is returned is valid until the next ones are flown.

        Raises:
            ValueError: They last longer or shorter than the reader has room for, or are more than there are lanes.
        """
        rows, first = self._rows, components[0]
        if len(components) > WIDTH or first.plant.steps + 1 != rows:
            raise ValueError(f"{len(components)} flights of {first.plant.steps} steps: expected {rows - 1} steps")
        ended = np.full(WIDTH, rows)
        last = np.empty((WIDTH, N_STATES))
        state, tails = initial(WIDTH), np.zeros((WIDTH, BLOCK_NUMBERS))
        worst = LaneArray.zeros(1)
        self._fly_and_read(
            lane_loop(components, rows),
            self._history.lanes,
            self._history.arrays,
            ended,
            first.nominal_trajectory.reference.along(rows).state,
            (self._levels.tube, self._levels.work(LaneArray.zeros), LaneArray.zeros(1), worst),
            (self._curves, self._saturated, last),
            (state, tails) if AVAILABLE else None,
        )
        lengths = ended.tolist()
        if AVAILABLE:
            digests = [written(digest) for digest in finished(state, [n * FLOWN for n in lengths], [*tails])]
        else:
            digests = [fingerprint(flown[:n]) for flown, n in zip(self._history.arrays[0], lengths, strict=True)]
        found = []
        for i, own in enumerate(components):
            n = lengths[i]
            curves = FlightCurves(
                times(n, own.plant.period), self._curves[i, :, :n], self._saturated[i, :n], fault_start(own, n)
            )
            level = float(worst.array[0, i]) if self._levels.defined else None
            found.append(FlightReading(curves, last[i], level, digests[i]))
        return found


@njit_in_flight(nogil=True)
def _fly_and_read(
    loop: Any,
    lane_history: Any,
    history: Any,
    ended: np.ndarray,
    reference: np.ndarray,
    levels: Any,
    kept: Any,
    digest: Any,
) -> None:
    """Fly a piece, read it, and fly the next one, until the flights end.

    Args:
        loop: First arguments of :func:`hsv.simulation.closed_loop.fly_loop`.
        lane_history: The history of a piece, in lanes.
        history: The same memory as arrays (lanes, rows of a piece, columns).
        ended: Rows of each flight (lanes); holds those of a flight that does not diverge.
        reference: x_r (n + 1, 9).
        levels: Tube, scratch and rows for :func:`hsv.campaign.tube_levels.worst_level`, and what it writes to.
        kept: Curves, saturation and last state of each flight.
        digest: State of each flight's digest, and numbers after its last whole block, or ``None``.
    """
    tube, work, lengths, worst = levels
    flown = lane_history[0]
    rows, size, stop = len(reference), len(flown), 0
    while stop < rows:
        start, stop = stop, min(stop + size, rows)
        fly_loop(*loop, lane_history, ended, start, stop)  # type: ignore[call-arg]
        if len(tube[2]) > 0:
            for i in range(len(ended)):  # which a flight that diverged in this piece has just changed
                lengths[0] = with_lane(lengths[0], i, float(ended[i]))
            worst_level(tube, work, reference, flown, flown, X_N, lengths, worst, start)
        latest = 0
        for i in range(len(ended)):
            latest = max(latest, ended[i])
            _read_piece(i, start, min(stop, ended[i]), ended[i], history, reference, kept)
        if digest is not None:
            for i in range(0, len(ended), 2):
                _digest_piece(i, start, stop, ended, history[0], digest)
        if latest <= stop:
            break


@njit_in_flight()
def _read_piece(lane: int, start: int, stop: int, rows: int, history: Any, reference: np.ndarray, kept: Any) -> None:
    """Read the steps ``start`` ... ``stop`` - 1 of a flight of so many ``rows``; there may be none."""
    n = stop - start
    if n <= 0:
        return
    curves, saturated, last = kept
    own, beside = history[0][lane, :n], history[1][lane, :n]
    read_flight(
        own[:, X:Q_F],
        reference[start:stop],
        own[:, X_N:U_N],
        own[:, U:ACTUATOR],
        beside[:, U_UNSATURATED:BESIDE],
        curves[lane, :, start:stop],
        saturated[lane, start:stop],
    )
    if stop == rows:
        for i in range(len(last[lane])):
            last[lane, i] = own[n - 1, X + i]


@njit_in_flight()
def _digest_piece(lane: int, start: int, stop: int, ended: np.ndarray, flown: np.ndarray, digest: Any) -> None:
    """Take the steps ``start`` ... ``stop`` - 1 of the flights of two lanes into their digests, as far as they fly."""
    state, tails = digest
    first, second = flown[lane], flown[lane + 1]
    n = max(min(stop, ended[lane]) - start, 0) * FLOWN
    m = max(min(stop, ended[lane + 1]) - start, 0) * FLOWN
    absorb(state[lane : lane + 2], first.ctypes.data, second.ctypes.data, n // BLOCK_NUMBERS, m // BLOCK_NUMBERS)
    _keep_tail(first, n, tails[lane])
    _keep_tail(second, m, tails[lane + 1])


@njit_in_flight()
def _keep_tail(rows: np.ndarray, numbers: int, tail: np.ndarray) -> None:
    """Copy what follows the last whole block of ``numbers`` numbers; only a flight's last piece has such a tail."""
    left = numbers % BLOCK_NUMBERS
    for j in range(left):
        number = numbers - left + j
        tail[j] = rows[number // FLOWN, number % FLOWN]
