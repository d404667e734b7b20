"""The base class of POGEMA's environments."""

from __future__ import annotations

from typing import Any, Optional, cast

import gymnasium
import numpy as np

from pogema_rs._overrides import Overridable
from pogema_rs.errors import NotResetError
from pogema_rs.grid import Grid
from pogema_rs.grid_config import GridConfig


class ActionsSampler:
    """A source of random actions with its own generator.

    Rule: seed/streams
    """

    def __init__(self, num_actions: int, seed: Optional[int] = 42) -> None:
        self._num_actions = num_actions
        self.update_seed(seed)

    def update_seed(self, seed: Optional[int] = None) -> None:
        """Restarts the generator from a seed."""
        self._rnd = np.random.default_rng(seed)

    def sample_actions(self, dim: int = 1) -> np.ndarray:
        """Returns `dim` random actions.

        Shape: `(dim,)`, int64
        """
        return self._rnd.integers(self._num_actions, size=dim)


class PogemaBase(Overridable, gymnasium.Env):
    """The base class of POGEMA's environments, which does not implement `step` and `reset`."""

    metadata = {"render_modes": ["ansi"]}
    grid: Optional[Grid]

    def __init__(self, grid_config: Optional[GridConfig] = None) -> None:
        self.grid_config = GridConfig() if grid_config is None else grid_config
        self.__dict__["grid"] = None  # `Pogema` rejects assignments to its grid
        self.action_space: gymnasium.spaces.Discrete = gymnasium.spaces.Discrete(len(self.grid_config.MOVES))
        self._sampler = ActionsSampler(int(self.action_space.n), seed=self.grid_config.seed)

    def step(self, action: Any) -> Any:
        """Plays one step; a subclass implements this method."""
        raise NotImplementedError

    def reset(self, seed: Optional[int] = None, return_info: bool = False, options: Optional[dict] = None) -> Any:
        """Begins an episode; a subclass implements this method."""
        raise NotImplementedError

    def check_reset(self) -> None:
        """Raises `NotResetError` if the environment has not been reset yet."""
        if self.grid is None:
            raise NotResetError("the environment has not been reset yet; call `reset` first")

    def render(self, mode: str = "human") -> Optional[str]:
        """Prints the map and its border in colours, or returns the text if `mode` is "ansi"."""
        return self._started().render(mode=mode)

    def sample_actions(self) -> np.ndarray:
        """Returns a random action for each agent, from a generator seeded with the config's seed.

        Shape: `(agents,)`, int64
        """
        return self._sampler.sample_actions(dim=self.grid_config.num_agents)

    def get_num_agents(self) -> int:
        """Returns the number of agents."""
        return self.grid_config.num_agents

    def _started(self) -> Grid:
        self.check_reset()
        return cast(Grid, self.grid)
