"""Many environments behind Gymnasium's interface for vectors of them, stepped by one call on all cores."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NoReturn, Optional, Union, cast

import numpy as np
from gymnasium import spaces
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space

from pogema_rs import _engine, grid_registry
from pogema_rs._vec_input import AutoresetMode, check_out, read_actions, read_autoreset, read_mask, read_seed
from pogema_rs.grid_config import GridConfig, engine_fields
from pogema_rs.semantics import Semantics

__all__ = ["AutoresetMode", "VecEnv"]

NUM_ACTIONS = 5
_DTYPES: dict[str, np.dtype] = {"float32": np.dtype(np.float32), "uint8": np.dtype(np.uint8)}


_Config = tuple[dict[str, Any], Optional[str]]


def _engine_config(config: Any) -> _Config:
    """The fields that the engine reads, and the text of the map that it names."""
    if not isinstance(config, GridConfig):
        config = GridConfig(**_fields(config))
    return engine_fields(config), grid_registry.map_text(config.map_name)


def _fields(config: Any) -> Mapping[str, Any]:
    if isinstance(config, Mapping):
        return config
    dump = getattr(config, "model_dump", None) or getattr(config, "dict", None)
    if dump is None:
        kind = type(config).__name__
        raise TypeError(f"grid_config holds a {kind}, expected a GridConfig or a dict, or a list of them")
    return dump()


class VecEnv(VectorEnv):
    """`num_envs` environments of `agents` agents each, all stepped by one call.

    Every array has the axes `(num_envs, agents, ...)`: observations `(num_envs, agents, 3, side, side)`, rewards as
    float32, `terminated` and `truncated` as bool. An episode of an environment ends when all its agents terminated or
    all were truncated: `terminated.all(axis=1) | truncated.all(axis=1)`. Gymnasium's wrappers that count rewards or
    ends want one number per environment and have to be given that, or `rewards.sum(axis=1)`.

    The array of observations is made once and overwritten by the next call of `reset` or `step`; copy it to keep it,
    pass `out=` to have it written elsewhere, or ask for a `double_buffer`, which leaves the last one as it is until
    the call after the next. All other arrays are new with every call.

    Seeds. With `reset(seed=S)`, episode e of environment i (both from 0) is the one that POGEMA makes of the seed
    `int(SeedSequence(S, spawn_key=(i, e)).generate_state(1, np.uint64)[0]) % (2**63 - 1)`, with NumPy's
    `SeedSequence`. With a sequence of seeds, the first episode of environment i is POGEMA's of the i-th seed T itself,
    and episode e > 0 that of the same formula with `T` and `spawn_key=(e,)`. Without a seed the episodes go on; the
    first reset then takes the config's seed for S, or one from the system. No episode depends on the number of
    environments or threads. `episode_seeds` tells the seeds now played.

    Autoreset, as in Gymnasium: under `SAME_STEP` an episode that ends is followed by the next one in the same step,
    and `infos["final_obs"]` and `infos["final_info"]` hold how it ended; under `NEXT_STEP` the following step ignores
    that environment's actions and begins the next episode; under `DISABLED` the environment stays as it ended, with
    rewards of 0 and its last ends, until `reset(options={"reset_mask": ...})`.

    `infos` holds `is_active`, `(num_envs, agents)`; with `masks` the `action_masks`, `(num_envs, agents, 5)`, int8, 1
    where no obstacle forbids the move; when episodes ended `metrics`, a dict of float arrays `(num_envs,)` that are NaN
    where `_metrics` is False.

    One thread at a time may call it, and it does not survive a fork; either is a RuntimeError. A config is read once,
    and changes of it later change nothing; warnings about single instances are not shown.
    """

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
    ) -> None:
        """An environment for each of a list of configs, or `num_envs` of one; each is a GridConfig or a dict.

        The configs of a list may have different maps, but must agree on agents, radius and rules. With the semantics
        `2.0` every agent is seen, as in POGEMA's 2.0 line. Without `num_threads` all cores work.

        Errors: ValueError or TypeError naming what was expected; `InstanceError` comes with the first reset.
        """
        self.closed = True
        if semantics not in [known.value for known in Semantics]:
            expected = " or ".join(repr(known.value) for known in Semantics)
            raise ValueError(f"semantics is {semantics!r}, expected {expected}")
        self.semantics = Semantics(semantics)
        self._dtype = _read_dtype(dtype)
        self.autoreset_mode = read_autoreset(autoreset_mode)
        configs, of_env = _read_configs(grid_config, num_envs)
        self.num_envs = len(of_env)
        self.num_threads = _read_threads(num_threads, self.num_envs)
        self._batch = _engine.Batch(
            configs, of_env, self.autoreset_mode.value, self.semantics.occupancy_is_exact, self.num_threads
        )
        self.num_agents, radius = self._batch.sizes()
        side = 2 * radius + 1
        self.metadata = {"autoreset_mode": self.autoreset_mode}
        self.single_observation_space: spaces.Box = spaces.Box(0, 1, (self.num_agents, 3, side, side), self._dtype.type)
        self.single_action_space = spaces.MultiDiscrete([NUM_ACTIONS] * self.num_agents)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._has_masks = bool(masks)
        self._buffers = [self._new_observations(self.num_envs) for _ in range(2 if double_buffer else 1)]
        self._next_buffer = 0
        self._all = np.ones(self.num_envs, dtype=np.bool_)
        self._all.flags.writeable = False
        self.closed = False

    # Gymnasium's is an attribute.
    @cached_property
    def observation_space(self) -> spaces.Box:  # type: ignore[override]
        """The space of all observations; made when it is asked for, since it is larger than what it describes."""
        return cast(spaces.Box, batch_space(self.single_observation_space, self.num_envs))

    @property
    def episode_seeds(self) -> np.ndarray:
        """POGEMA's seed of each environment's present episode, `(num_envs,)`, int64."""
        return np.array(self._batch.episode_seeds(), dtype=np.int64)

    def reset(
        self,
        *,
        seed: Union[int, Sequence[int], None] = None,
        options: Optional[dict[str, Any]] = None,
        out: Optional[np.ndarray] = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins the first episodes of a seed, or of one seed per environment, or else the next episodes.

        `options={"reset_mask": mask}` leaves the environments where the mask is False as they are; the observations
        returned are those of all.

        Errors: ValueError or TypeError naming what was expected; `InstanceError` if an environment has no instance.
        Nothing changes then.
        """
        chosen = read_mask(options, self.num_envs)
        one, each = read_seed(seed, self.num_envs)
        observations = self._observations(out)
        active, masks = self._new_state(self.num_envs)
        self._batch.reset((observations, active, masks), chosen, one, each)
        if seed is not None:
            self._np_random = np.random.default_rng(one if each is None else each)
            self._np_random_seed = one if each is None else each[0]
        self._turn(out)
        return observations, self._state_infos(active, masks, self._all)

    def step(
        self, actions: Any, *, out: Optional[np.ndarray] = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Plays one step: observations, rewards, terminated, truncated, infos.

        `actions` are whole numbers 0 to 4 of the shape `(num_envs, agents)`: an array, nested lists, or whatever
        shares its memory with NumPy, as a torch tensor on the CPU. Unlike in a single environment, which reads
        negative numbers as Python's lists do, -5 to -1 are refused, and so are wrong actions of agents that are gone.

        Errors: ValueError or TypeError naming what was expected, and nothing is played; `InstanceError` if an
        environment has no next episode.
        """
        numbers = read_actions(actions, (self.num_envs, self.num_agents))
        observations = self._observations(out)
        shape = (self.num_envs, self.num_agents)
        rewards = np.empty(shape, dtype=np.float32)
        terminated, truncated = np.empty(shape, dtype=np.bool_), np.empty(shape, dtype=np.bool_)
        active, masks = self._new_state(self.num_envs)
        ended = self._batch.step(numbers, (rewards, terminated, truncated), (observations, active, masks))
        self._turn(out)
        infos = self._state_infos(active, masks, self._all)
        if ended:
            self._add_ends(infos, ended)
        return observations, rewards, terminated, truncated, infos

    def action_masks(self) -> np.ndarray:
        """Which actions make sense now, `(num_envs, agents, 5)`, int8.

        1 for staying, and for a move whose cell is on the map and free of obstacles, whoever stands there. An agent
        that takes no part may only stay.

        Errors: `NotResetError` before the first reset.
        """
        masks = np.empty((self.num_envs, self.num_agents, NUM_ACTIONS), dtype=np.int8)
        self._batch.mask_actions(masks)
        return masks

    def sample_actions(self) -> np.ndarray:
        """Random actions, `(num_envs, agents)`, int64, from `np_random`, which `reset(seed=...)` seeds."""
        return self.np_random.integers(NUM_ACTIONS, size=(self.num_envs, self.num_agents))

    def close(self, **kwargs: Any) -> None:
        """Lets go of environments and threads; every later call is a RuntimeError, but for another `close`."""
        if not self.closed:
            self._batch.close()
            self.closed = True

    def __reduce_ex__(self, protocol: Any) -> NoReturn:
        raise TypeError("a VecEnv cannot be pickled or copied: make a new one of the same config, in each process")

    def _new_observations(self, num_envs: int) -> np.ndarray:
        return np.zeros((num_envs, *self.single_observation_space.shape), dtype=self._dtype)

    def _new_state(self, num_envs: int) -> tuple[np.ndarray, Optional[np.ndarray]]:
        shape = (num_envs, self.num_agents)
        masks = np.empty((*shape, NUM_ACTIONS), dtype=np.int8) if self._has_masks else None
        return np.empty(shape, dtype=np.bool_), masks

    def _observations(self, out: Optional[np.ndarray]) -> np.ndarray:
        buffer = self._buffers[self._next_buffer]
        return buffer if out is None else check_out(out, buffer.shape, self._dtype)

    def _turn(self, out: Optional[np.ndarray]) -> None:
        if out is None:
            self._next_buffer = (self._next_buffer + 1) % len(self._buffers)

    def _state_infos(self, active: np.ndarray, masks: Optional[np.ndarray], present: np.ndarray) -> dict[str, Any]:
        infos = {"is_active": active, "_is_active": present}
        if masks is not None:
            infos.update(action_masks=masks, _action_masks=present)
        return infos

    def _add_ends(self, infos: dict[str, Any], ended: list[int]) -> None:
        """Adds how the episodes of some environments ended, in the layout of Gymnasium."""
        present = np.zeros(self.num_envs, dtype=np.bool_)
        present[ended] = True
        metrics: dict[str, Any] = {}
        for env, figures in zip(ended, self._batch.metrics(ended)):
            for name, value in figures.items():
                if name not in metrics:
                    metrics.update({name: np.full(self.num_envs, np.nan), f"_{name}": present})
                metrics[name][env] = value
        infos.update(metrics=metrics, _metrics=present)
        if self.autoreset_mode != AutoresetMode.SAME_STEP:
            return
        observations = self._new_observations(len(ended))
        active, masks = self._new_state(len(ended))
        self._batch.ended(ended, (observations, active, masks))
        final = np.full(self.num_envs, None, dtype=object)
        for env, observation in zip(ended, observations):
            final[env] = observation
        every_active, every_masks = self._spread(ended, active), None if masks is None else self._spread(ended, masks)
        info = {**self._state_infos(every_active, every_masks, present), "metrics": metrics, "_metrics": present}
        infos.update(final_obs=final, _final_obs=present, final_info=info, _final_info=present)

    def _spread(self, envs: list[int], values: np.ndarray) -> np.ndarray:
        every = np.zeros((self.num_envs, *values.shape[1:]), dtype=values.dtype)
        every[envs] = values
        return every


def _read_dtype(dtype: Any) -> np.dtype:
    for name, known in _DTYPES.items():
        if dtype == name or dtype == known:
            return known
    raise ValueError(f"dtype is {dtype!r}, expected 'float32' or 'uint8'")


def _read_configs(grid_config: Any, num_envs: Optional[int]) -> tuple[list[_Config], list[int]]:
    """The configs that differ, and which one each environment has."""
    if isinstance(grid_config, (list, tuple)):
        if num_envs not in (None, len(grid_config)):
            raise ValueError(f"num_envs is {num_envs}, expected {len(grid_config)}, one for each config of the list")
        configs = [_engine_config(config) for config in grid_config]
    else:
        num_envs = 1 if num_envs is None else num_envs
        _check_whole("num_envs", num_envs)
        configs = [_engine_config(grid_config)] * num_envs
    if not configs:
        raise ValueError("num_envs is 0, expected at least 1")
    # Equal configs are read once; two that only look different are merely read twice.
    keys = [pickle.dumps(config) for config in configs]
    places = {key: place for place, key in enumerate(dict.fromkeys(keys))}
    first = {places[key]: config for key, config in zip(reversed(keys), reversed(configs))}
    return [first[place] for place in range(len(places))], [places[key] for key in keys]


def _read_threads(num_threads: Optional[int], num_envs: int) -> int:
    if num_threads is None:
        return min(num_envs, _engine.num_cores(), _engine.MAX_THREADS)
    _check_whole("num_threads", num_threads)
    if num_threads > _engine.MAX_THREADS:
        raise ValueError(f"num_threads is {num_threads}, expected 1 to {_engine.MAX_THREADS}")
    if num_threads > _engine.num_cores():
        text = f"num_threads is {num_threads}, the machine has {_engine.num_cores()} cores"
        warnings.warn(text, UserWarning, stacklevel=3)
    return int(num_threads)


def _check_whole(name: str, value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name} is {value!r}, expected a whole number")
    if value < 1:
        raise ValueError(f"{name} is {value}, expected at least 1")
