"""Renders maps as text with terminal colours."""

from __future__ import annotations

import string
from collections.abc import Mapping, Sequence
from typing import Any, Optional, Union

from gymnasium.utils import colorize

__all__ = ["grid_to_str", "render_grid"]

_NAMES = string.digits + string.ascii_letters + string.punctuation


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
