"""Planners: plans for all agents at once, and agents that follow them.

    from pogema_rs.planners import PlannerAgents, plan

A planner knows the whole map and all goals, where a policy sees windows. Cells are rows and columns, counted from 0
at the map's corner, without any border.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pogema_rs import _engine

__all__ = ["Plan", "PlannerAgents", "cost_to_go", "plan", "validate"]


@dataclass(frozen=True)
class Plan:
    """What a planner found out.

    Shape: `cells` is `(steps + 1, agents, 2)`, int32, the start first; `actions` is `(steps, agents)`, int64
    """

    #: "solved", "timed_out", "gave_up" or "impossible"
    outcome: str
    #: Time that it took. Units: seconds
    seconds: float
    #: Where each agent is; where none was found, of the plan that came closest, if there is one.
    cells: Optional[NDArray[np.int32]] = None
    #: What each agent does.
    actions: Optional[NDArray[np.int64]] = None
    #: Steps until each agent stays where it ends, summed over the agents.
    sum_of_costs: Optional[int] = None
    #: The last step in which an agent moves.
    makespan: Optional[int] = None
    #: The least that any plan's sum of costs can be, as far as it is known; if it is reached, the plan is optimal.
    lower_bound: Optional[int] = None
    #: Why there is no plan.
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
    most_steps: Optional[int] = None,
    num_threads: int = 1,
    seed: int = 0,
) -> Plan:
    """Brings all agents from their starts to their goals, where they stay.

    Thinks for so many seconds at most, 1 unless nodes are given, or so many nodes of its search, which on one thread
    give the same plan each time; other threads of Python go on meanwhile.

    Shape: `obstacles` `(height, width)`, nonzero for an obstacle; `starts` and `goals` `(agents, 2)`

    Errors: ValueError for cells that are not free, wrong shapes, or a planner that there is not. That there is no
    plan, or that none was found, is no error but an outcome.
    """
    told = _engine.make_plan(
        obstacles, starts, goals, planner, _budget(seconds, nodes), most_steps, num_threads, seed
    )
    return Plan(**told)


def validate(
    obstacles: ArrayLike, starts: ArrayLike, goals: Optional[ArrayLike], cells: ArrayLike
) -> Optional[str]:
    """The first conflict of a plan, in words, or None if it is valid; without goals agents may end anywhere.

    Shape: `cells` `(steps + 1, agents, 2)`

    Errors: ValueError for wrong shapes.
    """
    return _engine.check_plan(obstacles, starts, goals, cells)


def cost_to_go(obstacles: ArrayLike, goal: Sequence[int]) -> NDArray[np.int32]:
    """Steps to a goal from every cell, other agents left out; -1 from where no path leads there.

    Shape: `(height, width)`

    Errors: ValueError for a goal that is not free.
    """
    row, col = goal
    return _engine.cost_to_go(obstacles, (int(row), int(col)))


class PlannerAgents:
    """Agents of an environment that follow a planner, made from observations of the type `MAPF`.

    It plans in the first step of an episode, and again when agents or goals are not where the plan has them. With
    `lifelong=True`, for episodes in which agents get goal after goal, it is one of the planners `rhcr`, `pibt` and
    `guided-pibt` that plan as they go, and `seconds` and `nodes` are for each step. Goals that are still to come it
    is never told. `act` and `reset_states` are what pogema-toolbox asks of an algorithm.
    """

    def __init__(
        self,
        planner: str = "lacam",
        *,
        seconds: Optional[float] = None,
        nodes: Optional[int] = None,
        most_steps: Optional[int] = None,
        num_threads: int = 1,
        seed: int = 0,
        lifelong: bool = False,
    ) -> None:
        """See `plan`; `most_steps` are those of an episode.

        Errors: ValueError for a planner that there is not, or not for such episodes.
        """
        budget = _budget(seconds, nodes)
        self._follower = _engine.PlanFollower(planner, budget, most_steps, num_threads, seed, lifelong)

    def act(self, observations: Sequence[Mapping[str, Any]]) -> list[int]:
        """The actions of all agents.

        Errors: TypeError for observations of another type than `MAPF`.
        """
        first = observations[0] if len(observations) else None
        if not isinstance(first, Mapping) or "global_obstacles" not in first:
            raise TypeError("observations are of another type, expected those of observation_type='MAPF'")
        cells = [observation["global_xy"] for observation in observations]
        goals = [observation["global_target_xy"] for observation in observations]
        return self._follower.act(first["global_obstacles"], cells, goals)

    def reset_states(self) -> None:
        """Forgets the last episode; to be called before each."""
        self._follower.reset()


def _budget(seconds: Optional[float], nodes: Optional[int]) -> tuple[Optional[float], Optional[int]]:
    return (1.0 if seconds is None and nodes is None else seconds, nodes)
