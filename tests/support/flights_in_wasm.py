"""Flights in wasmtime: structs filled by the layouts of the page, without its script."""

import base64
import hashlib
import struct

import numpy as np
import pytest

HISTORY, AUXILIARY = 25, 3


class Machine:
    """The core's module and the prepared flights of :func:`hsv.pages.fly.described`."""

    def __init__(self, module, data):
        """Load the file ``module``."""
        wasmtime = pytest.importorskip("wasmtime", reason="make test-long installs it")
        self.store = wasmtime.Store()
        module = wasmtime.Module.from_file(self.store.engine, str(module))
        self.exports = wasmtime.Instance(self.store, module, []).exports(self.store)
        self.memory, self.data = self.exports["memory"], data
        self.base = self.exports["__heap_base"].value(self.store)

    def room(self, content):
        """Return the address of a copy of some bytes."""
        at = -(-self.top // 64) * 64
        self.top = at + len(content)
        if (missing := self.top - self.memory.data_len(self.store)) > 0:
            self.memory.grow(self.store, -(-missing // 65536))
        self.memory.write(self.store, content, at)
        return at

    def zeros(self, count):
        """Return the address of numbers that are zero."""
        return self.room(bytes(8 * count))

    def numbers(self, *values):
        """Return the address of numbers."""
        return self.room(struct.pack(f"<{len(values)}d", *values))

    def fill(self, at, kind, values):
        """Fill the struct ``kind`` by the names of its fields."""
        structs, fields = self.data["structs"], self.data["structs"][kind]["fields"]
        for name, value in values.items():
            field, place = fields[name], at + fields[name]["offset"]
            content = value
            if isinstance(value, dict):
                if field["type"] in structs:
                    self.fill(place, field["type"], value["values"])
                    continue
                content = base64.b64decode(self.data["arrays"][value["array"]]) if "array" in value else self.put(value)
            if "counts" in field and value is not None:
                shape = value.get("shape", ()) if isinstance(value, dict) else ()
                pointer = self.room(content) if isinstance(content, bytes) else content
                self.memory.write(self.store, struct.pack("<I", pointer), place)
                for size, (counted, more) in zip(shape, field["counts"], strict=False):
                    if counted:
                        self.memory.write(self.store, struct.pack("<q", size - more), at + fields[counted]["offset"])
            elif value is not None:
                form = "<q" if field["type"] == "int64_t" else "<d"
                packed = (
                    content
                    if isinstance(content, bytes)
                    else struct.pack(form, float(value) if form == "<d" else value)
                )
                self.memory.write(self.store, packed, place)

    def put(self, value):
        """Return the address of a new struct."""
        at = self.room(bytes(self.data["structs"][value["struct"]]["size"]))
        self.fill(at, value["struct"], value["values"])
        return at

    def fingerprint(self, name):
        """Fly a scenario as it is shipped and return its fingerprint."""
        self.top = self.base
        flight, call = self.data["scenarios"][name], lambda function, *given: self.exports[function](self.store, *given)
        corners, period, count = flight["corners"], flight["period"], flight["rows"]
        given, first = self.numbers(*(number for corner in corners for number in corner)), self.zeros(1)
        rows = call("hsv_reference_steps", len(corners), given, period, first)
        [begun] = struct.unpack("<q", self.memory.read(self.store, first, first + 8))
        commands = [self.zeros(width * rows) for width in (2, 2, 1)]
        results = [self.zeros(width * rows) for width in (9, 2, 9, 1)]
        call("hsv_commands", len(corners), given, period, int(flight["climbing"]), begun, rows, *commands)
        guess = self.numbers(*self.data["guess"])
        call("hsv_reference_rows", self.put(flight["rigid"]), rows, *commands, guess, period, 2, *results)
        state, defect = results[0], results[2]
        reference = {"state": state, "input": results[1], "defect": defect, "first": begun, "rows": rows}
        history = self.zeros(HISTORY * count)
        written = {"history": history, "auxiliary": self.zeros(AUXILIARY * count), "rows": count, "ended": count}
        written |= {"estimated": self.zeros(9 * count)} if flight["estimated"] else {}
        written["reference"] = {"struct": "hsv_reference", "values": reference}
        values = flight["flight"]["values"] | written
        loop = self.room(bytes(call("hsv_memory_size", 1)))
        struct_address = self.put({"struct": "hsv_flight", "values": values})
        steps = call("hsv_watch", struct_address, loop, self.zeros(2 * count), self.zeros(count))
        signals = np.frombuffer(self.memory.read(self.store, history, history + 8 * HISTORY * steps), "<f8")
        return f"v1:{hashlib.sha256(np.where(np.isnan(signals), np.nan, signals).tobytes()).hexdigest()}"
