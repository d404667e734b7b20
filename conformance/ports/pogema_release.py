"""The abilities of the installed POGEMA, and the construction of its environments, for releases from 1.1.6 to 1.4.0.

This module never compares version numbers: it detects each difference directly.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args, get_type_hints

import numpy as np
import pogema
from environment_object import Refusal
from pogema import GridConfig, envs, pogema_v0
from pogema.grid_registry import GRID_STR_REGISTRY, RegisteredGrid
from pogema.wrappers import metrics as wrappers
from pogema.wrappers.persistence import PersistentWrapper

METRICS = {
    "ISRMetric": ["ISR"],
    "CSRMetric": ["CSR"],
    "EpLengthMetric": ["ep_length"],
    "SumOfCostsAndMakespanMetric": ["SoC", "makespan"],
    "LifeLongAverageThroughputMetric": ["avg_throughput"],
    "AgentsDensityWrapper": ["avg_agents_density"],
}
PLANNER: Any = getattr(pogema, "BatchAStarAgent", None)  # since 1.2
HAS_SIZES = "width" in get_type_hints(GridConfig)
ACCEPTS_SEQUENCES = FORECASTS_GOALS = hasattr(envs.PogemaLifeLong, "get_lifelong_targets_xy")


def choices(field: str) -> list[str]:
    """Returns the accepted values of a config field."""
    return list(get_args(get_type_hints(GridConfig)[field]))


def is_valid(**fields: Any) -> bool:
    """Returns whether the config accepts these values."""
    try:
        GridConfig(**fields)
    except ValueError:
        return False
    return True


def claims(raw: bool) -> dict[str, Any]:
    """Returns the answer to `hello`."""
    profiles = ["core", "observations", "seeding"]
    profiles += [] if raw else ["metrics", "history"]
    profiles += ["policies"] if PLANNER else []
    tells = ["on_goal", "occupied", "padded", "actions_after"]
    tells += ["derived"] if HAS_SIZES else []
    tells += ["foretold"] if FORECASTS_GOALS else []
    metrics = [name for wrapper, names in METRICS.items() if hasattr(wrappers, wrapper) for name in names]
    limits = {"max_radius": 128}
    if not is_valid(size=4096):
        limits.update(max_side=1024, max_agents=10_000)
    return {
        "protocol": "pogema-conform/1",
        "name": "pogema (raw)" if raw else "pogema",
        "version": pogema.__version__,
        "profiles": profiles,
        "collision": choices("collision_system"),
        "on_goal": choices("on_target"),
        "observation": choices("observation_type"),
        "noise": True,
        "metrics": [] if raw else metrics,
        "tells": tells,
        **limits,
    }


def make(config: GridConfig, raw: bool, with_density: bool) -> Any:
    """Returns an environment with POGEMA's wrappers and, if requested, the density wrapper; if `raw`, without any."""
    if config.integration not in (None, "SampleFactory"):
        raise Refusal(f"`integration` is `{config.integration}`, expected none or `SampleFactory`")
    env = pogema_v0(grid_config=config)
    if raw:
        return env.unwrapped
    return wrappers.AgentsDensityWrapper(env) if with_density else env


def persistent_layer(env: Any) -> PersistentWrapper:
    """Returns the wrapper that records the steps."""
    while not isinstance(env, PersistentWrapper):
        if env is env.unwrapped:
            raise Refusal("steps are kept only with `persistent: true`")
        env = env.env
    return env


def full_history(wrapper: PersistentWrapper) -> Any:
    """Returns each agent's state at every step; before 1.4.0, POGEMA's helper omits the last step by default."""
    if hasattr(wrapper, "get_full_history"):
        return wrapper.get_full_history()
    num_states = wrapper._step + 1
    return [wrapper.agent_state_to_full_list(states, num_states) for states in wrapper.get_history()]


class Registration:
    """Keeps at most one map in POGEMA's registry."""

    def __init__(self) -> None:
        self.name: str | None = None

    def clear(self) -> None:
        """Removes the map."""
        GRID_STR_REGISTRY.pop(self.name, None)
        self.name = None

    def register(self, grid: dict[str, Any]) -> None:
        """Registers a map."""
        RegisteredGrid(grid["name"], "\n".join(grid["rows"]))
        self.name = grid["name"]


# The rest of this module makes POGEMA play an instance, in which nothing is drawn at random.


def config_of(instance: dict[str, Any]) -> GridConfig:
    """Returns the config closest to an instance; `patch_grids` applies the rest of the instance."""
    rules, rows, goals = instance["config"], instance["map"], instance["goals"]
    if rules["occupancy"] != "as_released" or rules["reward"] != "own":
        raise Refusal("POGEMA supports only occupancy `as_released` and reward `own`")
    is_sequence = ACCEPTS_SEQUENCES and rules["on_goal"] == "restart"
    # POGEMA rejects a sequence with one entry. If the sequence is assigned afterwards, POGEMA accepts it.
    targets = [2 * each if is_sequence and len(each) == 1 else each for each in goals]
    config = GridConfig(
        map=[[int(letter == "#") for letter in row] for row in rows],
        agents_xy=instance["starts"],
        targets_xy=targets if is_sequence else [each[0] for each in goals],
        num_agents=rules["num_agents"],
        obs_radius=rules["radius"],
        max_episode_steps=rules["max_steps"],
        collision_system=rules["collision"],
        on_target=rules["on_goal"],
        observation_type=rules["observation"],
        persistent=rules["persistent"],
        empty_outside=instance.get("outside", "free") == "free",
        # A config without `width` checks positions against the size before it reads the map.
        **({} if HAS_SIZES else {"size": max(len(rows), len(rows[0]), 2)}),
    )
    if is_sequence:
        config.targets_xy = goals
    return config


class GoalList:
    """Replaces an agent's random generator where POGEMA has no sequences; draws the goals of a list in order."""

    def __init__(self, goals: list[Any], radius: int) -> None:
        self.goals, self.radius, self.index = goals, radius, 0

    def choice(self, _candidates: Any, _size: int) -> list[tuple[int, int]]:
        """Returns the next goal in grid coordinates, like the candidates."""
        self.index = (self.index + 1) % len(self.goals)
        row, col = self.goals[self.index]
        return [(row + self.radius, col + self.radius)]


def patch_grids(base: Any, instance: dict[str, Any]) -> None:
    """Applies to every new grid the parts of an instance that the config cannot express."""
    make_grid: Callable[[], None] = base._initialize_grid

    def make_patched_grid() -> None:
        make_grid()
        place_obstacles(base.grid.obstacles, instance)
        if not ACCEPTS_SEQUENCES and base.grid_config.on_target == "restart":
            radius = base.grid_config.obs_radius
            base.random_generators = [GoalList(goals, radius) for goals in instance["goals"]]

    base._initialize_grid = make_patched_grid


def place_obstacles(grid: Any, instance: dict[str, Any]) -> None:
    """Restores the obstacles under starts and goals, which POGEMA clears, and those outside the wall, which vary."""
    radius, outside = instance["config"]["radius"], instance.get("outside", "free")
    if outside != "free":
        wall = grid[radius - 1 : 1 - radius or None, radius - 1 : 1 - radius or None].copy()
        grid[:] = flags(outside["noise"])
        grid[radius - 1 : 1 - radius or None, radius - 1 : 1 - radius or None] = wall
    grid[radius:-radius, radius:-radius] = flags(instance["map"])


def flags(rows: list[str]) -> Any:
    """Converts rows of text to an array, 1 for an obstacle."""
    letters = np.frombuffer("".join(rows).encode("ascii"), np.uint8)
    return (letters == ord("#")).reshape(len(rows), -1)
