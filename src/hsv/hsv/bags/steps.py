"""Recorded steps of a bag: joined topics, expected and complete steps; and warnings about an incomplete bag."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from hsv.bags.columns import Columns
from hsv.bags.description import RUN, STATE, TOPICS, TUBE_MPC, step_topics
from hsv.bags.files import being_recorded
from hsv.bags.reader import Bag, Loss
from hsv.bags.recover import RECOVERED
from hsv.base.errors import RecordingError
from hsv.model.plant import MAX_PERIOD, MAX_STEPS


def cut_off(bag: Bag) -> bool:
    """Return whether the last messages may be missing: the bag lacks its end or a file, or is a recovered one."""
    return not bag.complete or RECOVERED.items() <= bag.custom_data.items()


def joined(bag: Bag, topics: Sequence[str]) -> dict[str, Columns]:
    """Return the columns of ``topics`` at the steps that all of them have; raise a RecordingError if there is none."""
    columns = {topic: bag.columns(topic) for topic in topics}
    steps = [found["step"] for found in columns.values()]
    common = reduce(np.intersect1d, steps, steps[0])
    if not len(common):
        raise RecordingError(f"{bag.path}: holds no complete step, expected a flight")
    if all(np.array_equal(found, common) for found in steps):
        return columns
    rows = {}
    for topic, found in zip(topics, steps, strict=True):
        present, first = np.unique(found, return_index=True)
        rows[topic] = columns[topic].rows(first[np.searchsorted(present, common)])
    return rows


def expected_stamps(bag: Bag) -> NDArray[np.int64]:
    """Return the stamps (ns) of all steps that a complete bag contains.

    These are the steps that the plant announced on /hsv/run; without an announcement, those up to the last recorded
    one. If a recorded state ends the flight (finished or diverged), its step is the last, unless more are recorded.

    Raises:
        RecordingError: A message does not fit its definition, or the number of steps or the period is out of range.
    """
    found = np.unique(np.concatenate([np.array([], np.int64), *_stamps(bag).values()]))
    announced = _announced(bag) or _numbered(bag)
    if not announced:
        return found
    period, last = announced
    state = bag.columns(STATE) if STATE in bag.roles else Columns()
    if {"status", "step"} <= state.keys() and len(ends := np.flatnonzero(state["status"])):
        last = int(state["step"][ends[0]])
    if last > MAX_STEPS or not 0.0 < period <= MAX_PERIOD:
        raise RecordingError(
            f"{bag.path}: tells of {last} steps of {period:g} s, expected at most {MAX_STEPS} of at most "
            f"{MAX_PERIOD:g} s"
        )
    steps = np.round(np.arange(last + 1) * period * 1e9).astype(np.int64)
    return steps if not len(others := _without(found, steps)) else np.union1d(steps, others)


def _without(stamps: NDArray[np.int64], others: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the ``stamps`` that are not among the ``others``; both ascend, and nothing is sorted, as numpy would."""
    if len(others) > len(stamps):
        at = np.minimum(np.searchsorted(others, stamps), len(others) - 1)
        return stamps[others[at] != stamps]
    at = np.searchsorted(stamps, others)
    inside = at < len(stamps)
    at, others = at[inside], others[inside]
    return np.delete(stamps, at[stamps[at] == others])


def _announced(bag: Bag) -> tuple[float, int] | None:
    """Return period (s) and last step of the announced run, or None without a recorded announcement."""
    columns = bag.columns(RUN) if RUN in bag.roles else Columns()
    if not {"period", "last_step"} <= columns.keys() or not len(columns["period"]):
        return None
    return float(columns["period"][-1]), int(columns["last_step"][-1])


def _numbered(bag: Bag) -> tuple[float, int] | None:
    """Return period (s) and last step inferred from the recorded steps; None if no step after step 0 is recorded."""
    last: tuple[float, int] | None = None
    for topic, stamps in _stamps(bag).items():
        steps = bag.columns(topic).get("step", np.array([], np.uint64))
        if len(steps) and (number := int(steps.max())) > (last[1] if last else 0):
            last = float(stamps[np.argmax(steps)]) * 1e-9 / number, number
    return last


def _stamps(bag: Bag) -> dict[str, NDArray[np.int64]]:
    return {bag.name_of(topic): bag.times(topic) for topic in TOPICS if topic in bag.roles}


def complete_stamps(bag: Bag) -> NDArray[np.int64]:
    """Return the stamps (ns) of the complete steps, which are recorded on all step topics of the bag."""
    stamps = list(_stamps(bag).values())
    return reduce(np.intersect1d, stamps, stamps[0] if stamps else np.array([], np.int64))


def lost_seconds(bag: Bag) -> float:
    """Return the simulated time (s) of the steps that are missing or incomplete in the bag."""
    stamps = expected_stamps(bag)
    if len(stamps) < 2:
        return 0.0
    missing = len(_without(stamps, complete_stamps(bag)))
    return missing * float(np.median(np.diff(stamps))) * 1e-9


def irregularities(bag: Bag) -> list[str]:
    """Return messages about steps that are missing on all or some topics, repeated, or out of order.

    In a bag that may lack its end, missing steps are sought only up to the last step that all topics have reached.
    """
    stamps = _stamps(bag)
    every = expected_stamps(bag)
    found = np.unique(np.concatenate([np.array([], np.int64), *stamps.values()]))
    if not len(found):
        return []
    words = []
    if (end := int(every[-1])) > found[-1]:
        words.append(f"ends at t = {found[-1] * 1e-9:.2f} s of {end * 1e-9:.2f} s")
        every = every[every <= found[-1]]
    if cut_off(bag):
        reached = min(int(stamp.max(initial=-1)) for stamp in stamps.values())
        every, found = every[every <= reached], found[found <= reached]
    nowhere = _without(every, found)
    if len(nowhere):
        first = f"the first at t = {nowhere[0] * 1e-9:.2f} s"
        words.append(f"lacks {len(nowhere)} of {len(every)} steps on all topics, {first}")
    for topic, stamp in stamps.items():
        if len(missing := np.setdiff1d(found, stamp)):
            first = f"the first at t = {missing[0] * 1e-9:.2f} s"
            more = "more " if len(nowhere) else ""
            words.append(f"{topic} lacks {len(missing)} {more}of {len(every)} steps, {first}")
        if len(late := stamp[1:][stamp[1:] <= stamp[:-1]]):
            words.append(f"{topic} is out of order at t = {late[0] * 1e-9:.2f} s")
    return words


_NAMED = 3
"""Maximum number of files and of damages listed by name; further ones are counted."""


def bag_warnings(bag: Bag) -> list[str]:
    """Return warnings about a bag: contradictory metadata, damage, a missing end, missing topics, irregular steps."""
    words = [*bag.contradictions[:_NAMED], *loss_in_words(bag.loss)]
    if any(map(being_recorded, bag.files)):
        words.append(f"is still being recorded, {bag.span[1] * 1e-9:.2f} s so far: the end of its recorder closes it")
    elif not bag.complete and not bag.loss.files:
        words.append(f"truncated after {bag.span[1] * 1e-9:.2f} s, hsv recover completes it")
    elif bag.loss:
        words.append("hsv recover makes a whole bag of the rest")
    expected = step_topics(bag.custom_data.get("controller", TUBE_MPC.name))
    if missing := [bag.name_of(topic) for topic in expected if topic not in bag.roles]:
        words.append(f"no topic {', '.join(missing)}")
    try:
        words += irregularities(bag)
    except RecordingError as error:
        words.append(str(error).removeprefix(f"{bag.path}: "))
    return words


def loss_in_words(loss: Loss) -> list[str]:
    """Return messages about the missing files of a bag, its damages, and its lost messages and attachments."""
    words = [f"lacks its file {name}" for name in loss.files[:_NAMED]]
    if (more := len(loss.files) - _NAMED) > 0:
        words.append(f"lacks {more} more of its files")
    if loss.damages:
        places = "; ".join(f"{path.name}: {what} at byte {offset}" for path, offset, what in loss.damages[:_NAMED])
        more = len(loss.damages) - _NAMED
        words.append(f"damaged ({places}{f'; and {more} more places' if more > 0 else ''})")
    lost = [f"{n} {what}" for n, what in ((loss.messages, "messages"), (loss.attachments, "attachments")) if n]
    if lost:
        words.append(f"{'' if loss.counted else 'at least '}{' and '.join(lost)} lost")
    elif loss:
        words.append("no message lost" if loss.counted else "an unknown number of messages lost")
    return words


def completeness(bag: Bag) -> str:
    """Return the number of complete steps as text, such as ``"90 of 100 steps"``; empty if all are complete."""
    complete, expected = len(complete_stamps(bag)), len(expected_stamps(bag))
    return f"{complete} of {expected} steps" if complete < expected else ""
