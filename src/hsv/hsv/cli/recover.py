"""The command ``hsv recover``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import BagArgument, JsonOption
from hsv.cli.output import console, print_json


def recover(
    bag: BagArgument,
    out: Annotated[
        Path | None,
        typer.Option(help="Bag to write; default: next to the old one, with _recovered appended to its name."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Write a new bag from the intact data of a truncated or damaged one, which is not modified.

    The loss is reported in messages and in seconds of simulated time.

    Example: hsv recover bags/case1_20260101T000000Z
    """
    from hsv.bags.bag_warnings import loss_in_words
    from hsv.bags.reader import Bag
    from hsv.bags.recover import recover as mend
    from hsv.bags.steps import irregularities, lost_seconds
    from hsv.base.errors import RecordingError

    recovery = mend(bag, out)
    kept = Bag(recovery.path)
    start, end = kept.span
    seconds = (end - start) * 1e-9
    lost: float | None
    try:
        lost, missing = lost_seconds(kept), irregularities(kept)
    except RecordingError as error:
        if not recovery.changed:
            raise
        # A definition is damaged: its messages are kept, and cannot be decoded.
        lost, missing = None, [str(error).removeprefix(f"{kept.path}: ")]
    loss = recovery.bag.loss
    if json:
        print_json(
            {
                "path": str(recovery.path),
                "changed": recovery.changed,
                "messages": recovery.messages,
                "duration_s": seconds,
                "lost_messages": loss.messages,
                "lost_messages_counted": loss.counted,
                "lost_attachments": loss.attachments,
                "lost_s": lost,
                "loss": loss_in_words(loss) + missing,
            }
        )
        return
    if not recovery.changed:
        console.print(
            f"{recovery.path}: already complete: {recovery.messages} messages, {seconds:.2f} s", soft_wrap=True
        )
        return
    console.print(f"{recovery.path}: {recovery.messages} messages, {seconds:.2f} s", soft_wrap=True)
    for words in loss_in_words(loss):
        console.print(words, soft_wrap=True)
    if lost is None:
        console.print(f"an unknown time lost: {'; '.join(missing)}", soft_wrap=True)
    elif lost:
        console.print(f"{lost:.2f} s lost: {'; '.join(missing)}", soft_wrap=True)
