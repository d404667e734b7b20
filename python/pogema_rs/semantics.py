"""Differences between POGEMA's release lines."""

from __future__ import annotations

from enum import Enum

__all__ = ["Semantics"]


class Semantics(str, Enum):
    """One of POGEMA's release lines; they are identical except for the properties here.

    Rule: occupancy/as-released, occupancy/exact, seed/reset
    """

    RELEASED = "1.4.0"
    DEVELOPED = "2.0"

    @property
    def occupancy_is_exact(self) -> bool:
        """Whether every agent is seen; in 1.4.0 `soft` collisions make some agents invisible."""
        return self is Semantics.DEVELOPED

    @property
    def reset_takes_seed(self) -> bool:
        """Whether `reset(seed=...)` chooses the episode."""
        return self is Semantics.DEVELOPED

    @property
    def reset_clears_metrics(self) -> bool:
        """Whether a reset clears the counters of an episode that did not end."""
        return self is Semantics.DEVELOPED

    @property
    def elapsed_needs_persistent(self) -> bool:
        """Whether the elapsed steps can be set only with `persistent` in the config."""
        return self is Semantics.RELEASED

    @property
    def deprecates_monitor(self) -> bool:
        """Whether `AnimationMonitor` is deprecated, because every environment has its methods."""
        return self is Semantics.DEVELOPED
