import hashlib

import numpy as np
import pytest

from hsv.base.errors import CampaignError
from hsv.flight.campaign.campaign import METHODS, plan
from hsv.model.vehicle import load_vehicle


def draw(campaign):
    return campaign.draw(range(campaign.samples))


BOUNDS = np.array(list(load_vehicle().uncertainty.values()))


def test_a_uniform_flight_can_be_drawn_alone_from_its_own_seed(planned):
    samples, seeds = draw(planned(samples=50))
    longer, _ = draw(planned(samples=80))
    assert np.array_equal(samples, longer[:50])
    assert len(set(seeds.tolist())) == 50
    unit = np.random.default_rng(int(seeds[17])).random(samples.shape[1])
    assert samples[17, :10] == pytest.approx(BOUNDS * (2.0 * unit[:10] - 1.0), rel=1e-13)


@pytest.mark.parametrize("method", METHODS)
def test_any_flights_can_be_drawn_without_the_others(planned, method):
    campaign = planned(samples=128, method=method)
    samples, seeds = draw(campaign)
    for flights in (range(32), range(32, 64), range(127, 128), range(1)):
        some, their_seeds = campaign.draw(flights)
        assert np.array_equal(some, samples[flights.start : flights.stop])
        assert np.array_equal(their_seeds, seeds[flights.start : flights.stop])


DIGESTS = {
    "uniform": ("07a157195c30bbbc", "83b65801f8d96725"),
    "latin_hypercube": ("984ce635f7c625f2", "750ee73c39f9f5d2"),
    "sobol": ("781056944ef0930f", "750ee73c39f9f5d2"),
    "corners": ("5a92d3fee8f74b06", "2594ed37723f8d48"),
}


@pytest.mark.parametrize("method", METHODS)
def test_samples_stay_what_they_were_in_every_bit(method):
    # A campaign begun with an earlier version, and the replay of one of its flights, draw the same.
    campaign = plan("case1", method=method, samples=64, seed=7, factors={"fault[0].start": ("90 s", "110 s")})
    drawn = tuple(hashlib.sha256(array.tobytes()).hexdigest()[:16] for array in draw(campaign))
    assert drawn == DIGESTS[method]


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"samples": 0}, "samples"),
        ({"samples": 10**7 + 1}, "samples"),
        ({"samples": 10**6 + 1, "method": "latin_hypercube"}, "samples"),
        ({"samples": 100, "method": "sobol"}, "samples"),
        ({"seed": -1}, "seed"),
        ({"method": "grid"}, "method"),
    ],
)
def test_wrong_settings_are_named(planned, settings, field):
    with pytest.raises(CampaignError, match=rf"^{field} = .*expected"):
        planned(**settings)
