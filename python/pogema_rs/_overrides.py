"""The methods of POGEMA's environments that subclasses override.

The engine plays a step as a whole. A subclass can replace the results of a step, but no operation within it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from pogema_rs._never_called import never_called
from pogema_rs.errors import OverrideError, StateError

if TYPE_CHECKING:
    from pogema_rs._engine import Engine
    from pogema_rs.grid import Grid
    from pogema_rs.grid_config import GridConfig

_CALLED = ("_obs", "_get_agents_obs", "_pomapf_obs", "_get_infos")
# The methods that are never called, with what a user does instead.
_NOT_CALLED = {
    "move_agents": "override `step`, and change the actions before `super().step(actions)`",
    "_revert_action": "override `step`, and change the actions before `super().step(actions)`",
    "update_was_on_goal": "read `was_on_goal` after the step",
    "_generate_new_target": "give the goals as `targets_xy` or `possible_targets_xy` of the config",
    "_initialize_grid": "give the map, the starts and the goals in the config",
}


class Overridable:
    """An environment whose results a subclass can compute itself."""

    grid_config: GridConfig
    _engine: Engine
    # Whether a step takes its infos from `_get_infos`, as a reset does.
    _step_gets_infos = True
    # The methods of `_CALLED` that the class or the object overrides.
    _overridden: frozenset[str] = frozenset()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls._overridden = _overridden_by(cls)

    def _check_overrides(self) -> None:
        """Notes which methods the class overrides now; raises `OverrideError` for one that is never called."""
        # Tests patch methods into a class after it was made.
        self._overridden = _overridden_by(type(self))
        for name in _NOT_CALLED:
            if getattr(type(self), name) is not getattr(Overridable, name):
                raise self._override_error(name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _NOT_CALLED:
            raise self._override_error(name)
        super().__setattr__(name, value)
        if name in _CALLED:
            self._overridden |= {name}

    def _override_error(self, name: str) -> OverrideError:
        return never_called(type(self), name, _NOT_CALLED)

    def _started(self) -> Grid:
        raise NotImplementedError

    def _obs(self) -> list:
        """Returns the observations of all agents."""
        kind = self.grid_config.observation_type
        if kind == "default" and "_get_agents_obs" in self._overridden:
            return [self._get_agents_obs(agent) for agent in range(self.grid_config.num_agents)]
        seen = self._engine.observe()
        if kind != "default" and "_pomapf_obs" in self._overridden:
            own = self._pomapf_obs()
            shared = [{name: one[name] for name in one if name.startswith("global_")} for one in seen]
            return [{**one, **more} for one, more in zip(own, shared)]
        return seen

    def _get_agents_obs(self, agent_id: int = 0) -> np.ndarray:
        """Returns the `default` observation of one agent, even if the config names another type."""
        grid = self._started()
        windows = (grid.get_obstacles_for_agent, grid.get_positions, grid.get_square_target)
        return np.stack([window(agent_id) for window in windows])

    def _pomapf_obs(self) -> list[dict[str, Any]]:
        """Returns the `POMAPF` observations of all agents, even if the config names another type."""
        grid = self._started()
        places = zip(grid.get_agents_xy_relative(), grid.get_targets_xy_relative())
        return [
            {
                "obstacles": grid.get_obstacles_for_agent(agent),
                "agents": grid.get_positions(agent),
                "xy": xy,
                "target_xy": target_xy,
            }
            for agent, (xy, target_xy) in enumerate(places)
        ]

    def _get_infos(self) -> list[dict[str, Any]]:
        """Returns the infos of all agents, without metrics."""
        return self._engine.infos()

    def _completed(self, step: tuple) -> tuple:
        """Returns the results of a step, after replacing those that the class computes itself."""
        observations, rewards, terminated, truncated, infos = step
        # In this order, as in POGEMA.
        if "_get_infos" in self._overridden and self._step_gets_infos:
            own = self._get_infos()
            own[0].update({name: infos[0][name] for name in infos[0] if name == "metrics"})
            infos = own
        if self._overridden - {"_get_infos"}:
            observations = self._obs()
        return observations, rewards, terminated, truncated, infos

    def move_agents(self, actions: Any) -> None:
        """Raises `StateError`, because only `step` moves agents."""
        _reject("move_agents")

    def _revert_action(self, agent_idx: int, used_cells: Any, cell: Any, actions: Any) -> None:
        _reject("_revert_action")

    def update_was_on_goal(self) -> None:
        """Raises `StateError`, because only `step` sets `was_on_goal`."""
        _reject("update_was_on_goal")

    def _generate_new_target(self, agent_idx: int) -> None:
        _reject("_generate_new_target")

    def _initialize_grid(self) -> None:
        _reject("_initialize_grid")


def _overridden_by(kind: type[Overridable]) -> frozenset[str]:
    return frozenset(name for name in _CALLED if getattr(kind, name) is not getattr(Overridable, name))


def _reject(name: str) -> NoReturn:
    raise StateError(f"`{name}` is part of a step that is played as a whole; {_NOT_CALLED[name]}")
