"""A wrapper that passes on what it does not have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium

if TYPE_CHECKING:
    from pogema_rs.envs import Pogema

__all__ = ["Wrapper"]


class Wrapper(gymnasium.Wrapper):
    """A `gymnasium.Wrapper` whose unknown attributes are those of the environment inside.

    Gymnasium's own wrappers did so before its release 1.0, and POGEMA's users rely on it.
    """

    if TYPE_CHECKING:
        # Gymnasium's types are those of one agent, and know nothing of what is inside.
        env: Any

        @property
        def unwrapped(self) -> Pogema: ...

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return getattr(self.env, name)
