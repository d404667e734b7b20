"""Environments for PettingZoo."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, Optional, Union

import gymnasium
import numpy as np

from pogema_rs.envs import _make_pogema
from pogema_rs.grid_config import GridConfig
from pogema_rs.semantics import Semantics

if TYPE_CHECKING:
    from pettingzoo import ParallelEnv
else:
    try:
        from pettingzoo import ParallelEnv
    except ImportError:
        # POGEMA's adapter has no base class, so a project can use it without PettingZoo.
        ParallelEnv = object

__all__ = ["PogemaParallel", "parallel_env"]


def parallel_env(
    grid_config: Optional[GridConfig] = None, semantics: Union[str, Semantics] = Semantics.RELEASED
) -> PogemaParallel:
    """Makes an environment with the agents `player_0`, `player_1` and so on."""
    return PogemaParallel(grid_config or GridConfig(), semantics=semantics)


class PogemaParallel(ParallelEnv):
    """An environment whose values are dictionaries keyed by agent names: a `ParallelEnv` if PettingZoo is installed.

    A step returns values of the agents that were active before it. As in POGEMA, the metrics are in the infos of
    `player_0`. If `player_0` finished before the end of the episode, the infos contain no metrics. The attribute
    `metrics` always holds the metrics of the last step, or None.

    Source: POGEMA 1.4.0, `integrations/pettingzoo.py`
    """

    def __init__(
        self,
        grid_config: GridConfig,
        render_mode: str = "ansi",
        semantics: Union[str, Semantics] = Semantics.RELEASED,
    ) -> None:
        self.metadata = {"render_modes": ["ansi"], "name": "pogema", "is_parallelizable": True}
        self.render_mode = render_mode
        self.pogema = _make_pogema(grid_config, semantics)
        self.possible_agents = [f"player_{agent}" for agent in range(self.pogema.get_num_agents())]
        self.agent_name_mapping = {name: agent for agent, name in enumerate(self.possible_agents)}
        self.agents: list[str] = []
        self.num_moves: Optional[int] = None
        self.metrics: Optional[dict[str, float]] = None
        self._are_all_terminated = self._are_all_truncated = False

    @functools.cached_property
    def observation_spaces(self) -> dict[str, gymnasium.Space]:
        """The space of each agent's observations."""
        return {name: self.pogema.observation_space for name in self.possible_agents}

    @functools.cached_property
    def action_spaces(self) -> dict[str, gymnasium.Space]:
        """The space of each agent's actions, each with its own random generator."""
        return {name: gymnasium.spaces.Discrete(self.pogema.action_space.n) for name in self.possible_agents}

    def observation_space(self, agent: str) -> gymnasium.Space:
        """Returns the space of an agent's observations.

        Errors: AssertionError for an unknown name, as in POGEMA.
        """
        return self.observation_spaces[self._known(agent)]

    def action_space(self, agent: str) -> gymnasium.Space:
        """Returns the space of an agent's actions.

        Errors: AssertionError for an unknown name, as in POGEMA.
        """
        return self.action_spaces[self._known(agent)]

    def _known(self, agent: str) -> str:
        if agent not in self.agent_name_mapping:
            expected = f"{self.possible_agents[0]!r} to {self.possible_agents[-1]!r}"
            raise AssertionError(f"agent is {agent!r}, expected a name from {expected}")
        return agent

    def reset(
        self, seed: Optional[int] = None, options: Optional[dict] = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Begins an episode and returns observations and infos by name."""
        observations, infos = self.pogema.reset(seed=seed, options=options)
        self.agents = self.possible_agents[:]
        self.num_moves, self.metrics = 0, None
        return dict(zip(self.agents, observations)), dict(zip(self.agents, infos))

    def step(
        self, actions: dict[str, int]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Plays one step; agents without an action stay, and unknown names are ignored."""
        result = self.pogema.step([actions.get(name, 0) for name in self.possible_agents])
        present = [(name, self.agent_name_mapping[name]) for name in self.agents]
        by_name: list[dict[str, Any]] = [{name: values[agent] for name, agent in present} for values in result]
        observations, rewards, terminated, truncated, infos = by_name
        self.metrics = result[4][0].get("metrics")
        self._are_all_terminated, self._are_all_truncated = all(result[2]), all(result[3])
        is_over = self._are_all_terminated or self._are_all_truncated
        active = self.pogema._started().is_active
        self.agents = [name for name, agent in present if active[agent] and not is_over]
        return observations, rewards, terminated, truncated, infos

    def state(self) -> np.ndarray:
        """See `Grid.get_state`."""
        return self.pogema.get_state()

    def render(self, mode: str = "human") -> Optional[str]:
        """Prints the map, or returns its text if `mode` is "ansi"."""
        return self.pogema.render(mode=mode)

    def close(self) -> None:
        """Does nothing."""

    @property
    def unwrapped(self) -> PogemaParallel:
        """This environment."""
        return self
