"""The core in WebAssembly: its compilation, the layout of its structs, and structs as JSON.

A struct goes into the page field by field, by the names in ``core.h``: a new field there needs no change here.
"""

from __future__ import annotations

import base64
import math
import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.errors import HsvError
from hsv.core import Struct, _pointers, ffi

_CORE = Path(__file__).parents[1]
_SOURCES = ("web/watch.c", "scalar.c", "complex.c", "dispatch.c")
_EXPORTS = ("hsv_reference_steps", "hsv_commands", "hsv_reference_rows", "hsv_memory_size", "hsv_watch", "hsv_curves")


def compile_module(out: Path, *options: str) -> None:
    """Compile the core to the WebAssembly module ``out``, which imports nothing.

    Args:
        out: File to write.
        options: Compiler options in addition to those of the native build.

    Raises:
        HsvError: The compiler, ziglang, is not installed, or it fails.
    """
    from hsv.core.build import FLAGS

    found = find_spec("ziglang")
    if found is None or not found.origin:
        raise HsvError("ziglang is not installed, expected the packages of requirements-web.txt")
    zig = Path(found.origin).parent
    # No library is linked; these headers declare fabs and sqrt, which are instructions.
    headers = [f"-isystem{zig}/lib/libc/include/{kind}-musl" for kind in ("wasm-wasi", "generic")]
    link = ["-s", "-Wl,--no-entry", *(f"-Wl,--export={name}" for name in (*_EXPORTS, "__heap_base"))]
    command = [f"{zig}/zig", "cc", "-target", "wasm32-freestanding", *FLAGS, "-mbulk-memory", *options, *headers]
    command += [f"-I{_CORE}", *(f"{_CORE}/{source}" for source in _SOURCES), *link, "-o", str(out)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise HsvError(f"the core does not compile to WebAssembly: {done.stderr.strip().splitlines()[-1]}")


def layouts(kind: str) -> dict[str, dict[str, Any]]:
    """Return size, alignment and fields of the struct ``kind`` and of all structs in it, with pointers of 4 bytes."""
    found: dict[str, dict[str, Any]] = {}
    _lay_out(kind, found)
    return found


def _lay_out(kind: str, found: dict[str, dict[str, Any]]) -> tuple[int, int]:
    if kind not in found:
        fields, end, greatest = {}, 0, 1
        for name, field in ffi.typeof(kind).fields:
            declared, count = field.type, 1
            while declared.kind == "array":
                declared, count = declared.item, count * declared.length
            entry: dict[str, Any] = {"type": declared.cname, "count": count}
            size = align = 8  # of double and int64_t
            if declared.kind == "struct":
                size, align = _lay_out(declared.cname, found)
            elif declared.kind in ("pointer", "function"):
                size = align = 4
                described = _pointers(kind).get(name)
                entry["counts"] = [[each.counts, each.more] for each in described.shape] if described else []
                if declared.kind == "pointer" and declared.item.kind == "struct":
                    _lay_out(declared.item.cname, found)
            entry["offset"] = -(-end // align) * align
            end, greatest = entry["offset"] + size * count, max(greatest, align)
            fields[name] = entry
        found[kind] = {"size": -(-end // greatest) * greatest, "align": greatest, "fields": fields}
    return found[kind]["size"], found[kind]["align"]


class Values:
    """Structs as plain data for JSON: ``{"struct": kind, "values": {...}}``, with equal arrays stored once.

    An array is ``{"array": i, "shape": [...]}`` with its little-endian bytes, in base64, in :attr:`arrays`.
    """

    def __init__(self) -> None:
        """Start without arrays."""
        self._index: dict[bytes, int] = {}

    @property
    def arrays(self) -> list[str]:
        """The contents of all arrays."""
        return [base64.b64encode(content).decode() for content in self._index]

    def plain(self, value: Any) -> Any:
        """Return a struct, array, number or None as plain data; an infinite number becomes a text."""
        if isinstance(value, Struct):
            return {"struct": value.kind, "values": {name: self.plain(each) for name, each in value.values.items()}}
        if value is None:
            return None
        array = np.asarray(value)
        if array.ndim == 0 and not array.dtype.names:
            number = array.item()
            return number if isinstance(number, int) or math.isfinite(number) else repr(number)
        if not array.dtype.names:
            array = array.astype("<f8" if array.dtype.kind == "f" else "<i8")
        return {"array": self._index.setdefault(array.tobytes(), len(self._index)), "shape": list(array.shape)}
