"""Drawing options and SVG drawings of episodes."""

from __future__ import annotations

import base64
import math
import sys
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, Optional, Union

from pogema_rs._checks import check_whole
from pogema_rs._files import write_text
from pogema_rs._forward import forwarded

if TYPE_CHECKING:
    from pogema_rs import _engine
    from pogema_rs.svg_animation.svg_objects import SvgObject

__all__ = ["AnimationConfig", "Drawing", "GridHolder", "SvgAnimation", "SvgSettings"]

# POGEMA's module offers these names too.
__getattr__, __dir__ = forwarded(
    __name__,
    {
        "Animation": "svg_animation.svg_objects",
        "AnimationDrawer": "svg_animation._drawer",
        "Circle": "svg_animation.svg_objects",
        "GridConfig": "grid_config",
        "Line": "svg_animation.svg_objects",
        "Rectangle": "svg_animation.svg_objects",
        "RectangleHref": "svg_animation.svg_objects",
    },
)


@dataclass
class AnimationConfig:
    """Options for drawing an episode.

    `static` with `frame_idx`, or `static_frame_idx` alone, draws one frame; 0 is the state after the reset.
    `egocentric_idx` draws the view of one agent. `show_numbers`, which POGEMA does not have, writes the number of each
    agent into the agent and its goal. `AnimationMonitor` uses `directory` and `save_every_idx_episode`.
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
    show_numbers: bool = False

    def _frame(self) -> Optional[int]:
        if self.static_frame_idx is not None:
            return self.static_frame_idx
        return (self.frame_idx or 0) if self.static else None


@dataclass
class SvgSettings:
    """The sizes and colours of an `AnimationDrawer`.

    Units: hundredths of a cell, unless `scale_size` is changed; `time_scale` is in seconds per step.
    """

    r: int = 35
    stroke_width: int = 10
    scale_size: int = 100
    time_scale: float = 0.25
    draw_start: int = 100
    rx: int = 15
    obstacle_color: str = "#84A1AE"
    ego_color: str = "#c1433c"
    ego_other_color: str = "#6e81af"
    shaded_opacity: float = 0.2
    egocentric_shaded: bool = True
    stroke_dasharray: int = 25
    colors: tuple = ("#c1433c", "#2e6f9e", "#6e81af", "#00b9c8", "#72D5C8", "#0ea08c", "#8F7B66")


@dataclass
class GridHolder:
    """An episode for an `AnimationDrawer`.

    `width` is the number of rows of `obstacles` and `height` the number of columns, as in POGEMA. `history` holds the
    `AgentState` of each agent at every step, in the coordinates of `obstacles`, and `colors` a colour for each agent.
    """

    obstacles: Any = None
    episode_length: Any = None
    height: Any = None
    width: Any = None
    colors: Any = None
    history: Any = None
    obs_radius: Any = None
    grid_config: Any = None
    on_target: Any = None
    config: Any = None
    svg_settings: Any = None


class Drawing:
    """An SVG made of elements; the y axis points up from the lower left corner.

    POGEMA always defines obstacles with its default sizes and colours; here they follow `svg_settings`.

    Source: POGEMA 1.4.0, `svg_animation/animation_drawer.py`, `Drawing`
    """

    def __init__(self, height: int, width: int, svg_settings: SvgSettings) -> None:
        self.height = height
        self.width = width
        self.origin = (0, 0)
        self.elements: list[SvgObject] = []
        self.svg_settings = svg_settings

    def add_element(self, element: SvgObject) -> None:
        """Adds an element above all others."""
        self.elements.append(element)

    def render(self) -> str:
        """Returns the text of the SVG, whose longer side is 512 pixels."""
        settings, scale = self.svg_settings, max(self.height, self.width) / 512
        width, height = (math.ceil(side / scale) for side in (self.width, self.height))
        left, bottom = self.origin
        side = 2 * settings.r
        lines = [
            '<?xml version="1.0" encoding="UTF-8"?>',
            '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
            f'width="{width}" height="{height}" viewBox="{left} {bottom - self.height} {self.width} {self.height}">',
            "<defs>",
            f'<rect id="obstacle" width="{side}" height="{side}" fill="{settings.obstacle_color}" rx="{settings.rx}"/>',
            "<style>",
            f".line {{stroke: {settings.obstacle_color}; stroke-width: {settings.stroke_width};}}",
            f".agent {{r: {settings.r};}}",
            f".target {{fill: none; stroke-width: {settings.stroke_width}; r: {settings.r};}}",
            "</style>",
            "</defs>",
        ]
        return "\n".join([*lines, *(element.render() for element in self.elements), "</svg>"])

    def __str__(self) -> str:
        return self.render()


class SvgAnimation:
    """A drawing that notebooks display."""

    def __init__(self, text: str) -> None:
        self._text = text

    def render(self) -> str:
        """Returns the text of the SVG."""
        return self._text

    def __str__(self) -> str:
        return self._text

    def save(self, name: Union[str, PathLike]) -> None:
        """Writes the SVG to a file, and creates missing parent folders.

        Errors: `OSError` if the file cannot be written.
        """
        write_text(name, self._text)

    def _repr_html_(self) -> str:
        # An <img> isolates the ids of the drawing from those of other drawings on the page.
        data = base64.b64encode(self._text.encode()).decode()
        return f'<img src="data:image/svg+xml;base64,{data}" alt="animation of an episode">'


def draw(engine: _engine.Engine, config: AnimationConfig) -> SvgAnimation:
    """Draws the episode that an engine has recorded."""
    agent, frame = config.egocentric_idx, config._frame()
    name = "frame_idx" if config.static_frame_idx is None else "static_frame_idx"
    text = engine.draw_svg(
        egocentric=None if agent is None else min(check_whole("egocentric_idx", agent, 0), sys.maxsize),
        static_frame=None if frame is None else min(check_whole(name, frame, 0), sys.maxsize),
        show_agents=config.show_agents,
        show_lines=config.show_grid_lines,
        show_numbers=config.show_numbers,
    )
    return SvgAnimation(text)
