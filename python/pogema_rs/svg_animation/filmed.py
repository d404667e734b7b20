"""Drawings of an environment's episodes."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Optional, Union

if TYPE_CHECKING:
    from pogema_rs._engine import Engine
    from pogema_rs.svg_animation.animation_drawer import AnimationConfig, SvgAnimation

__all__ = ["Filmed"]


class Filmed:
    """The methods of an environment that record and draw its episodes."""

    _engine: Engine

    def enable_animation(self) -> None:
        """Records the episodes from the next reset on."""
        self._engine.film(True)

    @property
    def animation_is_active(self) -> bool:
        """Whether the episodes from the next reset on are recorded."""
        return self._engine.is_filmed

    def render_animation(self, animation_config: Optional[AnimationConfig] = None) -> SvgAnimation:
        """Returns the episode so far as an animation that notebooks display.

        Errors: `StateError` if the episode is not recorded, or has no such agent or frame; TypeError or ValueError if
        the index of the agent or frame is negative or not a whole number.
        """
        # The dataclasses of `animation_drawer` take longer to import than any other module of the package.
        from pogema_rs.svg_animation.animation_drawer import AnimationConfig, draw

        return draw(self._engine, animation_config or AnimationConfig())

    def save_animation(
        self, name: Union[str, PathLike] = "render.svg", animation_config: Optional[AnimationConfig] = None
    ) -> None:
        """Writes the animation of the episode so far to a file, and creates missing parent folders.

        Errors: those of `render_animation`; `OSError` if the file cannot be written.
        """
        self.render_animation(animation_config).save(name)

    def save_replay(self, name: Union[str, PathLike] = "replay.html", title: str = "POGEMA episode") -> None:
        """Writes the episode so far as a page that replays it in any browser, and creates missing parent folders.

        Errors: `StateError` if the episode is not recorded; `OSError` if the file cannot be written.
        """
        from pogema_rs._files import write_text

        write_text(name, self._engine.draw_html(title))
