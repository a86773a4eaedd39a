"""Gymnasium environments; importing this module registers ``hsv/Track-v0`` as a single and as a vector environment.

An agent replaces the controller of a scenario, and an episode is one flight. The observation of step k, in SI units, is

    [x^(k); x^_f(k) - x_r(k)],

the 9 measured or estimated states, then their 9 deviations from the reference, in which the filtered pitch rate q_f
replaces q. The 2 actions a give the input u(k) = u_r(k) + u_n(k) + diag(:data:`SCALE`) a, which is limited to U;
values of a outside [-1, 1] are admitted. The reward of a step is, with the true state x after the step,

    T / (1 + ((h - h_r) / 100 m)^2 + ((V - V_r) / 20 m/s)^2 + |a|^2),

where T is the control period. The sum over an episode is thus at most T times its number of steps. An episode has one
step for every command of a flight, including that at the last state; this last step returns the last state again, and
the episode is then terminated if this state is outside the range of the model, otherwise truncated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from numbers import Integral
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import gymnasium.wrappers.vector
import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from hsv import core
from hsv.base.errors import ControllerError, ParameterError, RunError, ScenarioError, one_of, require
from hsv.control.design_file import find_design, read_design
from hsv.control.tube_law import no_tube
from hsv.core import Struct, lanes, lib
from hsv.flight.assembly import assemble_flight, without_code
from hsv.flight.campaign.campaign import MAX_SAMPLES, plan
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.closed_loop import Components, flight_struct
from hsv.flight.flight import Flight, flight_of
from hsv.flight.history import History
from hsv.flight.scenario import load_scenario, scenario_at_means, scenario_table, scenario_text
from hsv.flight.side_by_side import FlightGroup
from hsv.model.dynamics import in_model_range
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES, PITCH_RATE

__all__ = ["SCALE", "TrackEnv", "TrackVectorEnv", "normalised"]

SCALE = np.array([0.5, 0.25])
"""Change of fuel equivalence ratio and elevator deflection (rad) for an action of 1; powers of two scale exactly"""

_TOLERATED = np.array([100.0, 20.0])
"""Error of altitude (m), and error of velocity (m/s), that halves the reward"""

_OBSERVATION = Box(-np.inf, np.inf, (2 * N_STATES,), np.float64)
_ACTION = Box(-1.0, 1.0, (N_INPUTS,), np.float64)

Factors = Mapping[str, tuple[object, object]]
Info = dict[str, Any]


class _Draws:
    """The set of flights from which every episode is drawn; the arguments are those of :class:`TrackEnv`."""

    def __init__(self, scenario: str, scale: float, factors: Factors | None) -> None:
        text = scenario_text(scenario)
        name = Path(scenario).stem
        _, distributions = scenario_at_means(scenario_table(text, name), name)
        drawn = scale or factors or distributions
        self._campaign = None
        if drawn:
            self._campaign = plan(scenario, samples=MAX_SAMPLES, scale=scale, factors=factors, with_code=False)
            self._variants = FlightVariants(without_code(self._campaign.scenario), self._campaign.design)
            components = self._variants.unchanged
        else:
            components = assemble_flight(without_code(load_scenario(scenario)))
        if not components.nominal_trajectory.law.in_core:
            raise ScenarioError(f"scenario {name!r}: a nominal law that is solved in flight, expected one of the core")
        limits: Any = SimpleNamespace(in_core=True, kernel=no_tube(components.plant.vehicle), library=None)
        self._controller = limits
        self.unchanged = replace(components, controller=limits)

    def draw(self, random: np.random.Generator) -> tuple[Components, int]:
        """Draw a flight; return its components and its number in the campaign, 0 if there is only one flight."""
        if self._campaign is None:
            return self.unchanged, 0
        flight = int(random.integers(MAX_SAMPLES))
        [sample], _ = self._campaign.draw(range(flight, flight + 1))
        components = self._variants.components(without_code(self._campaign.flown(flight, sample.tolist())))
        return replace(components, controller=self._controller), flight

    def __deepcopy__(self, memo: dict[int, Any]) -> _Draws:
        return self  # it does not change


@dataclass
class _Group:
    """Flights of some environments that are simulated together, one per lane of a register."""

    places: list[int]
    """Index of the environment in each lane; negative in spare lanes, which repeat a flight or go on with one"""
    flights: list[Struct]
    """One flight per lane"""
    memory: np.ndarray
    references: list[Struct]
    """One reference per lane"""
    step: int = 0
    """The current step k, which is common to all flights"""
    over: bool = False
    """Whether the episodes are over and begin anew in the next step"""

    @property
    def rows(self) -> list[int]:
        """Indices of the environments."""
        return [place for place in self.places if place >= 0]

    def fly(self, half: int) -> None:
        """Simulate a half of the current step: ``lib.SENSE`` up to the nominal input, or ``lib.ACT`` after it."""
        core.fly(self.flights, self.memory, self.step, self.step + 1, half)

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        if len(self.flights) not in (1, lanes()):
            raise RunError(f"environment: from a processor with {len(self.flights)} lanes, expected {lanes()} as here")
        self.memory = core.loop_memory(len(self.flights))  # aligned, as the copied memory need not be
        self.memory[:] = state["memory"]


class _Episodes:
    """The current episodes of n environments, in groups of at most as many as the core has lanes."""

    def __init__(self, draws: _Draws, randoms: Sequence[np.random.Generator], *, recorded: bool = False) -> None:
        """Begin one episode per generator in ``randoms``, which is used to draw it; keep all steps if ``recorded``."""
        self._draws, self._randoms = draws, randoms
        self.recorded: list[History] | None = [] if recorded else None
        self._count = count = len(randoms)
        # The last rows are those of spare lanes.
        self._memory = np.zeros((count + lanes(), History.numbers()))
        self._commands = np.zeros((len(self._memory), N_INPUTS))
        self.history = self._history()
        self.components: list[Components] = [draws.unchanged] * count
        self.numbers = np.zeros(count, np.int64)
        self._x_r, self._u_r = np.zeros((count, N_STATES)), np.zeros((count, N_INPUTS))
        self._groups: list[_Group] = []
        self.restart(range(count))

    def restart(self, rows: Sequence[int]) -> None:
        """Begin the episodes of some environments anew; the others go on."""
        for group in self._groups:
            for lane, place in enumerate(group.places):
                if place in rows:
                    group.places[lane] = -1 - lane
                    group.flights[lane] = group.flights[lane].replaced(**self._written(-1 - lane))
        self._groups = [group for group in self._groups if group.rows]
        for start in range(0, len(rows), lanes()):
            self._groups += self._begun(rows[start : start + lanes()])

    def _history(self) -> History:
        parts: list[Any] = [part[: self._count, 0] for part in History.over(self._memory, 1) if part is not None]
        return History(*parts)

    def __deepcopy__(self, memo: dict[int, Any]) -> _Episodes:
        # What does not change in an episode is shared, so that a copy costs little.
        shared = [*self.components, *(reference for group in self._groups for reference in group.references)]
        memo.update((id(part), part) for part in shared)
        copied = object.__new__(_Episodes)
        copied.__setstate__(deepcopy(vars(self), memo))
        return copied

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Continue the episodes of a copy: its flights write to its own history, which is not shared."""
        vars(self).update(state)
        self.history = self._history()
        for group in self._groups:
            for lane, flight in enumerate(group.flights):
                group.flights[lane] = flight.replaced(**self._written(group.places[lane]))

    def _written(self, place: int) -> dict[str, np.ndarray | None]:
        """Return the fields of a flight that belong to the environment or the spare lane ``place``."""
        signals, auxiliary, estimated = History.over(self._memory[place], 1)
        written = {"history": signals, "auxiliary": auxiliary, "estimated": estimated}
        return written | {"commanded": self._commands[place]}

    @property
    def nominal_input(self) -> np.ndarray:
        """u_r + u_n, the inputs for actions of zero, shape (n, 2)."""
        return self._u_r + self.history.nominal_input

    @property
    def observation(self) -> np.ndarray:
        """Observations, shape (n, 18), see :mod:`hsv.gym`."""
        error = self.history.estimate - self._x_r
        error[:, PITCH_RATE] = self.history.filtered_pitch_rate - self._x_r[:, PITCH_RATE]
        return np.concatenate((self.history.estimate, error), 1)

    def step(self, actions: object, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Simulate a step with finite ``actions`` of a ``shape``; an episode that is over begins anew instead.

        Returns:
            Three arrays of shape (n,): rewards, 0 for an episode that begins anew; a mask of the episodes that
            terminate; and a mask of those that are truncated.

        Raises:
            ControllerError: The actions have another shape, or one is not a finite number.
        """
        actions = _numbers(actions, shape).reshape(self._count, N_INPUTS)
        self._commands[: self._count] = self.nominal_input + SCALE * actions
        self._commands[self._count :] = self._commands[self._count - 1]
        period = self.components[0].plant.period
        terminated, truncated, begun = np.zeros((3, self._count), bool)
        groups = []
        for group in self._groups:
            if group.over:
                groups += self._begun(group.rows)
                begun[group.rows] = True
                if self.recorded:
                    self.recorded.clear()
                continue
            groups.append(group)
            group.fly(lib.ACT)
            if self.recorded is not None:
                self.recorded.append(self.history.copy())
            if any(
                f.pointer.ended == group.step + 1 for f, i in zip(group.flights, group.places, strict=True) if i >= 0
            ):
                group.over = True
                for i in group.rows:
                    plant = self.components[i].plant
                    terminated[i] = not in_model_range(self.history.state[i], plant.vehicle.angle_limit)
                    truncated[i] = not terminated[i]
            else:
                self._sense(group, group.step + 1)
        self._groups = groups
        errors = (self.history.state - self._x_r)[:, : len(_TOLERATED)] / _TOLERATED
        rewards = period / (1.0 + (errors * errors).sum(1) + (actions * actions).sum(1))
        return np.where(begun, 0.0, rewards), terminated, truncated

    def _begun(self, rows: Sequence[int]) -> list[_Group]:
        for i in rows:
            self.components[i], self.numbers[i] = self._draws.draw(self._randoms[i])
        components = [self.components[i] for i in rows]
        groups = []
        for part in [rows] if FlightGroup.takes(components, 1) else [[i] for i in rows]:
            width = lanes() if len(part) > 1 else 1
            spare, steps = width - len(part), components[0].plant.steps + 1
            places, flown = [*part, *range(-1, -1 - spare, -1)], [*part, *[part[-1]] * spare]
            flights = [self._flight(row, place, steps) for row, place in zip(flown, places, strict=True)]
            references = [self.components[i].nominal_trajectory.reference.along(steps) for i in flown]
            group = _Group(places, flights, core.loop_memory(width), references)
            self._sense(group, 0)
            groups.append(group)
        return groups

    def _flight(self, row: int, place: int, steps: int) -> Struct:
        history, commands = History.over(self._memory[place], 1), self._commands[place]
        return flight_struct(self.components[row], history, commanded=commands, ended=steps)

    def _sense(self, group: _Group, k: int) -> None:
        group.step = k
        group.fly(lib.SENSE)
        for i, reference in zip(group.places, group.references, strict=True):
            if i >= 0:
                self._x_r[i], self._u_r[i] = reference.state[k], reference.input[k]


def _numbers(action: object, shape: tuple[int, ...]) -> np.ndarray:
    """Return an ``action`` as an array; refuse another ``shape``, and anything but finite numbers."""
    try:
        given = np.asarray(action)
    except ValueError:  # numpy refuses nested lists of different lengths
        given = np.array(None)
    if given.shape != shape:
        raise ControllerError(f"action of shape {given.shape}: expected {shape}")
    if given.dtype.kind not in "fiu" or not np.isfinite(given).all():
        raise ControllerError(f"action = {given.tolist()}: expected finite numbers")
    return np.asarray(given, float)


class TrackEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """An environment in which the agent tracks the reference of a scenario by fuel and elevator, see :mod:`hsv.gym`.

    ``info`` has ``nominal_input``, u_r + u_n, shape (2,), and ``flight``, its number in the campaign (0 without one).
    """

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 50}  # noqa: RUF012 (as in the base class)
    observation_space, action_space = _OBSERVATION, _ACTION

    def __init__(
        self,
        scenario: str = "case1",
        scale: float = 0.0,
        factors: Factors | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Read a scenario, whose controller is replaced by the agent.

        If the scenario has no distributions, ``scale`` is 0 and ``factors`` is empty, every episode is the flight of
        ``hsv simulate``. Otherwise it is a random flight of the campaign :func:`hsv.montecarlo` with these arguments.

        Args:
            scenario: Name of a shipped scenario, or path.
            scale: Factor on the bounds of the vehicle's uncertain parameters; with 0 these bounds are not used.
            factors: Least and largest value of further fields, written as in a scenario file, by field, such as
                ``fault[0].effectiveness``.
            render_mode: ``rgb_array``: :meth:`render` returns the side view; ``human``: a window shows each step.

        Raises:
            CampaignError, ScenarioError: A setting is wrong; the message names it.
        """
        if render_mode not in (None, *(modes := self.metadata["render_modes"])):
            raise ParameterError(f"render_mode = {render_mode!r}: expected {one_of(modes, str(render_mode))}")
        self.render_mode = render_mode
        self._draws = _Draws(scenario, scale, factors)
        self._over = False
        self._image: Any = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, Info]:
        """Begin an episode; return the first observation, shape (18,), and ``info``; ``options`` are ignored."""
        super().reset(seed=seed)
        self._episodes = _Episodes(self._draws, [self.np_random], recorded=True)
        self._over = False
        if self.render_mode == "human":
            self.render()
        return self._episodes.observation[0], self._info

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, Info]:
        """Simulate a control period with a finite ``action``, shape (2,).

        Return the observation, shape (18,), the reward, whether the episode terminates, whether it is truncated, and
        ``info``.

        Raises:
            RunError: The episode is over.
            ControllerError: The action has another shape, or is not finite.
        """
        if self._over:
            raise RunError("step: the episode is over, expected reset() first")
        [reward], [terminated], [truncated] = self._episodes.step(action, (N_INPUTS,))
        self._over = bool(terminated or truncated)
        if self.render_mode == "human":
            self.render()
        return self._episodes.observation[0], float(reward), bool(terminated), bool(truncated), self._info

    def render(self) -> np.ndarray | None:
        """Return the side view of the vehicle after the last step, pixels (400, 640, 3), or show it in a window."""
        if self.render_mode is None:
            return None
        from hsv.pages.side_view import Image  # matplotlib takes a second to import

        plant, history = self._episodes.components[0].plant, self._episodes.history
        if self._image is None:
            self._image = Image(self.render_mode == "human", plant.vehicle.form.elastic)
        recorded = self._episodes.recorded
        inputs = recorded[-1].command[0] if recorded else plant.initial.input
        pixels: np.ndarray | None = self._image.draw(len(recorded or ()) * plant.period, history.state[0], inputs)
        return pixels

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_image": None}

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._image is not None and self.render_mode == "human":
            from matplotlib import pyplot

            pyplot.close(self._image.figure)
        self._image = None

    @property
    def flight(self) -> Flight:
        """The flight in this episode up to the current step, with history, metrics and fingerprint.

        Raises:
            RunError: The episode has no step yet.
        """
        if not self._episodes.recorded:
            raise RunError("flight: no step since the episode began, expected step() first")
        parts: list[Any] = [np.concatenate(part) for part in zip(*self._episodes.recorded, strict=True)]
        return flight_of(self._episodes.components[0], History(*parts))

    @property
    def unchanged(self) -> Components:
        """The components of the flight from which those of the episodes deviate."""
        return self._draws.unchanged

    @property
    def _info(self) -> Info:
        return {"nominal_input": self._episodes.nominal_input[0], "flight": int(self._episodes.numbers[0])}


class TrackVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Several :class:`TrackEnv`, simulated side by side by the core; each step has the same bits as if simulated alone.

    A reset with one seed gives environment i that seed plus i. Flights that are simulated side by side have a common
    step: when one of them diverges, the others are truncated, and all begin anew in the next step. Flights that the
    core cannot simulate side by side, for example because the engine of one fails, are simulated alone.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 (as in the base class)

    def __init__(
        self, num_envs: int = 1, scenario: str = "case1", scale: float = 0.0, factors: Factors | None = None
    ) -> None:
        """Read a scenario for ``num_envs`` environments; other arguments and errors as for :class:`TrackEnv`."""
        require("num_envs", num_envs, Integral, "an integer above zero")
        if num_envs < 1:
            raise ParameterError(f"num_envs = {num_envs}: expected an integer above zero")
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = _OBSERVATION, _ACTION
        self.observation_space, self.action_space = (batch_space(space, num_envs) for space in (_OBSERVATION, _ACTION))
        self._draws = _Draws(scenario, scale, factors)
        self._randoms = [np_random()[0] for _ in range(num_envs)]
        self._episodes: Any = None

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, Info]:
        """Begin all episodes, or those of ``options["reset_mask"]``, with one ``seed`` or one per environment.

        Return the observations, shape (n, 18), and ``info`` with arrays over the n environments.

        Raises:
            ControllerError: There is another number of seeds than environments, or the mask is not n truth values.
        """
        rows = range(self.num_envs)
        mask = (options or {}).get("reset_mask")
        if mask is not None and not (self._episodes and np.shape(mask) == (self.num_envs,) and np.any(mask)):
            raise ControllerError(f"reset_mask: expected {self.num_envs} truth values, one true, after a first reset")
        chosen = [i for i in rows if mask is None or mask[i]]
        if seed is None or isinstance(seed, int | np.integer):
            seeds: list[int | None] = [None if seed is None else int(seed) + i for i in rows]
        else:
            seeds = [*seed] if np.iterable(seed) else [seed]
        if len(seeds) != self.num_envs:
            raise ControllerError(f"seed: {len(seeds)} seeds, expected {self.num_envs}, one for each environment")
        for i in chosen:
            if seeds[i] is not None:
                self._randoms[i] = np_random(seeds[i])[0]
        if mask is None:
            self._episodes = _Episodes(self._draws, self._randoms)
        else:
            self._episodes.restart(chosen)
        return self._episodes.observation, self._infos

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Info]:
        """Simulate a control period with finite ``actions``, shape (n, 2); an episode that is over begins anew instead.

        Return observations, shape (n, 18), and with shape (n,) rewards and masks of terminated and of truncated
        episodes; then ``info``.
        """
        found = self._episodes.step(actions, (self.num_envs, N_INPUTS))
        return self._episodes.observation, *found, self._infos

    @property
    def unchanged(self) -> Components:
        """The components of the flight from which those of the episodes deviate."""
        return self._draws.unchanged

    @property
    def _infos(self) -> Info:
        every = np.ones(self.num_envs, bool)
        infos = {"nominal_input": self._episodes.nominal_input, "flight": self._episodes.numbers.copy()}
        return infos | {f"_{name}": every for name in infos}


def normalised(env: Any, design: str = "baseline") -> Any:
    """Return a single or vector environment with its observations in the scales of a design.

    States are deviations from those at the first reference of the scenario. These and the errors are divided by the
    ``nominal.state_scale`` of the ``design``; elastic coordinates by their values at that reference, and their rates by
    these values times the natural frequencies.
    """
    components = env.unwrapped.unchanged
    x_r, vehicle = components.nominal_trajectory.reference.along(1).state[0], components.plant.vehicle
    rates = [1.0, vehicle.natural_frequency_1, 1.0, vehicle.natural_frequency_2]
    elastic = np.repeat(np.abs(x_r[N_RIGID::2]), 2) * rates if vehicle.form.elastic else np.ones(4)
    scale = np.concatenate((read_design(find_design(design)).nominal_state_scale, elastic))
    shift, by = np.concatenate((x_r, np.zeros(N_STATES))), np.concatenate((scale, scale))

    def change(observation: np.ndarray) -> np.ndarray:
        return (observation - shift) / by

    wrappers = gymnasium.wrappers.vector if isinstance(env, VectorEnv) else gymnasium.wrappers
    return wrappers.TransformObservation(env, change, env.observation_space)


gymnasium.register("hsv/Track-v0", "hsv.gym:TrackEnv", vector_entry_point="hsv.gym:TrackVectorEnv")
