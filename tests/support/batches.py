"""Functions that fly batches in tests of executors.

Spawned processes find them here: a package named tests, which rtamt installs, hides the tests themselves.
"""

import os
import time
from pathlib import Path


def end_of_the_third(text, batch):
    """Fly a batch; on the third batch the worker process ends."""
    if batch == 3:
        os._exit(1)
    return b""


def length_of(text, batch):
    """Fly a batch and return the length of the text."""
    return str(len(text)).encode()


def begin_and_never_end(text, batch):
    """Create a file in the folder that the text names, as a sign that the batch has begun, and never return."""
    Path(text.split()[0], str(batch)).touch()
    time.sleep(1e6)
    return b""
