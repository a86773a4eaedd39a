"""The command ``hsv include``."""

from __future__ import annotations

import sys


def include() -> None:
    """Print the folder of hsv_block.h, the header of controllers and other blocks in C, for a compiler's option -I.

    Example: hsv include
    """
    from hsv.control.c_block import include_folder

    sys.stdout.write(f"{include_folder()}\n")
