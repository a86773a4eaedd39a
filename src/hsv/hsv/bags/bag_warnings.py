"""Warnings about readable but incomplete bags, for pages, plots, tables and messages."""

from __future__ import annotations

from hsv.bags.description import TUBE_MPC, step_topics
from hsv.bags.files import being_recorded
from hsv.bags.reader import Bag, Loss
from hsv.bags.steps import complete_stamps, expected_stamps, irregularities
from hsv.base.errors import RecordingError

_NAMED = 3
"""Maximum number of files and of damages listed by name; further ones are counted."""


def bag_warnings(bag: Bag) -> list[str]:
    """Return the warnings about a bag: damage, a missing end, missing topics, and topics with missing steps."""
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
        places = "; ".join(f"{path.name}: {damage}" for path, damage in loss.damages[:_NAMED])
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
