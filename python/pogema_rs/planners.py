"""Planners for all agents, and agents that follow their plans.

    from pogema_rs.planners import PlannerAgents, plan

A planner knows the whole map and all goals; a policy sees only windows. Cells are (row, col), counted from 0 at the
map's corner, without the border.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pogema_rs import _engine
from pogema_rs._checks import check_cells, check_whole
from pogema_rs._counted import counted

_LARGEST = 2**64 - 1
# The budget, the number of steps, the number of threads and the seed.
_Limits = tuple[tuple[Optional[float], Optional[int]], Optional[int], int, int]

__all__ = ["Plan", "PlannerAgents", "cost_to_go", "plan", "validate"]


@dataclass(frozen=True)
class Plan:
    """The outcome of a planner.

    Shape: `cells` is `(steps + 1, agents, 2)`, int32, starts first; `actions` is `(steps, agents)`, int64
    """

    #: "solved", "timed_out", "gave_up" or "impossible"
    outcome: str
    #: Planning time. Units: seconds
    seconds: float
    #: The cells of all agents at each step. If no plan was found, those of the closest attempt, if any.
    cells: Optional[NDArray[np.int32]] = None
    #: The action of each agent at each step.
    actions: Optional[NDArray[np.int64]] = None
    #: Steps until an agent stays on its last cell, summed over all agents.
    sum_of_costs: Optional[int] = None
    #: The last step in which an agent moves.
    makespan: Optional[int] = None
    #: A lower bound on the sum of costs of any plan; a plan that reaches it is optimal.
    lower_bound: Optional[int] = None
    #: Why the problem is impossible.
    reason: Optional[str] = None

    @property
    def is_solved(self) -> bool:
        """Whether all agents reach their goals."""
        return self.outcome == "solved"


def plan(
    obstacles: ArrayLike,
    starts: ArrayLike,
    goals: ArrayLike,
    planner: str = "lacam",
    *,
    seconds: Optional[float] = None,
    nodes: Optional[int] = None,
    max_steps: Optional[int] = None,
    num_threads: int = 1,
    seed: int = 0,
) -> Plan:
    """Plans the moves of all agents from their starts to their goals, where they stay.

    The planner stops after `seconds` [default: 1 if `nodes` is not given] or after `nodes` search nodes. With one
    thread, a budget of `nodes` alone gives the same plan each time. Other Python threads run during planning.

    Shape: `obstacles` `(height, width)`, nonzero for an obstacle; `starts` and `goals` `(agents, 2)`

    Errors: ValueError for cells that are not free, wrong shapes, or an unknown planner. An impossible problem or an
    exhausted budget is an outcome, not an error.
    """
    limits = _limits(seconds, nodes, max_steps, num_threads, seed)
    return _plan(obstacles, starts, goals, planner, limits)


def validate(obstacles: ArrayLike, starts: ArrayLike, goals: Optional[ArrayLike], cells: ArrayLike) -> Optional[str]:
    """Returns the first conflict of a plan as text, or None if it is valid; without goals agents may end anywhere.

    Shape: `cells` `(steps + 1, agents, 2)`

    Errors: ValueError for wrong shapes.
    """
    goals = None if goals is None else check_cells("goals", goals, 2)
    return _engine.check_plan(obstacles, check_cells("starts", starts, 2), goals, check_cells("cells", cells, 3))


def cost_to_go(obstacles: ArrayLike, goal: Sequence[int]) -> NDArray[np.int32]:
    """Returns the distance to a goal from every cell, without other agents; -1 where no path leads to it.

    Shape: `(height, width)`

    Units: steps

    Errors: ValueError for a goal that is not free, or is not a pair of whole numbers.
    """
    cell = check_cells("goal", goal, 1).tolist()
    if len(cell) != 2:
        raise ValueError(f"goal holds {counted(len(cell), 'number')}, expected a row and a column")
    row, col = cell
    return _engine.cost_to_go(obstacles, (int(row), int(col)))


class PlannerAgents:
    """Agents of an environment that follow a planner; they need observations of type `MAPF`.

    The planner runs in the first step of an episode, and again if agents or goals differ from its plan. For lifelong
    episodes set `lifelong=True` and choose one of the lifelong planners `rhcr`, `rhcr-pbs`, `rhcr-ecbs`, `pibt` and
    `guided-pibt`; `seconds` and `nodes` then limit each step. The planner does not know future goals. `act` and
    `reset_states` are the methods that pogema-toolbox requires of an algorithm.
    """

    def __init__(
        self,
        planner: str = "lacam",
        *,
        seconds: Optional[float] = None,
        nodes: Optional[int] = None,
        max_steps: Optional[int] = None,
        num_threads: int = 1,
        seed: int = 0,
        lifelong: bool = False,
    ) -> None:
        """Makes the agents; the arguments are those of `plan`, and `max_steps` is the length of an episode.

        Errors: ValueError for a planner that is unknown or does not support such episodes.
        """
        limits = _limits(seconds, nodes, max_steps, num_threads, seed)
        self._follower = _engine.PlanFollower(planner, *limits, lifelong)

    def act(self, observations: Sequence[Mapping[str, Any]]) -> list[int]:
        """Returns the actions of all agents.

        Errors: TypeError for observations of a type other than `MAPF`.
        """
        first = observations[0] if len(observations) else None
        if not isinstance(first, Mapping) or "global_obstacles" not in first:
            raise TypeError("observations have the wrong type, expected those of observation_type='MAPF'")
        cells = [observation["global_xy"] for observation in observations]
        goals = [observation["global_target_xy"] for observation in observations]
        return self._follower.act(first["global_obstacles"], cells, goals)

    def reset_states(self) -> None:
        """Forgets the last episode; call it before each episode."""
        self._follower.reset()


def _plan(
    obstacles: ArrayLike,
    starts: ArrayLike,
    goals: ArrayLike,
    planner: str,
    limits: _Limits,
    stop: Optional[_engine.Stop] = None,
) -> Plan:
    """Does the work of `plan`, until another thread sets `stop`."""
    starts, goals = check_cells("starts", starts, 2), check_cells("goals", goals, 2)
    return Plan(**_engine.make_plan(obstacles, starts, goals, planner, *limits, stop))


def _limits(
    seconds: Optional[float], nodes: Optional[int], max_steps: Optional[int], num_threads: int, seed: int
) -> _Limits:
    """Returns the budget, the number of steps, the number of threads and the seed, as the engine reads them."""
    if nodes is not None:
        nodes = min(check_whole("nodes", nodes, 0), _LARGEST)
    if max_steps is not None:
        max_steps = min(check_whole("max_steps", max_steps, 0), sys.maxsize)
    budget = (1.0 if seconds is None and nodes is None else seconds, nodes)
    num_threads = check_whole("num_threads", num_threads, 1, _engine.MAX_THREADS)
    return budget, max_steps, num_threads, check_whole("seed", seed, 0, _LARGEST)
