"""What differs between the lines of POGEMA."""

from __future__ import annotations

from enum import Enum

__all__ = ["Semantics"]


class Semantics(str, Enum):
    """One of POGEMA's lines; everything that is not named here is equal in both.

    Rule: occupancy/as-released, occupancy/exact, seed/reset
    """

    RELEASED = "1.4.0"
    DEVELOPED = "2.0"

    @property
    def occupancy_is_exact(self) -> bool:
        """Whether every agent is seen; in 1.4.0 `soft` loses some of them."""
        return self is Semantics.DEVELOPED

    @property
    def reset_takes_seed(self) -> bool:
        """Whether `reset(seed=...)` chooses the episode."""
        return self is Semantics.DEVELOPED

    @property
    def reset_clears_metrics(self) -> bool:
        """Whether an episode that is left early counts no more."""
        return self is Semantics.DEVELOPED
