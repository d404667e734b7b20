"""Types that several modules name in their signatures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np

__all__ = ["Cell", "Infos", "Observation", "Step"]

# A position (row, col). A tuple counts from the corner of the border, a list from the corner of the map.
Cell = Sequence[int]
# What an agent receives besides its observation; entry 0 also holds the metrics of an episode that ended.
Infos = list[dict[str, Any]]

# What one agent observes: a dictionary for the observation types `POMAPF` and `MAPF`, otherwise an array.
if TYPE_CHECKING:
    from typing_extensions import TypeVar

    Observation = TypeVar("Observation", bound=Union[np.ndarray, dict[str, Any]], default=np.ndarray)
else:
    from typing import TypeVar

    Observation = TypeVar("Observation")

# Observations, rewards, terminated, truncated and infos, each with one entry per agent.
Step = tuple[list[Observation], list[float], list[bool], list[bool], Infos]
