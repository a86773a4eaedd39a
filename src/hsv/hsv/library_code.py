"""Machine code of functions for the library of :mod:`hsv.ahead_of_time`.

For each function that numba compiles, numba optimizes the code with that of all functions called in it, and makes
machine code. In the library only entries are called from outside. Here both steps are done once for each entry, with
all that it calls (:func:`object_of`), and not for the functions inside it.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.registry import cpu_target


class _Code(JITCodeLibrary):
    """The code of a function and of all that it calls, before it is optimized."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_specific(self) -> None:
        pass

    def get_pointer_to_function(self, name: str) -> int:
        """Finalize the code, so that it holds what is called, and return 0: there is no machine code."""
        self._ensure_finalized()
        return 0

    def serialize_using_object_code(self) -> Any:
        """Return what other processes need of a function."""
        return self.serialize_using_bitcode()


class _Codegen(JITCPUCodegen):
    """Generates code for this processor as numba does, and loads none into the process."""

    _library_class = _Code

    def _add_module(self, module: Any) -> None:
        pass

    def set_env(self, env_name: str, env: Any) -> None:
        """Do nothing: the environment of a function is for what calls Python."""


def compile_without_machine_code() -> None:
    """Let numba in this process, which has compiled nothing so far, make no machine code of the functions it compiles.

    They cannot be called afterwards.
    """
    cpu_target.target_context._internal_codegen = _Codegen("hsv")


def object_of(code: str, symbol: str) -> bytes:
    """Return the object file of the code of an entry, in which only ``symbol``, the entry, is visible from outside."""
    module = binding.parse_assembly(code)
    for function in module.functions:
        if function.name.startswith("cfunc."):
            function.name = symbol
        elif not function.is_declaration:
            function.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    machine = _machine()
    passes = binding.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, binding.create_pass_builder(machine, binding.create_pipeline_tuning_options()))
    library = cpu_target.target_context.codegen().create_library(symbol)
    library._final_module = module
    JITCodeLibrary._optimize_final_module(library)
    compiled: bytes = machine.emit_object(library._final_module)
    return compiled


def _machine() -> Any:
    """Return what makes code for this processor, as numba does."""
    target = binding.Target.from_default_triple()
    features = binding.get_host_cpu_features().flatten()
    return target.create_target_machine(
        cpu=binding.get_host_cpu_name(), features=features, opt=3, reloc="pic", codemodel="small"
    )
