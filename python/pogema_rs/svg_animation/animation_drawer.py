"""How an episode is drawn, and the drawing."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Optional, Union

if TYPE_CHECKING:
    from pogema_rs import _engine

__all__ = ["AnimationConfig", "SvgAnimation"]


@dataclass
class AnimationConfig:
    """How an episode is drawn.

    `static` with `frame_idx`, or `static_frame_idx` alone, draws one frame; 0 is the state after the reset.
    `egocentric_idx` draws what one agent sees. `directory` and `save_every_idx_episode` are for `AnimationMonitor`.
    """

    directory: str = "renders/"
    static: bool = False
    show_agents: bool = True
    egocentric_idx: Optional[int] = None
    frame_idx: Optional[int] = None
    uid: Optional[str] = None
    save_every_idx_episode: Optional[int] = 1
    show_grid_lines: bool = True
    static_frame_idx: Optional[int] = None

    def _frame(self) -> Optional[int]:
        if self.static_frame_idx is not None:
            return self.static_frame_idx
        return (self.frame_idx or 0) if self.static else None


class SvgAnimation:
    """A drawing, which notebooks show."""

    def __init__(self, text: str) -> None:
        self._text = text

    def render(self) -> str:
        """The text of the SVG."""
        return self._text

    def save(self, name: Union[str, PathLike]) -> None:
        """Writes the SVG to a file."""
        with open(name, "w", encoding="utf-8") as file:
            file.write(self._text)

    def _repr_html_(self) -> str:
        # As an image of its own, so that the names in two drawings on one page do not meet.
        data = base64.b64encode(self._text.encode()).decode()
        return f'<img src="data:image/svg+xml;base64,{data}" alt="animation of an episode">'


def draw(engine: _engine.Engine, config: AnimationConfig) -> SvgAnimation:
    """Draws the episode that an engine has filmed."""
    text = engine.draw_svg(
        egocentric=config.egocentric_idx,
        static_frame=config._frame(),
        show_agents=config.show_agents,
        show_lines=config.show_grid_lines,
    )
    return SvgAnimation(text)
