"""The configs and seeds of the episodes of a training run; no published set contains these episodes."""

from __future__ import annotations

from functools import cache
from typing import Any, Optional

import numpy as np

from pogema_rs import _engine
from pogema_rs.baselines._config import EnvironmentConfig
from pogema_rs.errors import InstanceError
from pogema_rs.grid_config import engine_fields
from pogema_rs.toolbox.generators.maze_generator import MazeGenerator, MazeRangeSettings
from pogema_rs.toolbox.generators.random_generator import MapRangeSettings, generate_map
from pogema_rs.toolbox.generators.warehouse_generator import WarehouseConfig, generate_warehouse

#: The seeds of pogema-toolbox's sets for validation and training; the sets of the paper's results have fewer.
PUBLISHED_SEEDS = range(128 + 2048)
#: The smallest seed of a map or an episode; larger than all published seeds.
FIRST_SEED = 2**32
#: The rows and columns that have room for all maps of a kind; for warehouses, those of the published one.
LARGEST = {"random": (21, 21), "mazes": (21, 21), "warehouse": (33, 46)}

#: The largest number of maps that are drawn until one has room for the agents.
_TRIES = 100

# The streams of seeds.
_TRAINING, _VALIDATION = 0, 1


class Episodes:
    """The configs and seeds of all episodes of a training run, as a function of its seed.

    The validation episodes have their own seeds and maps, and are the same each time.
    """

    def __init__(self, config: EnvironmentConfig, seed: int, validation_steps: int) -> None:
        self._config, self._seed, self._validation_steps = config, seed, validation_steps

    @property
    def map_size(self) -> tuple[int, int]:
        """The rows and columns that have room for all maps."""
        sizes = [LARGEST.get(kind, (self._config.size, self._config.size)) for kind in self._config.maps]
        rows, columns = zip(*sizes)
        return max(rows), max(columns)

    def of_iteration(self, iteration: int, count: int) -> tuple[list[dict[str, Any]], list[int]]:
        """Returns the configs and the seeds of the training episodes of an iteration."""
        kinds = self._config.kinds
        return self._draw(_TRAINING, iteration, count, kinds[iteration % len(kinds)])

    def of_validation(
        self, count: int, kind: Optional[tuple[str, int]] = None
    ) -> tuple[list[dict[str, Any]], list[int]]:
        """Returns the configs and the seeds of the validation episodes of a kind [default: the first]."""
        configs, seeds = self._draw(_VALIDATION, 0, count, kind or self._config.kinds[0])
        return [{**config, "max_episode_steps": self._validation_steps} for config in configs], seeds

    def _draw(
        self, stream: int, number: int, count: int, kind: tuple[str, int]
    ) -> tuple[list[dict[str, Any]], list[int]]:
        sequence = np.random.SeedSequence(self._seed, spawn_key=(stream, number))
        drawn = sequence.generate_state(2 * count, np.uint64)
        seeds = [FIRST_SEED + int(one) % 2**62 for one in drawn[:count]]
        map_kinds = self._config.maps
        map_seeds = [FIRST_SEED + int(one) % 2**62 for one in drawn[count:]]
        pairs = zip(map_seeds, seeds)
        configs = [self._environment(map_kinds[lane % len(map_kinds)], kind, *pair) for lane, pair in enumerate(pairs)]
        return configs, seeds

    def _environment(self, map_kind: str, kind: tuple[str, int], map_seed: int, seed: int) -> dict[str, Any]:
        config = self._config
        on_target, num_agents = kind
        fields: dict[str, Any] = {
            "num_agents": num_agents,
            "on_target": on_target,
            "max_episode_steps": config.max_episode_steps,
            "collision_system": config.collision_system,
            "obs_radius": config.obs_radius,
        }
        if map_kind == "plain":
            return {**fields, "size": config.size, "density": config.density}
        # Some maps have no room for large crowds. If no map has room, the environment raises `InstanceError`.
        for number in range(_TRIES):
            with_map = {**fields, "map": map_text(map_kind, map_seed + number)}
            if _has_instance(with_map, seed):
                break
        return with_map


def _has_instance(fields: dict[str, Any], seed: int) -> bool:
    try:
        _engine.make_instances(engine_fields(fields), None, [seed], 0)
    except InstanceError:
        return False
    return True


def map_text(kind: str, seed: int) -> str:
    """Returns the text of a map, drawn like the paper's maps of the same kind, but never a published maze."""
    text = _drawn(kind, seed)
    # Different seeds draw the same maze if it has few walls. Random maps have too many obstacles for that.
    while "#" not in text or (kind == "mazes" and text in _published_mazes()):
        seed += 1
        text = _drawn(kind, seed)
    return text


@cache
def _published_mazes() -> frozenset[str]:
    return frozenset(_drawn("mazes", seed) for seed in PUBLISHED_SEEDS)


def _drawn(kind: str, seed: int) -> str:
    if kind == "random":
        return generate_map(MapRangeSettings().sample(seed))
    if kind == "mazes":
        return MazeGenerator.generate_maze(**MazeRangeSettings(17, 21, 17, 21).sample(seed))
    # The warehouse of the default settings has 5 rows of shelves, and the published one has 8.
    rng = np.random.default_rng(seed)
    return generate_warehouse(WarehouseConfig(walls_in_row=int(rng.integers(3, 6)), walls_rows=int(rng.integers(3, 5))))
