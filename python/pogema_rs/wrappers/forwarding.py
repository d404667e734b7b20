"""A wrapper that passes on what it does not have."""

from __future__ import annotations

from typing import Any

import gymnasium

__all__ = ["Wrapper"]


class Wrapper(gymnasium.Wrapper):
    """A `gymnasium.Wrapper` whose unknown attributes are those of the environment inside.

    Gymnasium's own wrappers did so before its release 1.0, and POGEMA's users rely on it.
    """

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return getattr(self.env, name)
