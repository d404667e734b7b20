"""The map and its agents: a view of an environment's state with POGEMA's names.

All coordinates are (row, col) and include the border, unless `ignore_borders` is set. A grid is read-only: writing into
one of its attributes raises an error.
"""

from __future__ import annotations

import operator
import sys
import warnings
from collections.abc import Callable, Sequence
from copy import deepcopy
from functools import cached_property
from typing import Any, Literal, NoReturn, Optional, TypeVar, Union, overload

import numpy as np

from pogema_rs import _engine, grid_registry
from pogema_rs._forward import forwarded
from pogema_rs._never_called import reject_overrides
from pogema_rs._read_only import FixedAttributes, ReadOnlyDict, ReadOnlyList
from pogema_rs._types import Cell
from pogema_rs.errors import StateError
from pogema_rs.generator import get_components
from pogema_rs.grid_config import GridConfig, engine_fields
from pogema_rs.utils import render_grid

__all__ = ["Grid", "GridLifeLong"]

# POGEMA's module offers these names too.
__getattr__, __dir__ = forwarded(
    __name__,
    {
        "generate_from_possible_positions": "generator",
        "generate_obstacles": "generator",
        "generate_positions_and_targets_fast": "generator",
        "get_grid": "grid_registry",
        "in_registry": "grid_registry",
    },
)

Shown = TypeVar("Shown")
Goal = tuple[Union[int, np.int64], Union[int, np.int64]]

_CELLS = "override `get_agents_xy` and `get_targets_xy`"
# The methods that are never called, with what a user does instead.
_NOT_CALLED = {
    "add_artificial_border": "read the map without its border with `get_obstacles(ignore_borders=True)`",
    "_cut_borders_xy": _CELLS,
    "_filter_inactive": _CELLS,
    "_prepare_positions": _CELLS,
    "_normalize_coordinates": "override `get_state`",
}


class Grid(FixedAttributes):
    """The map and its agents.

    A grid of an environment shows that environment's current state; a grid made from a config shows the state after a
    reset. It is read-only: the methods with which POGEMA's users change a grid raise an error here. If the config has
    neither a map nor a seed, up to `num_retries` further maps are drawn until one has room for all agents.

    Rule: border/ring, border/outside, grid/coordinates, place/retries

    Source: POGEMA 1.4.0, `grid.py`, `Grid`
    """

    _FIXED = {"config": "set `grid_config` of the environment before its reset"}
    config: GridConfig
    _seed: Optional[int] = None
    #: The seed that was given to the reset. If no seed was given, the attribute does not exist, as in POGEMA.
    seed: int

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        reject_overrides(cls, _NOT_CALLED)

    def __init__(self, grid_config: GridConfig, add_artificial_border: bool = True, num_retries: int = 10) -> None:
        num_retries = min(max(operator.index(num_retries), 0), sys.maxsize)
        named = grid_registry.map_text(grid_config.map_name)
        engine = _engine.Engine(engine_fields(grid_config), named, num_retries=num_retries)
        for text in engine.reset():
            warnings.warn(text, UserWarning, stacklevel=2)
        self._show(engine, grid_config)
        if not add_artificial_border:
            raise StateError("add_artificial_border is False, expected True: an environment always has its border")

    @classmethod
    def _of(cls, engine: _engine.Engine, grid_config: GridConfig) -> Grid:
        grid = cls.__new__(cls)
        grid._show(engine, grid_config)
        return grid

    def _show(self, engine: _engine.Engine, grid_config: GridConfig) -> None:
        self._engine = engine
        self.__dict__["config"] = grid_config
        self._seed = grid_config.seed
        self._obstacles: Optional[np.ndarray] = None

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in self.__dict__.items() if name not in ("_components", "_shown")}
        return {**kept, "_obstacles": None}

    def _once(self, name: str, make: Callable[[], Shown]) -> Shown:
        """Returns a value of the current state, cached at its first use: users read it for one agent after another."""
        shown: dict[Any, Any] = self.__dict__.setdefault("_shown", {})
        key = name, self.config.obs_radius
        if key not in shown:
            shown[key] = make()
        made: Shown = shown[key]
        return made

    def _forget(self) -> None:
        """Forgets the values of the last state."""
        self.__dict__.pop("_shown", None)

    @property
    def obstacles(self) -> np.ndarray:
        """The map with its border, 1 for an obstacle: float64 if the area beyond the wall is free, otherwise int64."""
        if self._obstacles is None:
            dtype = np.float64 if self._engine.is_free_outside else np.int64
            self._obstacles = self._engine.obstacles().astype(dtype)
            self._obstacles.flags.writeable = False
        return self._obstacles

    @property
    def positions(self) -> np.ndarray:
        """The occupancy grid, 1 for a marked cell: float64 with the shape of `obstacles`."""
        return self._once("positions", self._marked)

    def _marked(self) -> np.ndarray:
        marked = np.zeros(self.obstacles.shape)
        for cell in self._engine.occupied():
            marked[cell] = 1
        marked.flags.writeable = False
        return marked

    @property
    def positions_xy(self) -> list[tuple[int, int]]:
        """The cell of each agent."""
        return self._once("cells", lambda: ReadOnlyList(self._engine.cells(self.config.obs_radius)))

    @property
    def finishes_xy(self) -> list[Goal]:
        """The goal of each agent; a goal drawn since the reset consists of NumPy integers, as in POGEMA."""
        return self._once("goals", lambda: ReadOnlyList(self._goals()))

    @property
    def starts_xy(self) -> list[tuple[int, int]]:
        """The cell of each agent: POGEMA's list of starts moves with the agents."""
        return self.positions_xy

    @property
    def is_active(self) -> dict[int, bool]:
        """Whether each agent is active, by index."""
        return self._once("active", lambda: ReadOnlyDict(enumerate(self._engine.active)))

    @cached_property
    def rnd(self) -> np.random.Generator:
        """A generator in the state of POGEMA's generator after drawing the border; nothing else draws from it."""
        rnd = np.random.default_rng(self._seed)
        if not self._engine.is_free_outside:
            rnd.binomial(1, self.config.density, self.obstacles.shape)
        return rnd

    def _goals(self) -> list[Goal]:
        goals = self._engine.goals(self.config.obs_radius)
        is_drawn = self._engine.is_drawn
        return [(np.int64(row), np.int64(col)) if drawn else (row, col) for (row, col), drawn in zip(goals, is_drawn)]

    def get_obstacles(self, ignore_borders: bool = False) -> np.ndarray:
        """Returns a copy of `obstacles`, with or without the border."""
        radius = self.config.obs_radius
        inside = slice(radius, -radius)
        return self.obstacles[inside, inside].copy() if ignore_borders else self.obstacles.copy()

    def get_agents_xy(self, only_active: bool = False, ignore_borders: bool = False) -> list[Cell]:
        """Returns the cell of each agent, as a tuple, or as a list with `ignore_borders`.

        `only_active` omits inactive agents; POGEMA's own flag drops agent 0 or raises.
        """
        return self._prepared(self.positions_xy, only_active, ignore_borders)

    def get_targets_xy(self, only_active: bool = False, ignore_borders: bool = False) -> list[Cell]:
        """Returns the goal of each agent, as a tuple, or as a list with `ignore_borders`."""
        return self._prepared(self.finishes_xy, only_active, ignore_borders)

    def _prepared(self, places: Sequence[Any], only_active: bool, ignore_borders: bool) -> list[Cell]:
        if only_active:
            places = [place for place, active in zip(places, self._engine.active) if active]
        if ignore_borders:
            radius = self.config.obs_radius
            return [[row - radius, col - radius] for row, col in places]
        return list(places)

    @staticmethod
    def to_relative(coordinates: Sequence[Any], offset: Sequence[Any]) -> list[tuple[int, int]]:
        """Returns each cell relative to its own offset."""
        return [(row - from_row, col - from_col) for (row, col), (from_row, from_col) in zip(coordinates, offset)]

    def get_agents_xy_relative(self) -> list[tuple[int, int]]:
        """Returns the cell of each agent relative to its start."""
        return self.to_relative(self.positions_xy, self._initial_xy)

    def get_targets_xy_relative(self) -> list[tuple[int, int]]:
        """Returns the goal of each agent relative to its start."""
        return self.to_relative(self.finishes_xy, self._initial_xy)

    @property
    def _initial_xy(self) -> list[tuple[int, int]]:
        return self._engine.starts(self.config.obs_radius)

    @overload
    def get_state(self, ignore_borders: bool = False, as_dict: Literal[False] = False) -> np.ndarray: ...

    @overload
    def get_state(self, ignore_borders: bool = False, *, as_dict: Literal[True]) -> dict[str, Any]: ...

    def get_state(self, ignore_borders: bool = False, as_dict: bool = False) -> Union[np.ndarray, dict[str, Any]]:
        """Returns agents, goals and the map, as a dictionary or as one flat array.

        Coordinates are divided by the map's height or width minus 1. A map of one row or column thus raises
        `ZeroDivisionError`, as in POGEMA.
        """
        radius, height, width = self.config.obs_radius, self.config.height - 1, self.config.width - 1

        def normalized(places: Sequence[Any]) -> list[tuple[float, float]]:
            return [((row - radius) / height, (col - radius) / width) for row, col in places]

        agents_xy, targets_xy = normalized(self.get_agents_xy()), normalized(self.get_targets_xy())
        obstacles = self.get_obstacles(ignore_borders)
        if as_dict:
            return {"obstacles": obstacles, "agents_xy": agents_xy, "targets_xy": targets_xy}
        return np.concatenate([np.array(part).flatten() for part in (agents_xy, targets_xy, obstacles)])

    def get_observation_shape(self) -> tuple[int, int, int]:
        """Returns POGEMA's shape of an observation, which omits the goal's channel."""
        side = 2 * self.config.obs_radius + 1
        return 2, side, side

    def get_num_actions(self) -> int:
        """Returns the number of actions."""
        return len(self.config.MOVES)

    def get_grid_config(self) -> GridConfig:
        """Returns a copy of the config."""
        return deepcopy(self.config)

    def _window(self, padded: np.ndarray, agent_id: int) -> np.ndarray:
        row, col = self.positions_xy[agent_id]
        radius = self.config.obs_radius
        return padded[row - radius : row + radius + 1, col - radius : col + radius + 1].astype(np.float32)

    def get_obstacles_for_agent(self, agent_id: int) -> np.ndarray:
        """Returns the obstacles in an agent's window, float32 `(side, side)`."""
        return self._window(self.obstacles, agent_id)

    def get_positions(self, agent_id: int) -> np.ndarray:
        """Returns the agents in an agent's window, float32 `(side, side)`."""
        return self._window(self.positions, agent_id)

    def get_target(self, agent_id: int) -> tuple[float, float]:
        """Returns the direction of an agent's goal as a unit vector; zeros on the goal."""
        (row, col), (goal_row, goal_col) = self.positions_xy[agent_id], self.finishes_xy[agent_id]
        if (row, col) == (goal_row, goal_col):
            return 0.0, 0.0
        down, right = goal_row - row, goal_col - col
        distance = np.sqrt(down**2 + right**2)
        return down / distance, right / distance

    def get_square_target(self, agent_id: int) -> np.ndarray:
        """Returns the goal in an agent's window, each coordinate clipped to it: float32 `(side, side)`.

        Rule: observe/default/goal
        """
        radius = self.config.obs_radius
        (row, col), (goal_row, goal_col) = self.positions_xy[agent_id], self.finishes_xy[agent_id]
        window = np.zeros((2 * radius + 1, 2 * radius + 1), dtype=np.float32)
        away = np.array((goal_row - row, goal_col - col))
        window[tuple(radius + np.clip(away, -radius, radius))] = 1
        return window

    def has_obstacle(self, x: int, y: int) -> bool:
        """Returns whether a cell is an obstacle."""
        return self.obstacles[x, y] == self.config.OBSTACLE

    def on_goal(self, agent_id: int) -> bool:
        """Returns whether an agent is on its goal."""
        return self.positions_xy[agent_id] == self.finishes_xy[agent_id]

    def render(self, mode: str = "human") -> Optional[str]:
        """Prints the map and its border in colours, or returns the text if `mode` is "ansi"."""
        return render_grid(self.obstacles, self.positions_xy, self.finishes_xy, self.is_active, mode=mode)

    def move(self, agent_id: int, action: int) -> None:
        """Raises `StateError`, because only the step of an environment moves agents."""
        _reject()

    def move_without_checks(self, agent_id: int, action: int) -> None:
        """Raises `StateError`, because only the step of an environment moves agents."""
        _reject()

    def move_agent_to_cell(self, agent_id: int, x: int, y: int) -> None:
        """Raises `StateError`, because a grid is read-only."""
        _reject()

    def hide_agent(self, agent_id: int) -> None:
        """Raises `StateError`, because a grid is read-only."""
        _reject()

    def show_agent(self, agent_id: int) -> None:
        """Raises `StateError`, because a grid is read-only."""
        _reject()

    def add_artificial_border(self) -> None:
        """Raises `StateError`, because a grid always has its border."""
        _reject()


def _reject() -> NoReturn:
    raise StateError("a grid cannot be changed by hand; reset with agents_xy and targets_xy to place agents")


class GridLifeLong(Grid):
    """The map and its agents with `on_target="restart"`."""

    @cached_property
    def _components(self) -> tuple[dict, dict]:
        points, labels = get_components(self.config, self.obstacles)
        return ReadOnlyDict({label: ReadOnlyList(cells) for label, cells in points.items()}), ReadOnlyDict(labels)

    @property
    def component_to_points(self) -> dict[int, list[tuple[int, int]]]:
        """The cells of each component, with those of the border.

        Rule: place/components
        """
        return self._components[0]

    @property
    def point_to_component(self) -> dict[tuple[int, int], int]:
        """The component of each cell; obstacles form a component of their own.

        Rule: place/components
        """
        return self._components[1]


def given_goals(config: GridConfig, ignore_borders: bool) -> Optional[list]:
    """Returns the goal sequence that a config gives each agent, or `None` if it has no goals."""
    if config.targets_xy is None or ignore_borders:
        return config.targets_xy
    radius = config.obs_radius
    return [[[row + radius, col + radius] for row, col in sequence] for sequence in config.targets_xy]


def foretold_goals(grid: Grid, ignore_borders: bool) -> list:
    """Returns the goals that the agents of a grid will draw, as POGEMA predicts them."""
    radius = grid.config.obs_radius
    goals = grid._engine.foretold_goals()
    if goals is None:
        raise StateError("the list of goals would never end: only the goal just reached can be drawn again")
    shift = 0 if ignore_borders else radius
    first = grid.get_targets_xy(ignore_borders=ignore_borders)
    return [
        [start, *([np.int64(row + shift), np.int64(col + shift)] for row, col in rest[1:])]
        for start, rest in zip(first, goals)
    ]
