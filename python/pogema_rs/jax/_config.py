"""The static sizes and rules of environments on a device."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax

from pogema_rs import _engine
from pogema_rs._checks import LARGEST_RADIUS, check_whole

__all__ = ["Config"]

# Cells are int32 pairs, and one int32 addresses the grid.
INT32_MAX = 2**31 - 1
COLLISIONS = tuple(_engine.WORDS["collision_system"])
ON_GOAL = tuple(_engine.WORDS["on_target"])
OCCUPANCIES = ("as_released", "exact")
REWARDS = ("own", "shared")


@jax.tree_util.register_static
@dataclasses.dataclass(frozen=True)
class Config:
    """The sizes and rules that a compiled function is specialised for.

    `num_agents`, `height` and `width` are the largest that an instance may have; smaller instances are padded. The
    step limit is data, not part of this class, so that a new limit does not trigger a compilation.

    Errors: TypeError or ValueError that names the first wrong field.
    """

    num_agents: int
    height: int
    width: int
    radius: int = 5
    collision: str = "priority"
    on_goal: str = "finish"
    occupancy: str = "as_released"
    rewards: str = "own"

    def __post_init__(self) -> None:
        for name in ("num_agents", "height", "width", "radius"):
            most = {"num_agents": INT32_MAX // 4, "radius": LARGEST_RADIUS}.get(name)
            # Products of NumPy's fixed-size integers can overflow.
            object.__setattr__(self, name, check_whole(name, getattr(self, name), 1, most))
        rows, columns = self.grid
        if rows * columns > INT32_MAX:
            reason = f"a grid has at most {INT32_MAX} cells, with its border of {self.radius} cells"
            raise ValueError(f"height is {self.height} and width is {self.width}: {reason}")
        check_word("collision", self.collision, COLLISIONS)
        check_word("on_goal", self.on_goal, ON_GOAL)
        check_word("occupancy", self.occupancy, OCCUPANCIES)
        check_word("rewards", self.rewards, REWARDS)

    @property
    def side(self) -> int:
        """The side of a window. Units: cells."""
        return 2 * self.radius + 1

    @property
    def grid(self) -> tuple[int, int]:
        """The numbers of rows and columns of the largest map with its border. Rule: border/ring"""
        return self.height + 2 * self.radius, self.width + 2 * self.radius

    @property
    def words(self) -> int:
        """The number of 32-bit words of a row of the grid, including one extra word at the end for windows."""
        return -(-self.grid[1] // 32) + 1

    @property
    def window_words(self) -> int:
        """The number of 32-bit words of a row of a window."""
        return -(-self.side // 32)


def check_word(name: str, value: Any, known: tuple[str, ...]) -> None:
    """Checks that an argument is one of the known words."""
    if value not in known:
        hint = _engine.did_you_mean(str(value), list(known))
        raise ValueError(f"{name} is {value!r}, expected one of {', '.join(map(repr, known))}{hint}")
