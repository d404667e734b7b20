"""Serves POGEMA through its PettingZoo integration as a port, and shows how to use `environment_object.serve`.

Works with the installed POGEMA, from 1.2.2 to 1.4.0. Claims only the default observation, because the integration fails
on others. Claims no metrics, because they are lost when the agent that holds them in its info drops out.
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
    """Returns a ParallelEnv that plays an instance and stores the last results of its inner environment."""
    config = release.config_of(instance)
    config.integration = "PettingZoo"
    env = pogema_v0(grid_config=config)
    release.patch_grids(env.pogema.unwrapped, instance)
    play = env.pogema.step

    def play_and_store(actions: list[int]) -> Any:
        env.results = play(actions)
        return env.results

    env.pogema.step = play_and_store
    return env


def read_state(env: Any) -> Record:
    """Returns the cells, goals and flags of all agents and the occupied cells; if agents have dropped out, also results
    and observations."""
    base = env.pogema.unwrapped
    grid, radius = base.grid, base.grid_config.obs_radius
    state = {
        "cells": views.cell_lists(grid.positions_xy, radius),
        "goals": views.cell_lists(grid.finishes_xy, radius),
        "active": list(grid.is_active.values()),
        "on_goal": list(base.was_on_goal),
        "occupied": views.cell_lists(zip(*grid.positions.nonzero()), radius),
    }
    if len(env.agents) == len(env.possible_agents):
        return state
    observations, rewards, terminated, truncated, _ = env.results
    results = {"rewards": rewards, "terminated": terminated, "truncated": truncated}
    return {**state, **results, "observations": observations}


def main() -> None:
    """Claims the abilities of the integration, and serves."""
    warnings.simplefilter("ignore")
    if "soft" not in release.choices("collision_system"):
        sys.exit("pogema_pettingzoo.py: needs POGEMA 1.2.2 or later, where a step returns `truncated`")
    claims = {key: value for key, value in release.claims(raw=True).items() if key in CLAIMED}
    claims["name"] = "pogema (PettingZoo)"
    claims["profiles"] = ["core", "observations"]
    claims["observation"] = ["default"]
    claims["tells"] = ["on_goal", "occupied"]
    serve(make_env, claims=claims, read_state=read_state)


if __name__ == "__main__":
    main()
