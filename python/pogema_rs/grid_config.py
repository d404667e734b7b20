"""The config of an environment, with POGEMA's names."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Optional, Union

from pogema_rs import _engine, _map_text
from pogema_rs._coerce import coerced
from pogema_rs._counted import counted
from pogema_rs._models import validation_error
from pogema_rs._never_called import reject_overrides
from pogema_rs.errors import EmptyMapError, MapShapeError, MapTextError, OutsideMapError, RejectedConfigError
from pogema_rs.utils import CommonSettings

__all__ = ["GridConfig"]


_GIVEN_TWICE = "config: `map` has letters alongside agents_xy and targets_xy, expected one or the other"
# The methods that are never called, with what a user does instead.
_NOT_CALLED = {"_validate_dimension": "check the fields in `__init__`, after `super().__init__(**fields)`"}


class GridConfig(CommonSettings):
    """The complete description of an environment.

    Fields, defaults and derivations are those of POGEMA 1.4.0. Unknown fields are ignored, as in POGEMA, but trigger a
    warning that names the closest known field. A value assigned to a field later is checked at the next reset.

    Errors: `pydantic.ValidationError`, which is a ValueError, for a value of the wrong type or range; `IndexError` for
    a start or goal outside the map; `KeyError` for an unknown character in a map, and for letters in addition to other
    starts and goals; `ZeroDivisionError` for a map without cells.

    Rule: config/fields, config/size, config/map, config/agents, config/positions

    Source: POGEMA 1.4.0, `grid_config.py`, `GridConfig`
    """

    on_target: Literal["finish", "nothing", "restart"] = "finish"
    seed: Optional[int] = None
    # None, as in POGEMA: the engine derives the sides. The same holds for the number of agents, below.
    width: int = None  # type: ignore[assignment]
    height: int = None  # type: ignore[assignment]
    size: int = 8
    density: float = 0.3
    obs_radius: int = 5
    agents_xy: Optional[list] = None
    targets_xy: Optional[list] = None
    num_agents: int = None  # type: ignore[assignment]
    possible_agents_xy: Optional[list] = None
    possible_targets_xy: Optional[list] = None
    collision_system: Literal["block_both", "priority", "soft"] = "priority"
    persistent: bool = False
    observation_type: Literal["POMAPF", "MAPF", "default"] = "default"
    map: Optional[Union[list, str]] = None
    map_name: Optional[str] = None
    integration: Optional[Literal["SampleFactory", "PyMARL", "rllib", "gymnasium", "PettingZoo"]] = None
    max_episode_steps: int = 64
    auto_reset: Optional[bool] = None

    # Fields that the engine always derives. The others keep the given values, except those that a map text sets.
    _DERIVED: ClassVar[tuple[str, ...]] = ("width", "height", "size", "density", "num_agents")
    _PLACES: ClassVar[tuple[str, ...]] = ("agents_xy", "targets_xy", "possible_agents_xy", "possible_targets_xy")
    # Fields of a subclass that the engine reads, too.
    _EXTENSIONS: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        reject_overrides(cls, _NOT_CALLED)

    def __init__(self, **fields: Any) -> None:
        known, aliases = type(self).model_fields, self._aliases()
        fields = {aliases.get(name, name): value for name, value in fields.items()}
        ignores_unknown = self._extra() == "ignore"
        if ignores_unknown:
            _warn_of_unknown(fields, known)
        own = {name: value for name, value in fields.items() if name in GridConfig.model_fields}
        own = {**self._changed_defaults(), **own}
        own = self._with_derived(own, {name: fields[name] for name in self._EXTENSIONS if name in fields})
        kept = {name: value for name, value in fields.items() if name in known or not ignores_unknown}
        given = {name: alias for alias, name in aliases.items()}
        super().__init__(**{given.get(name, name): value for name, value in {**kept, **own}.items()})
        self._set_given_fields(set(kept))

    @classmethod
    def _with_derived(cls, fields: dict[str, Any], extensions: Mapping[str, Any]) -> dict[str, Any]:
        """Checks the fields of this class and returns them with those that the engine derives."""
        try:
            own = _derived(coerced(cls._with_own_map(fields)), extensions)
        except RejectedConfigError as rejected:
            field = rejected.field if rejected.field in GridConfig.model_fields else None
            raise validation_error(cls, rejected.reason, field, {**fields, **extensions}) from None
        cls._check_own_positions(own)
        return own

    @classmethod
    def _changed_defaults(cls) -> Mapping[str, Any]:
        """Returns the defaults of a subclass that differ from those of this class."""
        if cls is GridConfig:
            return {}
        ours, theirs = GridConfig._defaults(), cls._defaults()
        return {name: theirs[name] for name in ours if name in theirs and theirs[name] != ours[name]}

    @classmethod
    def _with_own_map(cls, fields: dict[str, Any]) -> dict[str, Any]:
        """Returns the fields; if a subclass overrides `str_map_to_list`, reads the map text with its method."""
        text = fields.get("map")
        if cls.str_map_to_list is GridConfig.str_map_to_list or not isinstance(text, str):
            return fields
        defaults = cls._defaults()
        rows, starts, goals, *pools = cls.str_map_to_list(text, defaults["FREE"], defaults["OBSTACLE"])
        has_both = None not in (fields.get("agents_xy"), fields.get("targets_xy"))
        fields = {**fields, "map": rows}
        if (starts or goals) and any(pools):
            raise MapTextError("config: `map` has starts and goals as well as pools, expected one or the other")
        if starts and goals:
            if has_both:
                raise MapTextError(_GIVEN_TWICE)
            fields.update(agents_xy=starts, targets_xy=goals, num_agents=len(starts))
        elif all(pools) and not has_both:
            fields.update(possible_agents_xy=pools[0], possible_targets_xy=pools[1])
        return fields

    @classmethod
    def _check_own_positions(cls, fields: Mapping[str, Any]) -> None:
        """Checks the starts and goals with `check_positions` if a subclass overrides it."""
        if cls.check_positions is GridConfig.check_positions:
            return
        for name in ("agents_xy", "targets_xy"):
            cells = fields.get(name) or []
            is_nested = bool(cells) and isinstance(cells[0][0], (list, tuple))
            for part in cells if is_nested else [cells] * bool(cells):
                cls.check_positions(part, fields["width"], fields["height"])

    def update_config(self, **fields: Any) -> None:
        """Sets some fields and derives the others again; after an error the config is unchanged.

        A new `size` discards width and height, and a new width or height discards the size.
        """
        ours, theirs = GridConfig.model_fields, type(self).model_fields
        merged = {name: getattr(self, name) for name in ours}
        if "size" in fields:
            merged.pop("width", None)
            merged.pop("height", None)
        elif "width" in fields or "height" in fields:
            merged.pop("size", None)
        of_subclass = {name: value for name, value in fields.items() if name in theirs and name not in ours}
        _warn_of_unknown({name: value for name, value in fields.items() if name not in theirs}, ours)
        changes = {name: value for name, value in fields.items() if name in ours}
        extensions = {name: fields.get(name, getattr(self, name)) for name in self._EXTENSIONS}
        updated = self._with_derived({**merged, **changes}, extensions)
        for name in ours:
            setattr(self, name, updated[name])
        for name, value in of_subclass.items():
            setattr(self, name, value)

    @staticmethod
    def str_map_to_list(
        str_map: str, free: Any, obstacle: Any
    ) -> tuple[list, list, list, Optional[list], Optional[list]]:
        """Returns the rows, the starts, the goals and the two pools of a map text.

        The pools are `None` if the text contains none of the signs `@`, `$` and `!`.

        Errors: `KeyError` for an unknown character, `AssertionError` for unequal rows or unequal numbers of letters.

        Rule: grid/text, grid/letters, grid/pools
        """
        rows, cells = _map_text.read(str_map, _map_text.SIGNS + _map_text.POOL_SIGNS)
        obstacles = [[obstacle if sign == "#" else free for sign in row] for row in rows]
        starts = _map_text.lettered(cells, _map_text.LETTERS)
        goals = _map_text.lettered(cells, _map_text.LETTERS.upper())
        if len(starts) != len(goals):
            found = f"{counted(len(starts), 'start')} and {counted(len(goals), 'goal')}"
            raise MapShapeError(f"the map has {found}, expected equal numbers")
        if not any(sign in cells for sign in _map_text.POOL_SIGNS):
            return obstacles, starts, goals, None, None
        agents, targets = (
            sorted(cell for sign in cells if sign not in others for cell in cells[sign]) for others in ("#$!", "#@!")
        )
        return obstacles, starts, goals, agents, targets

    @staticmethod
    def check_positions(v: Sequence, width: int, height: int) -> None:
        """Raises an error if a cell is not a pair of integers (`ValueError`) or not on the map (`IndexError`)."""
        for cell in v:
            is_pair = isinstance(cell, (list, tuple)) and len(cell) == 2
            if not is_pair or not all(isinstance(number, int) for number in cell):
                raise ValueError(f"the position is {cell!r}, expected a pair (row, col) of whole numbers")
            if not (0 <= cell[0] < height and 0 <= cell[1] < width):
                size = f"{counted(height, 'row')} and {counted(width, 'column')}"
                raise OutsideMapError(f"the position is {cell!r}, expected a cell of {size}")


# The engine plays the same episode in every framework.
_OF_ENGINE = tuple(name for name in GridConfig.model_fields if name not in ("integration", "auto_reset"))


def engine_fields(config: GridConfig | Mapping[str, Any], **changes: Any) -> dict[str, Any]:
    """Returns the fields of a config that the engine reads."""
    if isinstance(config, Mapping):
        own = {name: config[name] for name in _OF_ENGINE if name in config}
    else:
        # `size` is derived from width and height, and may be less than the given size.
        own = {name: config.__dict__[name] for name in (*_OF_ENGINE, *config._EXTENSIONS) if name != "size"}
    return {**own, **changes}


def _warn_of_unknown(fields: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    for name in fields:
        if name not in known:
            warnings.warn(
                f"GridConfig has no field `{name}`, which is ignored{_engine.did_you_mean(name, list(known))}",
                UserWarning,
                stacklevel=_level_of_caller(),
            )


def _level_of_caller() -> int:
    """Returns the `stacklevel` of the first caller outside of this package, for the function that calls this one."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "pogema_rs":
        frame, level = frame.f_back, level + 1
    return level


def _derived(fields: dict[str, Any], extensions: Mapping[str, Any]) -> dict[str, Any]:
    text = fields.get("map")
    if text is not None and not (text.strip() if isinstance(text, str) else any(len(row) for row in text)):
        raise EmptyMapError("config: `map` has no cells")
    if isinstance(text, str):
        _check_letters(text, fields)
    derived = _engine.derive_config(engine_fields(fields, **extensions))
    result = {**fields, **{name: derived[name] for name in GridConfig._DERIVED}}
    if isinstance(text, str):
        result["map"] = derived["map"]
        if _has_letters(text):
            result.update(agents_xy=derived["agents_xy"], targets_xy=derived["targets_xy"])
        elif _gives_pools(text) and (fields.get("agents_xy") is None or fields.get("targets_xy") is None):
            for name in ("possible_agents_xy", "possible_targets_xy"):
                result[name] = [tuple(cell) for cell in derived[name]]
    return result


def _has_letters(text: str) -> bool:
    return any(character.isascii() and character.isalpha() for character in text)


def _gives_pools(text: str) -> bool:
    """Returns whether a map text contains `@`, `$` or `!`, and both of its pools have cells."""
    return any(sign in text for sign in "@$!") and all(any(sign in text for sign in pool) for pool in (".@", ".$"))


def _check_letters(text: str, fields: Mapping[str, Any]) -> None:
    has_letters = _has_letters(text)
    if has_letters and any(character in "@$!" for character in text):
        raise MapTextError("config: `map` has both letters and `@`, `$` or `!`, expected one or the other")
    if has_letters and fields.get("agents_xy") is not None and fields.get("targets_xy") is not None:
        raise MapTextError(_GIVEN_TWICE)
