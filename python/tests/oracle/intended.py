"""Intended differences between pogema_rs and POGEMA 1.4.0: scripts with the expected error of each side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

_RESET = ("reset", None)
_SMALL = {"map": "....\n....", "obs_radius": 2, "seed": 3, "num_agents": 2}
_PAIR = {"map": "abAB", "obs_radius": 1}


@dataclass(frozen=True)
class IntendedDifference:
    """An intended difference in the last call of a script.

    `theirs` and `ours` are error classes; an empty string stands for a value. A comment `differences, X` refers to
    table X in docs/spec/differences.md.
    """

    name: str
    fields: dict[str, Any]
    script: tuple
    theirs: str
    ours: str


def _intended(name: str, fields: dict[str, Any], *calls: tuple, theirs: str, ours: str) -> IntendedDifference:
    return IntendedDifference(name, fields, (("make", fields), *calls), theirs, ours)


INTENDED = (
    # differences, Starts and goals: two agents with one start.
    _intended(
        "one start twice",
        {**_SMALL, "agents_xy": [[0, 0], [0, 0]], "targets_xy": [[0, 1], [0, 2]]},
        _RESET,
        theirs="",
        ours="InstanceError",
    ),
    # differences, Starts and goals: a pool has a start outside the map.
    _intended(
        "pool start outside",
        {**_SMALL, "num_agents": 1, "possible_agents_xy": [[0, 5]], "possible_targets_xy": [[0, 1]]},
        _RESET,
        theirs="ValueError",
        ours="InstanceError",
    ),
    # differences, Starts and goals: a pool has a goal outside the map.
    _intended(
        "pool goal outside",
        {**_SMALL, "num_agents": 1, "possible_agents_xy": [[0, 0]], "possible_targets_xy": [[0, 9]]},
        _RESET,
        theirs="",
        ours="InstanceError",
    ),
    # differences, Starts and goals: a pool of one goal makes POGEMA draw forever.
    _intended(
        "pool goal drawn forever",
        {
            **{"map": "....\n....", "num_agents": 1, "on_target": "restart", "obs_radius": 1, "seed": 1},
            **{"possible_targets_xy": [[1, 1]]},
        },
        _RESET,
        theirs="",
        ours="InstanceError",
    ),
    # differences, Starts and goals: fewer sequences than agents.
    _intended(
        "too few sequences",
        {**_SMALL, "on_target": "restart", "targets_xy": [[[0, 0], [0, 1]]]},
        _RESET,
        theirs="",
        ours="InstanceError",
    ),
    # differences, Config: letters with `on_target: restart`.
    _intended("letters and restart", {**_PAIR, "on_target": "restart"}, theirs="", ours="ValidationError"),
    # differences, Config: other MOVES.
    _intended("other moves", {**_SMALL, "MOVES": [[0, 0], [0, 1]]}, theirs="", ours="ValidationError"),
    # differences, Config: max_episode_steps over 64 bits.
    _intended("endless episode", {**_SMALL, "max_episode_steps": 2**70}, theirs="", ours="ValidationError"),
    # differences, Maps: cells that are neither 0 nor 1.
    _intended("other cells", {"map": [[0, 2, 0, 0]]}, theirs="", ours="ValidationError"),
    # differences, Errors that differ only in form: POGEMA rejects rows of unequal length at the reset.
    _intended("ragged list", {"map": [[0, 0, 0], [0, 0]]}, theirs="", ours="ValidationError"),
    # differences, Metrics and history: throughput over no steps.
    _intended(
        "throughput over nothing",
        {**_SMALL, "on_target": "restart", "max_episode_steps": 0},
        theirs="",
        ours="ValidationError",
    ),
    # POGEMA drops agent 0, or raises: docs/spec/defects.md, The Python package.
    _intended(
        "only active agents", _SMALL, _RESET, ("call", "get_agents_xy", (), {"only_active": True}), theirs="", ours=""
    ),
    _intended(
        "state without border",
        _SMALL,
        _RESET,
        ("call", "get_state", (), {"ignore_borders": True, "as_dict": True}),
        theirs="",
        ours="",
    ),
    # docs/spec/defects.md, The Python package: POGEMA discards the text.
    _intended("render as text", _SMALL, _RESET, ("call", "unwrapped.render", (), {"mode": "ansi"}), theirs="", ours=""),
    # POGEMA's wrapped environments do not accept `return_info`; its environment classes do.
    _intended("no infos", _SMALL, ("call", "reset", (), {"return_info": False}), theirs="TypeError", ours=""),
    # docs/spec/defects.md, Collisions and occupancy: `soft` writes into the actions, which a tuple does not allow.
    _intended(
        "soft and a tuple",
        {**_PAIR, "collision_system": "soft"},
        _RESET,
        ("step", [4, 3], "tuple"),
        theirs="TypeError",
        ours="",
    ),
    _intended(
        "soft and a list",
        {**_PAIR, "collision_system": "soft"},
        _RESET,
        ("step", [4, 3], "list"),
        ("left",),
        theirs="",
        ours="",
    ),
    # differences, Metrics and history: steps back after agents have vanished.
    _intended(
        "steps back after vanishing",
        {"map": "ab...AB", "collision_system": "soft", "obs_radius": 1, "persistent": True},
        _RESET,
        ("step", [4, 4], "list"),
        ("step", [4, 4], "list"),
        ("back",),
        ("back",),
        theirs="KeyError",
        ours="",
    ),
    # differences, Metrics and history: a step back onto an obstacle.
    _intended(
        "step back onto an obstacle",
        {
            **{"map": "#..", "possible_agents_xy": [[0, 0]], "possible_targets_xy": [[0, 2]], "obs_radius": 1},
            **{"seed": 1, "persistent": True},
        },
        _RESET,
        ("step", [4], "list"),
        ("back",),
        theirs="ValueError",
        ours="",
    ),
    # Our package stores coordinates of any number type as plain integers. POGEMA keeps flags, and rejects NumPy's
    # numbers.
    _intended(
        "flags as coordinates", {"agents_xy": [[False, True]], "targets_xy": [[1, 1]], "size": 3}, theirs="", ours=""
    ),
    _intended(
        "numpy coordinates", {"num_agents": 1, "agents_xy": [[np.int64(1), 1]]}, theirs="ValidationError", ours=""
    ),
    # A grid is a read-only view of the environment.
    _intended(
        "write-protected grid", _SMALL, _RESET, ("call", "grid.hide_agent", (0,), {}), theirs="", ours="StateError"
    ),
)
