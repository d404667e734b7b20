"""What the installed POGEMA can do, and how to make an environment of it; releases from 1.1.6 to 1.4.0 differ.

Nothing here goes by version numbers: each difference is looked for where it shows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args, get_type_hints

import numpy as np
import pogema
from pogema import GridConfig, envs, pogema_v0
from pogema.grid_registry import GRID_STR_REGISTRY, RegisteredGrid
from pogema.wrappers import metrics as wrappers
from pogema.wrappers.persistence import PersistentWrapper

FIGURES = {
    "ISRMetric": ["ISR"],
    "CSRMetric": ["CSR"],
    "EpLengthMetric": ["ep_length"],
    "SumOfCostsAndMakespanMetric": ["SoC", "makespan"],
    "LifeLongAverageThroughputMetric": ["avg_throughput"],
    "AgentsDensityWrapper": ["avg_agents_density"],
}
PLANNER: Any = getattr(pogema, "BatchAStarAgent", None)  # from 1.2 on
TELLS_SIZES = "width" in get_type_hints(GridConfig)
TAKES_SEQUENCES = FORETELLS = hasattr(envs.PogemaLifeLong, "get_lifelong_targets_xy")


class Refusal(Exception):
    """A question that is answered with an error, by POGEMA or by us."""


def choices(field: str) -> list[str]:
    """The words that a field of the config may hold."""
    return list(get_args(get_type_hints(GridConfig)[field]))


def is_valid(**fields: Any) -> bool:
    """Whether the config takes these values."""
    try:
        GridConfig(**fields)
    except ValueError:
        return False
    return True


def claims(raw: bool) -> dict[str, Any]:
    """The answer to `hello`."""
    profiles = ["core", "observations", "seeding"]
    profiles += [] if raw else ["metrics", "history"]
    profiles += ["policies"] if PLANNER else []
    tells = ["on_goal", "occupied", "padded", "actions_after"]
    tells += ["derived"] if TELLS_SIZES else []
    tells += ["foretold"] if FORETELLS else []
    figures = [name for wrapper, names in FIGURES.items() if hasattr(wrappers, wrapper) for name in names]
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
        "metrics": [] if raw else figures,
        "tells": tells,
        **limits,
    }


def make(config: GridConfig, raw: bool, with_density: bool) -> Any:
    """An environment with the wrappers that POGEMA puts around it, or, raw, without any."""
    if config.integration not in (None, "SampleFactory"):
        raise Refusal(f"integration {config.integration} gives an environment of another form")
    env = pogema_v0(grid_config=config)
    if raw:
        return env.unwrapped
    return wrappers.AgentsDensityWrapper(env) if with_density else env


def keeper_of(env: Any) -> PersistentWrapper:
    """The layer that keeps the steps."""
    while not isinstance(env, PersistentWrapper):
        if env is env.unwrapped:
            raise Refusal("steps are only kept with persistent: true")
        env = env.env
    return env


def full_history(keeper: PersistentWrapper) -> Any:
    """Each agent's state at every step; before 1.4.0 POGEMA's own helper stops one step short unless told to go on."""
    if hasattr(keeper, "get_full_history"):
        return keeper.get_full_history()
    num_states = keeper._step + 1
    return [keeper.agent_state_to_full_list(states, num_states) for states in keeper.get_history()]


class Registration:
    """At most one map in POGEMA's registry, until the next one."""

    def __init__(self) -> None:
        self.name: str | None = None

    def clear(self) -> None:
        """Takes the map out."""
        GRID_STR_REGISTRY.pop(self.name, None)
        self.name = None

    def register(self, grid: dict[str, Any]) -> None:
        """Puts a map in."""
        RegisteredGrid(grid["name"], "\n".join(grid["rows"]))
        self.name = grid["name"]


# What follows makes POGEMA play an instance, in which everything is drawn already.


def config_of(instance: dict[str, Any]) -> GridConfig:
    """The config that comes nearest to an instance; `settle` does the rest."""
    rules, rows, goals = instance["config"], instance["map"], instance["goals"]
    if rules["occupancy"] != "as_released" or rules["reward"] != "own":
        raise Refusal("POGEMA has neither exact occupancy nor a shared reward")
    is_sequence = TAKES_SEQUENCES and rules["on_goal"] == "restart"
    # A sequence has to have two entries, though it may be put in with one afterwards.
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
        # Where the config knows no width, it checks positions against the size before it looks at the map.
        **({} if TELLS_SIZES else {"size": max(len(rows), len(rows[0]), 2)}),
    )
    if is_sequence:
        config.targets_xy = goals
    return config


class GoalList:
    """In the place of an agent's random generator, where POGEMA knows no sequences: it draws what the list says."""

    def __init__(self, goals: list[Any], radius: int) -> None:
        self.goals, self.radius, self.index = goals, radius, 0

    def choice(self, _candidates: Any, _size: int) -> list[tuple[int, int]]:
        """The next goal, counted from the border's corner as the candidates are."""
        self.index = (self.index + 1) % len(self.goals)
        row, col = self.goals[self.index]
        return [(row + self.radius, col + self.radius)]


def settle(base: Any, instance: dict[str, Any]) -> None:
    """Puts into every new grid what no field of the config can say."""
    make_grid: Callable[[], None] = base._initialize_grid

    def make_settled_grid() -> None:
        make_grid()
        place_obstacles(base.grid.obstacles, instance)
        if not TAKES_SEQUENCES and base.grid_config.on_target == "restart":
            radius = base.grid_config.obs_radius
            base.random_generators = [GoalList(goals, radius) for goals in instance["goals"]]

    base._initialize_grid = make_settled_grid


def place_obstacles(grid: Any, instance: dict[str, Any]) -> None:
    """Obstacles under starts and goals, which POGEMA clears, and beyond the wall, which it draws."""
    radius, outside = instance["config"]["radius"], instance.get("outside", "free")
    if outside != "free":
        wall = grid[radius - 1 : 1 - radius or None, radius - 1 : 1 - radius or None].copy()
        grid[:] = flags(outside["noise"])
        grid[radius - 1 : 1 - radius or None, radius - 1 : 1 - radius or None] = wall
    grid[radius:-radius, radius:-radius] = flags(instance["map"])


def flags(rows: list[str]) -> Any:
    """Rows of text as an array, 1 for an obstacle."""
    letters = np.frombuffer("".join(rows).encode("ascii"), np.uint8)
    return (letters == ord("#")).reshape(len(rows), -1)
