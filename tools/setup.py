"""Set the bench up: what "make setup" runs. Needs nothing but some Python 3."""

from __future__ import annotations

import sys

if sys.version_info < (3, 8):
    sys.exit("make setup: needs Python 3.11 or 3.12: sudo apt-get install python3 python3-venv python3-dev")

from hsv_setup.main import main

sys.exit(main(sys.argv[1:]))
