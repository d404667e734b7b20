"""Vectorized environments with Gymnasium's interface; one call steps all of them on all cores."""

from __future__ import annotations

import pickle
import sys
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
    """Returns the fields that the engine reads, and the text of the map that the config names."""
    if not isinstance(config, GridConfig):
        config = GridConfig(**_fields(config))
    if config.map_name is not None:
        grid_registry.get_grid(config.map_name)  # an unknown name is an error, which a single environment ignores
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
    """A batch of `num_envs` environments with `agents` agents each, all stepped by one call.

    Every array has the axes `(num_envs, agents, ...)`: observations `(num_envs, agents, 3, side, side)`, rewards as
    float32, `terminated` and `truncated` as bool. An episode of an environment ends when all its agents terminated or
    all were truncated: `terminated.all(axis=1) | truncated.all(axis=1)`. Gymnasium's wrappers that count rewards or
    ends expect one number per environment; pass them this expression, or `rewards.sum(axis=1)`.

    The next call of `reset` or `step` overwrites the array of observations. To keep it, copy it, pass `out=`, or set
    `double_buffer`, which preserves it until the call after the next. All other arrays are new with every call.

    Seeds: with `reset(seed=S)`, episode e of environment i (both from 0) is POGEMA's episode of the seed
    `int(SeedSequence(S, spawn_key=(i, e)).generate_state(1, np.uint64)[0]) % (2**63 - 1)`, with NumPy's
    `SeedSequence`. With a sequence of seeds, the first episode of environment i is POGEMA's episode of the i-th seed T
    itself, and episode e > 0 uses the same formula with `T` and `spawn_key=(e,)`. A reset without a seed begins the
    next episodes. If the first reset has no seed, S is the config's seed, or a random seed from the system if the
    config has none. No episode depends on the number of environments or threads. `episode_seeds` returns the seeds of
    the current episodes.

    Autoreset, as in Gymnasium: with `SAME_STEP` the step that ends an episode also begins the next one, and
    `infos["final_obs"]` and `infos["final_info"]` hold the end of the old one. With `NEXT_STEP` the following step
    ignores the environment's actions and begins the next episode. With `DISABLED` the environment keeps its final
    state, with rewards of 0 and the last `terminated` and `truncated`, until `reset(options={"reset_mask": ...})`.

    `infos` holds `is_active`, `(num_envs, agents)`. With `masks` it holds `action_masks`, `(num_envs, agents, 5)`,
    int8, 1 where no obstacle blocks the move. When episodes ended it holds `metrics`, a dict of float arrays
    `(num_envs,)` that are NaN where `_metrics` is False.

    Calls from two threads at the same time, and calls in a forked child, raise a RuntimeError. A config is read once;
    later changes to it have no effect. Warnings about single instances are not shown.
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
        """Makes one environment for each config of a list, or `num_envs` of a single config.

        A config is a GridConfig or a dict. The configs of a list may have different maps, but must agree on agents,
        radius and rules. With the semantics `2.0` every agent is seen, as in POGEMA's 2.0 line. `num_threads` is the
        number of threads [default: one per core, at most one per environment].

        Errors: ValueError or TypeError for wrong arguments, including a `map_name` that is not registered. A config
        without an instance raises `InstanceError` only at the first reset.
        """
        self.closed = True
        if semantics not in [known.value for known in Semantics]:
            expected = " or ".join(repr(known.value) for known in Semantics)
            raise ValueError(f"semantics is {semantics!r}, expected {expected}")
        self.semantics = Semantics(semantics)
        self._dtype = _read_dtype(dtype)
        self.autoreset_mode = read_autoreset(autoreset_mode)
        configs, of_env, self.num_envs = _read_configs(grid_config, num_envs)
        self.num_threads = _read_threads(num_threads, self.num_envs)
        self._batch = _engine.Batch(
            configs,
            of_env,
            self.num_envs,
            self.autoreset_mode.value,
            self.semantics.occupancy_is_exact,
            self.num_threads,
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

    # Gymnasium defines an attribute.
    @cached_property
    def observation_space(self) -> spaces.Box:  # type: ignore[override]
        """The space of all observations; made at first access, because it takes more memory than the observations."""
        return cast(spaces.Box, batch_space(self.single_observation_space, self.num_envs))

    @property
    def episode_seeds(self) -> np.ndarray:
        """POGEMA's seed of each environment's current episode, `(num_envs,)`, int64."""
        return np.array(self._batch.episode_seeds(), dtype=np.int64)

    def reset(
        self,
        *,
        seed: Union[int, Sequence[int], None] = None,
        options: Optional[dict[str, Any]] = None,
        out: Optional[np.ndarray] = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins the first episodes of a seed or of one seed per environment; without a seed, the next episodes.

        `options={"reset_mask": mask}` skips the environments where the mask is False; the returned observations still
        are those of all environments.

        Errors: ValueError or TypeError for wrong arguments; `InstanceError` if an environment has no instance. After an
        error the state is unchanged.
        """
        chosen = read_mask(options, self.num_envs)
        one, each = read_seed(seed, self.num_envs)
        observations = self._observations(out)
        active, masks = self._new_state(self.num_envs)
        self._batch.reset((observations, active, masks), chosen, one, each)
        if seed is not None:
            self._np_random = np.random.default_rng(one if each is None else each)
            self._np_random_seed = one if each is None else each[0]
        self._swap_buffers(out)
        return observations, self._state_infos(active, masks, self._all)

    def step(
        self, actions: Any, *, out: Optional[np.ndarray] = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Plays one step and returns observations, rewards, terminated, truncated and infos.

        `actions` are integers from 0 to 4 of shape `(num_envs, agents)`: an array, nested lists, or any object that
        shares its memory with NumPy, for example a torch tensor on the CPU. A single environment also accepts -5 to -1,
        as indices from the end of a list, and wrong actions of inactive agents; this class rejects both.

        Errors: ValueError or TypeError for wrong actions, before anything is played; `InstanceError` if an environment
        has no next episode.
        """
        numbers = read_actions(actions, (self.num_envs, self.num_agents))
        observations = self._observations(out)
        shape = (self.num_envs, self.num_agents)
        rewards = np.empty(shape, dtype=np.float32)
        terminated, truncated = np.empty(shape, dtype=np.bool_), np.empty(shape, dtype=np.bool_)
        active, masks = self._new_state(self.num_envs)
        ended = self._batch.step(numbers, (rewards, terminated, truncated), (observations, active, masks))
        self._swap_buffers(out)
        infos = self._state_infos(active, masks, self._all)
        if ended:
            self._add_ends(infos, ended)
        return observations, rewards, terminated, truncated, infos

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

    def sample_actions(self) -> np.ndarray:
        """Returns random actions from `np_random`, which `reset(seed=...)` seeds.

        Shape: `(num_envs, agents)`, int64
        """
        return self.np_random.integers(NUM_ACTIONS, size=(self.num_envs, self.num_agents))

    def close(self, **kwargs: Any) -> None:
        """Frees the environments and threads; later calls except `close` raise a RuntimeError."""
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

    def _swap_buffers(self, out: Optional[np.ndarray]) -> None:
        if out is None:
            self._next_buffer = (self._next_buffer + 1) % len(self._buffers)

    def _state_infos(self, active: np.ndarray, masks: Optional[np.ndarray], present: np.ndarray) -> dict[str, Any]:
        infos = {"is_active": active, "_is_active": present}
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


def _read_configs(grid_config: Any, num_envs: Optional[int]) -> tuple[list[_Config], Optional[list[int]], int]:
    """Returns the distinct configs, the index of each environment's config if they differ, and their number."""
    if not isinstance(grid_config, (list, tuple)):
        num_envs = 1 if num_envs is None else num_envs
        _check_whole("num_envs", num_envs)
        return [_engine_config(grid_config)], None, min(int(num_envs), sys.maxsize)
    if num_envs not in (None, len(grid_config)):
        raise ValueError(f"num_envs is {num_envs}, expected {len(grid_config)}, one for each config of the list")
    configs = [_engine_config(config) for config in grid_config]
    if not configs:
        raise ValueError("num_envs is 0, expected at least 1")
    # Equal configs are read once. Two equal configs with different pickles are read twice, which is harmless.
    keys = [pickle.dumps(config) for config in configs]
    places = {key: place for place, key in enumerate(dict.fromkeys(keys))}
    first = {places[key]: config for key, config in zip(reversed(keys), reversed(configs))}
    return [first[place] for place in range(len(places))], [places[key] for key in keys], len(configs)


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
