"""Collects the metrics of an episode."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

__all__ = ["ResultsHolder"]


class ResultsHolder:
    """A collector of the metrics in the infos of an episode."""

    def __init__(self) -> None:
        self.results: dict[str, Any] = {}

    def after_step(self, infos: Sequence[dict[str, Any]]) -> None:
        """Adds the metrics in the infos of a step."""
        self.results.update(infos[0].get("metrics", {}))

    def get_final(self) -> dict[str, Any]:
        """Returns the metrics by name."""
        return self.results

    def __repr__(self) -> str:
        return str(self.get_final())
