"""POGEMA's functions for drawing instances, for direct use.

Environments do not call these functions: their engine draws the same numbers.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np

from pogema_rs.errors import InstanceError
from pogema_rs.grid_config import GridConfig

__all__ = [
    "bfs",
    "generate_from_possible_positions",
    "generate_from_possible_targets",
    "generate_new_target",
    "generate_obstacles",
    "generate_positions_and_targets_fast",
    "get_components",
]

Cell = tuple[int, int]


def generate_obstacles(grid_config: GridConfig, rnd: Optional[np.random.Generator] = None) -> np.ndarray:
    """Returns a random map, 1 for an obstacle; the default `rnd` is seeded with the config's seed.

    Shape: `(height, width)`, int64

    Rule: place/obstacles
    """
    rnd = np.random.default_rng(grid_config.seed) if rnd is None else rnd
    return rnd.binomial(1, grid_config.density, (grid_config.height, grid_config.width))


def bfs(grid: np.ndarray, moves: Sequence[Sequence[int]], start_id: int, free_cell: int) -> list[int]:
    """Sets each free cell of `grid` to the number of its component, and returns the sizes of the components.

    Components are numbered from `start_id` in the order of their first cells, row by row. The returned list is
    indexed by component number; its entries below `start_id` are 0.

    Rule: place/components
    """
    sizes = [0] * start_id
    for first in np.ndindex(*grid.shape):
        if grid[first] == free_cell:
            sizes.append(_flood(grid, moves, first, len(sizes), free_cell))
    return sizes


def _flood(grid: np.ndarray, moves: Sequence[Sequence[int]], first: Cell, label: int, free_cell: int) -> int:
    height, width = grid.shape
    grid[first] = label
    size, waiting = 1, deque([first])
    while waiting:
        row, col = waiting.popleft()
        for down, right in moves:
            there = (row + down, col + right)
            if 0 <= there[0] < height and 0 <= there[1] < width and grid[there] == free_cell:
                grid[there] = label
                size += 1
                waiting.append(there)
    return size


def _labelled(grid_config: GridConfig, obstacles: np.ndarray) -> tuple[np.ndarray, list[int], int]:
    start_id = max(grid_config.FREE, grid_config.OBSTACLE) + 1
    grid = obstacles.copy()
    return grid, bfs(grid, grid_config.MOVES, start_id, grid_config.FREE), start_id


def generate_positions_and_targets_fast(
    obstacles: np.ndarray, grid_config: GridConfig
) -> tuple[list[Cell], list[Cell]]:
    """Returns random starts and goals, each pair in one component.

    If the map has no room for all agents, returns fewer starts than goals.

    Rule: place/pairs
    """
    grid, sizes, start_id = _labelled(grid_config, obstacles)
    order = [cell for cell in np.ndindex(*grid.shape) if grid[cell] >= start_id]
    np.random.default_rng(grid_config.seed).shuffle(order)
    num_agents = grid_config.num_agents
    starts: list[Cell] = []
    goals: list[Cell] = [(-1, -1)] * num_agents
    room, num_goals = list(sizes), 0
    waiting: dict[int, list[int]] = defaultdict(list)
    for cell in order:
        label = int(grid[cell])
        if waiting[label]:
            goals[waiting[label].pop()] = cell
            num_goals += 1
        elif len(starts) >= num_agents:
            if num_goals >= num_agents:
                break
        elif room[label] >= 2:
            room[label] -= 2
            waiting[label].append(len(starts))
            starts.append(cell)
    return starts, goals


def generate_from_possible_positions(grid_config: GridConfig) -> tuple[list, list]:
    """Returns starts and goals from the pools of the config, and shuffles these lists in place.

    Errors: `InstanceError`, an `OverflowError`, for a pool with fewer cells than agents.

    Rule: place/pools
    """
    pools: tuple[Any, Any] = (grid_config.possible_agents_xy, grid_config.possible_targets_xy)
    num_agents = grid_config.num_agents
    for name, pool in zip(("possible_agents_xy", "possible_targets_xy"), pools):
        if len(pool) < num_agents:
            expected = f"at most {len(pool)}, the number of cells in {name}"
            raise InstanceError(f"config: `num_agents` is `{num_agents}`, expected {expected}")
    generator = np.random.default_rng(grid_config.seed)
    for pool in pools:
        generator.shuffle(pool)
    return pools[0][:num_agents], pools[1][:num_agents]


def generate_from_possible_targets(
    rnd_generator: np.random.Generator, possible_positions: Sequence, position: Sequence[int]
) -> tuple:
    """Returns a goal that differs from `position`, drawn from a pool.

    Errors: `InstanceError` if the pool has no other cell; POGEMA loops forever.

    Rule: goal/restart/pool
    """
    return _drawn(rnd_generator, possible_positions, position)


def generate_new_target(
    rnd_generator: np.random.Generator, point_to_component: dict, component_to_points: dict, position: Cell
) -> tuple:
    """Returns a goal that is reachable from `position` and differs from it.

    Errors: `InstanceError` if no such cell exists; POGEMA loops forever.

    Rule: goal/restart/draw
    """
    return _drawn(rnd_generator, component_to_points[point_to_component[position]], position)


def _drawn(generator: np.random.Generator, cells: Sequence, position: Any) -> tuple:
    if all(tuple(cell) == position for cell in cells):
        raise InstanceError(f"no goal can be drawn other than the position {position}")
    while True:
        cell = tuple(generator.choice(cells, 1)[0])
        if cell != position:
            return cell


def get_components(
    grid_config: GridConfig, obstacles: np.ndarray, positions_xy: Any = None, target_xy: Any = None
) -> tuple[dict[int, list[Cell]], dict[Cell, int]]:
    """Returns the cells of each component and the component of each cell; obstacles form a component of their own.

    Rule: place/components
    """
    grid, _, _ = _labelled(grid_config, obstacles)
    points: dict[int, list[Cell]] = defaultdict(list)
    labels: dict[Cell, int] = {}
    for cell in np.ndindex(*grid.shape):
        # A NumPy integer, as in POGEMA.
        label: Any = grid[cell]
        points[label].append(cell)
        labels[cell] = label
    return points, labels
