"""The command ``hsv recover``."""

from __future__ import annotations

from hsv.cli.options import BagArgument, JsonOption
from hsv.cli.output import console, print_json


def recover(bag: BagArgument, json: JsonOption = False) -> None:
    """Mend the bag of a killed recorder: keep everything complete, write summary, indexes and metadata.yaml.

    Example: hsv recover bags/case1_20260101T000000Z
    """
    from hsv.recording.reader import Bag
    from hsv.recording.recover import recover as mend

    recovery = mend(bag)
    start, end = Bag(recovery.path).span
    seconds = (end - start) * 1e-9
    if json:
        print_json(
            {
                "path": str(recovery.path),
                "changed": recovery.changed,
                "messages": recovery.messages,
                "duration_s": seconds,
            }
        )
        return
    what = "recovered" if recovery.changed else "complete already:"
    console.print(f"{recovery.path}: {what} {recovery.messages} messages, {seconds:.2f} s", soft_wrap=True)
