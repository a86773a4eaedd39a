"""The build of the core: its compiler, its options, and the one line where no compiler is installed."""

import os
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "src" / "hsv"


def test_without_a_compiler_one_line_names_the_packages_to_install():
    command = [sys.executable, "setup.py", "--version"]
    ran = subprocess.run(command, cwd=PACKAGE, env=os.environ | {"CC": "absent"}, capture_output=True, text=True)
    needed = "hsv needs a C compiler and Python's header files: sudo apt-get install g++ python3-dev\n"
    assert (ran.returncode, ran.stdout, ran.stderr) == (1, "", needed)
