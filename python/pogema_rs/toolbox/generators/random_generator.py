"""Maps with obstacles at random cells."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np

from pogema_rs import _engine
from pogema_rs.toolbox.generators.generator_utils import drawn_seed, generate_and_save, maps_dict_to_yaml

__all__ = ["MapRangeSettings", "generate_and_save_maps", "generate_map", "maps_dict_to_yaml"]


@dataclass
class MapRangeSettings:
    """The ranges from which the settings of a map are drawn; both ends of a range of integers are included.

    Source: pogema-toolbox 0.1.1, `random_generator.py`, `MapRangeSettings`
    """

    width_min: int = 17
    width_max: int = 21
    height_min: int = 17
    height_max: int = 21
    obstacle_density_min: float = 0.1
    obstacle_density_max: float = 0.3

    def sample(self, seed: Optional[int] = None) -> dict[str, Any]:
        """Draws the settings of one map."""
        rng = np.random.default_rng(seed)
        return {
            "width": rng.integers(self.width_min, self.width_max + 1),
            "height": rng.integers(self.height_min, self.height_max + 1),
            "obstacle_density": rng.uniform(self.obstacle_density_min, self.obstacle_density_max),
            "seed": seed,
        }


def generate_map(settings: Mapping[str, Any]) -> str:
    """Returns the text of a map with the settings `width`, `height`, `obstacle_density` and `seed`.

    Errors: `ValueError` for a density outside 0 to 1 and for a seed out of range, `AssertionError` for a side out of
    range.

    Source: pogema-toolbox 0.1.1, `random_generator.py`, `generate_map`
    """
    sides = (settings["width"], settings["height"])
    return _engine.random_map(sides, settings["obstacle_density"], drawn_seed(settings["seed"]))


def generate_and_save_maps(name_prefix: str, seed_range: Iterable[int]) -> None:
    """Writes a map for each seed to `<name_prefix>.yaml`."""
    generate_and_save(name_prefix, seed_range, lambda seed: generate_map(MapRangeSettings().sample(seed)))
