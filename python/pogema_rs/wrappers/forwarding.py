"""A wrapper that forwards unknown attributes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Generic, Union

import gymnasium

from pogema_rs._types import Infos, Observation, Step

if TYPE_CHECKING:
    import numpy as np

    from pogema_rs.envs import Pogema

__all__ = ["Wrapper"]


class Wrapper(gymnasium.Wrapper, Generic[Observation]):
    """A `gymnasium.Wrapper` that forwards unknown public attributes to the inner environment.

    Gymnasium's own wrappers did so before release 1.0, and POGEMA's users rely on it.
    """

    if TYPE_CHECKING:
        # Gymnasium's types describe one agent and hide the class of the inner environment, whose attributes a wrapper
        # has too.
        env: Pogema[Observation]

        def __init__(self, env: Union[Pogema[Observation], Wrapper[Observation]]) -> None: ...

        @property
        def unwrapped(self) -> Pogema[Observation]: ...

        def reset(self, **kwargs: Any) -> tuple[list[Observation], Infos]: ...  # type: ignore[override]

        def step(  # type: ignore[override]
            self, action: Union[Sequence[int], np.ndarray]
        ) -> Step[Observation]: ...

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        return getattr(self.env, name)
