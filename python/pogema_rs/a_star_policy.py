"""POGEMA's A* policy, with identical actions, and its search for direct use."""

from __future__ import annotations

from heapq import heappop, heappush
from typing import Any, Optional, Union

import numpy as np

from pogema_rs import _engine
from pogema_rs._checks import check_whole
from pogema_rs._forward import forwarded

__all__ = ["INF", "AStarAgent", "BatchAStarAgent", "GridMemory", "Node", "a_star", "h"]

# POGEMA's module offers this name too.
__getattr__, __dir__ = forwarded(__name__, {"GridConfig": "grid_config"})

Cell = tuple[int, int]

#: The coordinates of a `Node` without a cell.
INF = 1e7


class GridMemory:
    """The obstacles that an agent has seen, in coordinates relative to its start; unknown cells are free.

    Source: POGEMA 1.4.0, `a_star_policy.py`, `GridMemory`
    """

    def __init__(self, start_r: int = 64) -> None:
        side = 2 * start_r + 1
        self._memory = np.zeros((side, side), dtype=bool)

    def update(self, x: int, y: int, obstacles: np.ndarray) -> None:
        """Replaces the window around a cell; the memory grows if the window does not fit."""
        while not _try_insert(obstacles, self._memory, (x, y)):
            side = 2 * len(self._memory) + 1
            larger = np.zeros((side, side))
            _try_insert(self._memory, larger, (0, 0))
            self._memory = larger

    def is_obstacle(self, x: int, y: int) -> Any:
        """Returns whether a cell is known to be an obstacle."""
        radius = len(self._memory) // 2
        return max(abs(x), abs(y)) <= radius and self._memory[radius + x, radius + y]


def _try_insert(window: np.ndarray, memory: np.ndarray, center: Cell) -> bool:
    """Writes a window into a memory and returns whether it fits."""
    radius = len(window) // 2
    row, col = (len(memory) // 2 + number for number in center)
    try:
        memory[row - radius : row + radius + 1, col - radius : col + radius + 1] = window
    except ValueError:
        return False
    return True


class Node:
    """A cell on the frontier of the search, with its cost `g` and its estimate `h`."""

    def __init__(self, coord: tuple[float, float] = (INF, INF), g: int = 0, h: int = 0) -> None:
        self.i: Any
        self.j: Any
        self.i, self.j = coord
        self.g = g
        self.h = h
        self.f = g + h

    def __lt__(self, other: Node) -> bool:
        # POGEMA's comparison of cells is not an order; the expanded nodes depend on it.
        if (self.f, self.g) != (other.f, other.g):
            return (self.f, self.g) < (other.f, other.g)
        return bool(self.i < other.i or self.j < other.j)


def h(node: Cell, target: Cell) -> int:
    """Returns the Manhattan distance between two cells."""
    return abs(node[0] - target[0]) + abs(node[1] - target[1])


def a_star(start: Cell, target: Cell, grid: GridMemory, max_steps: int = 10000) -> list[Cell]:
    """Returns a shortest path from `start` to `target`, both included; empty if the search does not find one.

    The search expands at most `max_steps` nodes.

    Rule: policy/astar

    Source: POGEMA 1.4.0, `a_star_policy.py`, `a_star`
    """
    parents: dict[Cell, Optional[Cell]] = {start: None}
    frontier = [Node(start, 0, h(start, target))]
    for _ in range(int(max_steps)):
        node = heappop(frontier)
        row, col = cell = (node.i, node.j)
        for there in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)):
            if there not in parents and not grid.is_obstacle(*there):
                parents[there] = cell
                heappush(frontier, Node(there, node.g + 1, h(there, target)))
        if cell == target or not frontier:
            break
    path: list[Cell] = []
    step = target if target in parents else None
    while step is not None:
        path.append(step)
        step = parents[step]
    return path[::-1]


class AStarAgent:
    """An agent that follows a shortest path around the obstacles it has seen, and ignores other agents.

    If a step did not move it and it is not on its goal, it acts at random until it moves again. It needs observations
    of type `POMAPF` or `MAPF`.

    Rule: policy/astar

    Source: POGEMA 1.4.0, `a_star_policy.py`, `AStarAgent`
    """

    def __init__(self, seed: Optional[int] = 0) -> None:
        """Creates the agent; if `seed` is None, its random actions differ each time."""
        drawn = int(np.random.SeedSequence().generate_state(1, np.uint64)[0]) if seed is None else seed
        self._agent = _engine.AStarAgent(check_whole("seed", drawn, 0, 2**64 - 1))
        self.clear_state()

    def act(self, obs: dict[str, Any]) -> Union[int, np.int64]:
        """Returns the action for an observation; a random action is a NumPy integer, as in POGEMA.

        Errors: `IndexError` if the agent is more than one step from its last cell; call `clear_state` between
        episodes.
        """
        action, was_random = self._agent.act(obs["xy"], obs["target_xy"], obs["obstacles"])
        return np.int64(action) if was_random else action

    def clear_state(self) -> None:
        """Forgets the map before a new episode; the random generator continues its stream."""
        self._agent.clear_state()


class BatchAStarAgent:
    """An `AStarAgent` for each agent of an environment, all with the same seed."""

    def __init__(self) -> None:
        self.astar_agents: dict[int, AStarAgent] = {}

    def act(self, observations: list[dict[str, Any]]) -> list[int]:
        """Returns an action for each agent."""
        actions: list[Any] = []
        for index, seen in enumerate(observations):
            if index not in self.astar_agents:
                self.astar_agents[index] = AStarAgent()
            actions.append(self.astar_agents[index].act(seen))
        return actions

    def reset_states(self) -> None:
        """Discards all agents before a new episode."""
        self.astar_agents = {}
