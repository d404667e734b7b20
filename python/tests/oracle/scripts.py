"""The cases: configs with the calls to make on them, each a pure function of a seed and a number."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from configs import COLLISIONS, OBSERVATIONS, Draw, Fields
from intended import INTENDED
from odd_configs import ACCEPTED, UNPLAYABLE, rejected
from player import GREEDY

Call = tuple[Any, ...]

CONTAINERS = ("list", "list", "tuple", "int64", "int32", "uint8", "numbers")
WRONG_ACTIONS = (5, -6, 99, 10**30, 1.0, None, "1", float("nan"), [0])
ODD_ACTIONS = (-1, -2, -3, -4, -5, True, False)

_BOTH = ("get_agents_xy", "get_targets_xy", "get_obstacles")
_PLAIN = (
    *("get_agents_xy_relative", "get_targets_xy_relative", "get_num_agents", "was_on_goal", "unwrapped.was_on_goal"),
    *("get_state", "grid.positions", "grid.obstacles", "grid.positions_xy", "grid.finishes_xy", "grid.is_active"),
    *("grid.starts_xy", "grid.get_observation_shape", "grid.get_num_actions", "grid.get_agents_xy_relative"),
)
_OF_AGENT = ("get_obstacles_for_agent", "get_positions", "get_square_target", "get_target", "on_goal")


@dataclass
class Case:
    """A script, the kinds of features that it covers, and the config of its environment."""

    number: int
    fields: Fields
    script: list[Call]
    kinds: set[str]
    intended: str = ""


def case(seed: int, number: int) -> Case:
    """Returns the case with this number."""
    draw = Draw(np.random.default_rng([seed, number]))
    kind = draw.number(0, 99)
    if kind < 15:
        fields = rejected(draw)
        return Case(number, fields, [("config", fields), ("make", fields)], draw.kinds)
    if kind < 21:
        fields = dict(draw.one(UNPLAYABLE))
        draw.note("rejected at the reset")
        script: list[Call] = [("make", fields), ("reset", None), ("dump",), ("reset", None)]
        return Case(number, fields, script, draw.kinds)
    if kind < 26:
        difference = draw.one(INTENDED)
        draw.note("intended difference")
        return Case(number, difference.fields, list(difference.script), draw.kinds, difference.name)
    if kind < 38:
        fields = dict(draw.one(ACCEPTED))
        draw.note("odd config")
    else:
        fields = draw.config()
    return Case(number, fields, _Episodes(draw, fields).script(), draw.kinds)


def look(fields: Fields, num_agents: int) -> list[Call]:
    """Returns calls to all functions and attributes that show the current state."""
    calls: list[Call] = [("call", name, (), {}) for name in (*_BOTH, *_PLAIN)]
    calls += [("call", name, (), {"ignore_borders": True}) for name in _BOTH]
    calls.append(("call", "get_state", (), {"as_dict": True}))
    agent = num_agents - 1
    calls += [("call", f"grid.{name}", (agent,), {}) for name in _OF_AGENT]
    calls.append(("call", "grid.has_obstacle", (fields.get("obs_radius", 5), fields.get("obs_radius", 5)), {}))
    if fields.get("on_target") == "restart":
        calls += [("call", "get_lifelong_targets_xy", (), {"ignore_borders": flag}) for flag in (False, True)]
    return calls


class _Episodes:
    """Episodes of one environment, with other calls of a user between the steps."""

    def __init__(self, draw: Draw, fields: Fields) -> None:
        self.draw, self.fields = draw, fields
        starts = fields.get("agents_xy") or []
        text = fields["map"] if isinstance(fields.get("map"), str) else ""
        letters = sum(sign.islower() for sign in set(text))
        self.num_agents = letters or int(fields.get("num_agents") or len(starts) or 1)
        self.is_persistent = bool(fields.get("persistent"))
        self.calls: list[Call] = []

    def script(self) -> list[Call]:
        draw = self.draw
        self.calls = [("register", *draw.registered)] if draw.registered else []
        self.calls.append(("make", self.fields))
        if draw.chance(0.1) and self.fields.get("seed") is not None:
            draw.note("grid of a config")
            self.calls.append(("grid", self.fields))
        if draw.chance(0.06):
            draw.note("before the reset")
            self.calls += [("step", [0] * self.num_agents, "list"), ("render",), ("call", "get_agents_xy", (), {})]
        self._reset()
        for _ in range(draw.number(2, 14)):
            if draw.chance(0.8):
                self._step()
            else:
                self._event()
            if draw.chance(0.25):
                self.calls += look(self.fields, self.num_agents)
        self.calls += look(self.fields, self.num_agents)
        if self.is_persistent:
            self._history()
        if draw.chance(0.4):
            self._reset()
            self._step()
        self.calls.append(("dump",))
        return self.calls

    def _reset(self) -> None:
        seed = None
        if self.draw.chance(0.15):
            seed = self.draw.number(0, 9)
            self.draw.note("reset with a seed")
        self.calls.append(("reset", seed))
        if self.draw.chance(0.5):
            self.calls += look(self.fields, self.num_agents)

    def _step(self) -> None:
        draw = self.draw
        draw.note("step")
        skill = draw.one((0.0, 0.5, 0.9, 1.0))
        plan: list[Any] = [GREEDY if draw.chance(skill) else draw.number(0, 4) for _ in range(self.num_agents)]
        form = draw.one(CONTAINERS)
        if form in ("list", "tuple") and draw.chance(0.1):
            draw.note("odd action")
            plan[draw.number(0, self.num_agents - 1)] = draw.one(ODD_ACTIONS)
        draw.note(f"actions as {form}")
        self.calls += [("step", plan, form), ("left",)]

    def _event(self) -> None:
        events = [self._reset, self._seed, self._update, self._replace, self._sample, self._wrong, self._render]
        events += [self._elapsed, *3 * [self._back], self._history] if self.is_persistent else [self._no_history]
        self.draw.one(events)()

    def _seed(self) -> None:
        self.draw.note("seed changed")
        self.calls.append(("seed", self.draw.number(0, 99)))
        self._reset()

    def _update(self) -> None:
        self.draw.note("config updated")
        self.calls += [("update", self._changes()), ("reset", None), *look(self.fields, self.num_agents)]

    def _replace(self) -> None:
        self.draw.note("config replaced")
        changes = self._changes()
        fields = {**self.fields, **changes}
        if "size" in changes:
            fields = {name: value for name, value in fields.items() if name not in ("width", "height")}
        self.calls += [("replace", fields), ("reset", None), *look(self.fields, self.num_agents)]

    def _changes(self) -> Fields:
        draw = self.draw
        name = draw.one(
            ("seed", "density", "size", "collision_system", "observation_type", "empty_outside", "obs_radius")
        )
        values = {
            "seed": draw.number(0, 2**40),
            "density": draw.one((0.0, 0.2, 0.4)),
            "size": draw.number(3, 8),
            "collision_system": draw.one(COLLISIONS),
            "observation_type": draw.one(OBSERVATIONS),
            "empty_outside": draw.chance(0.5),
            "obs_radius": draw.number(1, 4),
        }
        return {name: values[name]}

    def _sample(self) -> None:
        if self.fields.get("seed") is not None:
            self.draw.note("sampled actions")
            self.calls.append(("sample",))

    def _wrong(self) -> None:
        draw = self.draw
        draw.note("wrong action")
        plan: list[Any] = [draw.number(0, 4) for _ in range(self.num_agents)]
        if draw.chance(0.4):
            self.calls.append(("step", plan + [0] if draw.chance(0.5) else plan[:-1], "list"))
            return
        plan[draw.number(0, self.num_agents - 1)] = draw.one(WRONG_ACTIONS)
        # A failed step can leave POGEMA in the middle of a step, so the script resets.
        self.calls += [("step", plan, draw.one(("list", "tuple"))), ("reset", None)]

    def _render(self) -> None:
        self.draw.note("render")
        self.calls.append(("render",))

    def _elapsed(self) -> None:
        self.draw.note("elapsed steps")
        self.calls += [("elapsed", self.draw.number(0, 12)), ("step", [GREEDY] * self.num_agents, "list")]

    def _back(self) -> None:
        self.draw.note("step back")
        self.calls += [("back",), *look(self.fields, self.num_agents)]

    def _history(self) -> None:
        self.draw.note("history")
        self.calls.append(("history",))

    def _no_history(self) -> None:
        self.draw.note("no history")
        self.calls.append(self.draw.one((("back",), ("elapsed", 3), ("history",))))
