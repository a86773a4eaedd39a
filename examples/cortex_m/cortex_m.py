"""Processor in the loop: the exported controller on an emulated Cortex-M7, with one exchange for each step.

``python3 cortex_m.py`` simulates Case 1 and prints instructions and memory of a step, see README.md.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.errors import ParameterError, RunError
from hsv.control.controller import ControllerInput, ExternalController
from hsv.control.design import ControlDesign
from hsv.control.nominal_trajectory import NominalTrajectory

FIRMWARE = Path(__file__).parent / "build" / "firmware.elf"
REQUEST, ANSWER = struct.Struct("<q29d"), struct.Struct("<2d2I")
SHIFT = 10
"""QEMU takes 2^SHIFT ns of simulated time for an instruction."""
TICKS_PER_INSTRUCTION = 2**SHIFT * 1e-9 * 25e6
QEMU = (
    *("qemu-system-arm", "-machine", "mps2-an500", "-icount", f"shift={SHIFT}", "-display", "none"),
    *("-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel"),
)


class CortexM:
    """A controller whose steps are computed by the firmware on an emulated Cortex-M7."""

    PARAMETERS = ()

    def __init__(self, reference: Any) -> None:
        """Create the controller; the defect of ``reference`` is an input of the exported controller."""
        self.reference = reference
        self.instructions: list[int] = []
        """Number of instructions of each step."""
        self.stack = 0
        """Largest use of the stack so far (bytes)."""
        self._process: subprocess.Popen[bytes] | None = None

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], design: ControlDesign | None) -> CortexM:
        """Return the controller; its gains are those in the firmware."""
        for tool in (QEMU[0], FIRMWARE):
            if not shutil.which(tool) and not Path(tool).is_file():
                raise ParameterError(f"{tool}: not there, expected as examples/cortex_m/README.md says")
        return cls(NominalTrajectory.from_parameters(values, design).reference.data)

    def reset(self) -> None:
        """Restart the emulated processor."""
        self.close()
        self._process = subprocess.Popen([*QEMU, FIRMWARE], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def close(self) -> None:
        """Close the input of the emulated processor, which ends it, and wait for the end."""
        if self._process:
            self._process.communicate()
            self._process = None

    def __del__(self) -> None:
        self.close()

    def step(self, inputs: ControllerInput) -> np.ndarray:
        """Return the input u (2) that the processor computes, before it is limited."""
        row = min(max(inputs.step - self.reference.first, 0), len(self.reference.defect) - 1)
        signals = (inputs.estimate, inputs.reference, self.reference.defect[row], inputs.reference_input)
        process = self._process
        assert process and process.stdin and process.stdout
        process.stdin.write(REQUEST.pack(inputs.step, *np.concatenate(signals)))
        process.stdin.flush()
        answer = process.stdout.read(ANSWER.size)
        if len(answer) < ANSWER.size:
            raise RunError("the emulated processor has stopped")
        fuel, elevator, ticks, self.stack = ANSWER.unpack(answer)
        self.instructions.append(round(ticks / TICKS_PER_INSTRUCTION))
        return np.array([fuel, elevator])


def main() -> None:
    """Simulate Case 1; print the fingerprint, and the instructions and memory that a step needs."""
    from hsv.flight.assembly import assemble_flight
    from hsv.flight.closed_loop import fly
    from hsv.flight.scenario import load_scenario

    scenario = load_scenario(str(Path(__file__).with_name("cortex_m.toml")))
    components = assemble_flight(scenario)
    processor = CortexM(components.nominal_trajectory.reference.data)
    controller = ExternalController(scenario.controller, processor, components.plant.vehicle)
    print("fingerprint", fly(replace(components, controller=controller)).fingerprint)
    first, later = processor.instructions[0], processor.instructions[1:]
    print(f"instructions per step: {min(later)} to {max(later)}, step 0: {first}")
    print(f"stack: {processor.stack} bytes")
    sizes = subprocess.run(["arm-none-eabi-size", FIRMWARE], capture_output=True, text=True, check=True).stdout.split()
    print(f"code and constants: {sizes[6]} bytes, with {sizes[8]} bytes of memory")


if __name__ == "__main__":
    sys.exit(main())
