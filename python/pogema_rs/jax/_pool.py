"""Instances of a config, made by the generator of `pogema_rs` and packed into arrays for a device."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Union

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.integrations.make_pogema import pogema_v0
from pogema_rs.grid_config import GridConfig
from pogema_rs.jax._params import Params
from pogema_rs.semantics import Semantics


class Instances(NamedTuple):
    """Packed instances, as a pytree: the same arrays for all environments, indexed and never copied."""

    #: Shape: `(instances, rows, bytes)`, uint8: obstacles of the maps with their borders, eight cells per byte.
    maps: jax.Array
    #: Shape: `(instances, agents)`: cells of the agents.
    starts: jax.Array
    #: Shape: `(goals,)`: the goals of all agents of all instances, one agent after another.
    goals: jax.Array
    #: Shape: `(instances,)`, int32: place of the first goal of each instance.
    begin: jax.Array
    #: Shape: `(instances, agents)`, int32: place after the last goal of each agent.
    ends: jax.Array


class InstancePool:
    """Instances of one config, bit for bit those of POGEMA, on a device.

    `arrays` holds them as `Instances`, `params` what functions are compiled for. Instance i is POGEMA's episode of the
    seed `seeds[i]`; a number stands for the seeds from it on. Under `restart`, the pool holds as many goals of an agent
    as it can have within `max_episode_steps`, by the sum of the Manhattan distances between them. If steps continue
    after the time limit, a list may end; it then begins again, and `State.num_wraps` counts it.
    """

    def __init__(
        self,
        config: Any,
        num: int,
        seeds: Union[int, Sequence[int]] = 0,
        *,
        semantics: Union[str, Semantics] = Semantics.RELEASED,
        rewards: str = "own",
    ) -> None:
        """Makes the instances.

        Errors: ValueError for a pool without instances, for a wrong number of seeds, and for maps of different sizes;
        those of `GridConfig`; `InstanceError` if a seed has no instance.
        """
        if isinstance(num, bool) or not isinstance(num, int) or num < 1:
            raise ValueError(f"num is {num!r}, expected a whole number from 1")
        chosen = range(seeds, seeds + num) if isinstance(seeds, int) else list(seeds)
        if len(chosen) != num:
            raise ValueError(f"seeds has {len(chosen)} values, expected {num}, one per instance")
        config = config if isinstance(config, GridConfig) else GridConfig(**config)
        made = [_Made(config, seed) for seed in chosen]
        size = made[0].size
        for seed, one in zip(chosen, made):
            if one.size != size:
                raise ValueError(f"the map of seed {seed} has size {one.size}, that of seed {chosen[0]} {size}")
        self.params = Params.of(config, size, semantics=semantics, rewards=rewards)
        self.arrays = _pack(self.params, made)

    @property
    def num_bytes(self) -> int:
        """Number of bytes of the arrays."""
        return sum(array.nbytes for array in self.arrays)


class _Made:
    """One instance, as POGEMA draws it."""

    def __init__(self, config: GridConfig, seed: int) -> None:
        changes = {"seed": seed, "observation_type": "default", "integration": None, "auto_reset": False}
        env: Any = pogema_v0(GridConfig(**{**config.dict(), **changes}))
        env.reset()
        radius = config.obs_radius
        self.obstacles = np.asarray(env.unwrapped.get_obstacles()) != 0
        rows, columns = self.obstacles.shape
        self.size = (rows - 2 * radius, columns - 2 * radius)
        stride = columns
        self.starts = _places(env.unwrapped.get_agents_xy(), stride)
        if config.on_target == "restart":
            later = [_places(goals, stride) for goals in env.unwrapped.get_lifelong_targets_xy()]
            self.goals = [
                _within(start, goals, stride, config.max_episode_steps) for start, goals in zip(self.starts, later)
            ]
        else:
            self.goals = [goal[None] for goal in _places(env.unwrapped.get_targets_xy(), stride)]


def _places(cells: Any, stride: int) -> np.ndarray:
    pairs = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0] * stride + pairs[:, 1]


def _within(start: np.ndarray, goals: np.ndarray, stride: int, num_steps: int) -> np.ndarray:
    """Returns the goals that an agent can have within a number of steps, one more than it can reach."""
    cells = np.concatenate([[start], goals])
    steps = np.abs(np.diff(cells // stride)) + np.abs(np.diff(cells % stride))
    # An agent spends at least one step on each goal.
    num_reached = int((np.maximum(steps, 1).cumsum() <= num_steps).sum())
    return goals[: num_reached + 1]


def _pack(params: Params, made: Sequence[_Made]) -> Instances:
    """Returns the instances as arrays, with the smallest type that holds all cells."""
    place: Any = np.uint16 if params.num_cells <= 2**16 else np.int32
    lengths = np.array([[len(goals) for goals in one.goals] for one in made], dtype=np.int64)
    ends = lengths.reshape(-1).cumsum()
    if ends[-1] > 2**31 - 1:
        raise ValueError(f"the pool has {ends[-1]} goals, expected at most {2**31 - 1}")
    ends = ends.reshape(lengths.shape)
    arrays = (
        np.stack([np.packbits(one.obstacles, axis=-1) for one in made]),
        np.stack([one.starts for one in made]).astype(place),
        np.concatenate([goals for one in made for goals in one.goals]).astype(place),
        (ends[:, 0] - lengths[:, 0]).astype(np.int32),
        ends.astype(np.int32),
    )
    return Instances(*(jnp.asarray(array) for array in arrays))
