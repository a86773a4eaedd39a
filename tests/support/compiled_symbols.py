"""External symbols of compiled functions: run as a program, it lists those of the loop and of all that sets it up."""

import subprocess
import sys
import tempfile

from flights import step_by_step
from numba.core.registry import CPUDispatcher


def undefined_symbols(dispatcher: CPUDispatcher) -> set[str]:
    """Return the names that the machine code of ``dispatcher`` takes from elsewhere, as ``nm`` finds them."""
    found = set()
    for signature in dispatcher.signatures:
        code = dispatcher.overloads[signature].library._get_compiled_object()
        with tempfile.NamedTemporaryFile(suffix=".o") as file:
            file.write(code)
            file.flush()
            listed = subprocess.run(["nm", "--undefined-only", file.name], capture_output=True, text=True, check=True)
        found |= {line.split()[-1] for line in listed.stdout.splitlines() if line.strip()}
    return found


def main() -> None:
    """Fly once compiled and once step by step, then print "function: symbol" for every function of ours compiled."""
    from hsv import compiled
    from hsv.simulation.assembly import assemble_flight
    from hsv.simulation.closed_loop import fly
    from hsv.simulation.scenario import load_scenario

    compiled.instead = lambda function, arguments, named: function.dispatcher(*arguments, **named)  # numba compiles all
    scenario = load_scenario("case2").model_copy(update={"duration": 120.0})
    fly(assemble_flight(scenario))
    step_by_step(assemble_flight(scenario.model_copy(update={"duration": 0.1})))
    modules = [module for name, module in sys.modules.items() if name.startswith("hsv.")]
    functions = {
        value.name: value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, compiled.CompiledFunction)
    }
    for name, function in functions.items():
        dispatcher = function.dispatcher
        for symbol in sorted(undefined_symbols(dispatcher)) or ["-"] * bool(dispatcher.signatures):
            print(f"{name}: {symbol}")
        if function.targetoptions.get("_nrt") is False:
            # Who holds an array is not counted then: an array, or a view of one, is none to return.
            for overload in dispatcher.overloads.values():
                returned = overload.signature.return_type
                if "Array" in repr(returned):
                    print(f"{name}: returns {returned}")


if __name__ == "__main__":
    main()
