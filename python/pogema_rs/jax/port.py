"""Serves `pogema_rs.jax` to the conformance kit: `python -m pogema_rs.jax.port`.

The port pads instances to a few sizes, so that few functions are compiled. `--cache FOLDER` keeps the compiled
functions in a folder [default: none].
"""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any, Optional

import jax
import numpy as np

from pogema_rs import __version__, _engine
from pogema_rs.jax._config import Config
from pogema_rs.jax._density import density_counts
from pogema_rs.jax._metrics import exact_metrics
from pogema_rs.jax._observe import marks, observe_rows
from pogema_rs.jax._pack import pack_grids
from pogema_rs.jax._pool import HostInstances, Params, make_params, make_pool
from pogema_rs.jax._state import State, reset
from pogema_rs.jax._step import step

Record = dict[str, Any]

CLAIMS: Record = {
    "protocol": "pogema-conform/1",
    "name": "pogema_rs.jax",
    "version": __version__,
    "profiles": ["core", "observations", "metrics", "history", "policies"],
    "collision": ["priority", "block_both", "soft"],
    "on_goal": ["finish", "nothing", "restart"],
    "observation": ["default", "POMAPF", "MAPF"],
    "occupancy": ["as_released", "exact"],
    "reward": ["own", "shared"],
    "noise": True,
    "metrics": [
        "ISR",
        "CSR",
        "ep_length",
        "SoC",
        "makespan",
        "avg_throughput",
        "avg_agents_density",
        "a_collisions",
        "o_collisions",
    ],
    "tells": ["on_goal", "occupied", "padded", "actions_after"],
    "max_radius": 128,
}
# JAX keeps all compiled functions, and each takes dozens of the 65,530 memory maps that Linux gives a process.
MAX_SIZES = 64
_compiled_for: set[Any] = set()


class Refusal(Exception):
    """A question that the port answers with an error."""


@jax.jit
def _begin(params: Params) -> tuple[State, Any]:
    state = reset(params, np.int32(0))
    return state, _seen(params, state)


@jax.jit
def _play(params: Params, state: State, actions: jax.Array) -> tuple[State, Any, Any]:
    after, out = step(params, state, actions)
    return after, _seen(params, after), out


@jax.jit
def _seen(params: Params, state: State) -> Any:
    return observe_rows(params, state), marks(params.config, state), density_counts(params, state)


class Episode:
    """One instance, and the states of its episode."""

    def __init__(self, instance: Record, measured: list[str]) -> None:
        rules = instance["config"]
        self.rules, self.measured = rules, measured
        self.num_agents, self.radius = rules["num_agents"], rules["radius"]
        cells = np.array([[cell == "#" for cell in row] for row in instance["map"]], dtype=np.uint8)
        self.size = cells.shape
        self.params = _params(instance, cells)
        self.states: list[Any] = []
        self.means: list[float] = []
        self.agents: Optional[list[Any]] = None
        state, self.seen = _begin(self.params)
        self._keep(state)
        self._measure()

    @property
    def state(self) -> Any:
        """The current state, on the host."""
        return self.states[-1]

    def _keep(self, state: Any) -> None:
        # One transfer for all arrays, which the answers then read several times.
        state, self.seen = jax.device_get((state, self.seen))
        self.states.append(state)

    def step(self, actions: Any) -> Record:
        """Plays a step, and returns the whole answer."""
        is_list = isinstance(actions, list) and len(actions) == self.num_agents
        if not is_list or any(type(action) is not int or not 0 <= action <= 4 for action in actions):
            raise Refusal(f"expected {self.num_agents} actions from 0 to 4")
        padded = np.zeros(self.params.config.num_agents, dtype=np.int32)
        padded[: self.num_agents] = actions
        before = self.state
        state, self.seen, out = _play(self.params, before, padded)
        out = jax.device_get(out)
        if not self.rules["persistent"]:
            self.states.clear()
        self._keep(state)
        self._measure()
        num = self.num_agents
        stays = before.active & (before.cells == self.state.cells).all(-1)
        is_soft = self.rules["collision"] == "soft"
        return {
            "rewards": out.rewards[:num].tolist(),
            "terminated": out.terminated[:num].tolist(),
            "truncated": out.truncated[:num].tolist(),
            "actions": actions,
            "actions_after": [0 if is_soft and stays[agent] else action for agent, action in enumerate(actions)],
            "metrics": self._metrics(bool(out.ended)),
            **self.answer(),
        }

    def act(self, policy: str) -> Record:
        """Plays a step of POGEMA's A* agents."""
        if policy != "astar":
            raise Refusal(f"policy `{policy}` needs the seed of a config, and this port plays instances")
        if self.agents is None:
            self.agents = [_engine.AStarAgent(0) for _ in range(self.num_agents)]
        windows = self._windows()[:, 0].astype(np.float32)
        state, actions = self.state, []
        for index, agent in enumerate(self.agents):
            start = state.starts[index]
            here, goal = state.cells[index] - start, state.goals[index] - start
            action, _ = agent.act(tuple(here.tolist()), tuple(goal.tolist()), windows[index])
            actions.append(int(action))
        return self.step(actions)

    def back(self) -> Record:
        """Takes the last step back.

        Rule: history/step-back
        """
        if not self.rules["persistent"]:
            raise Refusal("steps are kept only with `persistent: true`")
        moved = len(self.states) > 1
        if moved:
            last = self.states.pop()
            kept = {name: getattr(last, name) for name in ("goal_index", "on_goal", "counts", "num_wraps")}
            self.states[-1] = self.state._replace(**kept)
            self.seen = jax.device_get(_seen(self.params, self.state))
        return {"moved": moved, **self.answer()}

    def history(self) -> Record:
        """Returns the changes of each agent, and its state at each step.

        Rule: history/changes
        """
        changes: list[list[Any]] = []
        full: list[list[Any]] = []
        for agent in range(self.num_agents):
            changes.append([])
            full.append([])
            for number, state in enumerate(self.states):
                cells = [*state.cells[agent].tolist(), *state.goals[agent].tolist()]
                entry = [*cells, number, bool(state.active[agent])]
                if not changes[-1] or [*changes[-1][-1][:4], changes[-1][-1][5]] != [*cells, entry[5]]:
                    changes[-1].append(entry)
                full[-1].append(changes[-1][-1])
        return {"full": full, "changes": changes}

    def answer(self, at_reset: bool = False) -> Record:
        """Returns the state and the observations."""
        num, state = self.num_agents, self.state
        grid = np.unpackbits(self.seen[1].view(np.uint8), axis=-1, bitorder="little")
        record = {
            "cells": state.cells[:num].tolist(),
            "goals": state.goals[:num].tolist(),
            "active": state.active[:num].tolist(),
            "on_goal": state.on_goal[:num].tolist(),
            "occupied": (np.argwhere(grid) - self.radius).tolist(),
            "observations": self._observations(at_reset),
        }
        if at_reset:
            record["padded"] = self._padded()
        return record

    def _windows(self) -> np.ndarray:
        rows = np.ascontiguousarray(self.seen[0][: self.num_agents])
        bits = np.unpackbits(rows.view(np.uint8), axis=-1, bitorder="little")
        return bits[..., : 2 * self.radius + 1]

    def _observations(self, at_reset: bool) -> Any:
        windows, state, num = self._windows(), self.state, self.num_agents
        kind = self.rules["observation"]
        if kind == "default":
            return [np.packbits(window).tobytes().hex() for window in windows]
        seen = {
            "obstacles": [np.packbits(window).tobytes().hex() for window in windows[:, 0]],
            "agents": [np.packbits(window).tobytes().hex() for window in windows[:, 1]],
            "xy": (state.cells - state.starts)[:num].tolist(),
            "target_xy": (state.goals - state.starts)[:num].tolist(),
        }
        if kind == "MAPF":
            seen["global_xy"] = (state.cells + self.radius)[:num].tolist()
            seen["global_target_xy"] = (state.goals + self.radius)[:num].tolist()
            if at_reset:
                seen["global_obstacles"] = self._padded()
        return seen

    def _padded(self) -> list[str]:
        grid = np.unpackbits(np.ascontiguousarray(self.state.obstacles).view(np.uint8), axis=-1, bitorder="little")
        rows, columns = (side + 2 * self.radius for side in self.size)
        return ["".join(".#"[cell] for cell in row) for row in grid[:rows, :columns]]

    def _measure(self) -> None:
        """Adds the density of one frame. Rule: metrics/density"""
        if "avg_agents_density" in self.measured:
            occupied, free = self.seen[2][: self.num_agents].T
            shares = np.where(free == 0, 0.0, occupied / np.maximum(free, 1))
            self.means.append(float(np.mean(shares)))

    def _metrics(self, ended: bool) -> Optional[Record]:
        if not ended:
            return None
        found: Record = {}
        if not self.rules["persistent"]:
            config, counts = self.params.config, self.state.counts
            found.update(exact_metrics(config, counts, self.num_agents, self.rules["max_steps"]) or {})
        if "avg_agents_density" in self.measured:
            found["avg_agents_density"] = float(np.mean(np.array(self.means)))
        for place, name in enumerate(("a_collisions", "o_collisions")):
            if name in self.measured:
                found[name] = int(self.state.counts.collisions[place])
        return found or None


def _params(instance: Record, cells: np.ndarray) -> Params:
    rules = instance["config"]
    height, width = cells.shape
    config = Config(
        num_agents=_room(rules["num_agents"], 4, 4),
        height=_room(height, 8, 4),
        width=_room(width, 8, 4),
        radius=rules["radius"],
        collision=rules["collision"],
        on_goal=rules["on_goal"],
        occupancy=rules["occupancy"],
        rewards=rules["reward"],
    )
    outside = instance.get("outside", "free")
    noise = None
    if outside != "free":
        noise = np.array([[[cell == "#" for cell in row] for row in outside["noise"]]], dtype=np.uint8)
    grids = pack_grids(config, cells[None], noise)
    goals = np.array([goal for goals in instance["goals"] for goal in goals]).reshape(-1, 2)
    counts = np.array([[len(goals) for goals in instance["goals"]]])
    made = HostInstances(grids, np.array([instance["starts"]]), goals, counts)
    pool = make_pool(config, made, capacity=_room(len(goals), 64, 16))
    _forget(config, len(pool.goals))
    return make_params(config, rules["max_steps"], pool)


def _forget(*sizes: Any) -> None:
    """Drops all compiled functions if they were compiled for too many sizes."""
    _compiled_for.add(sizes)
    if len(_compiled_for) > MAX_SIZES:
        jax.clear_caches()
        _compiled_for.clear()


def _room(size: int, least: int, factor: int) -> int:
    """Returns the first of `least`, `least * factor`, `least * factor**2` and so on that a size fits into."""
    room = least
    while room < size:
        room *= factor
    return room


class Port:
    """Answers questions. A refusal is also an answer."""

    episode: Optional[Episode] = None

    def answer(self, question: Record) -> Record:
        """Answers one question."""
        kind = question.get("type")
        if kind == "hello":
            return CLAIMS
        try:
            if kind == "reset" and "config" not in question:
                return self._reset(question)
            if self.episode is None:
                raise Refusal("expected a reset with an instance before this question")
            if kind in ("step", "act"):
                is_step = kind == "step"
                return self.episode.step(question["actions"]) if is_step else self.episode.act(question["policy"])
            if kind in ("back", "history"):
                return self.episode.back() if kind == "back" else self.episode.history()
            raise Refusal(f"the question {kind!r} is not claimed")
        except (KeyError, Refusal, TypeError, ValueError) as error:
            return {"error": f"{type(error).__name__}: {error}"}

    def _reset(self, question: Record) -> Record:
        if "instance" in question:
            self.instance, self.measured = question["instance"], []
        elif self.episode is None:
            raise Refusal("this reset needs an instance")
        if "measure" in question:
            self.measured = question["measure"]
        self.episode = Episode(self.instance, self.measured)
        return self.episode.answer(at_reset=True)


def main() -> None:
    """Reads one question per line and writes one answer per line, until `bye`."""
    parser = argparse.ArgumentParser(prog="python -m pogema_rs.jax.port", description=__doc__)
    parser.add_argument("--cache", metavar="FOLDER", help="folder for compiled functions")
    options = parser.parse_args()
    if options.cache is not None:
        jax.config.update("jax_compilation_cache_dir", options.cache)
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)
    port = Port()
    for line in sys.stdin:
        question = json.loads(line)
        if question.get("type") == "bye":
            break
        print(json.dumps(port.answer(question), separators=(",", ":")), flush=True)


if __name__ == "__main__":
    main()
