"""Mazes whose walls tend to be straight."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from pogema_rs import _engine
from pogema_rs._optional import import_optional
from pogema_rs.toolbox.generators.generator_utils import drawn_seed, generate_and_save, maps_dict_to_yaml

__all__ = ["MazeGenerator", "MazeRangeSettings", "generate_and_save_mazes", "maps_dict_to_yaml"]


@dataclass
class MazeRangeSettings:
    """The ranges from which the settings of a maze are drawn; both ends of a range of integers are included.

    Source: pogema-toolbox 0.1.1, `maze_generator.py`, `MazeRangeSettings`
    """

    width_min: int = 5
    width_max: int = 9
    height_min: int = 5
    height_max: int = 9
    obstacle_density_min: float = 0.0
    obstacle_density_max: float = 1.0
    wall_components_min: int = 1
    wall_components_max: int = 8
    go_straight_min: float = 0.75
    go_straight_max: float = 0.85

    def sample(self, seed: Optional[int] = None) -> dict[str, Any]:
        """Draws the settings of one maze."""
        rng = np.random.default_rng(seed)
        return {
            "width": rng.integers(self.width_min, self.width_max + 1),
            "height": rng.integers(self.height_min, self.height_max + 1),
            "obstacle_density": rng.uniform(self.obstacle_density_min, self.obstacle_density_max),
            "wall_components": rng.integers(self.wall_components_min, self.wall_components_max + 1),
            "go_straight": rng.uniform(self.go_straight_min, self.go_straight_max),
            "seed": seed,
        }


class MazeGenerator:
    """A generator of mazes; its methods need no instance.

    Source: pogema-toolbox 0.1.1, `maze_generator.py`, `MazeGenerator`
    """

    @classmethod
    def array_to_string(cls, array_maze: Any) -> str:
        """Returns the text of a map, in which 1 is an obstacle."""
        return "\n".join("".join("#" if cell == 1 else "." for cell in row) for row in array_maze)

    @classmethod
    def string_to_array(cls, string_maze: str) -> np.ndarray:
        """Returns a map text as an array, 1 for an obstacle.

        Shape: `(height, width)`, int64
        """
        return np.array([[int(sign == "#") for sign in line] for line in string_maze.split("\n")])

    @classmethod
    def generate_maze(
        cls,
        width: int,
        height: int,
        obstacle_density: float,
        wall_components: int,
        go_straight: float,
        seed: Optional[int] = None,
    ) -> str:
        """Returns the text of a maze; an even side is one cell longer in the maze.

        As in pogema-toolbox, the density may be negative or above 1, and the number of wall components may be any
        integer.

        Errors: `AssertionError` for a side out of range, `ValueError` for a density that is not finite or needs more
        than 10^9 pieces of wall, and for a `go_straight` or seed out of range.
        """
        sides = (width, height)
        maze = _engine.maze(sides, obstacle_density, wall_components, go_straight, drawn_seed(seed))
        return cls.array_to_string(cls.string_to_array(maze))

    @classmethod
    def draw(cls, mazes: Union[str, Iterable[str]]) -> None:
        """Shows mazes one after the other in a window of Matplotlib."""
        pyplot = import_optional("matplotlib.pyplot", "`MazeGenerator.draw`")
        for maze in [mazes] if isinstance(mazes, str) else mazes:
            pyplot.imshow(cls.string_to_array(maze))
            pyplot.pause(0.1)
        pyplot.show()

    @staticmethod
    def generate_maze_from_ranges(seed: Optional[int] = None) -> str:
        """Returns the text of a maze with settings drawn from the default ranges."""
        return MazeGenerator.generate_maze(**MazeRangeSettings().sample(seed))


def generate_and_save_mazes(name_prefix: str, seed_range: Iterable[int]) -> None:
    """Writes a maze for each seed to `<name_prefix>.yaml`."""
    generate_and_save(name_prefix, seed_range, MazeGenerator.generate_maze_from_ranges)
