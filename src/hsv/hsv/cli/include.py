"""The command ``hsv include``."""

from __future__ import annotations

import sys


def include() -> None:
    """Print the folder of hsv_block.h, for compilers: the header of controllers and other blocks in C.

    Example: cc -O2 -ffp-contract=off -shared -fPIC -I"$(hsv include)" -o mine.so mine.c
    """
    from hsv.control.c_block import include_folder

    sys.stdout.write(f"{include_folder()}\n")
