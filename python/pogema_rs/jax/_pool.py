"""The instances of a pool: made in Rust, played on a device."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Optional, Union

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs import _engine
from pogema_rs._checks import check_semantics, check_whole
from pogema_rs._counted import counted
from pogema_rs._vec_configs import engine_config
from pogema_rs.grid_config import GridConfig
from pogema_rs.jax._config import Config
from pogema_rs.jax._pack import Array, pack_grids
from pogema_rs.semantics import Semantics

__all__ = ["InstancePool", "Params", "Pool", "check_fits", "draw_instance", "make_params", "make_pool"]

LARGEST_STEP = 2**31 - 1
LARGEST_SEED = 2**63 - 2


class Pool(NamedTuple):
    """The arrays of all instances. A cell is the number `row * config.width + col`, as uint16 if all fit, else int32.

    Shape: `obstacles` `(num, rows, words)`, uint32, the maps with their borders; `starts` `(num, agents)`; `goals`
    `(total,)`, the goals of all agents of all instances; `offsets` `(num, agents + 1)`, int32, where the goals of each
    agent begin; `num_agents` `(num,)`, int32
    """

    obstacles: jax.Array
    starts: jax.Array
    goals: jax.Array
    offsets: jax.Array
    num_agents: jax.Array


class Params(NamedTuple):
    """Everything that a step needs besides the state: the static config, the limit of steps, and the instances.

    With `jax.vmap`, its axis is None: all environments share it, and nothing copies it.
    """

    config: Config
    max_steps: jax.Array
    pool: Pool


class InstancePool:
    """Instances of a config, bit for bit those of POGEMA for the same seeds.

    `config` is a GridConfig or a dict. `seeds` is one seed, S, or one for each instance; with one, the seed of instance
    i is `int(SeedSequence(S, spawn_key=(i,)).generate_state(1, np.uint64)[0]) % (2**63 - 1)`, with NumPy's
    `SeedSequence`. `num_steps` is the number of steps for which lifelong agents have goals [default: the config's
    `max_episode_steps`, at least 1]. An agent that reaches the last of its goals continues with its first one, and
    `State.num_wraps` counts it. This never happens within `num_steps` steps of an episode, except to sequences of the
    config, which repeat by the rules (Rule: goal/restart/sequence).

    `num_agents` and `map_size`, rows and columns, make room for larger instances [default: those of the config].
    `rewards` is `own` or `shared`. With the semantics `2.0` every agent is seen.

    Errors: TypeError or ValueError for wrong arguments, before more than one instance is made; `InstanceError` if a
    seed has no instance.
    """

    def __init__(
        self,
        config: Any,
        num: int,
        seeds: Union[int, Sequence[int]] = 0,
        *,
        num_steps: Optional[int] = None,
        num_agents: Optional[int] = None,
        map_size: Optional[tuple[int, int]] = None,
        rewards: str = "own",
        semantics: Union[str, Semantics] = Semantics.RELEASED,
    ) -> None:
        self.num = check_whole("num", num, 1)
        check_pair("map_size", map_size)
        line = check_semantics(semantics)
        if not isinstance(config, GridConfig):
            config = GridConfig(**config)
        self._fields, self._registered = engine_config(config, "own")
        limit = max(config.max_episode_steps, 1) if num_steps is None else num_steps
        self.num_steps = check_whole("num_steps", limit, 0, 2**64 - 1)
        occupancy = "exact" if line.occupancy_is_exact else "as_released"
        listed = self._seeds(seeds)
        probe = self._arrays(listed[:1])
        rows, columns = (int(size) for size in probe["sizes"])
        agents = len(probe["num_goals"])
        height, width = (rows, columns) if map_size is None else map_size
        self.config = Config(
            num_agents=agents if num_agents is None else num_agents,
            height=height,
            width=width,
            radius=config.obs_radius,
            collision=config.collision_system,
            on_goal=config.on_target,
            occupancy=occupancy,
            reward=rewards,
        )
        check_fits(self.config, agents, (rows, columns))
        self._max_steps = config.max_episode_steps
        self._capacity = 0
        self.params = self._make(listed)

    def refill(self, seeds: Union[int, Sequence[int]]) -> Params:
        """Replaces all instances, and returns the new `params`.

        The arrays keep their shapes, so nothing is compiled again, unless the new instances have over an eighth more
        goals than the first ones. Current episodes continue with the old `params`; with the new ones, lifelong agents
        continue with goals of the new instances. After an error the old instances stay.
        """
        self.params = self._make(self._seeds(seeds))
        return self.params

    @property
    def num_bytes(self) -> int:
        """The size of all arrays on the device. Units: bytes."""
        return sum(leaf.size * leaf.dtype.itemsize for leaf in jax.tree.leaves(self.params))

    def _make(self, seeds: list[int]) -> Params:
        arrays = self._arrays(seeds)
        rows, columns = (int(size) for size in arrays["sizes"][:2])
        maps = arrays["maps"].reshape(self.num, rows, columns)
        border = 2 * self.config.radius
        noise = arrays["noise"].reshape(-1, rows + border, columns + border)
        grids = pack_grids(self.config, maps, noise if len(noise) else None)
        agents = len(arrays["num_goals"]) // self.num
        starts = arrays["starts"].reshape(self.num, agents, 2)
        num_goals = arrays["num_goals"].reshape(self.num, agents)
        goals = arrays["goals"].reshape(-1, 2)
        if len(goals) > self._capacity:
            self._capacity = -(-9 * len(goals) // 8192) * 1024
        pool = make_pool(self.config, grids, starts, goals, num_goals, self._capacity)
        return make_params(self.config, self._max_steps, pool)

    def _arrays(self, seeds: list[int]) -> dict[str, Array]:
        return _engine.make_instances(self._fields, self._registered, seeds, self.num_steps)

    def _seeds(self, seeds: Union[int, Sequence[int]]) -> list[int]:
        if isinstance(seeds, (int, np.integer)):
            first = check_whole("seeds", seeds, 0)  # NumPy takes seeds of any size
            sequences = (np.random.SeedSequence(first, spawn_key=(index,)) for index in range(self.num))
            return [int(each.generate_state(1, np.uint64)[0]) % (2**63 - 1) for each in sequences]
        if isinstance(seeds, str) or not isinstance(seeds, Iterable):
            raise TypeError(f"seeds is {seeds!r}, expected a whole number, or one for each instance")
        listed = [check_whole(f"seeds[{index}]", seed, 0, LARGEST_SEED) for index, seed in enumerate(seeds)]
        if len(listed) != self.num:
            found = counted(len(listed), "seed")
            raise ValueError(f"seeds holds {found}, expected {self.num}, one for each instance")
        return listed


def draw_instance(params: Params, key: jax.Array) -> jax.Array:
    """Returns the index of an instance that the key draws, every instance with the same probability."""
    return jax.random.randint(key, (), 0, params.pool.starts.shape[0], dtype=jnp.int32)


def check_pair(name: str, value: Any) -> None:
    """Checks that an argument is a pair of numbers of rows and columns, or None."""
    if value is not None and (not isinstance(value, (list, tuple)) or len(value) != 2):
        raise TypeError(f"{name} is {value!r}, expected a pair (rows, columns)")


def check_fits(config: Config, num_agents: int, size: tuple[int, int]) -> None:
    """Checks that an instance fits the arrays of a config."""
    if num_agents > config.num_agents:
        raise ValueError(f"num_agents is {num_agents}, expected at most {config.num_agents}, as in the config")
    if size[0] > config.height or size[1] > config.width:
        room = f"{config.height} x {config.width}"
        raise ValueError(f"map_size is {size[0]} x {size[1]}, expected at most {room}, as in the config")


def make_pool(config: Config, grids: Array, starts: Array, goals: Array, num_goals: Array, capacity: int = 0) -> Pool:
    """Returns instances as arrays on the default device.

    Shape: `grids` as `pack_grids` returns them; `starts` `(num, agents, 2)`; `goals` `(total, 2)`; `num_goals`
    `(num, agents)`. `capacity` is the least length of the array of goals.
    """
    num, agents = num_goals.shape
    if num == 0:
        raise ValueError("the pool is empty, expected at least 1 instance")
    total = max(len(goals), capacity)
    if total > LARGEST_STEP:
        raise ValueError(f"num_steps is too large: the instances have {total} goals, expected at most {LARGEST_STEP}")
    dtype = np.uint16 if config.height * config.width <= 2**16 else np.int32

    def numbered(cells: Array, room: tuple[int, ...]) -> Array:
        numbers = np.zeros(room, dtype=dtype)
        filled = tuple(slice(size) for size in cells.shape[:-1])
        numbers[filled] = cells[..., 0].astype(np.int64) * config.width + cells[..., 1]
        return numbers

    ends = np.cumsum(num_goals.ravel(), dtype=np.int64).reshape(num, agents)
    offsets = np.empty((num, config.num_agents + 1), dtype=np.int32)
    offsets[:, 0] = np.concatenate([[0], ends[:-1, -1]])
    offsets[:, 1 : agents + 1] = ends
    offsets[:, agents + 1 :] = ends[:, -1:]
    return Pool(
        obstacles=jnp.asarray(grids),
        starts=jnp.asarray(numbered(starts, (num, config.num_agents))),
        goals=jnp.asarray(numbered(goals, (total,))),
        offsets=jnp.asarray(offsets),
        num_agents=jnp.full(num, agents, dtype=jnp.int32),
    )


def make_params(config: Config, max_steps: int, pool: Pool) -> Params:
    """Returns the parameters of a step. Limits of steps beyond 2**31 - 1 in size are cut to it."""
    return Params(config, jnp.int32(max(min(max_steps, LARGEST_STEP), -LARGEST_STEP)), pool)
