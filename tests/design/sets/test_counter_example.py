"""Counter-examples: an independent simulation reaches them, switching gains, and no certified bound is exceeded."""

import json
import math

import numpy as np
import pytest
import yaml
from marking import long

from hsv.control.design_file import certificate_path, find_design
from hsv.design.certified import load_certified
from hsv.design.sets.counter_example import worst_sequence
from hsv.model.lpv.linearisation import acceleration_channels
from hsv.model.signals import CHANNELS
from hsv.model.vehicle import load_vehicle


class Simulation:
    """The tube error of a design with ideal actuators and one section of the notch filter, from its files.

    The state is the error of the five rigid states and two of the filter, in direct form: q_f = b0 q + z1,
    z1+ = b1 q - a1 q_f + z2, z2+ = b2 q - a2 q_f.
    """

    def __init__(self, path):
        p = yaml.safe_load(path.read_text())["/**"]["ros__parameters"]
        r = len(p["model"]["a"]) // 81
        self.A, self.B = (np.reshape(p["model"][name], (r, 9, -1))[:, :5] for name in "ab")
        self.F = np.reshape(p["feedback"]["gain"], (2, 9))[:, :5]
        w, e_z, p_w, e_p = (
            p["notch"][name][0] for name in ("zero_frequency", "zero_damping", "pole_frequency", "pole_damping")
        )
        half = math.tan(w * p["period"] / 2.0) / w  # the bilinear transform keeps the frequency of the zeros
        ratio = (p_w / w) ** 2
        high = [ratio * (1.0 + s * 2.0 * e_z * w * half + (w * half) ** 2) for s in (1.0, -1.0)]
        low = [1.0 + s * 2.0 * e_p * p_w * half + (p_w * half) ** 2 for s in (1.0, -1.0)]
        middle = [ratio * 2.0 * ((w * half) ** 2 - 1.0), 2.0 * ((p_w * half) ** 2 - 1.0)]
        self.b = np.array([high[0], middle[0], high[1]]) / low[0]
        self.a = np.array([middle[1], low[1]]) / low[0]
        self.W = acceleration_channels(load_vehicle(), p["period"])
        stated = json.loads(certificate_path(path).read_text())["tube"]
        self.driven = stated["invariant_set"]["counter_examples"]
        bounds = [stated["disturbance"]["channels"][c.name] for c in CHANNELS]
        self.middle, self.half = (
            0.5 * np.array([b["upper"] + sign * b["lower"] for b in bounds]) for sign in (1.0, -1.0)
        )

    def feedback(self, x):
        """Return F e with the filtered pitch rate."""
        rigid = x[:5].copy()
        rigid[4] = self.b[0] * x[4] + x[5]
        return self.F @ rigid

    def output(self, x, row):
        return x[row] if row < 5 else self.feedback(x)[row - 5]

    def step(self, x, vertex, d):
        u = self.feedback(x) + self.F[:, 4] * d[4]
        u[1] += d[3]
        moved = self.A[vertex, :, :5] @ x[:5] + self.B[vertex] @ u + self.W @ d[:3]
        moved[[0, 3]] += d[5:]
        filtered = self.b[0] * x[4] + x[5]
        z = self.b[1] * x[4] - self.a[0] * filtered + x[6], self.b[2] * x[4] - self.a[1] * filtered
        return np.append(moved, z)

    def half_range(self, row):
        """Return half the difference of the outputs after the worst disturbances and after their mirror images."""
        vertices = np.repeat(*np.transpose(self.driven["sequences"][row]))
        zero, none = np.zeros(7), np.zeros(7)
        A = [np.array([self.step(x, i, none) for x in np.eye(7)]).T for i in range(len(self.A))]
        G = [np.array([self.step(zero, i, d) for d in np.eye(7)]).T for i in range(len(self.A))]
        response, signs = np.array([self.output(x, row) for x in np.eye(7)]), []
        for vertex in vertices[::-1]:
            signs.append(np.sign(response @ G[vertex]))
            response = response @ A[vertex]
        ends = []
        for side in (1.0, -1.0):
            x = zero
            for vertex, sign in zip(vertices, reversed(signs), strict=True):
                x = self.step(x, vertex, self.middle + side * sign * self.half)
            ends.append(self.output(x, row))
        return 0.5 * (ends[0] - ends[1])


@pytest.mark.parametrize(("name", "rows"), [("tight", [4, 6]), long("baseline", range(7)), long("derived", range(7))])
def test_an_independent_simulation_reaches_them(name, rows):
    simulated = Simulation(find_design(name))
    for row in rows:
        assert simulated.half_range(row) == pytest.approx(simulated.driven["half_range"][row], rel=1e-9)


@pytest.fixture(scope="module")
def tight():
    return load_certified(find_design("tight")).invariant_set()


@pytest.mark.parametrize("seeds", [range(1), long(range(100))])
def test_switching_lies_between_the_fixed_vertices_and_the_bounds(tight, seeds):
    """Each seed has other random starts, another output and another part of W."""
    norms, problem = tight.star_norms, tight.problem
    for seed in seeds:
        draw = np.random.default_rng(seed)
        row = draw.uniform(-1.0, 1.0, size=7) @ (problem.output_rows() / tight.star_norms.bounds(problem)[:, None])
        columns = problem.system.G * problem.disturbance.half_width * draw.uniform(size=7)
        reached, vertices = worst_sequence(problem.system.A, columns, row, seed)
        constant = np.zeros(len(columns))
        left = np.tile(row, (len(columns), 1))
        for _ in vertices:
            constant += np.abs(np.einsum("in,ind->id", left, columns)).sum(axis=1)
            left = np.einsum("in,inm->im", left, problem.system.A)
        stars = np.sqrt(np.einsum("n,kjnm,m->kj", row, norms.Q, row)).sum(axis=1)
        assert constant.max() * (1.0 - 1e-9) <= reached <= min(np.sqrt(row @ tight.Q @ row), stars.min())
