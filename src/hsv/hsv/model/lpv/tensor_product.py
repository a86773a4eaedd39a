"""Tensor-product model transformation (paper eq. 10 to eq. 12; Baranyi): few vertices, weights variable by variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.base.errors import DesignError
from hsv.model.lpv.hull import hull_weights
from hsv.model.lpv.polytope import Polytope, axis_weights

FUNCTIONS = ("singular", "polynomial")


@dataclass(frozen=True)
class TensorProduct:
    """A polytopic model found from samples.

    ``altitude_samples`` and ``velocity_samples``: breakpoints (s) and weights (s, r) of each variable, between them
    cubic splines. ``singular_values``: for each variable those of its unfolding, relative to the largest.
    """

    polytope: Polytope
    altitude_samples: tuple[np.ndarray, np.ndarray]
    velocity_samples: tuple[np.ndarray, np.ndarray]
    singular_values: tuple[np.ndarray, np.ndarray]


def tensor_product(
    A: np.ndarray,
    B: np.ndarray,
    altitudes: np.ndarray,
    velocities: np.ndarray,
    state_scale: np.ndarray,
    input_scale: np.ndarray,
    tolerance: float,
    functions: str = "singular",
) -> TensorProduct:
    """Return the polytopic model of discrete-time samples on a grid (paper eq. 11), with a tight hull.

    The higher-order singular value decomposition is taken of [A - I, B] over the scales: the identity is the same
    everywhere and would make the ranks depend on the sampling period.

    Args:
        A: (n_h, n_v, n, n) discrete-time state matrices, SI.
        B: (n_h, n_v, n, m) input matrices, SI.
        altitudes: (n_h) m, increasing.
        velocities: (n_v) m/s, increasing.
        state_scale: (n) sizes of the states that count as equal, SI.
        input_scale: (m) sizes of the inputs, SI.
        tolerance: Singular values below this share of the largest are left out; the rest are the rank r.
        functions: Functions that span the model in a variable: the constant and r - 1 ``"singular"`` functions, which
            have the least total error, or the ``"polynomial"`` of degree r - 1, which at a low rank distributes the
            error more evenly over small and large entries.

    Raises:
        DesignError: Shapes that do not match, unknown functions, too few samples for the rank, or no hull.
    """
    if functions not in FUNCTIONS:
        raise DesignError(f"tensor_product.functions = {functions!r}: expected one of {', '.join(FUNCTIONS)}")
    n, m = B.shape[2:]
    shape = (len(altitudes), len(velocities))
    if A.shape != (*shape, n, n) or B.shape != (*shape, n, m):
        raise DesignError(f"samples A {A.shape}, B {B.shape}: expected {shape} matrices of matching size")
    if state_scale.shape != (n,) or input_scale.shape != (m,):
        raise DesignError(f"scales {state_scale.shape} and {input_scale.shape}: expected ({n},) and ({m},)")
    columns = np.concatenate((state_scale, input_scale))
    samples = np.concatenate((A - np.eye(n), B), axis=3) * columns / state_scale[:, None]

    weights, singular_values = [], []
    for axis, breakpoints in enumerate((altitudes, velocities)):
        unfolded = np.moveaxis(samples, axis, 0).reshape(len(breakpoints), -1)
        values = np.linalg.svd(unfolded, compute_uv=False)
        rank = int(np.count_nonzero(values > tolerance * values[0]))
        if rank >= len(breakpoints):
            raise DesignError(f"{len(breakpoints)} samples of rank {rank}: expected more samples or a larger tolerance")
        # With the constant in the basis, in place of one function, the weights can sum to one exactly.
        if functions == "singular":
            basis = np.linalg.svd(unfolded - unfolded.mean(axis=0), full_matrices=False)[0][:, : rank - 1]
        else:
            middle, half = 0.5 * (breakpoints[0] + breakpoints[-1]), 0.5 * (breakpoints[-1] - breakpoints[0])
            basis = np.vander((breakpoints - middle) / half, rank, increasing=True)[:, 1:]
        weights.append(hull_weights(breakpoints, basis))
        singular_values.append(values / values[0])

    inverse = [np.linalg.pinv(w) for w in weights]
    core = np.einsum("ih,jv,hvab->ijab", *inverse, samples).reshape(-1, n, n + m)
    vertices = core * state_scale[:, None] / columns
    polytope = Polytope(
        vertices[:, :, :n] + np.eye(n),
        np.ascontiguousarray(vertices[:, :, n:]),
        axis_weights(altitudes, weights[0], "cubic"),
        axis_weights(velocities, weights[1], "cubic"),
    )
    return TensorProduct(
        polytope, (altitudes, weights[0]), (velocities, weights[1]), (singular_values[0], singular_values[1])
    )
