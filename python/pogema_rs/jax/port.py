"""Serves `pogema_rs.jax` to the conformance kit: `pogema conform --port "python -m pogema_rs.jax.port"`.

Reads one question per line from standard input and writes one answer per line, as docs/PORTING.md describes.
"""

from __future__ import annotations

import json
import sys
from functools import partial
from typing import Any, Optional

import jax
import jax.numpy as jnp
import numpy as np

from pogema_rs.jax._observe import observe
from pogema_rs.jax._params import Params
from pogema_rs.jax._pool import Instance, Instances, pack
from pogema_rs.jax._state import State, reset
from pogema_rs.jax._step import Outcome, step

CLAIMS = {
    "protocol": "pogema-conform/1",
    "name": "pogema_rs.jax",
    "version": "1",
    "profiles": ["core", "observations"],
    "collision": ["priority", "block_both", "soft"],
    "on_goal": ["finish", "nothing", "restart"],
    "observation": ["default"],
    "occupancy": ["as_released", "exact"],
    "reward": ["own", "shared"],
    "noise": True,
    "tells": ["on_goal", "occupied"],
}

#: Sides of maps are rounded up to multiples of this number, so that fewer functions are compiled. The wall around the
#: map stays where it is; the cells beyond it are never entered.
_ROUNDING = 8

_reset = partial(jax.jit, static_argnums=0)(reset)
_step = partial(jax.jit, static_argnums=0)(step)
_observe = partial(jax.jit, static_argnums=(0, 2))(observe)


class Port:
    """Answers questions. A refusal is also an answer."""

    def __init__(self) -> None:
        self._params: Optional[Params] = None
        self._instances: Optional[Instances] = None
        self._state: Optional[State] = None

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """Answers one question."""
        if question["type"] == "hello":
            return dict(CLAIMS)
        try:
            if question["type"] == "reset" and "instance" in question:
                self._params, self._instances = _read(question["instance"])
                self._state = _reset(self._params, self._instances, 0)
                return self._describe(self._state, None)
            if question["type"] == "step" and self._params and self._state and self._instances:
                actions = _actions(question["actions"], self._params.num_agents)
                before = self._state
                self._state, outcome = _step(self._params, self._instances, before, actions)
                return self._describe(self._state, outcome)
            raise ValueError(f"the question {question['type']!r} is not claimed, or came before an instance")
        except (KeyError, TypeError, ValueError) as error:
            return {"error": f"{type(error).__name__}: {error}"}

    def _describe(self, state: State, outcome: Optional[Outcome]) -> dict[str, Any]:
        assert self._params is not None
        params = self._params
        windows = np.asarray(_observe(params, state, jnp.uint8)).reshape(params.num_agents, -1)
        values = {
            "cells": _pairs(params, state.cells),
            "goals": _pairs(params, state.goals),
            "active": np.asarray(state.active).tolist(),
            "on_goal": np.asarray(state.on_goal).tolist(),
            "occupied": _pairs(params, np.flatnonzero(np.asarray(state.occupied))),
            "observations": [np.packbits(window).tobytes().hex() for window in windows],
        }
        if outcome is not None:
            values.update({name: np.asarray(found).tolist() for name, found in outcome._asdict().items()})
        return values


def _actions(values: Any, num_agents: int) -> jax.Array:
    if len(values) != num_agents or any(value not in range(5) for value in values):
        raise ValueError(f"expected {num_agents} actions from 0 to 4")
    return jnp.asarray(values, jnp.int32)


def _pairs(params: Params, cells: Any) -> list[list[int]]:
    """Returns cells as pairs of row and column on the map without its border."""
    cells = np.asarray(cells)
    rows, columns = cells // params.stride - params.obs_radius, cells % params.stride - params.obs_radius
    return np.stack([rows, columns], axis=-1).tolist()  # type: ignore[no-any-return, unused-ignore]


def _read(instance: dict[str, Any]) -> tuple[Params, Instances]:
    """Returns an instance of the protocol, packed."""
    config, rows = instance["config"], instance["map"]
    radius, height, width = config["radius"], len(rows), len(rows[0])
    params = Params(
        num_agents=config["num_agents"],
        height=-(-height // _ROUNDING) * _ROUNDING,
        width=-(-width // _ROUNDING) * _ROUNDING,
        obs_radius=radius,
        collision_system=config["collision"],
        on_target=config["on_goal"],
        max_episode_steps=min(config["max_steps"], 2**31 - 1),
        exact_occupancy=config["occupancy"] == "exact",
        shared_rewards=config["reward"] == "shared",
    )
    obstacles = np.zeros((params.height + 2 * radius, params.stride), dtype=bool)
    if instance["outside"] != "free":
        obstacles[: height + 2 * radius, : width + 2 * radius] = _grid(instance["outside"]["noise"])
    obstacles[radius - 1 : radius + height + 1, radius - 1 : radius + width + 1] = True
    obstacles[radius : radius + height, radius : radius + width] = _grid(rows)
    goals = [_places(params, cells) for cells in instance["goals"]]
    if params.on_target != "restart":
        goals = [cells[:1] for cells in goals]
    packed = pack(params, [Instance(obstacles, _places(params, instance["starts"]), goals)])
    # Lists of goals of similar length share a compiled function.
    room = 1 << (len(packed.goals) - 1).bit_length()
    return params, packed._replace(goals=jnp.pad(packed.goals, (0, room - len(packed.goals))))


def _grid(rows: list[str]) -> np.ndarray:
    return np.array([[cell == "#" for cell in row] for row in rows])


def _places(params: Params, cells: Any) -> np.ndarray:
    pairs = np.asarray(cells, dtype=np.int64) + params.obs_radius
    return np.asarray(pairs[:, 0] * params.stride + pairs[:, 1])


def main() -> None:
    """Answers questions until `bye` or the end of the input."""
    port = Port()
    for line in sys.stdin:
        question = json.loads(line)
        if question["type"] == "bye":
            break
        print(json.dumps(port.answer(question), separators=(",", ":")), flush=True)


if __name__ == "__main__":
    main()
