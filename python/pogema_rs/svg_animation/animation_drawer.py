"""Drawing options and SVG drawings of episodes."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Optional, Union

from pogema_rs._forward import forwarded

if TYPE_CHECKING:
    from pogema_rs import _engine

__all__ = ["AnimationConfig", "SvgAnimation"]

# POGEMA's module offers this name too.
__getattr__, __dir__ = forwarded(__name__, {"GridConfig": "grid_config"})


@dataclass
class AnimationConfig:
    """Options for drawing an episode.

    `static` with `frame_idx`, or `static_frame_idx` alone, draws one frame; 0 is the state after the reset.
    `egocentric_idx` draws the view of one agent. `AnimationMonitor` uses `directory` and `save_every_idx_episode`.
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
    """A drawing that notebooks display."""

    def __init__(self, text: str) -> None:
        self._text = text

    def render(self) -> str:
        """Returns the text of the SVG."""
        return self._text

    def save(self, name: Union[str, PathLike]) -> None:
        """Writes the SVG to a file."""
        with open(name, "w", encoding="utf-8") as file:
            file.write(self._text)

    def _repr_html_(self) -> str:
        # An <img> isolates the ids of the drawing from those of other drawings on the page.
        data = base64.b64encode(self._text.encode()).decode()
        return f'<img src="data:image/svg+xml;base64,{data}" alt="animation of an episode">'


def draw(engine: _engine.Engine, config: AnimationConfig) -> SvgAnimation:
    """Draws the episode that an engine has recorded."""
    text = engine.draw_svg(
        egocentric=config.egocentric_idx,
        static_frame=config._frame(),
        show_agents=config.show_agents,
        show_lines=config.show_grid_lines,
    )
    return SvgAnimation(text)
