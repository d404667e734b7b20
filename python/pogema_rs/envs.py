"""Single environments with POGEMA's interface: lists with one entry per agent.

`pogema_v0` makes an environment with a time limit and metrics. The classes of this module have neither, as in POGEMA;
`pogema_rs.wrappers` adds them.
"""

from __future__ import annotations

import copy
import sys
import warnings
from collections.abc import Sequence
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Generic, Literal, Optional, Union, overload

import gymnasium
import numpy as np

from pogema_rs import _engine
from pogema_rs._base import ActionsSampler, PogemaBase
from pogema_rs._checks import check_semantics
from pogema_rs._forward import forwarded
from pogema_rs._goal_generators import GoalGenerators
from pogema_rs._history import Kept
from pogema_rs._read_only import FixedAttributes, ReadOnlyList
from pogema_rs._resets import Resettable
from pogema_rs._types import Cell, Infos, Observation, Step
from pogema_rs.errors import StateError
from pogema_rs.grid import Grid, GridLifeLong, foretold_goals, given_goals
from pogema_rs.grid_config import GridConfig, engine_fields
from pogema_rs.install import is_installed
from pogema_rs.semantics import Semantics
from pogema_rs.svg_animation.filmed import Filmed

__all__ = ["ActionsSampler", "Pogema", "PogemaBase", "PogemaCoopFinish", "PogemaLifeLong"]

# POGEMA's module offers these names too.
__getattr__, __dir__ = forwarded(
    __name__,
    {
        "CSRMetric": "wrappers.metrics",
        "EpLengthMetric": "wrappers.metrics",
        "ISRMetric": "wrappers.metrics",
        "LifeLongAverageThroughputMetric": "wrappers.metrics",
        "MultiTimeLimit": "wrappers.multi_time_limit",
        "NonDisappearCSRMetric": "wrappers.metrics",
        "NonDisappearEpLengthMetric": "wrappers.metrics",
        "NonDisappearISRMetric": "wrappers.metrics",
        "PersistentWrapper": "wrappers.persistence",
        "SumOfCostsAndMakespanMetric": "wrappers.metrics",
        "generate_from_possible_targets": "generator",
        "generate_new_target": "generator",
    },
)


class Pogema(FixedAttributes, Filmed, Kept, Resettable, PogemaBase, Generic[Observation]):
    """An environment; `pogema_v0` makes one with a time limit and metrics.

    A subclass may override `_obs`, `_get_agents_obs`, `_pomapf_obs` and `_get_infos`, which compute what `reset` and
    `step` return, and all public methods except `move_agents` and `update_was_on_goal`.

    Shape: the `default` observation of each agent is float32 `(3, side, side)` with the channels obstacles, agents and
    goal; `POMAPF` and `MAPF` are dictionaries. For type checkers, such an environment is a `Pogema[dict[str, Any]]`.

    Errors: those of `pogema_rs.errors`. A call that fails leaves the environment as it was. A subclass that overrides a
    method that is never called raises `OverrideError`, a `TypeError`, when an object of it is made.

    Rule: observe/default, observe/pomapf, observe/mapf

    Source: POGEMA 1.4.0, `envs.py`
    """

    _FIXED = {
        "grid": "reset with `agents_xy` and `targets_xy` to place agents",
        "semantics": "make a new environment with `pogema_v0(config, semantics=...)`",
    }
    _grid_class = Grid
    _on_target = "finish"
    semantics: Semantics
    # Whether the environment neither truncates episodes nor measures metrics.
    _is_bare = False
    # Whether a step under `soft` writes into the caller's actions.
    _rewrites_actions = False
    # How many goals of its sequence each agent has reached, if the config gives sequences.
    _num_reached: Optional[list[int]] = None
    # The generators of `random_generators`, if a user asked for them since the reset.
    _generators: Optional[GoalGenerators] = None

    def __init__(
        self,
        grid_config: Optional[GridConfig] = None,
        *,
        semantics: Union[str, Semantics] = Semantics.RELEASED,
    ) -> None:
        self._check_overrides()
        super().__init__(GridConfig(num_agents=2) if grid_config is None else grid_config)
        self.__dict__["semantics"] = check_semantics(semantics)
        self._is_bare, self._has_metrics = True, False
        self._rewrites_actions = is_installed()
        # As in POGEMA, the class determines what reaching a goal does, and the first config determines whether a
        # history is kept.
        self._fixed = {"on_target": self._on_target, "persistent": self.grid_config.persistent}
        if self._on_target == "restart" and self.grid_config.targets_xy is not None:
            self._num_reached = [0] * self.grid_config.num_agents
        self._remember_config()
        self._engine = _engine.Engine(
            engine_fields(self.grid_config, **self._fixed),
            self._registered(),
            self.semantics.occupancy_is_exact,
        )
        self.observation_space = _observation_space(self.grid_config)

    if TYPE_CHECKING:

        @property
        def unwrapped(self) -> Pogema[Observation]: ...

    # Gymnasium's types describe one agent; here each value is a list with an entry for every agent.

    @overload  # type: ignore[override]
    def reset(
        self, seed: Optional[int] = None, return_info: Literal[True] = True, options: Optional[dict] = None
    ) -> tuple[list[Observation], Infos]: ...

    @overload
    def reset(
        self, seed: Optional[int] = None, *, return_info: Literal[False], options: Optional[dict] = None
    ) -> list[Observation]: ...

    def reset(
        self, seed: Optional[int] = None, return_info: bool = True, options: Optional[dict] = None
    ) -> Union[tuple[list[Observation], Infos], list[Observation]]:
        """Begins an episode and returns the lists of observations and infos.

        With the default semantics "1.4.0", `seed` has no effect. With "2.0" it becomes the seed of the config, for this
        reset and all later ones.

        Rule: seed/reset
        """
        # If the user keeps the old grid, it must continue to show the last state of its episode.
        is_kept = self.grid is not None and _num_references(self.__dict__) > _ALONE
        last = copy.deepcopy(self._engine) if is_kept else None
        if seed is not None and self.semantics.reset_takes_seed:
            messages = self._reset_to(seed)
        else:
            messages = self._reset_engine()
        if self.grid is not None and last is not None:
            self.grid._engine = last
        self.__dict__["grid"] = grid = self._grid_class._of(self._engine, self.grid_config)
        if seed is not None:
            grid.seed = seed  # without any effect, as in POGEMA
        if self._num_reached is not None:
            self._num_reached = [0] * self.grid_config.num_agents
        self._generators = None
        for text in messages:
            warnings.warn(text, UserWarning, stacklevel=2)
        if self.semantics.reset_clears_metrics:
            self._engine.clear_metrics()
        observations = self._obs()
        return (observations, self._get_infos()) if return_info else observations

    def _reset_to(self, seed: int) -> list[str]:
        """Sets the config's seed and resets the engine; after an error, restores the old seed. Returns the warnings."""
        gymnasium.utils.seeding.np_random(seed)  # raises Gymnasium's errors
        before, self.grid_config.seed = self.grid_config.seed, seed
        try:
            messages = self._reset_engine()
        except BaseException:
            self.grid_config.seed = before
            raise
        gymnasium.Env.reset(self, seed=seed)
        self._sampler.update_seed(seed)
        return messages

    def step(  # type: ignore[override]
        self, action: Union[Sequence[int], np.ndarray]
    ) -> Step[Observation]:
        """Plays one step and returns the lists of observations, rewards, terminated, truncated and infos.

        In the step that ends an episode, `infos[0]["metrics"]` holds its metrics. The caller's actions stay unchanged;
        `executed_actions` holds the actions as carried out. After `install_as_pogema()`, the caller's actions change
        as in POGEMA: if `collision_system` is `soft`, 0 replaces each reverted move.

        Errors: `ActionCountError`, `ActionError`, `TypeError`, and `NotResetError` before the first reset. `StateError`
        if a field of the config that POGEMA reads in every step, for example `collision_system`, changed since the
        reset.

        Rule: move/actions, end/terminated, end/truncated
        """
        self._check_unchanged()
        if self.grid is not None:
            self.grid._forget()
        if self._generators is None:
            result = self._engine.step(action, self._has_metrics)
        else:
            with self._generators:
                result = self._engine.step(action, self._has_metrics)
        if self._rewrites_actions and self.grid_config.collision_system == "soft":
            self._rewrite(action)
        if self._num_reached is not None:
            for agent, on_goal in enumerate(self._engine.on_goal):
                self._num_reached[agent] += on_goal
        if self._is_bare:
            result = (*result[:3], [False] * len(result[3]), result[4])
        return self._completed(result) if self._overridden else result

    def _rewrite(self, actions: Any) -> None:
        """Writes 0, the action to stay, over each move that was not carried out; a tuple stays unchanged.

        Rule: collide/soft/rewrite
        """
        if not isinstance(actions, tuple):
            for agent, done in enumerate(self._engine.executed):
                if done == 0 and actions[agent] % 5 != 0:  # 0 and -5 stay
                    actions[agent] = 0

    @property
    def executed_actions(self) -> Optional[list[int]]:
        """What each agent did in the last step: its action if it moved, otherwise 0.

        Before the first step of an episode, and after a step back, it is `None`.
        """
        executed = self._engine.executed
        return ReadOnlyList(action or 0 for action in executed) if executed else None

    @property
    def was_on_goal(self) -> Optional[list[bool]]:
        """Whether each agent was active and on its goal after the last move; `None` before the first reset."""
        return None if self.grid is None else ReadOnlyList(self._engine.on_goal)

    def get_obstacles(self, ignore_borders: bool = False) -> np.ndarray:
        """See `Grid.get_obstacles`."""
        return self._started().get_obstacles(ignore_borders=ignore_borders)

    def get_agents_xy(self, only_active: bool = False, ignore_borders: bool = False) -> list[Cell]:
        """See `Grid.get_agents_xy`."""
        return self._started().get_agents_xy(only_active=only_active, ignore_borders=ignore_borders)

    def get_targets_xy(self, only_active: bool = False, ignore_borders: bool = False) -> list[Cell]:
        """See `Grid.get_targets_xy`."""
        return self._started().get_targets_xy(only_active=only_active, ignore_borders=ignore_borders)

    def get_agents_xy_relative(self) -> list[tuple[int, int]]:
        """See `Grid.get_agents_xy_relative`."""
        return self._started().get_agents_xy_relative()

    def get_targets_xy_relative(self) -> list[tuple[int, int]]:
        """See `Grid.get_targets_xy_relative`."""
        return self._started().get_targets_xy_relative()

    @overload
    def get_state(self, ignore_borders: bool = False, as_dict: Literal[False] = False) -> np.ndarray: ...

    @overload
    def get_state(self, ignore_borders: bool = False, *, as_dict: Literal[True]) -> dict[str, Any]: ...

    def get_state(self, ignore_borders: bool = False, as_dict: bool = False) -> Union[np.ndarray, dict[str, Any]]:
        """See `Grid.get_state`."""
        if as_dict:
            return self._started().get_state(ignore_borders=ignore_borders, as_dict=True)
        return self._started().get_state(ignore_borders=ignore_borders)


class PogemaLifeLong(Pogema[Observation]):
    """An environment with `on_target="restart"`."""

    _grid_class = GridLifeLong
    _on_target = "restart"
    _step_gets_infos = False
    # Later goals are drawn from the possible goals, and the throughput is the number of reached goals divided by
    # `max_episode_steps`.
    _LIVE = (*Pogema._LIVE, "possible_targets_xy", "targets_xy", "max_episode_steps")
    _live = itemgetter(*_LIVE)

    @property
    def random_generators(self) -> list[np.random.Generator]:
        """The generators from which goals are drawn, one for each agent; each reset makes new ones.

        Drawing from a generator, or replacing it with another one that uses PCG64, changes the later goals.

        Errors: `NotResetError`, an `AttributeError`, before the first reset. A step raises `TypeError`
        if an entry is not a generator that uses PCG64, and `ValueError` for a wrong number of generators or for one
        that two agents share.

        Rule: seed/goals
        """
        return self._goal_generators().generators

    @random_generators.setter
    def random_generators(self, generators: list[np.random.Generator]) -> None:
        self._goal_generators().generators = generators

    def _goal_generators(self) -> GoalGenerators:
        if self._generators is None:
            grid = self._started()
            self._generators = GoalGenerators(self._engine, grid._seed, len(self._engine.active))
        return self._generators

    @property
    def has_custom_sequences(self) -> bool:
        """Whether the config gave each agent a sequence of goals when the environment was made."""
        return self._num_reached is not None

    @property
    def current_goal_indices(self) -> list[int]:
        """The index of each agent's goal in its sequence of goals; 0 without sequences.

        As in POGEMA, `step_back` does not change it.
        """
        counts, sequences = self._num_reached, self.grid_config.targets_xy
        if counts is None or sequences is None:
            return ReadOnlyList([0] * self.grid_config.num_agents)
        return ReadOnlyList(count % len(sequence) for count, sequence in zip(counts, sequences))

    def get_lifelong_targets_xy(self, ignore_borders: bool = False) -> list[list[Cell]]:
        """Returns the goals that each agent gets if it reaches all of them, as POGEMA predicts them.

        Rule: goal/restart/foretold
        """
        given = given_goals(self.grid_config, ignore_borders)
        return given if given is not None else foretold_goals(self._started(), ignore_borders)


class PogemaCoopFinish(Pogema[Observation]):
    """An environment with `on_target="nothing"`."""

    _on_target = "nothing"
    _step_gets_infos = False
    is_multiagent = True

    @property
    def num_agents(self) -> int:
        """Number of agents."""
        return self.get_num_agents()


def _num_references(owner: dict[str, Any]) -> int:
    return sys.getrefcount(owner["grid"])


# The number of references to a grid that only its environment holds.
_ALONE = _num_references({"grid": object()})

_CLASSES = {"restart": PogemaLifeLong, "nothing": PogemaCoopFinish, "finish": Pogema}


def _make_pogema(grid_config: GridConfig, semantics: Union[str, Semantics] = Semantics.RELEASED) -> Pogema[Observation]:
    try:
        made = _CLASSES[grid_config.on_target]
    except (KeyError, TypeError):
        raise StateError(f"on_target is {grid_config.on_target!r}, expected one of {list(_CLASSES)}") from None
    env: Pogema[Observation] = made(grid_config, semantics=semantics)
    env._is_bare, env._has_metrics = False, not grid_config.persistent
    return env


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
