"""The Gymnasium environments: their interface, and the bits of their flights."""

import copy
import multiprocessing
import os
import pickle
import runpy
import subprocess
import sys
from pathlib import Path

import gymnasium
import matplotlib
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from matplotlib import pyplot
from page_blocks import blocks, indented

import hsv.gym
from hsv.base.errors import CampaignError, ControllerError, ParameterError, RunError, ScenarioError
from hsv.control.design_file import find_design, read_design
from hsv.core import lanes
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario

ROOT = Path(__file__).parents[1]
LQR = ROOT / "examples" / "lqr"
DRAWN = {"scale": 1.0, "factors": {"fault[0].effectiveness": (0.5, 1.0)}}


@pytest.mark.filterwarnings("ignore:.*Box observation space m")
@pytest.mark.parametrize("options", [{}, DRAWN, {"scenario": "case1_realistic"}], ids=["case1", "drawn", "realistic"])
def test_gymnasium_finds_no_fault(options):
    check_env(gymnasium.make("hsv/Track-v0", render_mode="rgb_array", **options).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("scenario", ["case1", "winged_cone"])
def test_the_side_view_follows_the_vehicle(scenario):
    env = gymnasium.make("hsv/Track-v0", scenario=scenario, render_mode="rgb_array").unwrapped
    env.reset(seed=1)
    first = env.render()
    assert first.shape == (400, 640, 3) and first.dtype == np.uint8 and len(np.unique(first)) > 10
    for _ in range(100):
        env.step([0.0, 0.1])
    assert not np.array_equal(env.render(), first)
    assert np.array_equal(copy.deepcopy(env).render(), env.render())
    env.close()
    assert hsv.gym.TrackEnv().render() is None
    with pytest.raises(ParameterError, match="render_mode = 'ansi': expected one of human, rgb_array"):
        hsv.gym.TrackEnv(render_mode="ansi")
    matplotlib.use("agg")
    with pytest.warns(UserWarning, match="'human': no window can be opened without a display"):
        hsv.gym.TrackEnv(render_mode="human").reset()


@pytest.mark.skipif("DISPLAY" not in os.environ, reason="there is no display; xvfb-run gives one")
def test_a_window_that_is_closed_stays_closed():
    matplotlib.use("tkagg", force=True)
    env = hsv.gym.TrackEnv(render_mode="human")
    env.reset()
    assert pyplot.get_fignums()
    pyplot.close("all")
    env.step([0.0, 0.0])
    assert not pyplot.get_fignums()
    env.close()


def test_observations_are_normalised_by_the_scales_of_a_design():
    single, vector = hsv.gym.TrackEnv(), hsv.gym.TrackVectorEnv(3)
    plain, own = single.reset()[0], hsv.gym.normalised(hsv.gym.TrackEnv()).reset()[0]
    scale = read_design(find_design("baseline")).nominal_state_scale
    np.testing.assert_allclose(own[9:14], plain[9:14] / scale, rtol=1e-12)
    np.testing.assert_allclose(own[:9], own[9:], atol=1e-9)  # the flight begins at the trim
    assert np.array_equal(hsv.gym.normalised(vector).reset()[0], [own] * 3)
    assert gymnasium.spaces.Box(-10.0, 10.0, (18,), float).contains(own)


def test_a_mask_resets_some_environments_and_the_others_fly_on():
    count, random = lanes() + 3, np.random.default_rng(1)
    masked, kept, begun = (hsv.gym.TrackVectorEnv(count, scale=1.0) for _ in range(3))
    for env in (masked, kept):
        env.reset(seed=5)
    mask = np.zeros(count, bool)
    mask[[1, 2, -1]] = True
    for env, actions in ((env, a) for a in random.uniform(-0.1, 0.1, (5, count, 2)) for env in (masked, kept)):
        env.step(actions)
    observations = masked.reset(seed=100, options={"reset_mask": mask})[0]
    assert np.array_equal(observations[mask], begun.reset(seed=100)[0][mask])
    for actions in random.uniform(-0.1, 0.1, (20, count, 2)):
        found, others, new = (env.step(actions) for env in (copy.deepcopy(masked), kept, begun))
        masked.step(actions)
        for one, other, third in zip(found[:4], others[:4], new[:4], strict=True):
            assert np.array_equal(one[~mask], other[~mask]) and np.array_equal(one[mask], third[mask])
    for wrong in (mask[1:], np.zeros(count, bool)):
        with pytest.raises(ControllerError, match="reset_mask: expected"):
            masked.reset(options={"reset_mask": wrong})


def test_the_example_of_the_page_trains(capsys):
    program = runpy.run_path(str(ROOT / "examples" / "gymnasium" / "train.py"))
    before, after = program["main"](8)
    assert before < 5.0 and after > 9.0


def test_the_example_of_the_page_flies_the_flight_of_its_controller(tmp_path, monkeypatch):
    scenario = tmp_path / "lqr.toml"
    scenario.write_text((LQR / "lqr.toml").read_text().replace('controller = "lqr"', 'controller = "hsv_lqr:Lqr"'))
    [program] = [block.text for block in blocks("docs/gymnasium.md", "python") if "hsv_lqr" in block.text]
    program = program.replace("examples/lqr/lqr.toml", str(scenario))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(LQR), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    monkeypatch.syspath_prepend(LQR)
    assert done.stdout.split() == [fly(assemble_flight(load_scenario(str(scenario)))).fingerprint], done.stderr


def test_the_commands_of_the_page_that_measure_run():
    [commands] = [block.text for block in indented("docs/gymnasium.md") if "timeit" in block.text]
    script = commands.replace("timeit", "timeit -n 20 -r 1")
    done = subprocess.run(["bash", "-e", "-c", script], capture_output=True, text=True)
    assert done.stdout.count("20 loops, best of 1") == 2, done.stderr


@pytest.mark.parametrize("options", [{}, DRAWN], ids=["alike", "drawn"])
def test_rows_of_the_vector_have_the_bits_of_single_environments(options):
    count = lanes() + 3
    vector = gymnasium.make_vec("hsv/Track-v0", num_envs=count, **options)
    singles = [hsv.gym.TrackEnv(**options) for _ in range(count)]
    observations, infos = vector.reset(seed=7)
    alone = [single.reset(seed=7 + i) for i, single in enumerate(singles)]
    assert np.array_equal(observations, [first for first, _ in alone])
    assert infos["flight"].tolist() == [info["flight"] for _, info in alone]
    random, over, ends = np.random.default_rng(1), np.zeros(count, bool), 0
    for _ in range(300):
        actions = random.uniform(-0.3, 0.3, (count, 2))
        observations, rewards, terminated, truncated, infos = vector.step(actions)
        # Another flight in its vector register may truncate a row; then its single environment is reset, too.
        alone = [singles[i].reset() if over[i] else singles[i].step(actions[i]) for i in range(count)]
        alike = np.flatnonzero(~truncated)
        assert np.array_equal(observations[alike], [alone[i][0] for i in alike])
        assert np.array_equal(infos["nominal_input"][alike], [alone[i][-1]["nominal_input"] for i in alike])
        assert rewards[alike].tolist() == [0.0 if over[i] else alone[i][1] for i in alike]
        assert terminated[alike].tolist() == [False if over[i] else alone[i][2] for i in alike]
        over = terminated | truncated
        ends += over.sum()
    assert ends >= count


def test_an_episode_is_the_whole_flight_and_its_return_is_bounded():
    env = gymnasium.make("hsv/Track-v0", scenario="case1").unwrapped
    env.reset(seed=1)
    total, steps, terminated = 0.0, 0, False
    while not terminated:
        observation, reward, terminated, truncated, _ = env.step(np.zeros(2))
        total, steps = total + reward, steps + 1
        assert not truncated and 0.0 < reward <= 0.02
    assert env.flight.status.name == "DIVERGED" and len(env.flight.time) == steps
    assert 0.0 < total < steps * 0.02
    assert np.array_equal(observation[:9], env.flight.history.state[-1])


def test_a_seed_draws_the_same_flights_and_another_seed_others():
    env = hsv.gym.TrackEnv(**DRAWN)
    draws = [[env.reset(seed=seed)[1]["flight"], env.reset()[1]["flight"]] for seed in (1, 1, 2)]
    assert draws[0] == draws[1] and len({*draws[0], *draws[2]}) == 4


def test_a_finished_episode_is_reset_not_stepped():
    env = hsv.gym.TrackEnv()
    env.reset()
    while not env.step(np.ones(2))[2]:
        pass
    with pytest.raises(RunError, match="the episode is over, expected reset"):
        env.step(np.zeros(2))
    env.reset()
    with pytest.raises(RunError, match=r"flight: no step since the episode began, expected step\(\) first"):
        _ = env.flight
    env.step(np.zeros(2))
    assert len(env.flight.time) == 1


def test_what_is_wrong_is_named():
    with pytest.raises(CampaignError, match="scale = -1"):
        hsv.gym.TrackEnv(scale=-1.0)
    with pytest.raises(ScenarioError, match="absent"):
        hsv.gym.TrackEnv("absent")
    with pytest.raises(ScenarioError, match="a nominal law that is solved in flight, expected one of the core"):
        hsv.gym.TrackEnv("case1_qp")
    env = hsv.gym.TrackEnv()
    env.reset()
    for wrong in ([np.nan, 0.0], ["a", "b"], np.array(["2020", "2021"], "datetime64[s]"), [1j, 1.0]):
        with pytest.raises(ControllerError, match=r"action = \[.*\]: expected finite numbers"):
            env.step(wrong)


def _flown(env, steps, seed):
    """Step ``env`` with random actions; return all observations, rewards and nominal inputs."""
    random = np.random.default_rng(seed)
    found = [env.step(random.uniform(-0.2, 0.2, env.action_space.shape)) for _ in range(steps)]
    return [(o.tolist(), np.asarray(r).tolist(), info["nominal_input"].tolist()) for o, r, _, _, info in found]


COPIES = {"deepcopy": copy.deepcopy, "pickle": lambda env: pickle.loads(pickle.dumps(env))}
REALISTIC = DRAWN | {"scenario": "case1_realistic"}


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
@pytest.mark.parametrize("options", [{}, DRAWN, REALISTIC], ids=["alike", "drawn", "equipped"])
@pytest.mark.parametrize("count", [None, 1, lanes() + 1])
def test_a_copy_flies_on_with_the_same_bits(copied, options, count):
    env = hsv.gym.TrackEnv(**options) if count is None else hsv.gym.TrackVectorEnv(count, **options)
    env.reset(seed=5)
    for steps in (0, 7):  # at the start, and in flight
        _flown(env, steps, 1)
        first, second = copied(env), copied(env)
        _flown(second, 10, 3)  # a copy does not change the others
        assert _flown(first, 20, 2) == _flown(env, 20, 2)
    if count is None:
        assert copied(env).flight.fingerprint == env.flight.fingerprint
    assert np.array_equal(env.reset()[0], first.reset()[0])  # copies also draw the same next episodes


def test_a_copy_in_a_forked_process_flies_on_with_the_same_bits():
    env = hsv.gym.TrackVectorEnv(lanes() + 1, **DRAWN)
    env.reset(seed=5)
    _flown(env, 5, 1)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        forked = pool.apply(_flown, (env, 20, 2))
    assert forked == _flown(env, 20, 2)


def test_a_copy_begins_the_next_episode_after_the_end_of_its_own():
    env = hsv.gym.TrackEnv()
    env.reset()
    while not env.step(np.ones(2))[2]:
        pass
    copied = copy.deepcopy(env)
    copied.reset(), env.reset()
    assert _flown(copied, 3, 1) == _flown(env, 3, 1)


@pytest.mark.parametrize(
    ("count", "action"),
    [(None, 0.3), (None, [0.3]), (None, [[0.3, 0.3]]), (2, [0.3, 0.3]), (2, [[0.3], [0.3]]), (2, [[0.3], [0.1, 0.2]])],
)
def test_an_action_of_another_shape_is_refused_before_the_step(count, action):
    env = hsv.gym.TrackEnv() if count is None else hsv.gym.TrackVectorEnv(count)
    env.reset(seed=1)
    before = copy.deepcopy(env)
    with pytest.raises(ControllerError, match=r"action of shape \(.*\): expected \((2, )?2,?\)$"):
        env.step(action)
    assert _flown(env, 2, 1) == _flown(before, 2, 1)


@pytest.mark.parametrize("seeds", [[], [4, 5], [4, 5, 6, 7]])
def test_another_number_of_seeds_than_environments_is_refused(seeds):
    with pytest.raises(ControllerError, match=f"seed: {len(seeds)} seeds, expected 3, one for each environment"):
        hsv.gym.TrackVectorEnv(3, **DRAWN).reset(seed=seeds)
