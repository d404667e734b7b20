"""Mazes with straight walls."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from pogema_rs.toolbox._optional import required
from pogema_rs.toolbox.generators.generator_utils import check_sides, generate_and_save, maps_dict_to_yaml

__all__ = ["MazeGenerator", "MazeRangeSettings", "generate_and_save_mazes", "maps_dict_to_yaml"]


@dataclass
class MazeRangeSettings:
    """The ranges, both ends included, from which the settings of a maze are drawn.

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

    @staticmethod
    def select_random_neighbor(
        x: int,
        y: int,
        maze_grid: Any,
        maze_shape: Sequence[int],
        rng: np.random.Generator,
        last_direction: tuple[int, int],
        go_straight: float,
    ) -> tuple[Optional[int], Optional[int], tuple[int, int]]:
        """Draws the next end of a wall, two cells away, and returns its column, its row and the direction (row, col).

        The direction of the last piece has the weight `go_straight`, any other one `1 - go_straight`. If no direction
        stays on the grid, returns `None` for the column and the row.
        """
        num_rows, num_cols = maze_shape
        stays = {(0, -2): x > 1, (0, 2): x < num_cols - 2, (-2, 0): y > 1, (2, 0): y < num_rows - 2}
        directions = [direction for direction, is_inside in stays.items() if is_inside]
        if not directions:
            return None, None, last_direction
        weights = [go_straight if direction == last_direction else 1 - go_straight for direction in directions]
        if all(weight == go_straight for weight in weights):
            shares = [1 / len(weights)] * len(weights)
        else:
            total = sum(weights)
            shares = [weight / total for weight in weights]
        down, right = directions[rng.choice(range(len(directions)), p=shares)]
        return x + right, y + down, (down, right)

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

        Errors: `AssertionError` for a side that is not positive.
        """
        check_sides(width, height)
        # Walls lie on even rows and columns; the ring around the grid is removed at the end.
        grid = np.ones((height // 2 * 2 + 3, width // 2 * 2 + 3), dtype=int)
        grid[1:-1, 1:-1] = 0
        rng = np.random.default_rng(seed)
        num_walls = int(grid.shape[0] * grid.shape[1] * obstacle_density // wall_components) if wall_components else 0
        for _ in range(num_walls):
            x = int(rng.integers(0, grid.shape[1] // 2)) * 2
            y = int(rng.integers(0, grid.shape[0] // 2)) * 2
            grid[y, x] = 1
            direction = (0, 0)
            for _ in range(wall_components):
                next_x, next_y, direction = cls.select_random_neighbor(
                    x, y, grid, grid.shape, rng, direction, go_straight
                )
                if next_x is not None and next_y is not None and grid[next_y, next_x] == 0:
                    grid[next_y, next_x] = grid[(y + next_y) // 2, (x + next_x) // 2] = 1
                    x, y = next_x, next_y
        return cls.array_to_string(grid[1:-1, 1:-1])

    @classmethod
    def draw(cls, mazes: Union[str, Iterable[str]]) -> None:
        """Shows mazes one after the other in a window of Matplotlib."""
        pyplot = required("matplotlib.pyplot", "`MazeGenerator.draw`")
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
