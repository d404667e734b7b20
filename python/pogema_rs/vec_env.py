"""Vectorized environments with Gymnasium's interface; one call steps all of them on several cores."""

from __future__ import annotations

import json
import weakref
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, NoReturn, Optional, Union, cast

import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from pogema_rs import _engine, _vec_spaces
from pogema_rs._checks import check_semantics
from pogema_rs._encoder import Encoder
from pogema_rs._vec_configs import read_changes, read_configs, read_room, read_threads
from pogema_rs._vec_curriculum import Curriculum, NextEpisodes
from pogema_rs._vec_film import Film, Films
from pogema_rs._vec_input import AutoresetMode, read_actions, read_autoreset, read_mask, read_seed
from pogema_rs._vec_rewards import RewardFunction, changed_rewards, read_rewards
from pogema_rs._vec_statistics import EpisodeStatistics
from pogema_rs.semantics import Semantics

__all__ = ["AutoresetMode", "Film", "VecEnv"]

NUM_ACTIONS = 5

# The observations: an array, or a dictionary of arrays with the observation types `POMAPF` and `MAPF`.
if TYPE_CHECKING:
    from typing_extensions import TypeVar

    Observations = TypeVar("Observations", bound=_vec_spaces.Arrays, default=np.ndarray)
else:
    from typing import TypeVar

    Observations = TypeVar("Observations")


class VecEnv(VectorEnv, Generic[Observations]):
    """A batch of `num_envs` environments with `agents` agents each, all stepped by one call.

    Unless stated otherwise, arrays have the axes `(num_envs, agents, ...)`: observations `(num_envs, agents, 3, side,
    side)`, rewards as float32, `terminated` and `truncated` as bool. An episode of an environment ends when all its
    agents terminated or all were truncated: `terminated.all(axis=1) | truncated.all(axis=1)`. Gymnasium's wrappers that
    count rewards or ends expect one number per environment; pass them this expression, or `rewards.sum(axis=1)`.

    Observations: with `dtype="bits"`, uint32 of shape `(num_envs, agents, words)`, for `pogema_rs.unpack`. With the
    config's `observation_type` `POMAPF` or `MAPF`, a dictionary of arrays: `obstacles` and `agents`
    `(num_envs, agents, side, side)`, `xy` and `target_xy` `(num_envs, agents, 2)` as int64. `MAPF` adds
    `global_obstacles` `(num_envs, rows, columns)` as uint8, one map per environment with its border, and `global_xy`
    and `global_target_xy` `(num_envs, agents, 2)` as int64. Smaller maps are padded below and on the right with
    obstacles. For type checkers, such an environment is a `VecEnv[dict[str, np.ndarray]]`.

    Encoders: `encoder` is an `Encoder` or the same as a dict. The observations are then its windows, float32 of shape
    `(num_envs, agents, channels, side, side)`, as a network that plays in Rust sees them. If the encoder has scalars,
    the observations are a dictionary of `windows` and `scalars` `(num_envs, agents, 2 * len(encoder.scalars))`.
    Channels with memory are reset at the start of each episode. An encoder requires the `dtype` `float32` and the
    config's `observation_type` `default`.

    Rewards: with `rewards="own"`, they are POGEMA's. With `"shared"`, every agent gets the number of agents that are on
    their goals after the moves, divided by the number of all agents; with `on_target` `finish` and `restart`, that is
    the mean of the agents' own rewards. With `"dense"`, a step nearer to the goal adds 1 / (rows + columns) of the map
    to the agent's own reward, and a step away subtracts the same amount. Distances are steps on the map without other
    agents. A function `(rewards, terminated, truncated, infos) -> rewards` gets and returns arrays of shape
    `(num_envs, agents)`, float32.

    The next call of `reset` or `step` overwrites the array of observations. To keep it, copy it, pass `out=`, or set
    `double_buffer`, which preserves it until the call after the next. All other arrays are new with every call,
    except read-only ones.

    Seeds: with `reset(seed=S)`, episode e of environment i (both from 0) is POGEMA's episode of the seed
    `int(SeedSequence(S, spawn_key=(i, e)).generate_state(1, np.uint64)[0]) % (2**63 - 1)`, with NumPy's
    `SeedSequence`. With a sequence of seeds, the first episode of environment i is POGEMA's episode of the i-th seed T
    itself, and episode e > 0 uses the same formula with `T` and `spawn_key=(e,)`. A reset without a seed begins the
    next episodes. If the first reset has no seed, S is the config's seed, or a random seed from the system if the
    config has none. No episode depends on the number of environments or threads. `episode_seeds` holds the seeds of the
    current episodes. If a drawn map has no room for all agents, but at least two cells for each agent, another map is
    drawn for the episode, up to 100 maps in total. Attempt a > 0 has the seed of the same formula with
    `spawn_key=(i, e, a)`, or `(e, a)`. After a reset with a sequence of seeds, the first episode has one attempt only,
    and the reset raises InstanceError if it fails.

    Padding: the configs of a list may differ in the number of agents, and `agents` is the argument `num_agents`
    [default: the largest of these numbers]. The rows after the agents of an environment are padding, with observations,
    rewards and positions of 0, `terminated` and `truncated` True, `is_active` False, and action masks that only allow
    staying. Their actions must be valid and have no effect. `infos["agent_mask"]`, `(num_envs, agents)`, is True for
    agents and False for padding. It is read-only, because later calls return the same array until it changes.

    Autoreset, as in Gymnasium: with `SAME_STEP` the step that ends an episode also begins the next one, and
    `infos["final_obs"]` and `infos["final_info"]` hold the end of the old one. With `NEXT_STEP` the following step
    ignores the environment's actions and begins the next episode. With `DISABLED` the environment keeps its final
    state, with rewards of 0 and the last `terminated` and `truncated`, until `reset(options={"reset_mask": ...})`.

    `infos` holds `is_active` and `agent_mask`, `(num_envs, agents)`, which belong to the returned observations. With
    `SAME_STEP`, a step that ends an episode returns the rewards, `terminated` and `truncated` of the old episode, whose
    `agent_mask` is in `final_info`. With `masks`, `infos` holds `action_masks`, `(num_envs, agents, 5)`, int8, 1 where
    no obstacle blocks the move. When episodes ended, `infos` holds `metrics`, a dict of float arrays `(num_envs,)` that
    are NaN where `_metrics` is False. With `statistics`, it then also holds `episode` and `_episode` in the form of
    Gymnasium's `RecordEpisodeStatistics`: arrays `(num_envs,)` with the return `r` (the mean of the agents' returns),
    the length `l` in steps and the time `t` in seconds. With `SAME_STEP`, `final_state` holds the global state at the
    end of each of these episodes, as `final_obs` holds the observations.

    Curriculum: `set_configs` changes configs from the next episode of each environment on. The function `curriculum`
    does so automatically: each time an episode ends, it gets the index of the environment and the metrics of the
    episode as a dict of floats, and returns the config of the environment's further episodes, or None to keep the
    config. Environments are passed in ascending order, so results are reproducible if the function is. New configs must
    fit the arrays: `num_agents` and `map_size` reserve room. `reset` does not restore earlier configs. The seed of a
    new config has no effect: the seeds of later episodes follow from the seed of the last reset.

    Calls from two threads at the same time, and calls in a forked child, raise a RuntimeError. A config is read once;
    later changes to it have no effect. Warnings about single instances are not shown.
    """

    # Wrappers of Gymnasium before 1.0 read this attribute. Its `VectorEnv.__init__`, which sets it, is not called here.
    is_vector_env = True

    def __init__(
        self,
        grid_config: Any,
        num_envs: Optional[int] = None,
        *,
        num_threads: Optional[int] = None,
        dtype: Union[str, np.dtype, type] = "float32",
        autoreset_mode: Union[AutoresetMode, str] = AutoresetMode.SAME_STEP,
        semantics: Union[str, Semantics] = Semantics.RELEASED,
        double_buffer: bool = False,
        masks: bool = False,
        rewards: Union[str, RewardFunction] = "own",
        statistics: bool = False,
        num_agents: Optional[int] = None,
        map_size: Union[None, int, tuple[int, int]] = None,
        curriculum: Optional[Curriculum] = None,
        film: Optional[Film] = None,
        encoder: Union[None, Encoder, Mapping[str, Any]] = None,
    ) -> None:
        """Makes one environment for each config of a list, or `num_envs` environments of a single config.

        A config is a GridConfig or a dict. The configs of a list may have different maps and numbers of agents, but
        must agree on radius and rules, `max_episode_steps` included. `num_agents` and `map_size` (the rows and columns,
        or the side of a square) make room for later configs [default: the largest of the configs]. `film` films every
        N-th episode of one environment. `encoder` replaces the observations. With the semantics `2.0` no agent vanishes
        from the observations, as in POGEMA's 2.0 line. `num_threads` is the largest number of threads [default: as many
        as suit the work of a step, at most one per core and environment]. A step uses fewer threads as long as measured
        times show that more do not make it faster.

        Errors: ValueError or TypeError for wrong arguments, including a `map_name` that is not registered. A config
        without an instance raises `InstanceError` only at the first reset.
        """
        self.closed = True
        self.semantics = check_semantics(semantics)
        dtype = _vec_spaces.read_dtype(dtype)
        self.encoder = None if encoder is None else _vec_spaces.read_encoder_for(encoder, dtype)
        self.autoreset_mode = read_autoreset(autoreset_mode)
        reward, is_dense, self._change_rewards = read_rewards(rewards)
        self._reward = reward
        configs, of_env, self.num_envs = read_configs(grid_config, num_envs, reward)
        # A curriculum chooses the config of the next episode after an episode ends and before the next one begins.
        begins_ended = curriculum is not None and self.autoreset_mode == AutoresetMode.SAME_STEP
        mode = AutoresetMode.DISABLED if begins_ended else self.autoreset_mode
        self._batch = _engine.Batch(
            (configs, of_env),
            self.num_envs,
            (mode.value, self.semantics.occupancy_is_exact, is_dense),
            (read_threads(num_threads), _vec_spaces.CELL_BITS[dtype]),
            read_room(num_agents, map_size),
            None if self.encoder is None else json.dumps(self.encoder.to_dict()),
        )
        self._next_episodes: Optional[NextEpisodes] = None
        if curriculum is not None:
            self._next_episodes = NextEpisodes(self._batch, curriculum, begins_ended, self.set_configs)
        self._films = None if film is None else Films(self._batch, film, self.num_envs)
        # If the program does not close the environment, this finalizer runs when the environment is collected, or when
        # the program exits, while Python can still import modules.
        self._finish_films = None if self._films is None else weakref.finalize(self, self._films.finish)
        self.num_threads = self._batch.num_threads()
        self.num_agents, radius, size = self._batch.sizes()
        self.metadata = {"autoreset_mode": self.autoreset_mode}
        single_space = _vec_spaces.observation_space(
            self._batch.observation_type(), dtype, self.num_agents, radius, size, self.encoder
        )
        # A Dict for `POMAPF`, `MAPF` and encoders with scalars; type checkers see the Box of all other environments.
        self.single_observation_space = cast(spaces.Box, single_space)
        self.single_state_space = _vec_spaces.state_space(self.num_agents, size)
        self.single_action_space = spaces.MultiDiscrete([NUM_ACTIONS] * self.num_agents)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._has_masks = bool(masks)
        self._statistics = EpisodeStatistics(self.num_envs, self.autoreset_mode) if statistics else None
        num_buffers = 2 if double_buffer else 1
        self._buffers = [_vec_spaces.zeros(single_space, self.num_envs) for _ in range(num_buffers)]
        self._next_buffer = 0
        self._all = np.ones(self.num_envs, dtype=np.bool_)
        self._all.flags.writeable = False
        # The agents of the current episodes, and whether an episode may have fewer than the arrays have room for.
        self._agent_mask = np.ones((self.num_envs, self.num_agents), dtype=np.bool_)
        self._is_padded = True
        # Whether the number of agents of an environment may change.
        self._may_change = False
        self._has_ends = False
        self.closed = False

    # Gymnasium defines `observation_space` as an attribute.
    @cached_property
    def observation_space(self) -> spaces.Box:  # type: ignore[override]
        """The space of all observations; a Dict for `POMAPF`, `MAPF` and encoders with scalars.

        It is made at first access, because it takes more memory than the observations.
        """
        return cast(spaces.Box, batch_space(self.single_observation_space, self.num_envs))

    @cached_property
    def state_space(self) -> spaces.Dict:
        """The space of `state()`; made at first access."""
        return cast(spaces.Dict, batch_space(self.single_state_space, self.num_envs))

    @property
    def episode_seeds(self) -> np.ndarray:
        """POGEMA's seed of each environment's current episode, `(num_envs,)`, int64."""
        return np.array(self._batch.episode_seeds(), dtype=np.int64)

    def reset(
        self,
        *,
        seed: Union[int, Sequence[int], None] = None,
        options: Optional[dict[str, Any]] = None,
        out: Optional[Observations] = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins the first episodes of a seed or of one seed per environment; without a seed, the next episodes.

        `options={"reset_mask": mask}` skips the environments where the mask is False; the returned observations are
        still those of all environments.

        Errors: ValueError or TypeError for wrong arguments; `InstanceError` if an environment has no instance. After an
        error the state is unchanged.
        """
        chosen = read_mask(options, self.num_envs)
        one, each = read_seed(seed, self.num_envs)
        if self._films is not None:
            self._films.warn()
        observations = self._observations(out)
        active, masks = self._new_state(self.num_envs)
        self._batch.reset((_vec_spaces.for_engine(observations), active, masks), chosen, one, each)
        if self._next_episodes is not None:
            self._next_episodes.follow_reset(chosen)
        if self._statistics is not None:
            self._statistics.begin(chosen)
        if seed is not None:
            self._np_random = np.random.default_rng(one if each is None else each)
            self._np_random_seed = one if each is None else each[0]
        self._swap_buffers(out)
        if self._is_padded:
            self._agent_mask = self._new_agent_mask(None)
            self._is_padded = self._may_change or not self._agent_mask.all()
        return observations, self._state_infos(active, self._agent_mask, masks, self._all)

    def step(
        self, actions: Any, *, out: Optional[Observations] = None
    ) -> tuple[Observations, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Plays one step and returns observations, rewards, terminated, truncated and infos.

        `actions` are integers from 0 to 4 of shape `(num_envs, agents)`: an array, nested lists, or any object that
        shares its memory with NumPy, for example a torch tensor on the CPU. A single environment also accepts -5 to -1,
        as indices from the end of a list, and wrong actions of inactive agents; this class rejects both.

        Errors: ValueError or TypeError for wrong actions, before anything is played; `InstanceError` if an environment
        has no next episode. TypeError or ValueError for wrong results of the function `rewards`, after the step. If
        `curriculum` raises an exception or returns a config that does not fit, the step ends as if it had returned None
        for all environments, and then raises.
        """
        numbers = read_actions(actions, (self.num_envs, self.num_agents))
        if self._films is not None:
            self._films.warn()
        if self._next_episodes is not None:
            self._next_episodes.check()
        observations = self._observations(out)
        shape = (self.num_envs, self.num_agents)
        rewards = np.empty(shape, dtype=np.float32)
        terminated, truncated = np.empty(shape, dtype=np.bool_), np.empty(shape, dtype=np.bool_)
        active, masks = self._new_state(self.num_envs)
        state = (_vec_spaces.for_engine(observations), active, masks)
        old_mask = self._agent_mask
        ended = self._batch.step(numbers, (rewards, terminated, truncated), state)
        self._swap_buffers(out)
        infos: dict[str, Any] = {}
        failure = None
        try:
            if ended:
                self._add_ends(infos, ended)
                failure = None if self._next_episodes is None else self._next_episodes.follow(ended, state)
        finally:
            # An episode begins in the step that ends the previous one, or in the step after it.
            if self._is_padded and (ended or self._has_ends):
                self._agent_mask = self._new_agent_mask(None)
            self._has_ends = bool(ended)
        infos.update(self._state_infos(active, self._agent_mask, masks, self._all))
        if self._change_rewards is not None or self._statistics is not None:
            rewards = self._count(rewards, terminated, truncated, infos, ended, old_mask)
        if failure is not None:
            raise failure
        return observations, rewards, terminated, truncated, infos

    def set_configs(self, configs: Any, envs: Optional[Sequence[int]] = None) -> None:
        """Changes configs from the next episode of each environment on; the current episodes continue.

        `configs` is one config for all environments, or a list with one for each. With `envs`, the indices of
        environments, only their configs change, and a list holds one config for each of them.

        A config may have another map and another number of agents, within the room that the `num_agents` and `map_size`
        of the constructor reserve. Radius and rules cannot change. A config's seed has no effect: the episodes keep
        their seeds and numbers. With `NEXT_STEP`, the next episode of an environment whose episode has just ended
        already uses the new config.

        Errors: ValueError or TypeError for wrong arguments or a config that does not fit; with `NEXT_STEP`,
        `InstanceError` if such a next episode does not exist. After an error no config is changed.
        """
        read, of_env, chosen = read_changes(configs, envs, self.num_envs, self._reward)
        if chosen:
            self._batch.set_configs((read, of_env), chosen)
            self._is_padded = self._may_change = True

    @property
    def films(self) -> list[str]:
        """The paths of the films that are complete, in the order of their episodes; after `close`, of all films."""
        return [] if self._films is None else self._films.paths()

    def action_masks(self) -> np.ndarray:
        """Returns the masks of the actions that no obstacle blocks now.

        A mask is 1 for staying, and for a move to a cell that is on the map and not an obstacle, even if an agent
        occupies it. An inactive agent can only stay.

        Shape: `(num_envs, agents, 5)`, int8

        Errors: `NotResetError` before the first reset.
        """
        masks = np.empty((self.num_envs, self.num_agents, NUM_ACTIONS), dtype=np.int8)
        self._batch.mask_actions(masks)
        return masks

    def state(self) -> dict[str, np.ndarray]:
        """Returns the global state of all environments, for example for a centralised critic.

        `obstacles` `(num_envs, rows, columns)`, uint8, are the maps without a border, 1 for an obstacle. The size is
        `map_size` [default: that of the largest map]; smaller maps are padded below and on the right with obstacles.
        `positions` and `goals` `(num_envs, agents, 2)`, int64, are the cells of the agents and their current goals, row
        first, counted from the corner of the map. `active` `(num_envs, agents)`, bool, is False for agents that have
        finished; they stay where they finished. The arrays are new with every call.

        Errors: `NotResetError` before the first reset.
        """
        return self._global_state(self.num_envs, None)

    def sample_actions(self) -> np.ndarray:
        """Returns random actions from `np_random`, which `reset(seed=...)` seeds.

        Shape: `(num_envs, agents)`, int64
        """
        return self.np_random.integers(NUM_ACTIONS, size=(self.num_envs, self.num_agents))

    def close(self, **kwargs: Any) -> None:
        """Completes the films, and frees the environments and threads.

        A film of an episode that has not ended shows the steps so far. Later calls except `close` raise a RuntimeError.
        """
        if self.closed:
            return
        try:
            if self._finish_films is not None:
                self._finish_films()
        finally:
            self._batch.close()
            self.closed = True

    def __reduce_ex__(self, protocol: Any) -> NoReturn:
        raise TypeError("a VecEnv cannot be pickled or copied: make a new one of the same config, in each process")

    def _global_state(self, num_envs: int, ended: Optional[list[int]]) -> dict[str, np.ndarray]:
        """Returns the current states of all environments, or the final states of some."""
        arrays: dict[str, np.ndarray] = _vec_spaces.zeros(self.single_state_space, num_envs)
        self._batch.global_state(arrays, arrays["active"], ended)
        return arrays

    def _count(
        self,
        rewards: np.ndarray,
        terminated: np.ndarray,
        truncated: np.ndarray,
        infos: dict[str, Any],
        ended: list[int],
        old_mask: np.ndarray,
    ) -> np.ndarray:
        """Returns the rewards of a step as the caller's function changes them, and adds the statistics to the infos."""
        # With `SAME_STEP`, the rewards are those of the old episodes.
        played = old_mask if self.autoreset_mode == AutoresetMode.SAME_STEP else self._agent_mask
        try:
            if self._change_rewards is not None:
                rewards = changed_rewards(self._change_rewards, rewards, terminated, truncated, infos)
                if not played.all():
                    rewards = np.where(played, rewards, np.float32(0))
        finally:
            # After an error of the function, the engine's rewards count: the step was played.
            if self._statistics is not None:
                self._statistics.count(rewards, played)
                if ended:
                    infos["episode"], infos["_episode"] = self._statistics.end(ended)
        return rewards

    def _new_state(self, num_envs: int) -> tuple[np.ndarray, Optional[np.ndarray]]:
        shape = (num_envs, self.num_agents)
        masks = np.empty((*shape, NUM_ACTIONS), dtype=np.int8) if self._has_masks else None
        return np.empty(shape, dtype=np.bool_), masks

    def _new_agent_mask(self, ended: Optional[list[int]]) -> np.ndarray:
        """Returns which rows are agents: now in all environments, or in the last episodes of some."""
        num_envs = self.num_envs if ended is None else len(ended)
        mask = np.empty((num_envs, self.num_agents), dtype=np.bool_)
        self._batch.mask_agents(mask, ended)
        mask.flags.writeable = False
        return mask

    def _observations(self, out: Optional[Observations]) -> Any:
        buffer = self._buffers[self._next_buffer]
        return buffer if out is None else _vec_spaces.check_out(out, buffer)

    def _swap_buffers(self, out: Optional[Observations]) -> None:
        if out is None:
            self._next_buffer = (self._next_buffer + 1) % len(self._buffers)

    def _state_infos(
        self, active: np.ndarray, agent_mask: np.ndarray, masks: Optional[np.ndarray], present: np.ndarray
    ) -> dict[str, Any]:
        infos = {"is_active": active, "_is_active": present, "agent_mask": agent_mask, "_agent_mask": present}
        if masks is not None:
            infos.update(action_masks=masks, _action_masks=present)
        return infos

    def _add_ends(self, infos: dict[str, Any], ended: list[int]) -> None:
        """Adds the ends of the episodes of some environments, in Gymnasium's layout."""
        present = np.zeros(self.num_envs, dtype=np.bool_)
        present[ended] = True
        metrics: dict[str, Any] = {}
        for env, ended_metrics in zip(ended, self._batch.metrics(ended)):
            for name, value in ended_metrics.items():
                if name not in metrics:
                    metrics.update({name: np.full(self.num_envs, np.nan), f"_{name}": present})
                metrics[name][env] = value
        infos.update(metrics=metrics, _metrics=present)
        if self.autoreset_mode != AutoresetMode.SAME_STEP:
            return
        observations = _vec_spaces.zeros(self.single_observation_space, len(ended))
        active, masks = self._new_state(len(ended))
        self._batch.ended(ended, (_vec_spaces.for_engine(observations), active, masks))
        final = _vec_spaces.per_env(observations, ended, self.num_envs)
        state = _vec_spaces.per_env(self._global_state(len(ended), ended), ended, self.num_envs)
        agents = (self._spread(ended, active), self._spread(ended, self._new_agent_mask(ended)))
        every_masks = None if masks is None else self._spread(ended, masks)
        info = {**self._state_infos(*agents, every_masks, present), "metrics": metrics, "_metrics": present}
        infos.update(final_obs=final, _final_obs=present, final_info=info, _final_info=present)
        infos.update(final_state=state, _final_state=present)

    def _spread(self, envs: list[int], values: np.ndarray) -> np.ndarray:
        every = np.zeros((self.num_envs, *values.shape[1:]), dtype=values.dtype)
        every[envs] = values
        return every
