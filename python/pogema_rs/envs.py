"""Single environments with POGEMA's interface: lists with one entry per agent."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Literal, Optional, Union, cast, overload

import gymnasium
import numpy as np

from pogema_rs import _engine, grid_registry
from pogema_rs.errors import ElapsedStepsError, NoHistoryError, NotKeptError, NotResetError, StateError
from pogema_rs.grid import Grid, GridLifeLong, foretold_goals, given_goals
from pogema_rs.grid_config import GridConfig, engine_fields
from pogema_rs.semantics import Semantics
from pogema_rs.svg_animation.filmed import Filmed
from pogema_rs.wrappers import persistence

__all__ = ["ActionsSampler", "Pogema", "PogemaBase", "PogemaCoopFinish", "PogemaLifeLong"]

_PLACES = ("agents_xy", "targets_xy", "possible_agents_xy", "possible_targets_xy")


def _differ(one: Any, other: Any) -> bool:
    """Returns whether two values of a field differ; arrays, which NumPy compares by element, count as different."""
    try:
        return bool(one != other)
    except ValueError:
        return True


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


class PogemaBase(Filmed, gymnasium.Env):
    """The base class of POGEMA's environments."""


class Pogema(PogemaBase):
    """An environment with its time limit and metrics; `pogema_v0` makes one.

    Shape: the `default` observation of each agent is float32 `(3, side, side)` with the channels obstacles, agents and
    goal; `POMAPF` and `MAPF` are dictionaries.

    Errors: those of `pogema_rs.errors`. A call that fails leaves the environment as it was.

    Rule: observe/default, observe/pomapf, observe/mapf

    Source: POGEMA 1.4.0, `envs.py`
    """

    metadata = {"render_modes": ["ansi"]}
    _grid_class = Grid

    def __init__(
        self,
        grid_config: Optional[GridConfig] = None,
        *,
        semantics: Union[str, Semantics] = Semantics.RELEASED,
    ) -> None:
        self.grid_config = GridConfig(num_agents=2) if grid_config is None else grid_config
        self.semantics = Semantics(semantics)
        self.grid: Optional[Grid] = None
        self._has_metrics = not self.grid_config.persistent
        # As in POGEMA, the time limit and the class follow from the config that the environment was made with.
        self._fixed = {"on_target": self.grid_config.on_target, "persistent": self.grid_config.persistent}
        self._remember_config()
        self._engine = _engine.Engine(
            engine_fields(self.grid_config, **self._fixed),
            self._registered(),
            self.semantics.occupancy_is_exact,
        )
        self.action_space: gymnasium.spaces.Discrete = gymnasium.spaces.Discrete(len(self.grid_config.MOVES))
        self.observation_space = _observation_space(self.grid_config)
        self._sampler = ActionsSampler(int(self.action_space.n), seed=self.grid_config.seed)

    # POGEMA's users change or replace the config between two resets. The values of the last reset are kept, so that an
    # unchanged config is not read again.

    def _remember_config(self) -> None:
        fields = self.grid_config.__dict__
        self._last_config = self.grid_config
        self._last_fields = {name: fields[name] for name in GridConfig.model_fields}
        self._last_places = {name: [*fields[name]] for name in _PLACES if fields[name] is not None}

    def _registered(self) -> Optional[str]:
        return grid_registry.map_text(self.grid_config.map_name)

    def _begin_episode(self) -> None:
        fields, last = self.grid_config.__dict__, self._last_fields
        is_same = self.grid_config is self._last_config
        changed = [name for name in last if fields[name] is not last[name] and _differ(fields[name], last[name])]
        changed += [name for name, places in self._last_places.items() if _differ(fields[name], places)]
        if is_same and all(name == "seed" for name in changed):
            if changed:
                self._engine.reseed({"seed": self.grid_config.seed})
            messages = self._engine.reset()
        else:
            fixed: dict[str, Any] = dict(self._fixed)
            pools = self._engine.pools()
            if is_same and pools and not {"possible_agents_xy", "possible_targets_xy", "map"} & set(changed):
                fixed.update(possible_agents_xy=pools[0], possible_targets_xy=pools[1])
            messages = self._engine.reset(engine_fields(self.grid_config, **fixed), self._registered())
        if changed or not is_same:
            self._remember_config()
        for text in messages:
            warnings.warn(text, UserWarning, stacklevel=3)
        self.grid = self._grid_class._of(self._engine, self.grid_config)

    # Gymnasium's types describe one agent; here each value is a list with an entry for every agent.

    @overload  # type: ignore[override]
    def reset(
        self, seed: Optional[int] = None, return_info: Literal[True] = True, options: Optional[dict] = None
    ) -> tuple[list, list]: ...

    @overload
    def reset(
        self, seed: Optional[int] = None, *, return_info: Literal[False], options: Optional[dict] = None
    ) -> list: ...

    def reset(
        self, seed: Optional[int] = None, return_info: bool = True, options: Optional[dict] = None
    ) -> Union[tuple[list, list], list]:
        """Begins an episode and returns the lists of observations and infos.

        With the default semantics "1.4.0", `seed` has no effect. With "2.0" it becomes the seed of the config, for this
        reset and all later ones.

        Rule: seed/reset
        """
        if seed is not None and self.semantics.reset_takes_seed:
            super().reset(seed=seed)
            self.grid_config.seed = seed
            self._sampler.update_seed(seed)
        self._begin_episode()
        if self.semantics.reset_clears_metrics:
            self._engine.clear_metrics()
        observations = self._engine.observe()
        return (observations, self._engine.infos()) if return_info else observations

    def step(  # type: ignore[override]
        self, action: Sequence[int]
    ) -> tuple[list, list[float], list[bool], list[bool], list[dict]]:
        """Plays one step and returns the lists of observations, rewards, terminated, truncated and infos.

        In the step that ends an episode `infos[0]["metrics"]` holds its metrics. The caller's actions stay unchanged;
        POGEMA writes into them if `collision_system` is `soft`.

        Errors: `ActionCountError`, `ActionError`, `TypeError`, and `NotResetError` before the first reset.

        Rule: move/actions, end/terminated, end/truncated
        """
        return self._engine.step(action, self._has_metrics)

    @property
    def was_on_goal(self) -> Optional[list[bool]]:
        """Whether each agent was active and on its goal after the last move; `None` before the first reset."""
        return None if self.grid is None else self._engine.on_goal

    def check_reset(self) -> None:
        """Raises `NotResetError` if the environment was not reset yet."""
        if self.grid is None:
            raise NotResetError("the environment was not reset yet")

    def render(self, mode: str = "human") -> Optional[str]:
        """Prints the map with its border in colours, or returns the text if `mode` is "ansi"."""
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

    def get_obstacles(self, ignore_borders: bool = False) -> np.ndarray:
        """See `Grid.get_obstacles`."""
        return self._started().get_obstacles(ignore_borders=ignore_borders)

    def get_agents_xy(self, only_active: bool = False, ignore_borders: bool = False) -> list:
        """See `Grid.get_agents_xy`."""
        return self._started().get_agents_xy(only_active=only_active, ignore_borders=ignore_borders)

    def get_targets_xy(self, only_active: bool = False, ignore_borders: bool = False) -> list:
        """See `Grid.get_targets_xy`."""
        return self._started().get_targets_xy(only_active=only_active, ignore_borders=ignore_borders)

    def get_agents_xy_relative(self) -> list:
        """See `Grid.get_agents_xy_relative`."""
        return self._started().get_agents_xy_relative()

    def get_targets_xy_relative(self) -> list:
        """See `Grid.get_targets_xy_relative`."""
        return self._started().get_targets_xy_relative()

    def get_state(self, ignore_borders: bool = False, as_dict: bool = False) -> Any:
        """See `Grid.get_state`."""
        return self._started().get_state(ignore_borders=ignore_borders, as_dict=as_dict)

    def step_back(self) -> bool:
        """Takes the last step back and returns whether there was one; needs `persistent` in the config.

        Rule: history/step-back
        """
        self._check_kept()
        return self._engine.step_back()

    def _check_kept(self) -> None:
        if not self._fixed["persistent"]:
            raise NotKeptError("steps are kept only with persistent=True in the config")
        if self.grid is None:
            raise NoHistoryError("the environment was not reset yet")

    def set_elapsed_steps(self, elapsed_steps: int) -> None:
        """Sets how many steps count towards the time limit so far; needs `persistent` in the config.

        Errors: `ValueError` for a config that is not persistent, and for a number below 0.
        """
        if not self._fixed["persistent"]:
            raise NotKeptError("elapsed steps can be set only with persistent=True in the config")
        if elapsed_steps < 0:
            raise ElapsedStepsError(f"elapsed_steps is {elapsed_steps}, expected 0 or more")
        self._engine.elapsed = elapsed_steps

    def get_history(self) -> list:
        """Returns for each agent its `AgentState` after the reset and after each later step that changed it.

        Needs `persistent` in the config.

        Rule: history/changes
        """
        self._check_kept()
        return persistence.kept(self._engine, self.grid_config.obs_radius)

    def get_full_history(self) -> list:
        """Returns for each agent its `AgentState` at every step so far, including the reset."""
        num_steps = self._engine.num_steps
        return [persistence.at_every_step(changes, num_steps) for changes in self.get_history()]

    agent_state_to_full_list = staticmethod(persistence.at_every_step)
    decompress_history = staticmethod(persistence.PersistentWrapper.decompress_history)


class PogemaLifeLong(Pogema):
    """An environment with `on_target="restart"`."""

    _grid_class = GridLifeLong

    def get_lifelong_targets_xy(self, ignore_borders: bool = False) -> list:
        """Returns the goals that each agent gets if it reaches all of them, as POGEMA predicts them.

        Rule: goal/restart/foretold
        """
        given = given_goals(self.grid_config, ignore_borders)
        return given if given is not None else foretold_goals(self._started(), ignore_borders)


class PogemaCoopFinish(Pogema):
    """An environment with `on_target="nothing"`."""

    is_multiagent = True

    @property
    def num_agents(self) -> int:
        """Number of agents."""
        return self.get_num_agents()


_CLASSES = {"restart": PogemaLifeLong, "nothing": PogemaCoopFinish, "finish": Pogema}


def _make_pogema(grid_config: GridConfig, semantics: Union[str, Semantics] = Semantics.RELEASED) -> Pogema:
    try:
        made = _CLASSES[grid_config.on_target]
    except (KeyError, TypeError):
        raise StateError(f"on_target is {grid_config.on_target!r}, expected one of {list(_CLASSES)}") from None
    return made(grid_config, semantics=semantics)


def _observation_space(grid_config: GridConfig) -> gymnasium.Space:
    side = 2 * grid_config.obs_radius + 1
    box = gymnasium.spaces.Box
    if grid_config.observation_type == "default":
        return box(-1.0, 1.0, shape=(3, side, side))
    return gymnasium.spaces.Dict(
        obstacles=box(0.0, 1.0, shape=(side, side)),
        agents=box(0.0, 1.0, shape=(side, side)),
        xy=box(low=-1024, high=1024, shape=(2,), dtype=int),
        target_xy=box(low=-1024, high=1024, shape=(2,), dtype=int),
    )
