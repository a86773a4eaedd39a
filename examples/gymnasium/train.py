"""Train a linear policy that stabilises the vehicle for ten seconds, by the cross-entropy method, within a minute.

python3 examples/gymnasium/train.py [GENERATIONS]
"""

import sys
from pathlib import Path

import numpy as np

import hsv.gym

POLICIES, BEST = 64, 8
UNITS = np.array([20.0, 5.0, 0.02, 0.02, 0.05])
"""Errors of the rigid states that are large: m, m/s, rad, rad, rad/s"""


def returns(env: hsv.gym.TrackVectorEnv, policies: np.ndarray) -> np.ndarray:
    """Fly one episode with each of the ``policies`` (64, 2, 5); return the sums of the rewards (64)."""
    observations, _ = env.reset()
    total, flying = np.zeros(len(policies)), np.ones(len(policies), bool)
    while flying.any():
        errors = observations[:, 9:14] / UNITS
        observations, rewards, terminated, truncated, _ = env.step(np.einsum("nij,nj->ni", policies, errors))
        total += rewards * flying
        flying &= ~(terminated | truncated)
    return total


def main(generations: int) -> tuple[float, float]:
    """Train from nothing; return the returns of the policy of zeros and of the trained one, of at most 10 s."""
    env = hsv.gym.TrackVectorEnv(POLICIES, str(Path(__file__).with_name("ten_seconds.toml")))
    random = np.random.default_rng(1)
    mean, spread = np.zeros((2, 5)), np.full((2, 5), 0.3)
    before = returns(env, np.zeros((POLICIES, 2, 5)))[0]
    for generation in range(generations):
        policies = mean + spread * random.standard_normal((POLICIES, 2, 5))
        found = returns(env, policies)
        best = policies[np.argsort(found)[-BEST:]]
        mean, spread = best.mean(0), best.std(0) + 0.02
        if generation % 5 == 0:
            print(f"generation {generation}: best return {found.max():.2f} s of 10 s", flush=True)
    after = returns(env, np.tile(mean, (POLICIES, 1, 1)))[0]
    print(f"policy of zeros {before:.2f} s, trained {after:.2f} s")
    return before, after


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
