"""The build of the core: setup.py passes `ffibuilder` to setuptools.

The compiler is that of CC, or else the one that Python was built with; HSV_CFLAGS adds options for it.
"""

import os
import re
import shlex
import shutil
import sys
import sysconfig
from pathlib import Path

from cffi import FFI

FOLDER = Path(__file__).parent
# Fused multiply-add would change the bits of a flight. Automatic vectorisation by gcc only makes a flight slower.
FLAGS = ["-std=gnu99", "-O3", "-g0", "-ffp-contract=off", "-fno-math-errno", "-fno-tree-vectorize"]
# Python calls the functions by a table of cffi. As symbols of the library, they could not be inlined.
FLAGS += ["-fvisibility=hidden"]
# Warnings about the calling convention of vector types do not matter, because these do not leave the core.
FLAGS += ["-Wno-psabi"]

compiler = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC"))[0]
if not shutil.which(compiler) or not Path(sysconfig.get_path("include"), "Python.h").is_file():
    sys.exit("hsv needs a C compiler and Python's header files: sudo apt-get install g++ python3-dev")

own = shlex.split(os.environ.get("HSV_CFLAGS", ""))
header = (FOLDER / "core.h").read_text(encoding="utf-8")
visible = header.split("/* begin */")[1].split("/* end */")[0]

visible = re.sub(r"(static const double \w+) = [^;]+;", r"\1;", visible)  # cffi reads the value from the compiled core

ffibuilder = FFI()
ffibuilder.cdef(re.sub(r"#include \"(.*)\"", lambda found: (FOLDER / found[1]).read_text(encoding="utf-8"), visible))
ffibuilder.cdef('extern "Python" int32_t hsv_call_python(int64_t, const double *, double *, double *, const double *);')
ffibuilder.set_source(
    "hsv.core._core",
    '#include "core.h"',
    sources=sorted(map(str, FOLDER.glob("*.c"))),
    depends=sorted(map(str, FOLDER.glob("*.h"))),
    include_dirs=[str(FOLDER)],
    extra_compile_args=[*FLAGS, *own],
    extra_link_args=own,
)
