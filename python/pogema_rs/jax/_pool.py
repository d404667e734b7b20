"""The instances of a pool: made in Rust, played on a device."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Optional, Union

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs import _engine
from pogema_rs._checks import check_semantics, check_whole
from pogema_rs._counted import counted
from pogema_rs._vec_configs import engine_config
from pogema_rs.grid_config import GridConfig
from pogema_rs.jax._config import INT32_MAX, Config
from pogema_rs.jax._pack import Array, pack_grids
from pogema_rs.semantics import Semantics

__all__ = ["InstancePool", "Params", "Pool", "draw_instance", "make_params", "make_pool"]

LARGEST_SEED = 2**63 - 2


class Pool(NamedTuple):
    """The arrays of all instances. A cell is the number `row * config.width + col`, as uint16 if all fit, else int32.

    After a refill of lifelong instances, the arrays also hold the instances that were replaced, because running
    episodes still need their goals. `current` says which instances begin new episodes.

    Shape: `obstacles` `(slots, rows, words)`, uint32, the maps with their borders; `starts` `(slots, agents)`; `goals`
    `(total,)`, the goals of all agents of all instances; `offsets` `(slots, agents + 1)`, int32, where the goals of
    each agent begin; `num_agents` `(slots,)`, int32; `current` `(2,)`, int32, the first current slot and the number of
    current slots
    """

    obstacles: jax.Array
    starts: jax.Array
    goals: jax.Array
    offsets: jax.Array
    num_agents: jax.Array
    current: jax.Array


class HostInstances(NamedTuple):
    """Instances on the host.

    Shape: `grids` as `pack_grids` returns them; `starts` `(num, agents, 2)`; `goals` `(total, 2)`; `num_goals`
    `(num, agents)`
    """

    grids: Array
    starts: Array
    goals: Array
    num_goals: Array


class Params(NamedTuple):
    """Everything that a step needs besides the state: the static config, the step limit, and the instances.

    With `jax.vmap`, its axis is None: all environments share it, and it is not copied.
    """

    config: Config
    max_steps: jax.Array
    pool: Pool


class InstancePool:
    """Instances of a config, bit for bit those of POGEMA for the same seeds.

    `config` is a GridConfig or a dict. `seeds` is one seed, S, or one for each instance. With a single seed, the seed
    of instance i is `int(SeedSequence(S, spawn_key=(i,)).generate_state(1, np.uint64)[0]) % (2**63 - 1)`, with NumPy's
    `SeedSequence`. `num_steps` is the number of steps for which lifelong agents have goals [default: the config's
    `max_episode_steps`, at least 1]. An agent that reaches the last of its goals continues with its first one, and
    `State.num_wraps` counts it. This never happens within `num_steps` steps of an episode, except with sequences of
    the config, which repeat by the rules (Rule: goal/restart/sequence).

    `num_agents` and `map_size` (rows, columns) make room for larger instances [default: those of the config].
    `rewards` is `own` or `shared`. With the semantics `2.0` every agent is seen.

    Errors: TypeError or ValueError for wrong arguments, before more than one instance is made, and for too large a
    `num_steps`, afterwards; `InstanceError` if a seed has no instance; MemoryError if the instances do not fit in
    memory.
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
        self.num = check_whole("num", num, 1, INT32_MAX)
        check_pair("map_size", map_size)
        line = check_semantics(semantics)
        if not isinstance(config, GridConfig):
            if not isinstance(config, Mapping):
                raise TypeError(f"config has type {type(config).__name__}, expected a GridConfig or a dict")
            config = GridConfig(**config)
        self._fields, self._registered = engine_config(config, "own")
        limit = max(config.max_episode_steps, 1) if num_steps is None else num_steps
        self.num_steps = check_whole("num_steps", limit, 0, 2**64 - 1)
        occupancy = "exact" if line.occupancy_is_exact else "as_released"
        checked = check_seeds(seeds, self.num)
        probe = self._arrays(first_seeds(checked, 1))
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
            rewards=rewards,
        )
        check_fits(self.config, agents, (rows, columns))
        self._max_steps = config.max_episode_steps
        self._capacity = 0
        self._check_memory(self._on_host(probe))
        self._current = 0
        self._generations = [self._on_host(self._arrays(first_seeds(checked, self.num)))]
        self.params = self._place(self._generations, 0)

    def refill(self, seeds: Union[int, Sequence[int]]) -> Params:
        """Replaces all instances, and returns the new `params`.

        Running episodes continue with the new `params` as with the old ones. Lifelong episodes need the goals of the
        instances that they began with, so the arrays keep the replaced instances until the next refill. Therefore
        refill lifelong instances at most once during the longest episode.

        The first refill of lifelong instances doubles the arrays, so functions are compiled once more. After that
        nothing is compiled again, unless new instances have over an eighth more goals than the earlier ones. After an
        error the old instances stay.
        """
        made = self._on_host(self._arrays(first_seeds(check_seeds(seeds, self.num), self.num)))
        current = 1 - self._current if self.config.on_goal == "restart" else 0
        generations = [*self._generations[:current], made, *self._generations[current + 1 :]]
        self.params = self._place(generations, current)
        self._generations, self._current = generations, current
        return self.params

    @property
    def num_bytes(self) -> int:
        """The size of all arrays on the device. Units: bytes."""
        return sum(leaf.size * leaf.dtype.itemsize for leaf in jax.tree.leaves(self.params))

    def _place(self, generations: list[HostInstances], current: int) -> Params:
        grids, starts, goals, num_goals = (
            parts[0] if len(parts) == 1 else np.concatenate(parts) for parts in zip(*generations)
        )
        if len(goals) > self._capacity:
            self._capacity = -(-9 * len(goals) // 8192) * 1024
        made = HostInstances(grids, starts, goals, num_goals)
        pool = make_pool(self.config, made, (current * self.num, self.num), self._capacity)
        return make_params(self.config, self._max_steps, pool)

    def _on_host(self, arrays: dict[str, Array]) -> HostInstances:
        rows, columns = (int(size) for size in arrays["sizes"][:2])
        num, border = len(arrays["sizes"]) // 2, 2 * self.config.radius
        noise = arrays["noise"].reshape(-1, rows + border, columns + border)
        maps = arrays["maps"].reshape(num, rows, columns)
        agents = len(arrays["num_goals"]) // num
        return HostInstances(
            pack_grids(self.config, maps, noise if len(noise) else None),
            arrays["starts"].reshape(num, agents, 2),
            arrays["goals"].reshape(-1, 2),
            arrays["num_goals"].reshape(num, agents),
        )

    def _arrays(self, seeds: list[int]) -> dict[str, Array]:
        return _engine.make_instances(self._fields, self._registered, seeds, self.num_steps)

    def _check_memory(self, one: HostInstances) -> None:
        """Checks that the memory of all instances can be allocated, before they are made."""
        size = self.num * sum(array.nbytes for array in one)
        try:
            np.empty(size, dtype=np.uint8)
        except (MemoryError, ValueError):
            reason = f"the instances need {size / 1e9:.0f} GB of memory, more than is available"
            raise MemoryError(f"num is {self.num}: {reason}") from None


def check_seeds(seeds: Union[int, Sequence[int]], num: int) -> Union[int, list[int]]:
    """Returns one seed, or one for each instance.

    Errors: TypeError or ValueError for anything else.
    """
    if isinstance(seeds, (int, np.integer)):
        return check_whole("seeds", seeds, 0)  # NumPy takes seeds of any size
    if isinstance(seeds, str) or not isinstance(seeds, Iterable):
        raise TypeError(f"seeds is {seeds!r}, expected a whole number, or one for each instance")
    checked = [check_whole(f"seeds[{index}]", seed, 0, LARGEST_SEED) for index, seed in enumerate(seeds)]
    if len(checked) != num:
        raise ValueError(f"seeds holds {counted(len(checked), 'seed')}, expected {num}, one for each instance")
    return checked


def first_seeds(seeds: Union[int, list[int]], num: int) -> list[int]:
    """Returns the seeds of the first instances."""
    if not isinstance(seeds, int):
        return seeds[:num]
    sequences = (np.random.SeedSequence(seeds, spawn_key=(index,)) for index in range(num))
    return [int(each.generate_state(1, np.uint64)[0]) % (2**63 - 1) for each in sequences]


def draw_instance(params: Params, key: jax.Array) -> jax.Array:
    """Returns the index of a current instance, drawn uniformly with the key."""
    return jax.random.randint(key, (), 0, params.pool.current[1], dtype=jnp.int32)


def check_pair(name: str, value: Any) -> None:
    """Checks that an argument is a pair of numbers of rows and columns, or None."""
    if value is not None and (not isinstance(value, (list, tuple)) or len(value) != 2):
        raise TypeError(f"{name} is {value!r}, expected a pair (rows, columns)")


def check_fits(config: Config, num_agents: int, size: tuple[int, int]) -> None:
    """Checks that an instance fits the arrays of a config."""
    if config.num_agents < num_agents:
        raise ValueError(f"num_agents is {config.num_agents}, expected at least {num_agents}, as in the config")
    if config.height < size[0] or config.width < size[1]:
        room = f"{config.height} x {config.width}"
        raise ValueError(f"map_size is {room}, expected at least {size[0]} x {size[1]}, the size of the map")


def make_pool(
    config: Config, made: HostInstances, current: Optional[tuple[int, int]] = None, capacity: int = 0
) -> Pool:
    """Returns instances as arrays on the default device.

    `current` holds the first instance that begins new episodes and the number of such instances [default: all].
    `capacity` is the minimum length of the array of goals.
    """
    num, agents = made.num_goals.shape
    if num == 0:
        raise ValueError("the pool is empty, expected at least 1 instance")
    total = max(len(made.goals), capacity)
    if total > INT32_MAX:
        raise ValueError(f"num_steps is too large: the instances have {total} goals, expected at most {INT32_MAX}")
    dtype = np.uint16 if config.height * config.width <= 2**16 else np.int32

    def numbered(cells: Array, room: tuple[int, ...]) -> Array:
        numbers = np.zeros(room, dtype=dtype)
        filled = tuple(slice(size) for size in cells.shape[:-1])
        numbers[filled] = cells[..., 0].astype(np.int64) * config.width + cells[..., 1]
        return numbers

    ends = np.cumsum(made.num_goals.ravel(), dtype=np.int64).reshape(num, agents)
    offsets = np.empty((num, config.num_agents + 1), dtype=np.int32)
    offsets[:, 0] = np.concatenate([[0], ends[:-1, -1]])
    offsets[:, 1 : agents + 1] = ends
    offsets[:, agents + 1 :] = ends[:, -1:]
    return Pool(
        obstacles=jnp.asarray(made.grids),
        starts=jnp.asarray(numbered(made.starts, (num, config.num_agents))),
        goals=jnp.asarray(numbered(made.goals, (total,))),
        offsets=jnp.asarray(offsets),
        num_agents=jnp.full(num, agents, dtype=jnp.int32),
        current=jnp.array(current or (0, num), dtype=jnp.int32),
    )


def make_params(config: Config, max_steps: int, pool: Pool) -> Params:
    """Returns the parameters of a step. The step limit is clamped to the range from -(2**31 - 1) to 2**31 - 1."""
    return Params(config, jnp.int32(max(min(max_steps, INT32_MAX), -INT32_MAX)), pool)
