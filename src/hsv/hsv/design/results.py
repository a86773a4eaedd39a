"""The table of results of the shipped designs: ``python -m hsv.design.results > offline_design/results.md``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from hsv.base.units import to_paper
from hsv.control.design import certificate_path, find_design, read_certificate

DESIGNS = (
    "baseline",
    "baseline_single_k",
    "baseline_derived",
    "adjustable",
    "stiffened",
    "realistic",
    "smooth",
    "governed",
    "tight",
    "derived",
)

_HEADER = """# Results of the shipped designs
Made by `python -m hsv.design.results > offline_design/results.md` from the certificates that `hsv design NAME` writes
and `hsv verify offline_design/NAME.yaml` recomputes. Units of the paper; the certificates are in SI.
"""


def results() -> str:
    """Return the page, with one column per design."""
    certificates = [read_certificate(certificate_path(find_design(name))) for name in DESIGNS]
    lines = [_HEADER, "| | " + " | ".join(DESIGNS) + " |", "| --- |" + " --- |" * len(DESIGNS)]
    for name, value in _ROWS.items():
        lines.append(f"| {name} | " + " | ".join(value(certificate) for certificate in certificates) + " |")
    return "\n".join(lines) + "\n"


def _in(unit: str, *values: float) -> str:
    return ", ".join(f"{to_paper(float(value), unit)[0]:.4g}" for value in values)


def _attained(certificate: dict[str, Any]) -> str:
    driven = certificate["tube"]["invariant_set"].get("counter_examples")
    return _sizes(driven["half_range"]) if driven else "-"


def _sizes(half_width: Sequence[float]) -> str:
    units = ("m", "m/s", "rad", "rad", "rad/s")
    return ", ".join(_in(unit, value) for unit, value in zip(units, half_width, strict=False))


def _each(values: Sequence[float]) -> str:
    return f"{_in('1', values[0])}; {_in('rad', values[1])}"


def _range(certificate: dict[str, Any]) -> str:
    bounds = certificate["tube"]["tightening"]
    (low, low_elevator), (high, high_elevator) = bounds["lower"], bounds["upper"]
    return f"{_in('1', low)} to {_in('1', high)}; {_in('rad', low_elevator)} to {_in('rad', high_elevator)}"


def _room(certificate: dict[str, Any]) -> str:
    plan = certificate["tube"]["tightening"]["plan"]
    return _each([min(pair) for pair in zip(plan["margin_to_lower"], plan["margin_to_upper"], strict=True)])


def _membership(certificate: dict[str, Any]) -> str:
    membership = certificate["tube"]["flights"]["disturbance_membership"]
    return f"{membership['worst_ratio']:.4g}, {membership['outside']} flights outside"


_ROWS: dict[str, Callable[[dict[str, Any]], str]] = {
    "vertices, altitude x velocity (eq. 12)": lambda c: " x ".join(str(n) for n in c["model"]["vertices"]),
    "error of the model off the grid, relative": lambda c: f"{c['model']['accuracy']['relative_frobenius_error']:.2g}",
    "Bode deviation of the model, dB; deg": lambda c: (
        f"{c['model']['accuracy']['bode_magnitude_error_db']:.2g}; {c['model']['accuracy']['bode_phase_error_deg']:.2g}"
    ),
    "(24), smallest eigenvalue over the vertices": lambda c: f"{min(c['feedback']['lmi_smallest_eigenvalues']):.3g}",
    "spectral radius of A + BF, rigid; all states": lambda c: (
        f"{max(c['feedback']['spectral_radii']):.5f}; {c['feedback']['spectral_radius_all_states']:.5f}"
    ),
    "tube factor; fraction of fault and parameter bounds in W (eq. 47)": lambda c: (
        f"{c['adjustable']['tau'][0]:g}; {c['adjustable']['share']:g}" if "adjustable" in c else "1; 1"
    ),
    "largest nominal input from trim: fuel; elevator deg (eq. 35, eq. 52)": lambda c: _each(
        c["adjustable"]["input_bound"] if "adjustable" in c else list(c["inputs"]["nominal"]["input_bound"].values())
    ),
    "nominal gains; certified cost of the outermost, s (eq. 32)": lambda c: (
        f"{len(c['nominal'])}; {c['nominal'][0]['certified_gamma']:.1f}"
    ),
    "notch filter, rad/s": lambda c: ", ".join(f"{n['zero_frequency']:g}" for n in c["inputs"]["notch"]),
    "inertial coupling; fraction of W in the tube": lambda c: (
        f"{c['inputs']['disturbance']['coupling']}; {c['inputs']['disturbance']['share']:g}"
    ),
    "half-widths z: ft, ft/s, deg, deg, deg/s (eq. 28)": lambda c: _sizes(c["tube"]["invariant_set"]["half_width"]),
    "half-widths of Z for the whole W at tau = 1": lambda c: (
        _sizes(c["adjustable"]["complete"]["invariant_set"]["half_width"]) if "adjustable" in c else "-"
    ),
    "the paper's tau Z": lambda c: _sizes(c["adjustable"]["scaled_half_width"]) if "adjustable" in c else "-",
    "attained by counter-examples: ft, ft/s, deg, deg, deg/s": _attained,
    "half-range of F Z: fuel; elevator deg": lambda c: _each(c["tube"]["invariant_set"]["feedback_half_range"]),
    "U minus F Z with trim: fuel; elevator deg (eq. 30)": _range,
    "smallest margin of the nominal inputs in it: fuel; elevator deg": _room,
    "largest level of 1e5 random sequences of 600 steps": lambda c: (
        f"{c['tube']['invariant_set']['sampling']['worst_level']:.4f}"
    ),
    "largest level of flights; number of flights": lambda c: (
        f"{c['tube']['flights']['worst_level']:.3f}; {c['tube']['flights']['flights']}"
    ),
    "largest disturbance of the flights, relative to its bound": _membership,
    "largest end errors of the flights: ft; ft/s": lambda c: (
        f"{_in('m', c['tube']['flights']['worst']['altitude_end_error'])}; "
        f"{_in('m/s', c['tube']['flights']['worst']['velocity_end_error'])}"
    ),
    "largest attitude deviation after the fault, from before it; from nominal: deg": lambda c: (
        f"{_in('rad', c['tube']['flights']['worst']['post_fault_attitude_deviation'])}; "
        f"{_in('rad', c['tube']['flights']['worst']['post_fault_attitude_from_nominal'])}"
    ),
    "largest level of flights with the whole fault": lambda c: (
        f"{c['adjustable']['complete_fault']['worst_level']:.3f}" if "adjustable" in c else "-"
    ),
    "saturated steps of the flights": lambda c: f"{c['tube']['flights']['worst']['saturated_steps']:g}",
}


if __name__ == "__main__":
    print(results(), end="")
