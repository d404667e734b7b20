"""Any environment object in Python as a port: write two functions, and call `serve`.

    from environment_object import serve

    def make_env(instance):             # an environment for what docs/PORTING.md calls an instance
        return MyEnv(instance["map"], instance["starts"], instance["goals"], **instance["config"])

    def read_state(env):                # cells and goals counted on the map without its border
        return {"cells": env.cells, "goals": env.goals, "active": env.active}

    serve(make_env, claims={"name": "mine", "profiles": ["core"], "collision": ["priority"], "on_goal": ["finish"]},
          read_state=read_state)

The environment is one of two kinds:

- lists, as POGEMA's own: `reset()` gives observations and infos, `step(actions)` gives observations, rewards,
  terminated, truncated and infos, each a list with one entry for each agent;
- dictionaries, as a `ParallelEnv` of PettingZoo: the same keyed by the names in `possible_agents`, where agents drop
  out of `agents` and of the answers as they end. While there are any in `agents`, only they are given actions;
  afterwards all are, since the checks play on after the end.

The checks ask of all agents, also of those that have dropped out. For them `read_state` may give `rewards`,
`terminated`, `truncated` and `observations` too, as lists for all agents. What it leaves out is put down as the rules
have it: no reward, terminated if it was, truncated from `max_steps` on. All its other keys go into the answers as they
are: so can `occupied`, `on_goal` or `metrics`. Without them `metrics` are taken from the first info.

`python3 environment_object.py --example` serves the environment of template.py in the form of a ParallelEnv.
"""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Callable
from typing import Any

Record = dict[str, Any]

FILLED = ("rewards", "terminated", "truncated", "observations")


class Refusal(Exception):
    """A question that is answered with an error."""


def native(value: Any) -> Any:
    """What JSON has no form for: arrays and their numbers as Python's own."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"an answer cannot hold a {type(value).__name__}")


def told(observations: list[Any], at_reset: bool) -> Any:
    """Observations in the form of the protocol; where each agent has a dictionary, one list for each of its names."""
    if not isinstance(observations[0], dict):
        return observations
    arrays = {name: [each[name] for each in observations] for name in observations[0]}
    obstacles = arrays.pop("global_obstacles", None)
    if obstacles and at_reset:  # one grid for all
        arrays["global_obstacles"] = ["".join(".#"[bool(cell)] for cell in row) for row in obstacles[0]]
    return arrays


class Episodes:
    """One environment at work."""

    def __init__(self, env: Any, instance: Record, read_state: Callable[[Any], Record], profiles: list[str]) -> None:
        self.env, self.read_state, self.profiles = env, read_state, profiles
        self.num_agents, self.max_steps = len(instance["starts"]), instance["config"]["max_steps"]
        self.elapsed, self.terminated = 0, [False] * self.num_agents

    def listed(self, values: Any, for_the_rest: list[Any]) -> list[Any]:
        """One value for each agent, whatever the environment's kind."""
        if not isinstance(values, dict):
            return list(values)
        return [values.get(name, other) for name, other in zip(self.env.possible_agents, for_the_rest)]

    def reset(self, seed: Any) -> Record:
        """Begins an episode."""
        result = self.env.reset() if seed is None else self.env.reset(seed=seed)
        self.elapsed, self.terminated = 0, [False] * self.num_agents
        return self.answer(result[0] if isinstance(result, tuple) else result, self.read_state(self.env), {})

    def step(self, actions: Any) -> Record:
        """Plays a step."""
        if not isinstance(actions, list) or len(actions) != self.num_agents:
            raise Refusal(f"expected {self.num_agents} actions")
        given: Any = list(actions)
        if hasattr(self.env, "possible_agents"):
            by_name = dict(zip(self.env.possible_agents, actions))
            given = {name: by_name[name] for name in self.env.agents} or by_name
        observations, rewards, terminated, truncated, infos = self.env.step(given)
        self.elapsed += 1
        state, late = self.read_state(self.env), [self.elapsed >= self.max_steps] * self.num_agents
        self.terminated = [bool(flag) for flag in self.listed(terminated, state.get("terminated", self.terminated))]
        results: Record = {
            "rewards": [float(each) for each in self.listed(rewards, state.get("rewards", [0.0] * self.num_agents))],
            "terminated": self.terminated,
            "truncated": [bool(flag) for flag in self.listed(truncated, state.get("truncated", late))],
        }
        if "metrics" in self.profiles:
            results["metrics"] = self.listed(infos, [{}] * self.num_agents)[0].get("metrics")
        return self.answer(observations, state, results)

    def answer(self, observations: Any, state: Record, results: Record) -> Record:
        """What the answers to a reset and to a step have in common."""
        answer = {**results, **{key: value for key, value in state.items() if key not in FILLED}}
        if "observations" in self.profiles:
            seen = self.listed(observations, state.get("observations", [None] * self.num_agents))
            if any(each is None for each in seen):
                raise Refusal("an agent has dropped out, and `read_state` gives no observations")
            answer["observations"] = told(seen, at_reset=not results)
        return answer


class Server:
    """Answers one question after the other."""

    def __init__(self, make_env: Callable[[Record], Any], claims: Record, read_state: Callable[[Any], Record]) -> None:
        self.make_env, self.read_state = make_env, read_state
        self.claims = {"protocol": "pogema-conform/1", **claims}
        self.episodes: Episodes | None = None

    def answer(self, question: Any) -> Record:
        """The answer to any question but `bye`."""
        kind = question.get("type") if isinstance(question, dict) else None
        if kind == "hello":
            return self.claims
        if kind == "reset":
            if "config" in question:
                raise Refusal("only instances can be played")
            if "instance" in question:
                env, self.episodes = self.make_env(question["instance"]), None
                self.episodes = Episodes(env, question["instance"], self.read_state, self.claims["profiles"])
        if kind == "reset" and self.episodes is not None:
            return self.episodes.reset(question.get("seed"))
        if kind == "step" and self.episodes is not None:
            return self.episodes.step(question.get("actions"))
        raise Refusal("this is not claimed, or comes too early")


def serve(
    make_env: Callable[[Record], Any],
    *,
    claims: Record,
    read_state: Callable[[Any], Record],
    trace: bool = False,
) -> None:
    """Answers questions until `bye`. With `trace`, what the environment raises is shown on stderr besides."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever the environment prints, it prints to stderr
    server = Server(make_env, claims, read_state)
    encode = json.JSONEncoder(separators=(",", ":"), default=native, check_circular=False).encode
    for line in sys.stdin:
        try:
            question = json.loads(line)
            if isinstance(question, dict) and question.get("type") == "bye":
                return
            reply = encode(server.answer(question))
        except Refusal as refusal:
            reply = encode({"error": str(refusal)})
        except Exception as error:  # the environment refuses in its own way
            if trace:
                traceback.print_exc()
            reply = encode({"error": f"{type(error).__name__}: {error}"})
        out.write(reply + "\n")
        out.flush()


class ExampleParallelEnv:
    """The environment of template.py, spoken to as one speaks to a ParallelEnv."""

    def __init__(self, environment: Any) -> None:
        self.environment = environment
        self.possible_agents = [f"agent_{number}" for number in range(len(environment.starts))]
        self.agents: list[str] = []
        self.results: tuple[list[Any], ...] = ([], [], [])

    def observe(self) -> list[list[int]]:
        """What everybody sees, as numbers."""
        return [[int(bit) for bit in bits] for bits in self.environment.observe()]

    def of_agents(self, values: list[Any]) -> Record:
        """The values of those who have not dropped out."""
        return {name: value for name, value in zip(self.possible_agents, values) if name in self.agents}

    def reset(self, seed: Any = None, options: Any = None) -> tuple[Record, Record]:
        """Begins an episode."""
        self.environment.reset()
        self.agents = list(self.possible_agents)
        return self.of_agents(self.observe()), {name: {} for name in self.agents}

    def step(self, actions: Record) -> tuple[Record, Record, Record, Record, Record]:
        """Plays a step; then those that are terminated or truncated drop out."""
        self.results = self.environment.step([actions.get(name, 0) for name in self.possible_agents])
        observations = self.of_agents(self.observe())
        infos: Record = {name: {} for name in self.agents}
        rewards, terminated, truncated = (self.of_agents(values) for values in self.results)
        self.agents = [name for name in self.agents if not (terminated[name] or truncated[name])]
        return observations, rewards, terminated, truncated, infos


def read_example(env: ExampleParallelEnv) -> Record:
    """Cells, goals and who is active, and what those see and get who have dropped out."""
    inner, (rewards, terminated, truncated) = env.environment, env.results
    state = {"cells": inner.cells, "goals": inner.goals, "active": inner.active}
    if len(env.agents) == len(env.possible_agents):
        return state
    results = {"rewards": rewards, "terminated": terminated, "truncated": truncated}
    return {**state, **results, "observations": env.observe()}


def serve_example() -> None:
    """How this module is used."""
    import template

    def make_env(instance: Record) -> ExampleParallelEnv:
        return ExampleParallelEnv(template.Environment(instance))

    serve(make_env, claims={**template.CLAIMS, "name": "example"}, read_state=read_example)


if __name__ == "__main__":
    if sys.argv[1:] != ["--example"]:
        sys.exit("usage: python3 environment_object.py --example")
    serve_example()
