"""POGEMA through its PettingZoo integration, as a port; an example of `environment_object.serve` besides.

Works with the POGEMA that is installed, from 1.2.2 to 1.4.0. Only the default observation can be had in this way: the
integration fails on others. Metrics get lost with the agent in whose info they are, and are not claimed.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

from pogema import pogema_v0

import pogema_release as release
import pogema_views as views
from environment_object import serve

Record = dict[str, Any]

CLAIMED = ("version", "collision", "on_goal", "noise", "max_radius", "max_side", "max_agents")


def make_env(instance: Record) -> Any:
    """A ParallelEnv that plays an instance, and that remembers what its inner environment gave last."""
    config = release.config_of(instance)
    config.integration = "PettingZoo"
    env = pogema_v0(grid_config=config)
    release.settle(env.pogema.unwrapped, instance)
    play = env.pogema.step

    def play_and_remember(actions: list[int]) -> Any:
        env.results = play(actions)
        return env.results

    env.pogema.step = play_and_remember
    return env


def read_state(env: Any) -> Record:
    """Cells, goals and who is active, and what those see and get who have dropped out."""
    base = env.pogema.unwrapped
    grid, radius = base.grid, base.grid_config.obs_radius
    state = {
        "cells": views.plain(grid.positions_xy, radius),
        "goals": views.plain(grid.finishes_xy, radius),
        "active": list(grid.is_active.values()),
        "on_goal": list(base.was_on_goal),
        "occupied": views.plain(zip(*grid.positions.nonzero()), radius),
    }
    if len(env.agents) == len(env.possible_agents):
        return state
    observations, rewards, terminated, truncated, _ = env.results
    results = {"rewards": rewards, "terminated": terminated, "truncated": truncated}
    return {**state, **results, "observations": observations}


def main() -> None:
    """Claims what the integration can do, and serves."""
    warnings.simplefilter("ignore")
    if "soft" not in release.choices("collision_system"):
        sys.exit("pogema_pettingzoo.py: POGEMA 1.2.2 or later is needed, whose steps tell terminated from truncated")
    claims = {key: value for key, value in release.claims(raw=True).items() if key in CLAIMED}
    claims["name"] = "pogema (PettingZoo)"
    claims["profiles"] = ["core", "observations"]
    claims["observation"] = ["default"]
    claims["tells"] = ["on_goal", "occupied"]
    serve(make_env, claims=claims, read_state=read_state)


if __name__ == "__main__":
    main()
