"""POGEMA's drawings of episodes, for scripts that change them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, groupby
from typing import Any, Optional

from pogema_rs._history import AgentState
from pogema_rs.svg_animation.animation_drawer import Drawing, GridHolder
from pogema_rs.svg_animation.svg_objects import Animation, Circle, Line, Rectangle, RectangleHref, SvgObject


class AnimationDrawer:
    """Draws an episode, given as a `GridHolder`, with the elements that POGEMA draws.

    Override a method to change the elements of its kind. `render_animation` and `save_animation` of an environment do
    not use this class: they draw the episode in the engine, faster and with another look.

    Source: POGEMA 1.4.0, `svg_animation/animation_drawer.py`, `AnimationDrawer`
    """

    def create_animation(self, grid_holder: GridHolder) -> Drawing:
        """Returns the drawing of all elements."""
        holder, config = grid_holder, grid_holder.config
        scale = holder.svg_settings.scale_size
        # The `width` of a holder is the number of rows of the map.
        drawing = Drawing((holder.width + 1) * scale, (holder.height + 1) * scale, holder.svg_settings)
        frame, is_egocentric = config._frame(), config.egocentric_idx is not None
        obstacles = self.create_obstacles(holder)
        agents: list[SvgObject] = []
        targets: list[SvgObject] = []
        if config.show_agents:
            targets = self.create_targets(holder)
            if frame is None:
                agents = self.create_agents(holder)
                self.animate_agents(agents, holder)
                self.animate_targets(targets, holder)
            else:
                agents = self.create_static_agents(holder)
                if is_egocentric:
                    obstacles = self.create_static_obstacles(obstacles, holder)
                self.create_frame_view(holder)
        lines = self.create_grid_lines(holder, drawing.width, drawing.height) if config.show_grid_lines else []
        views: list[SvgObject] = []
        if is_egocentric:
            views = [self.create_field_of_view(holder)]
            if frame is None:
                self.animate_obstacles(obstacles, holder)
                self.animate_field_of_view(views[0], holder)
        for element in (*lines, *obstacles, *agents, *targets, *views):
            drawing.add_element(element)
        return drawing

    @staticmethod
    def fix_point(x: int, y: int, length: int) -> tuple[int, int]:
        """Returns the row and column of the cell in column `x`, and in row `y` counted from the bottom."""
        return length - 1 - y, x

    @staticmethod
    def check_in_radius(x1: int, y1: int, x2: int, y2: int, r: int) -> bool:
        """Returns whether a cell is in the window of radius `r` around another one."""
        return max(abs(x1 - x2), abs(y1 - y2)) <= r

    @staticmethod
    def create_grid_lines(grid_holder: GridHolder, render_width: int, render_height: int) -> list[SvgObject]:
        """Returns the lines between the cells."""
        scale = grid_holder.svg_settings.scale_size
        lines: list[SvgObject] = []
        for number in range(-1, grid_holder.height + 1):
            x = (number + 0.5) * scale
            lines.append(Line(x1=x, y1=0, x2=x, y2=render_height, **{"class": "line"}))
        for number in range(-1, grid_holder.width + 1):
            y = (number + 0.5) * scale
            lines.append(Line(x1=0, y1=y, x2=render_width, y2=y, **{"class": "line"}))
        return lines

    def create_obstacles(self, grid_holder: GridHolder) -> list[SvgObject]:
        """Returns the obstacles; an egocentric drawing shades those that the agent does not see at first."""
        settings = grid_holder.svg_settings
        shaded = None
        if grid_holder.config.egocentric_idx is not None and settings.egocentric_shaded:
            shaded = {cell for cell in self._obstacles(grid_holder) if not self._seen(grid_holder, cell, 0)}
        return [
            _obstacle(grid_holder, cell, settings.shaded_opacity if shaded and cell in shaded else None)
            for cell in self._obstacles(grid_holder)
        ]

    def create_static_obstacles(self, obstacles: Sequence[SvgObject], grid_holder: GridHolder) -> list[SvgObject]:
        """Returns the obstacles of an egocentric frame, which shades those that the agent has not seen by then."""
        past = range((grid_holder.config._frame() or 0) + 1)
        opacity = grid_holder.svg_settings.shaded_opacity
        return [
            _obstacle(grid_holder, cell, 1.0 if any(self._seen(grid_holder, cell, step) for step in past) else opacity)
            for cell in self._obstacles(grid_holder)
        ]

    def animate_obstacles(self, obstacles: Sequence[SvgObject], grid_holder: GridHolder) -> None:
        """Shades each obstacle until the agent of an egocentric drawing first sees it."""
        steps = range(len(_ego(grid_holder)))
        for obstacle, cell in zip(obstacles, self._obstacles(grid_holder)):
            first = next((step for step in steps if self._seen(grid_holder, cell, step)), len(steps))
            opacity = [str(1.0 if step >= first else grid_holder.svg_settings.shaded_opacity) for step in steps]
            self._animate(obstacle, grid_holder, opacity=opacity)

    def create_agents(self, grid_holder: GridHolder) -> list[SvgObject]:
        """Returns the agents at the reset."""
        return self._agents(grid_holder, 0)

    def create_static_agents(self, grid_holder: GridHolder) -> list[SvgObject]:
        """Returns the agents of the frame that the config selects."""
        return self._agents(grid_holder, grid_holder.config._frame() or 0)

    def animate_agents(self, agents: Sequence[SvgObject], grid_holder: GridHolder) -> None:
        """Moves the agents, and hides them when they finish.

        An egocentric drawing shades the agents that its agent does not see.
        """
        for agent, states in zip(agents, grid_holder.history):
            places = [_place(grid_holder, state.get_xy()) for state in states]
            paths = {"cy": [str(-y) for _, y in places], "cx": [str(x) for x, _ in places]}
            paths["visibility"] = _visibility(states)
            if grid_holder.config.egocentric_idx is not None:
                opacity = grid_holder.svg_settings.shaded_opacity
                cells = enumerate(state.get_xy() for state in states)
                paths["opacity"] = [
                    str(1.0 if self._seen(grid_holder, cell, step) else opacity) for step, cell in cells
                ]
            self._animate(agent, grid_holder, **paths)

    @staticmethod
    def create_targets(grid_holder: GridHolder) -> list[SvgObject]:
        """Returns the goals at the reset: those of agents that are ever active, or only that of the egocentric one."""
        settings, targets = grid_holder.svg_settings, list[SvgObject]()
        for agent in _owners(grid_holder):
            x, y = _place(grid_holder, grid_holder.history[agent][0].get_target_xy())
            is_ego = grid_holder.config.egocentric_idx is not None
            stroke = settings.ego_color if is_ego else grid_holder.colors[agent]
            targets.append(Circle(cx=x, cy=y, r=settings.r, stroke=stroke, **{"class": "target"}))
        return targets

    def animate_targets(self, targets: Sequence[SvgObject], grid_holder: GridHolder) -> None:
        """Moves the goals if agents get new ones, and hides them with their agents."""
        for target, agent in zip(targets, _owners(grid_holder)):
            states = grid_holder.history[agent]
            paths = {}
            if grid_holder.on_target in ("restart", "wait"):
                places = [_place(grid_holder, state.get_target_xy()) for state in states]
                paths = {"cy": [str(-y) for _, y in places], "cx": [str(x) for x, _ in places]}
            self._animate(target, grid_holder, **paths, visibility=_visibility(states))

    @staticmethod
    def create_field_of_view(grid_holder: GridHolder) -> SvgObject:
        """Returns the window of the agent of an egocentric drawing."""
        settings = grid_holder.svg_settings
        x, y, side = _window(grid_holder, _ego(grid_holder)[0])
        return Rectangle(
            x=x,
            y=y,
            width=side,
            height=side,
            fill="none",
            rx=settings.rx,
            stroke=settings.ego_color,
            stroke_width=settings.stroke_width,
            stroke_dasharray=settings.stroke_dasharray,
        )

    def animate_field_of_view(self, view: SvgObject, grid_holder: GridHolder) -> None:
        """Moves the window with its agent."""
        windows = [_window(grid_holder, state) for state in _ego(grid_holder)]
        paths = {"x": [str(x) for x, _, _ in windows], "y": [str(-(y + side)) for _, y, side in windows]}
        self._animate(view, grid_holder, **paths, visibility=_visibility(_ego(grid_holder)))

    def create_frame_view(self, grid_holder: GridHolder) -> None:
        """Reduces the history of the holder to the frame that the config selects."""
        frame = grid_holder.config._frame() or 0
        grid_holder.history = [[states[frame]] for states in grid_holder.history]

    def _animate(self, element: SvgObject, grid_holder: GridHolder, **paths: list[str]) -> None:
        for name, tokens in paths.items():
            element.add_animation(self.compressed_anim(name, tokens, grid_holder.svg_settings.time_scale))

    @classmethod
    def compressed_anim(
        cls, attr_name: str, tokens: list[str], time_scale: float, rep_cnt: str = "indefinite"
    ) -> Animation:
        """Returns the animation of an attribute with one value for each step."""
        values, durations = cls.compress_tokens(tokens)
        times = [0, *accumulate(durations)]
        return Animation(
            attributeName=attr_name,
            dur=f"{time_scale * (times[-1] - 1)}s",
            values=";".join([values[0], *values]),
            keyTimes=";".join(str(round(time / times[-1], 10)) for time in times),
            repeatCount=rep_cnt,
        )

    @staticmethod
    def wisely_add(token: str, cnt: int, tokens: list[str], times: list[int]) -> None:
        """Appends a value that lasts `cnt` steps: the first step, and the rest if there is one."""
        parts = [1, cnt - 1] if cnt > 1 else [cnt]
        tokens.extend([token] * len(parts))
        times.extend(parts)

    @classmethod
    def compress_tokens(cls, input_tokens: list[str]) -> tuple[list[str], list[int]]:
        """Returns the values of an animation and the number of steps that each of them lasts."""
        tokens: list[str] = []
        times: list[int] = []
        for token, run in groupby(input_tokens):
            cls.wisely_add(token, len(list(run)), tokens, times)
        return tokens, times

    def _seen(self, holder: GridHolder, cell: tuple[Any, Any], step: int) -> bool:
        """Returns whether the agent of an egocentric drawing sees a cell at a step."""
        return self.check_in_radius(*cell, *_ego(holder)[step].get_xy(), holder.obs_radius)

    def _obstacles(self, holder: GridHolder) -> list[tuple[int, int]]:
        """Returns the cells of the obstacles, column by column from the bottom."""
        cells = (self.fix_point(x, y, holder.width) for x in range(holder.height) for y in range(holder.width))
        return [(row, col) for row, col in cells if holder.obstacles[row][col]]

    def _agents(self, holder: GridHolder, frame: int) -> list[SvgObject]:
        settings, ego, agents = holder.svg_settings, holder.config.egocentric_idx, list[SvgObject]()
        for agent, states in enumerate(holder.history):
            cell = states[frame].get_xy()
            x, y = _place(holder, cell)
            look = {"fill": holder.colors[agent]}
            if ego is not None:
                look["fill"] = settings.ego_color if agent == ego else settings.ego_other_color
                if settings.egocentric_shaded and not self._seen(holder, cell, frame):
                    look["opacity"] = settings.shaded_opacity
            agents.append(Circle(cx=x, cy=y, r=settings.r, **look, **{"class": "agent"}))
        return agents


def _place(holder: GridHolder, cell: tuple[Any, Any]) -> tuple[Any, Any]:
    """Returns the middle of a cell in the drawing, whose y axis points up."""
    settings, (row, col) = holder.svg_settings, cell
    up = holder.width - 1 - row
    return settings.draw_start + col * settings.scale_size, settings.draw_start + up * settings.scale_size


def _ego(holder: GridHolder) -> list[AgentState]:
    states: list[AgentState] = holder.history[holder.config.egocentric_idx]
    return states


def _visibility(states: Sequence[AgentState]) -> list[str]:
    return ["visible" if state.is_active() else "hidden" for state in states]


def _owners(holder: GridHolder) -> list[int]:
    """Returns the agents whose goals are drawn."""
    ego = holder.config.egocentric_idx
    active = [agent for agent, states in enumerate(holder.history) if any(state.is_active() for state in states)]
    return [agent for agent in active if ego in (None, agent)]


def _obstacle(holder: GridHolder, cell: tuple[int, int], opacity: Optional[float]) -> SvgObject:
    radius, (x, y) = holder.svg_settings.r, _place(holder, cell)
    shade = {} if opacity is None else {"opacity": opacity}
    return RectangleHref(x=x - radius, y=y - radius, height=2 * radius, **shade)


def _window(holder: GridHolder, state: AgentState) -> tuple[Any, Any, Any]:
    """Returns the lower left corner and the side of a square just inside the edge of an agent's window."""
    settings, (x, y) = holder.svg_settings, _place(holder, state.get_xy())
    reach = (holder.obs_radius + 1) * settings.scale_size - 2 * settings.stroke_width - settings.r
    return x - reach, y - reach, 2 * reach
