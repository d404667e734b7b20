"""The POGEMA that is installed, as a port: `python pogema_python.py [--raw] [--limit SECONDS]`.

It serves the releases 1.4.0, 1.3.1, 1.3.0, 1.2.2 and 1.1.6, and claims what the installed one can do. With `--raw` the
environment's class is driven without the wrappers that `pogema_v0` puts around it: no metrics, no history, and the
time limit, which is a wrapper, is kept here. Python 3.9 or newer.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pogema import GridConfig

import pogema_release as release
import pogema_views as views
from pogema_release import Refusal

Record = dict[str, Any]

# So many steps ahead goals are foretold; beyond, POGEMA's lists are long to draw and to tell.
LONGEST_FORESIGHT = 4096


class Timeout(BaseException):
    """The time is up; not an Exception, so that no handler within POGEMA takes it for its own."""


def expire(*_: Any) -> None:
    """The alarm's handler."""
    raise Timeout("the time limit is over")


def set_alarm(seconds: float) -> None:
    """Sets the alarm, which goes off again each second, or stops it; only some systems have one."""
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, expire)
        signal.setitimer(signal.ITIMER_REAL, seconds, 1.0 if seconds else 0.0)


@contextmanager
def calling(seconds: float) -> Iterator[None]:
    """Turns what POGEMA raises into refusals, and its endless loops too."""
    try:
        set_alarm(seconds)
        yield
    except Refusal:
        raise
    except (Exception, Timeout) as error:
        raise Refusal(f"{type(error).__name__}: {error}".removesuffix(": ")) from error
    finally:
        set_alarm(0)


class Port:
    """Answers one question after the other."""

    def __init__(self, raw: bool, limit: float) -> None:
        self.raw, self.limit = raw, limit
        self.claims = release.claims(raw)
        self.registration = release.Registration()
        self.env: Any = None
        self.has_config = False
        self.planner: Any = None
        self.elapsed = 0
        self.seen: Any = None
        self.figures: Any = None

    def answer(self, question: Any) -> Record:
        """The answer to any question but `bye`."""
        kind = question.get("type") if isinstance(question, dict) else None
        if kind == "hello":
            return self.claims
        if kind == "reset":
            return self.reset(question)
        if kind is None:
            raise Refusal("a question is an object with a `type`")
        if self.env is None:
            raise Refusal("there is no episode; reset comes first")
        if kind == "step":
            if not isinstance(question.get("actions"), list):
                raise Refusal("`actions` is no list")
            return self.step(question["actions"])
        if kind == "act":
            return self.act(question.get("policy"))
        if kind == "observe":
            return {"observations": views.observations(self.seen, self.config, at_reset=self.elapsed == 0)}
        if kind == "metrics" and not self.raw:
            return {"metrics": self.figures}
        if kind == "back" and not self.raw:
            return self.back()
        if kind == "history" and not self.raw:
            return self.history()
        raise Refusal(f"unknown question `{kind}`")

    @property
    def config(self) -> GridConfig:
        """The config at work, with all that POGEMA derives."""
        return self.env.unwrapped.grid_config

    def reset(self, question: Record) -> Record:
        """Begins an episode of an instance, of a config, or of the environment that is there."""
        try:
            with calling(self.limit):
                if "instance" in question or "config" in question:
                    self.make(question)
                if self.env is None:
                    raise Refusal("there is nothing to reset")
                seed = question.get("seed")
                told = self.env.reset() if seed is None else self.env.reset(seed=seed)
        except Refusal:
            self.env = None
            raise
        # The reset of 1.1 gives observations alone, later ones a pair; infos are not looked at.
        self.seen = told[0] if isinstance(told, tuple) else told
        self.elapsed, self.figures = 0, None
        if self.planner is not None:
            self.planner.reset_states()
        return {**self.instance(), **self.state(at_reset=True)}

    def make(self, question: Record) -> None:
        """Makes a new environment."""
        self.env = self.planner = None
        self.registration.clear()
        if question.get("register"):
            self.registration.register(question["register"])
        instance, self.has_config = question.get("instance"), "config" in question
        if instance is None:
            fields = question["config"]
            if fields.get("occupancy", "as_released") != "as_released" or fields.get("reward", "own") != "own":
                raise Refusal("POGEMA has neither exact occupancy nor a shared reward")
            config = GridConfig(**fields)
        else:
            config = release.config_of(instance)
        env = release.make(config, self.raw, "avg_agents_density" in question.get("measure", []))
        if instance is not None:
            release.settle(env.unwrapped, instance)
        self.env = env

    def instance(self) -> Record:
        """What a reset has made."""
        grid, radius, config = self.env.unwrapped.grid.obstacles, self.config.obs_radius, self.config
        rows = views.drawn(grid)
        told: Record = {"padded": rows}
        if self.has_config:
            told["map"] = [row[radius:-radius] for row in rows[radius:-radius]]
            if release.TELLS_SIZES:
                sizes = ("width", "height", "size", "density", "num_agents")
                told["derived"] = {name: getattr(config, name) for name in sizes}
        if release.FORETELLS and config.on_target == "restart":
            told["foretold"] = self.foretold()
        return told

    def foretold(self) -> Any:
        """The goals to come, or nothing where POGEMA fails or would never end."""
        if self.config.max_episode_steps > LONGEST_FORESIGHT:
            return None
        try:
            with calling(self.limit / 10):
                return [views.plain(goals) for goals in self.env.unwrapped.get_lifelong_targets_xy(ignore_borders=True)]
        except Refusal:
            return None

    def state(self, at_reset: bool) -> Record:
        """Where everybody is and what everybody sees."""
        return {**self.places(), "observations": views.observations(self.seen, self.config, at_reset)}

    def places(self) -> Record:
        """Where everybody is, and the occupancy grid, which may say otherwise."""
        base, radius = self.env.unwrapped, self.config.obs_radius
        return {
            "cells": views.plain(base.grid.positions_xy, radius),
            "goals": views.plain(base.grid.finishes_xy, radius),
            "active": [bool(flag) for flag in base.grid.is_active.values()],
            "on_goal": [bool(flag) for flag in base.was_on_goal],
            "occupied": views.plain(zip(*base.grid.positions.nonzero()), radius),
        }

    def step(self, actions: Any) -> Record:
        """Plays a step; `actions` is the caller's list, into which POGEMA may write."""
        with calling(self.limit):
            chosen = [int(action) for action in actions]
            result = self.env.step(actions)
        self.elapsed += 1
        self.seen, rewards, terminated, truncated, infos = as_five(result)
        if self.raw:
            truncated = [self.elapsed >= self.config.max_episode_steps] * len(rewards)
        told: Record = {"rewards": rewards, "terminated": terminated, "truncated": truncated, "actions": chosen}
        told["actions_after"] = [int(action) for action in actions]
        if not self.raw:
            told["metrics"] = self.figures = infos[0].get("metrics")
        return {**told, **self.state(at_reset=False)}

    def act(self, policy: Any) -> Record:
        """Plays a step that a policy of POGEMA's chooses."""
        if policy == "sample":
            return self.step(self.env.sample_actions())
        if policy != "astar" or release.PLANNER is None:
            raise Refusal(f"there is no policy `{policy}`")
        with calling(self.limit):
            self.planner = self.planner or release.PLANNER()
            actions = self.planner.act(self.seen)
        return self.step(actions)

    def back(self) -> Record:
        """Takes a step back."""
        with calling(self.limit):
            moved = release.keeper_of(self.env).step_back()
        self.elapsed -= moved
        return {"moved": moved, **self.places()}

    def history(self) -> Record:
        """What a persistent environment has kept."""
        keeper, radius = release.keeper_of(self.env), self.config.obs_radius
        full = views.histories(release.full_history(keeper), radius)
        return {"full": full, "changes": views.histories(keeper.get_history(), radius)}


def as_five(result: Any) -> Any:
    """The results of a step; those of 1.1 know `done` alone, and note in the infos what the time limit has changed."""
    if len(result) == 5:
        return result
    seen, rewards, done, infos = result
    # Where the limit has struck every agent is done, and its info says whether it was not before.
    truncated = ["TimeLimit.truncated" in info for info in infos]
    terminated = [not info.get("TimeLimit.truncated", not ended) for info, ended in zip(infos, done)]
    return seen, rewards, terminated, truncated, infos


def main() -> None:
    """Serves until `bye`."""
    parser = argparse.ArgumentParser(description="The POGEMA that is installed, as a port.")
    parser.add_argument("--raw", action="store_true", help="without POGEMA's wrappers")
    parser.add_argument("--limit", type=float, default=8.0, help="seconds that POGEMA may take for one answer")
    options = parser.parse_args()
    out = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(2, 1)  # whatever POGEMA prints, it prints to stderr
    warnings.simplefilter("ignore")
    port = Port(options.raw, options.limit)
    encode = json.JSONEncoder(separators=(",", ":"), check_circular=False).encode
    for line in sys.stdin:
        try:
            question = json.loads(line)
            if isinstance(question, dict) and question.get("type") == "bye":
                return
            reply = port.answer(question)
        except (Refusal, Timeout, json.JSONDecodeError) as error:  # an alarm may go off while it is being stopped
            set_alarm(0)
            reply = {"error": str(error)}
        out.write(encode(reply) + "\n")
        out.flush()


if __name__ == "__main__":
    main()
