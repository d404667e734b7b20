"""POGEMA's A* policy, with identical actions."""

from __future__ import annotations

from typing import Any, Union

import numpy as np

from pogema_rs import _engine

__all__ = ["AStarAgent", "BatchAStarAgent"]


class AStarAgent:
    """An agent that follows a shortest path around the obstacles it has seen, and ignores other agents.

    After a step that did not move it, it acts at random until it moves again. It needs observations of type `POMAPF`
    or `MAPF`.

    Rule: policy/astar

    Source: POGEMA 1.4.0, `a_star_policy.py`, `AStarAgent`
    """

    def __init__(self, seed: int = 0) -> None:
        self._agent = _engine.AStarAgent(seed)

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

    def act(self, observations: list[dict[str, Any]]) -> list:
        """Returns an action for each agent."""
        actions = []
        for index, seen in enumerate(observations):
            if index not in self.astar_agents:
                self.astar_agents[index] = AStarAgent()
            actions.append(self.astar_agents[index].act(seen))
        return actions

    def reset_states(self) -> None:
        """Discards all agents before a new episode."""
        self.astar_agents = {}
