"""Samples of the factors, the same for the same campaign whatever else happens."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from hsv.flight.campaign.campaign import Campaign


class Sampler:
    """Draws the flights of a campaign, any of them at any time: nobody has to draw a large campaign whole."""

    def __init__(self, campaign: Campaign) -> None:
        self._campaign = campaign
        self._factors = campaign.factors

    def draw(self, flights: range) -> tuple[np.ndarray, np.ndarray]:
        """Return the samples (flights, factors), in the factors' units, and the seed (flights) that each is drawn from.

        Uniform samples have a seed each, so that any can be drawn alone; the other methods draw from the campaign's.
        """
        shares, seeds = self._shares(flights)
        return np.column_stack([f.quantiles(column) for f, column in zip(self._factors, shares.T, strict=True)]), seeds

    def _shares(self, flights: range) -> tuple[np.ndarray, np.ndarray]:
        """Return the shares of the distributions (flights, factors) below the samples, 0 to 1, and the seeds."""
        method, seed, d = self._campaign.method, self._campaign.seed, len(self._factors)
        if method == "uniform":
            keys = (np.random.SeedSequence(seed, spawn_key=(flight,)) for flight in flights)
            seeds = np.array([key.generate_state(1, np.uint64)[0] for key in keys], np.uint64)
            return np.stack([np.random.default_rng(own).random(d) for own in seeds.tolist()]), seeds
        seeds = np.full(len(flights), seed, np.uint64)
        if method == "latin_hypercube":
            return self._hypercube[flights.start : flights.stop], seeds
        if method == "sobol":
            from scipy.stats import qmc

            engine = qmc.Sobol(d, seed=seed)
            if flights.start:
                engine.fast_forward(flights.start)
            return np.asarray(engine.random(len(flights))), seeds
        # Corners: the bits of the flight's number, the first factor's in front.
        return (np.array(flights)[:, None] >> np.arange(d)[::-1] & 1).astype(float), seeds

    @cached_property
    def _hypercube(self) -> np.ndarray:
        """All samples: where one lies in its factor's strata is settled by a shuffle of all."""
        from scipy.stats import qmc

        engine = qmc.LatinHypercube(len(self._factors), seed=self._campaign.seed)
        return np.asarray(engine.random(self._campaign.samples))
