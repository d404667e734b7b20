"""Drawings of an environment's episodes."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Optional, Union

from pogema_rs.svg_animation.animation_drawer import AnimationConfig, SvgAnimation, draw

if TYPE_CHECKING:
    from pogema_rs._engine import Engine

__all__ = ["Filmed"]


class Filmed:
    """The methods of an environment that record and draw its episodes."""

    _engine: Engine

    def enable_animation(self) -> None:
        """Records the episodes from the next reset on."""
        self._engine.film(True)

    def render_animation(self, animation_config: Optional[AnimationConfig] = None) -> SvgAnimation:
        """Returns the episode so far as an animation that notebooks display.

        Errors: `StateError` if the episode is not recorded, or has no such agent or frame.
        """
        return draw(self._engine, animation_config or AnimationConfig())

    def save_animation(
        self, name: Union[str, PathLike] = "render.svg", animation_config: Optional[AnimationConfig] = None
    ) -> None:
        """Writes the animation of the episode so far to a file."""
        self.render_animation(animation_config).save(name)

    def save_replay(self, name: Union[str, PathLike] = "replay.html", title: str = "POGEMA episode") -> None:
        """Writes the episode so far as a page that replays it in any browser."""
        page = self._engine.draw_html(title)
        with open(name, "w", encoding="utf-8") as file:
            file.write(page)
