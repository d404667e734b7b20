"""Checks maps with starts and goals, and renders them as text with terminal colours."""

from __future__ import annotations

import string
from collections.abc import Mapping, Sequence
from typing import Any, Literal, Optional, Union

from gymnasium.utils import colorize

from pogema_rs._counted import counted
from pogema_rs._models import Model
from pogema_rs.errors import BlockedCellError, InstanceError

__all__ = ["AgentsTargetsSizeError", "CommonSettings", "check_grid", "grid_to_str", "render_grid"]

_NAMES = string.digits + string.ascii_letters + string.punctuation


class CommonSettings(Model):
    """The fields that all configs have."""

    MOVES: list = [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]]
    FREE: Literal[0] = 0
    OBSTACLE: Literal[1] = 1
    empty_outside: bool = True


class AgentsTargetsSizeError(ValueError):
    """Starts without goals, or goals without starts."""


def check_grid(obstacles: Any, agents_xy: Optional[Sequence], targets_xy: Optional[Sequence]) -> None:
    """Raises an error if starts and goals do not fit each other or the map.

    Errors: `AgentsTargetsSizeError` if only one of them is given, `IndexError` for unequal numbers, `ValueError` for
    two equal starts, `KeyError` for a start or goal on an obstacle.

    Source: POGEMA 1.4.0, `utils.py`, `check_grid`
    """
    if bool(agents_xy) != bool(targets_xy):
        given, missing = ("agents_xy", "targets_xy") if agents_xy else ("targets_xy", "agents_xy")
        raise AgentsTargetsSizeError(f"`{given}` is given without `{missing}`, expected both or neither")
    if not agents_xy or not targets_xy:
        return
    if len(agents_xy) != len(targets_xy):
        found = f"{counted(len(agents_xy), 'start')} and {counted(len(targets_xy), 'goal')}"
        raise InstanceError(f"found {found}, expected equal numbers")
    starts = [tuple(start) for start in agents_xy]
    for agent, start in enumerate(starts):
        if start in starts[:agent]:
            agents = f"agents {starts.index(start)} and {agent}"
            raise InstanceError(f"{agents} both start at {start}, expected different cells")
    for start, goal in zip(starts, targets_xy):
        for what, cell in (("start", start), ("goal", tuple(goal))):
            if obstacles[cell]:
                raise BlockedCellError(f"the {what} {cell} is an obstacle, expected a free cell")


def grid_to_str(grid: Any) -> str:
    """Returns a map as lines of `.` and `#`."""
    return "\n".join("".join("#" if cell else "." for cell in row) for row in grid)


def render_grid(
    obstacles: Any,
    positions_xy: Optional[Sequence] = None,
    targets_xy: Optional[Sequence] = None,
    is_active: Union[Mapping[int, bool], Sequence[bool], None] = None,
    mode: str = "human",
) -> Optional[str]:
    """Prints a map with its agents and goals, or returns the text with `mode="ansi"`.

    An agent hides a goal on the same cell. Of several agents or goals on one cell, the last one is shown.

    Source: POGEMA 1.4.0, `utils.py`, `render_grid`
    """
    agents, goals = positions_xy or [], targets_xy or []
    active = is_active if is_active is not None else [True] * max(len(agents), len(goals))
    shown = {}
    for form, places in (("goal", goals), ("agent", agents)):
        shown.update({tuple(place): (form, index) for index, place in enumerate(places) if active[index]})
    lines = []
    for row, cells in enumerate(obstacles):
        lines.append("".join(_cell(bool(cell), shown.get((row, col))) for col, cell in enumerate(cells)))
    text = "\n".join(lines) + "\n"
    if mode != "human":
        return text
    print(text, end="")
    return None


def _cell(is_obstacle: bool, what: Optional[tuple[str, int]]) -> str:
    if is_obstacle:
        return colorize("   ", color="cyan", bold=False, highlight=True)
    if what is None:
        return colorize(" . ", "white", highlight=False)
    form, index = what
    name = _NAMES[index % len(_NAMES)]
    if form == "agent":
        return colorize(f" {name} ", color="red", bold=True, highlight=False)
    return colorize(f"|{name}|", "white", highlight=False)
