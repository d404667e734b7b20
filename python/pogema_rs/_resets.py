"""Resets of an environment whose config may have changed since the last reset."""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any, ClassVar, Optional

import numpy as np

from pogema_rs import grid_registry
from pogema_rs.errors import StateError
from pogema_rs.grid_config import GridConfig, engine_fields

if TYPE_CHECKING:
    from pogema_rs._engine import Engine
    from pogema_rs.grid import Grid


def _differ(one: Any, other: Any) -> bool:
    """Returns whether two values of a field differ; arrays, which NumPy compares by element, count as different."""
    try:
        return bool(one != other)
    except ValueError:
        return True


def _copied(value: Any) -> Any:
    """Returns a copy of the lists and tuples that a field consists of, and any other value unchanged."""
    if not isinstance(value, (list, tuple)) or not value:
        return value
    # All items of a field are lists, or none is.
    if isinstance(value[0], (list, tuple)):
        return (list if isinstance(value, list) else tuple)(_copied(item) for item in value)
    return value[:]


def _is_same_map(one: Optional[np.ndarray], other: Optional[np.ndarray]) -> bool:
    return one is other or (one is not None and other is not None and np.array_equal(one, other))


class Resettable:
    """An environment that begins episodes with the current values of its config.

    POGEMA's users change or replace the config between two resets. The values of the last reset are kept, so that an
    unchanged config is not read again.
    """

    grid_config: GridConfig
    grid: Optional[Grid]
    _engine: Engine
    # The fields that follow from the config with which the environment was made.
    _fixed: dict[str, Any]
    # The fields that POGEMA reads in every step. In POGEMA, a new value would take effect in the middle of an episode.
    _LIVE: ClassVar[tuple[str, ...]] = (
        *("collision_system", "obs_radius", "observation_type", "num_agents", "FREE", "OBSTACLE"),
    )
    _live = itemgetter(*_LIVE)
    _live_values: Optional[tuple[Any, ...]] = None
    # The obstacles of the registered map that the config names.
    _last_obstacles: Optional[np.ndarray] = None

    def _check_unchanged(self) -> None:
        """Raises `StateError` if a field that POGEMA reads in every step changed since the last reset."""
        fields = self.grid_config.__dict__
        last = self._live_values
        # An environment that an earlier release saved has no `_live_values`.
        if last is None or self.grid is None or not _differ(self._live(fields), last):
            return
        for name, value in zip(self._LIVE, last):
            if _differ(fields[name], value):
                raise StateError(
                    f"`{name}` of the config changed from `{value}` to `{fields[name]}`; call `reset` first"
                )

    def _remember_config(self) -> None:
        fields = self.grid_config.__dict__
        self._last_config = self.grid_config
        # Users change lists in place, for example a row of `map`.
        self._last_fields = {name: _copied(fields[name]) for name in GridConfig.model_fields}
        # Copies of lists, such as `targets_xy`, because users also change these in place.
        self._live_values = tuple(_copied(value) for value in self._live(fields))
        obstacles = grid_registry.obstacles(self.grid_config.map_name)
        self._last_obstacles = None if obstacles is None else obstacles.copy()

    def _registered(self) -> Optional[str]:
        return grid_registry.map_text(self.grid_config.map_name)

    def _reset_engine(self) -> list[str]:
        """Resets the engine, with a new config if the fields changed, and returns its warnings."""
        fields, last = self.grid_config.__dict__, self._last_fields
        is_same = self.grid_config is self._last_config
        changed = [name for name in last if fields[name] is not last[name] and _differ(fields[name], last[name])]
        if not _is_same_map(grid_registry.obstacles(self.grid_config.map_name), self._last_obstacles):
            changed.append("map_name")
        if is_same and all(name == "seed" for name in changed):
            messages = self._reset_with_seed(last["seed"]) if changed else self._engine.reset()
        else:
            fixed: dict[str, Any] = dict(self._fixed)
            pools = self._engine.pools()
            if is_same and pools and not {"possible_agents_xy", "possible_targets_xy", "map"} & set(changed):
                fixed.update(possible_agents_xy=pools[0], possible_targets_xy=pools[1])
            messages = self._engine.reset(engine_fields(self.grid_config, **fixed), self._registered())
        if changed or not is_same or self._live_values is None:
            self._remember_config()
        return messages

    def _reset_with_seed(self, last: Optional[int]) -> list[str]:
        """Resets the engine with the seed of the config; after an error, restores `last`, its previous seed."""
        try:
            self._engine.reseed({"seed": self.grid_config.seed})
            return self._engine.reset()
        except BaseException:
            self._engine.reseed({"seed": last})
            raise
