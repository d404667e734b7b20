"""A wrapper that forwards unknown attributes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium

if TYPE_CHECKING:
    from pogema_rs.envs import Pogema

__all__ = ["Wrapper"]


class Wrapper(gymnasium.Wrapper):
    """A `gymnasium.Wrapper` that forwards unknown attributes to the inner environment.

    Gymnasium's own wrappers did so before release 1.0, and POGEMA's users rely on it.
    """

    if TYPE_CHECKING:
        # Gymnasium's types describe one agent and hide the class of the inner environment.
        env: Any

        @property
        def unwrapped(self) -> Pogema: ...

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return getattr(self.env, name)
