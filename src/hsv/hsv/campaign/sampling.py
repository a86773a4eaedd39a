"""Samples of the factors, the same for the same campaign whatever else happens."""

from __future__ import annotations

import itertools

import numpy as np

from hsv.campaign.campaign import Campaign
from hsv.units import rounded


def draw(campaign: Campaign) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples (flights, factors), SI, and the seed (flights) that each was drawn from.

    Uniform samples have a seed each, so that any can be drawn alone; the other methods draw all from the campaign's.
    """
    unit, seeds = _unit_samples(campaign)
    low = np.array([factor.low for factor in campaign.factors])
    high = np.array([factor.high for factor in campaign.factors])
    values = np.where(unit == 1.0, high, low + (high - low) * unit)
    # As many digits as a scenario file keeps: a flight is then the same whichever way it is asked for.
    return np.vectorize(rounded, otypes=[float])(values), seeds


def _unit_samples(campaign: Campaign) -> tuple[np.ndarray, np.ndarray]:
    n, d, seed = campaign.samples, len(campaign.factors), campaign.seed
    seeds = np.full(n, seed, np.uint64)
    if campaign.method == "corners":
        return np.array(list(itertools.product((0.0, 1.0), repeat=d))), seeds
    if campaign.method == "uniform":
        for flight in range(n):
            seeds[flight] = np.random.SeedSequence(seed, spawn_key=(flight,)).generate_state(1, np.uint64)[0]
        return np.stack([np.random.default_rng(own).random(d) for own in seeds.tolist()]), seeds
    from scipy.stats import qmc

    engine = qmc.LatinHypercube(d, seed=seed) if campaign.method == "latin_hypercube" else qmc.Sobol(d, seed=seed)
    return np.asarray(engine.random(n)), seeds
