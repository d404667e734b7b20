"""Drives one POGEMA environment operation by operation, and records everything that is visible from outside."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pogema import BatchAStarAgent, GridConfig, pogema_v0
from pogema.wrappers.metrics import AgentsDensityWrapper

from deadline import LIMIT, Timeout, deadline

Record = dict[str, Any]
Array = NDArray[Any]

FLOAT32 = np.dtype(np.float32)
INTEGER = (int, np.integer)
MAX_GOAL_LIST_STEPS = 4096


class ProtocolError(ValueError):
    """The request is invalid; POGEMA is not at fault."""


def unpad(cells: Any, radius: int) -> list[list[Any]]:
    """Converts positions to map coordinates, without the padding."""
    return [[row - radius, column - radius] for row, column in cells]


def draw(grid: Array) -> list[str]:
    """Draws a grid as rows of '.' for 0, '#' for 1 and '?' for other values."""
    codes = np.full(grid.shape, ord("?"), np.uint8)
    codes[grid == 0] = ord(".")
    codes[grid == 1] = ord("#")
    text, width = codes.tobytes().decode("ascii"), grid.shape[1]
    return [text[start : start + width] for start in range(0, len(text), width)]


def same(left: Array, right: Array) -> bool:
    """Returns whether two arrays are equal in type, shape and every bit."""
    return left is right or (left.dtype, left.shape, left.tobytes()) == (right.dtype, right.shape, right.tobytes())


def pack(name: str, windows: list[Array], shape: tuple[int, ...], odd: list[str]) -> list[str]:
    """Encodes the window of each agent as hexadecimal; reports unexpected types, shapes and values in `odd`."""
    if wrong := [i for i, window in enumerate(windows) if window.dtype != FLOAT32 or window.shape != shape]:
        odd.extend(f"{name}[{i}] is {windows[i].dtype} {windows[i].shape}" for i in wrong)
        return [np.packbits(window.ravel() != 0).tobytes().hex() for window in windows]
    values = np.concatenate(windows).reshape(len(windows), -1)
    bits = values != 0
    if not same(bits.astype(FLOAT32), values):
        # As strings, because -0.0 equals 0.0.
        unexpected = [(i, set(map(repr, row.tolist())) - {"0.0", "1.0"}) for i, row in enumerate(values)]
        odd.extend(f"{name}[{i}] has values [{', '.join(sorted(found))}]" for i, found in unexpected if found)
    packed = np.packbits(bits, axis=1)
    text, size = packed.tobytes().hex(), 2 * packed.shape[1]
    return [text[start : start + size] for start in range(0, len(text), size)]


def is_integer_pair(value: Any) -> bool:
    """Returns whether a value is a tuple of two integers of Python or NumPy."""
    if type(value) is not tuple or len(value) != 2:
        return False
    row, column = value
    return isinstance(row, INTEGER) and isinstance(column, INTEGER) and bool not in (type(row), type(column))


class Episodes:
    """The state of one request: its environment, its last observations, and its config, which POGEMA may change."""

    def __init__(self, config: GridConfig, density: bool) -> None:
        """Makes the environment."""
        env = pogema_v0(grid_config=config)
        if config.integration not in (None, "SampleFactory"):
            raise ProtocolError(f"`integration` is `{config.integration}`, expected none or `SampleFactory`")
        self.env = AgentsDensityWrapper(env) if density else env
        self.base = self.env.unwrapped
        self.config = config
        self.radius = config.obs_radius
        self.observations: Any = None
        self.obstacles_at_reset: Array | None = None
        self.planner: BatchAStarAgent | None = None

    def perform(self, op: Any) -> Record:
        """Executes one operation; returns its record."""
        match op:
            case ["reset", seed]:
                return self.reset(seed)
            case ["step", list(actions)]:
                return self.step("step", actions)
            case ["astar"]:
                self.planner = self.planner or BatchAStarAgent()
                return self.step("astar", self.planner.act(self.observations))
            case ["sample"]:
                return self.step("sample", self.env.sample_actions())
            case ["back"]:
                return {"op": "back", "moved": self.env.step_back(), **self.state()}
            case ["history"]:
                return self.history()
        raise ProtocolError(f"unknown operation: {json.dumps(op)}")

    def reset(self, seed: Any) -> Record:
        """Resets the environment and records the whole instance."""
        self.observations, _ = self.env.reset() if seed is None else self.env.reset(seed=seed)
        self.obstacles_at_reset = None
        if self.planner is not None:
            self.planner.reset_states()
        config, grid, radius = self.base.grid_config, self.base.grid.obstacles, self.radius
        rows = draw(grid)
        return {
            "op": "reset",
            "derived": {name: getattr(config, name) for name in ("width", "height", "size", "density", "num_agents")},
            "map": [row[radius:-radius] for row in rows[radius:-radius]],
            "padded": {"dtype": str(grid.dtype), "rows": rows},
            **self.state(),
            "observations": self.observed(),
            **(self.goal_lists() if config.on_target == "restart" else {}),
        }

    def step(self, name: str, actions: Any) -> Record:
        """Plays a step and records the results. `actions` is the caller's container; POGEMA may write to it."""
        requested = list(actions)
        self.observations, rewards, terminated, truncated, infos = self.env.step(actions)
        return {
            "op": name,
            "actions": requested,
            "actions_after": list(actions),
            **self.state(),
            "rewards": rewards,
            "terminated": terminated,
            "truncated": truncated,
            "infos_active": [info["is_active"] for info in infos],
            "observations": self.observed(),
            "metrics": infos[0].get("metrics"),
        }

    def history(self) -> Record:
        """Returns the history of a persistent environment: all steps, and all changes."""

        def rows(histories: Any) -> list[Any]:
            r = self.radius
            return [[[s.x - r, s.y - r, s.tx - r, s.ty - r, s.step, s.active] for s in states] for states in histories]

        return {"op": "history", "full": rows(self.env.get_full_history()), "changes": rows(self.env.get_history())}

    def state(self) -> Record:
        """Returns the state of all agents, and the occupied cells, which may differ from the cells of the agents."""
        grid = self.base.grid
        return {
            "cells": unpad(grid.positions_xy, self.radius),
            "goals": unpad(grid.finishes_xy, self.radius),
            "active": list(grid.is_active.values()),
            "on_goal": list(self.base.was_on_goal),
            "occupied": unpad(np.argwhere(grid.positions).tolist(), self.radius),
        }

    def observed(self) -> Record:
        """Encodes and checks the last observations."""
        kind, side, seen = self.config.observation_type, 2 * self.radius + 1, self.observations
        odd: list[str] = []
        if kind == "default":
            record = {"type": kind, "dtype": str(seen[0].dtype), "windows": pack("windows", seen, (3, side, side), odd)}
        else:
            record = {"type": kind, "dtype": str(seen[0]["obstacles"].dtype)}
            for name in ("obstacles", "agents"):
                record[name] = pack(name, [one[name] for one in seen], (side, side), odd)
            record.update(self.pairs("xy", odd), **self.pairs("target_xy", odd))
        if kind == "MAPF":
            record["global_obstacles"] = self.global_obstacles(odd)
            record.update(self.pairs("global_xy", odd), **self.pairs("global_target_xy", odd))
        return {**record, "odd": odd} if odd else record

    def pairs(self, name: str, odd: list[str]) -> Record:
        """Returns one position per agent, unchanged; reports values other than integer pairs in `odd`."""
        values = [one[name] for one in self.observations]
        odd.extend([f"{name}[{i}] is {value!r}" for i, value in enumerate(values) if not is_integer_pair(value)])
        return {name: values}

    def global_obstacles(self, odd: list[str]) -> Record | None:
        """Returns the padded grid that all agents observe, or null if it equals the grid of the last reset."""
        first, *others = [one["global_obstacles"] for one in self.observations]
        odd.extend([f"global_obstacles[{i}] is not [0]" for i, other in enumerate(others, 1) if not same(first, other)])
        if self.obstacles_at_reset is not None and same(first, self.obstacles_at_reset):
            return None
        expected = np.float64 if self.config.empty_outside else np.int64
        if first.dtype != expected or first.shape != self.base.grid.obstacles.shape:
            odd.append(f"global_obstacles is {first.dtype} {first.shape}")
        if unexpected := set(np.unique(first).tolist()) - {0, 1}:
            odd.append(f"global_obstacles has values {sorted(unexpected)}")
        if self.obstacles_at_reset is None:
            self.obstacles_at_reset = first
        return {"dtype": str(first.dtype), "rows": draw(first)}

    def goal_lists(self) -> Record:
        """Returns the future goals, null for long episodes, or null and the reason if POGEMA fails or times out."""
        if self.config.max_episode_steps > MAX_GOAL_LIST_STEPS:
            return {"goal_lists": None}
        try:
            with deadline(LIMIT / 10):
                lists = self.base.get_lifelong_targets_xy(ignore_borders=True)
                return {"goal_lists": [unpad(goals, 0) for goals in lists]}
        except (Exception, Timeout) as error:  # noqa: BLE001 - POGEMA may raise anything
            return {"goal_lists": None, "goal_lists_error": f"{type(error).__name__}: {error}"}
