"""Serves any environment object in Python as a port: write two functions, and call `serve`.

    from environment_object import serve

    def make_env(instance):             # returns an environment for an instance, see docs/PORTING.md
        return MyEnv(instance["map"], instance["starts"], instance["goals"], **instance["config"])

    def read_state(env):                # returns cells and goals in map coordinates, without the border
        return {"cells": env.cells, "goals": env.goals, "active": env.active}

    serve(make_env, claims={"name": "mine", "profiles": ["core"], "collision": ["priority"], "on_goal": ["finish"]},
          read_state=read_state)

Two kinds of environments are supported:

- lists, as in POGEMA: `reset()` returns observations and infos, `step(actions)` returns observations, rewards,
  terminated, truncated and infos, each a list with one entry for each agent;
- dictionaries, as in a `ParallelEnv` of PettingZoo: the same, keyed by the names in `possible_agents`. Terminated and
  truncated agents drop out of `agents` and of the results. While `agents` is not empty, only the agents in it get
  actions. Afterwards all agents get actions, because the checks continue after the end.

The answers must cover all agents, including those that have dropped out. For them, `read_state` may also return
`rewards`, `terminated`, `truncated` and `observations`, as lists for all agents. Missing values follow the rules:
reward 0, terminated if the agent was terminated before, truncated from `max_steps` on. All other keys of `read_state`,
such as `occupied`, `on_goal` or `metrics`, are copied into the answers. If `metrics` is missing, the first info
provides it.

`python3 environment_object.py --example` serves the environment of template.py as a ParallelEnv.
"""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Callable
from typing import Any

Record = dict[str, Any]

RESULT_KEYS = ("rewards", "terminated", "truncated", "observations")


class Refusal(Exception):
    """The error with which the port answers a question."""


def to_native(value: Any) -> Any:
    """Converts arrays and their numbers, which JSON cannot encode, to Python's own types."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"an answer cannot contain a value of type {type(value).__name__}")


def to_protocol(observations: list[Any], at_reset: bool) -> Any:
    """Converts observations to the form of the protocol: if they are dictionaries, one list for each key."""
    if not isinstance(observations[0], dict):
        return observations
    arrays = {name: [each[name] for each in observations] for name in observations[0]}
    obstacles = arrays.pop("global_obstacles", None)
    if obstacles and at_reset:  # all agents share one grid
        arrays["global_obstacles"] = ["".join(".#"[bool(cell)] for cell in row) for row in obstacles[0]]
    return arrays


class Episodes:
    """The episodes of one environment."""

    def __init__(self, env: Any, instance: Record, read_state: Callable[[Any], Record], profiles: list[str]) -> None:
        self.env, self.read_state, self.profiles = env, read_state, profiles
        self.num_agents, self.max_steps = len(instance["starts"]), instance["config"]["max_steps"]
        self.elapsed, self.terminated = 0, [False] * self.num_agents

    def listed(self, values: Any, defaults: list[Any]) -> list[Any]:
        """Returns one value for each agent; `defaults` provides the values of agents that dropped out."""
        if not isinstance(values, dict):
            return list(values)
        return [values.get(name, other) for name, other in zip(self.env.possible_agents, defaults)]

    def reset(self, seed: Any) -> Record:
        """Begins an episode; returns the answer."""
        result = self.env.reset() if seed is None else self.env.reset(seed=seed)
        self.elapsed, self.terminated = 0, [False] * self.num_agents
        return self.answer(result[0] if isinstance(result, tuple) else result, self.read_state(self.env), {})

    def step(self, actions: Any) -> Record:
        """Plays a step; returns the answer."""
        if not isinstance(actions, list) or len(actions) != self.num_agents:
            raise Refusal(f"expected {self.num_agents} actions")
        env_actions: Any = list(actions)
        if hasattr(self.env, "possible_agents"):
            by_name = dict(zip(self.env.possible_agents, actions))
            env_actions = {name: by_name[name] for name in self.env.agents} or by_name
        observations, rewards, terminated, truncated, infos = self.env.step(env_actions)
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
        """Returns the answer to a reset or a step."""
        answer = {**results, **{key: value for key, value in state.items() if key not in RESULT_KEYS}}
        if "observations" in self.profiles:
            seen = self.listed(observations, state.get("observations", [None] * self.num_agents))
            if any(each is None for each in seen):
                raise Refusal("an agent has dropped out, and `read_state` returns no observations for it")
            answer["observations"] = to_protocol(seen, at_reset=not results)
        return answer


class Server:
    """The port: answers questions about its current environment."""

    def __init__(self, make_env: Callable[[Record], Any], claims: Record, read_state: Callable[[Any], Record]) -> None:
        self.make_env, self.read_state = make_env, read_state
        self.claims = {"protocol": "pogema-conform/1", **claims}
        self.episodes: Episodes | None = None

    def answer(self, question: Any) -> Record:
        """Returns the answer to a question other than `bye`."""
        kind = question.get("type") if isinstance(question, dict) else None
        if kind == "hello":
            return self.claims
        if kind == "reset":
            if "config" in question:
                raise Refusal("configs are not supported, expected an instance")
            if "instance" in question:
                # If the environment rejects the instance, no earlier environment may answer for this instance.
                self.episodes = None
                env = self.make_env(question["instance"])
                self.episodes = Episodes(env, question["instance"], self.read_state, self.claims["profiles"])
        if kind == "reset" and self.episodes is not None:
            return self.episodes.reset(question.get("seed"))
        if kind == "step" and self.episodes is not None:
            return self.episodes.step(question.get("actions"))
        raise Refusal("this port does not support this question, or no instance was sent yet")


def serve(
    make_env: Callable[[Record], Any],
    *,
    claims: Record,
    read_state: Callable[[Any], Record],
    trace: bool = False,
) -> None:
    """Answers questions until `bye`. With `trace`, also prints the environment's exceptions to stderr."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # anything the environment prints goes to stderr
    server = Server(make_env, claims, read_state)
    encode = json.JSONEncoder(separators=(",", ":"), default=to_native, check_circular=False).encode
    for line in sys.stdin:
        try:
            question = json.loads(line)
            if isinstance(question, dict) and question.get("type") == "bye":
                return
            reply = encode(server.answer(question))
        except Refusal as refusal:
            reply = encode({"error": str(refusal)})
        except Exception as error:  # noqa: BLE001 - the environment may raise anything
            if trace:
                traceback.print_exc()
            reply = encode({"error": f"{type(error).__name__}: {error}"})
        out.write(reply + "\n")
        out.flush()


class ExampleParallelEnv:
    """The environment of template.py with the interface of a ParallelEnv."""

    def __init__(self, environment: Any) -> None:
        self.environment = environment
        self.possible_agents = [f"agent_{number}" for number in range(len(environment.starts))]
        self.agents: list[str] = []
        self.results: tuple[list[Any], ...] = ([], [], [])

    def observe(self) -> list[list[int]]:
        """Returns the observations of all agents, as numbers."""
        return [[int(bit) for bit in bits] for bits in self.environment.observe()]

    def of_agents(self, values: list[Any]) -> Record:
        """Returns the values of the agents that have not dropped out, by name."""
        return {name: value for name, value in zip(self.possible_agents, values) if name in self.agents}

    def reset(self, seed: Any = None, options: Any = None) -> tuple[Record, Record]:
        """Begins an episode; returns observations and infos."""
        self.environment.reset()
        self.agents = list(self.possible_agents)
        return self.of_agents(self.observe()), {name: {} for name in self.agents}

    def step(self, actions: Record) -> tuple[Record, Record, Record, Record, Record]:
        """Plays a step; then terminated and truncated agents drop out."""
        self.results = self.environment.step([actions.get(name, 0) for name in self.possible_agents])
        observations = self.of_agents(self.observe())
        infos: Record = {name: {} for name in self.agents}
        rewards, terminated, truncated = (self.of_agents(values) for values in self.results)
        self.agents = [name for name in self.agents if not (terminated[name] or truncated[name])]
        return observations, rewards, terminated, truncated, infos


def read_example(env: ExampleParallelEnv) -> Record:
    """Returns cells, goals and activity; if agents have dropped out, also results and observations."""
    inner, (rewards, terminated, truncated) = env.environment, env.results
    state = {"cells": inner.cells, "goals": inner.goals, "active": inner.active}
    if len(env.agents) == len(env.possible_agents):
        return state
    results = {"rewards": rewards, "terminated": terminated, "truncated": truncated}
    return {**state, **results, "observations": env.observe()}


def serve_example() -> None:
    """Serves the example environment."""
    import template

    def make_env(instance: Record) -> ExampleParallelEnv:
        return ExampleParallelEnv(template.Environment(instance))

    serve(make_env, claims={**template.CLAIMS, "name": "example"}, read_state=read_example)


if __name__ == "__main__":
    if sys.argv[1:] != ["--example"]:
        sys.exit("usage: python3 environment_object.py --example")
    serve_example()
