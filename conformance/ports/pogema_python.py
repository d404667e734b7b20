"""Serves the installed POGEMA as a port: `python pogema_python.py [--raw] [--limit SECONDS]`.

Supports the releases 1.4.0, 1.3.1, 1.3.0, 1.2.2 and 1.1.6, and claims the abilities of the installed one. With `--raw`,
the port drives the environment class without the wrappers that `pogema_v0` adds: no metrics and no history. The step
limit of an episode is one of these wrappers, so the port applies it itself. Needs Python 3.9 or newer.
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
from functools import partial
from typing import Any

from pogema import GridConfig

import pogema_release as release
import pogema_views as views
from pogema_release import Refusal

Record = dict[str, Any]

# The step limit up to which the port lists future goals; POGEMA's lists for longer episodes are slow and large.
MAX_FORECAST_STEPS = 4096


class Timeout(BaseException):
    """The time limit is exceeded. Not an `Exception`, so that no handler within POGEMA catches it."""


def expire(*_: Any) -> None:
    """Handles the alarm."""
    raise Timeout("the time limit is exceeded")


def set_alarm(seconds: float) -> None:
    """Sets the alarm, which then repeats every second; 0 stops the alarm. Does nothing on systems without alarms."""
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, expire)
        signal.setitimer(signal.ITIMER_REAL, seconds, 1.0 if seconds else 0.0)


@contextmanager
def errors_as_refusals(seconds: float) -> Iterator[None]:
    """Turns POGEMA's exceptions and endless loops into refusals."""
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
    """The port: answers questions about its current environment."""

    def __init__(self, raw: bool, limit: float) -> None:
        self.raw, self.limit = raw, limit
        self.claims = release.claims(raw)
        self.registration = release.Registration()
        self.env: Any = None
        self.has_config = False
        self.planner: Any = None
        self.elapsed = 0
        self.observations: Any = None
        self.metrics: Any = None

    def answer(self, question: Any) -> Record:
        """Returns the answer to a question other than `bye`."""
        kind = question.get("type") if isinstance(question, dict) else None
        if kind == "hello":
            return self.claims
        if kind == "reset":
            return self.reset(question)
        if kind is None:
            raise Refusal("expected a question: an object with a `type`")
        if self.env is None:
            raise Refusal("no episode has begun; send `reset` first")
        if kind == "step":
            if not isinstance(question.get("actions"), list):
                raise Refusal("`actions` is not a list")
            return self.step(question["actions"])
        if kind == "act":
            return self.act(question.get("policy"))
        if kind == "observe":
            return {"observations": views.observations(self.observations, self.config, at_reset=self.elapsed == 0)}
        if kind == "metrics" and not self.raw:
            return {"metrics": self.metrics}
        if kind == "back" and not self.raw:
            return self.back()
        if kind == "history" and not self.raw:
            return self.history()
        raise Refusal(f"unknown question `{kind}`")

    @property
    def config(self) -> GridConfig:
        """The config of the environment, with the values that POGEMA derived."""
        return self.env.unwrapped.grid_config

    def reset(self, question: Record) -> Record:
        """Begins an episode of an instance, of a config, or of the current environment."""
        try:
            with errors_as_refusals(self.limit):
                if "instance" in question or "config" in question:
                    self.make(question)
                if self.env is None:
                    raise Refusal("no environment to reset, expected `instance` or `config`")
                seed = question.get("seed")
                result = self.env.reset() if seed is None else self.env.reset(seed=seed)
        except Refusal:
            self.env = None
            raise
        # `reset` returns only observations in 1.1, and a pair in later releases. The infos are ignored.
        self.observations = result[0] if isinstance(result, tuple) else result
        self.elapsed, self.metrics = 0, None
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
                raise Refusal("POGEMA supports only occupancy `as_released` and reward `own`")
            config = GridConfig(**fields)
        else:
            config = release.config_of(instance)
        env = release.make(config, self.raw, "avg_agents_density" in question.get("measure", []))
        if instance is not None:
            release.patch_grids(env.unwrapped, instance)
        self.env = env

    def instance(self) -> Record:
        """Returns the instance that the reset made."""
        grid, radius, config = self.env.unwrapped.grid.obstacles, self.config.obs_radius, self.config
        rows = views.grid_rows(grid)
        record: Record = {"padded": rows}
        if self.has_config:
            record["map"] = [row[radius:-radius] for row in rows[radius:-radius]]
            if release.HAS_SIZES:
                sizes = ("width", "height", "size", "density", "num_agents")
                record["derived"] = {name: getattr(config, name) for name in sizes}
        if release.FORECASTS_GOALS and config.on_target == "restart":
            record["foretold"] = self.goal_forecast()
        return record

    def goal_forecast(self) -> Any:
        """Returns the future goals, or nothing if the episode is long, or if POGEMA fails or needs too much time."""
        if self.config.max_episode_steps > MAX_FORECAST_STEPS:
            return None
        try:
            with errors_as_refusals(self.limit / 10):
                lists = self.env.unwrapped.get_lifelong_targets_xy(ignore_borders=True)
                return [views.cell_lists(goals) for goals in lists]
        except Refusal:
            return None

    def state(self, at_reset: bool) -> Record:
        """Returns the state and observations of all agents."""
        return {**self.places(), "observations": views.observations(self.observations, self.config, at_reset)}

    def places(self) -> Record:
        """Returns the cells, goals and flags of all agents, and the occupied cells, which may differ from the cells of
        the agents."""
        base, radius = self.env.unwrapped, self.config.obs_radius
        return {
            "cells": views.cell_lists(base.grid.positions_xy, radius),
            "goals": views.cell_lists(base.grid.finishes_xy, radius),
            "active": [bool(flag) for flag in base.grid.is_active.values()],
            "on_goal": [bool(flag) for flag in base.was_on_goal],
            "occupied": views.cell_lists(zip(*base.grid.positions.nonzero()), radius),
        }

    def step(self, actions: Any) -> Record:
        """Plays a step. `actions` is the caller's list; POGEMA may write into it."""
        with errors_as_refusals(self.limit):
            chosen = [int(action) for action in actions]
            result = self.env.step(actions)
        self.elapsed += 1
        self.observations, rewards, terminated, truncated, infos = five_results(result)
        if self.raw:
            truncated = [self.elapsed >= self.config.max_episode_steps] * len(rewards)
        record: Record = {"rewards": rewards, "terminated": terminated, "truncated": truncated, "actions": chosen}
        record["actions_after"] = [int(action) for action in actions]
        if not self.raw:
            record["metrics"] = self.metrics = infos[0].get("metrics")
        return {**record, **self.state(at_reset=False)}

    def act(self, policy: Any) -> Record:
        """Plays a step with the actions of a POGEMA policy."""
        if policy == "sample":
            return self.step(self.env.sample_actions())
        if policy != "astar" or release.PLANNER is None:
            raise Refusal(f"policy `{policy}` is not available")
        with errors_as_refusals(self.limit):
            self.planner = self.planner or release.PLANNER()
            actions = self.planner.act(self.observations)
        return self.step(actions)

    def back(self) -> Record:
        """Undoes the last step."""
        with errors_as_refusals(self.limit):
            moved = release.persistent_layer(self.env).step_back()
        self.elapsed -= moved
        return {"moved": moved, **self.places()}

    def history(self) -> Record:
        """Returns the history of a persistent environment."""
        keeper, radius = release.persistent_layer(self.env), self.config.obs_radius
        full = views.histories(release.full_history(keeper), radius)
        return {"full": full, "changes": views.histories(keeper.get_history(), radius)}


def five_results(result: Any) -> Any:
    """Converts results of 1.1 to the five values of later releases; 1.1 marks truncation in the infos."""
    if len(result) == 5:
        return result
    observations, rewards, done, infos = result
    # At the step limit, all agents are done; `TimeLimit.truncated` in an info is true if its agent was not done before.
    truncated = ["TimeLimit.truncated" in info for info in infos]
    terminated = [not info.get("TimeLimit.truncated", not ended) for info, ended in zip(infos, done)]
    return observations, rewards, terminated, truncated, infos


def respond(port: Port, question: Any) -> Record:
    """Answers a question. A refusal is also an answer."""
    try:
        return port.answer(question)
    except (Refusal, Timeout) as error:  # an alarm may fire while it is being stopped
        set_alarm(0)
        return {"error": str(error)}


answer = partial(respond, Port(raw=False, limit=8.0))


def main() -> None:
    """Serves until `bye`."""
    parser = argparse.ArgumentParser(description="Serves the installed POGEMA as a port.")
    parser.add_argument("--raw", action="store_true", help="drive the environment without POGEMA's wrappers")
    parser.add_argument("--limit", type=float, default=8.0, help="time limit for one answer in seconds [default: 8]")
    options = parser.parse_args()
    out = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(2, 1)  # anything POGEMA prints goes to stderr
    warnings.simplefilter("ignore")
    port = Port(options.raw, options.limit)
    encode = json.JSONEncoder(separators=(",", ":"), check_circular=False).encode
    for line in sys.stdin:
        try:
            question = json.loads(line)
        except json.JSONDecodeError as error:
            reply = {"error": str(error)}
        else:
            if isinstance(question, dict) and question.get("type") == "bye":
                return
            reply = respond(port, question)
        out.write(encode(reply) + "\n")
        out.flush()


if __name__ == "__main__":
    main()
