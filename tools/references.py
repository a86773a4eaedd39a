"""Renew the reference bags: ``make references``.

Every scenario ``bags/reference/<name>.toml`` has a bag ``bags/reference/<name>/``. All bags are first recorded and
replayed in a temporary folder. Only if all replays succeed do they replace the old bags.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from hsv.bags.description import ROSOUT
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter

ROOT = Path(__file__).resolve().parents[1]
REFERENCES = ROOT / "bags" / "reference"


def main() -> int:
    """Record all reference bags and replace the old ones, or change nothing; return the exit code."""
    changes = subprocess.run(
        ["git", "-C", str(ROOT), "status", "--porcelain", "--", ".", ":!bags/reference"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    if changes:
        return _refuse("uncommitted changes; commit first: a reference names the commit that made it\n" + changes)
    # Next to the old bags, so that replacing them is a rename.
    with tempfile.TemporaryDirectory(prefix=".new_", dir=REFERENCES) as folder:
        made = {}
        for scenario in sorted(REFERENCES.glob("*.toml")):
            bag = Path(folder, scenario.stem)
            print(f"flying {scenario.stem}", flush=True)
            for command in (
                ["hsv", "run", str(scenario), "--bag", str(bag)],
                ["hsv", "replay", str(bag)],
                ["hsv", "replay", str(bag), "--rerun"],
            ):
                done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
                if done.returncode:
                    return _refuse(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
            made[scenario.stem] = _without_paths(bag, Path(folder, "kept", scenario.stem))
        for name, bag in made.items():
            shutil.rmtree(REFERENCES / name, ignore_errors=True)
            bag.rename(REFERENCES / name)
    print(f"{len(made)} reference bags: look at git diff --stat, then commit them")
    return 0


def _without_paths(folder: Path, target: Path) -> Path:
    """Copy the bag in ``folder`` to ``target``, without the paths of this machine in its log; return ``target``."""
    bag = Bag(folder)
    target.parent.mkdir(exist_ok=True)
    writer = BagWriter(target, bag.topics.values(), bag.custom_data)
    for name, data in bag.attachments.items():
        writer.attach(name, bag.media_types[name], data)
    with bag.path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            data = message.data
            if channel.topic == ROSOUT:
                kind = bag.topics[ROSOUT].type
                log: Any = bag.types.deserialize_cdr(data, kind)
                log.file, log.msg = Path(log.file).name, log.msg.replace(str(folder), folder.name)
                data = bytes(bag.types.serialize_cdr(log, kind))
            writer.write(channel.topic, message.log_time, data)
    writer.close()
    return target


def _refuse(reason: str) -> int:
    print(f"make references: nothing changed: {reason}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
