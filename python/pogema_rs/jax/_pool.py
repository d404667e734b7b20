"""Instances of a config, made by the generator of `pogema_rs` and packed into arrays for a device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
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
        made = [_draw(config, seed) for seed in chosen]
        sizes = [tuple(side - 2 * config.obs_radius for side in one.obstacles.shape) for one in made]
        for seed, size in zip(chosen, sizes):
            if size != sizes[0]:
                raise ValueError(f"the map of seed {seed} has size {size}, that of seed {chosen[0]} {sizes[0]}")
        rows, columns = sizes[0]
        self.params = Params.of(config, (rows, columns), semantics=semantics, rewards=rewards)
        self.arrays = pack(self.params, made)

    @property
    def num_bytes(self) -> int:
        """Number of bytes of the arrays."""
        return sum(array.nbytes for array in self.arrays)


@dataclass(frozen=True)
class Instance:
    """One instance on the host: obstacles of the map with its border, and cells as indices in it."""

    obstacles: np.ndarray
    starts: np.ndarray
    goals: list[np.ndarray]


def _draw(config: GridConfig, seed: int) -> Instance:
    """Returns the instance that POGEMA draws from a seed."""
    changes = {"seed": seed, "observation_type": "default", "integration": None, "auto_reset": False}
    env: Any = pogema_v0(GridConfig(**{**config.dict(), **changes})).unwrapped
    env.reset()
    obstacles = np.asarray(env.get_obstacles()) != 0
    stride = obstacles.shape[1]
    starts = _places(env.get_agents_xy(), stride)
    if config.on_target == "restart":
        lists = [_places(goals, stride) for goals in env.get_lifelong_targets_xy()]
        limit = config.max_episode_steps
        goals = [_within(start, goals, stride, limit) for start, goals in zip(starts, lists)]
    else:
        goals = [goal[None] for goal in _places(env.get_targets_xy(), stride)]
    return Instance(obstacles, starts, goals)


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


def pack(params: Params, made: Sequence[Instance]) -> Instances:
    """Returns instances as arrays, with the smallest type that holds all cells."""
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
