"""Configs that POGEMA rejects, and odd configs that it accepts."""

from __future__ import annotations

from typing import Any

from configs import Draw, Fields

NAN = float("nan")

REJECTED: tuple[Fields, ...] = (
    *({"size": size} for size in (1, 0, -4, 4097, "many", [3], 2.5e9)),
    *({"width": 5}, {"height": 5}, {"width": 0, "height": 3}, {"width": 3, "height": 4097}),
    *({"density": density} for density in (1.01, -0.1, NAN, "thick", [0.1])),
    *({"seed": seed} for seed in (-1, 2**63 - 1, 2**63, 2**70, "seed", [1])),
    *({"num_agents": number} for number in (0, -1, 10_000_001, "few", [2])),
    *({"obs_radius": radius} for radius in (0, -1, 129, "far", None)),
    *({"collision_system": name} for name in ("none", "Priority", 1, None)),
    *({"on_target": name} for name in ("stop", "Finish", 0, None)),
    *({"observation_type": name} for name in ("pomapf", "Default", None)),
    *({"integration": name} for name in ("sb3", "pettingzoo", 3)),
    *({"FREE": 1}, {"OBSTACLE": 0}, {"FREE": 2, "OBSTACLE": 1}),
    *({"empty_outside": flag} for flag in ("maybe", 2, [True], None)),
    *({"persistent": flag} for flag in ("maybe", 7, None)),
    *({"max_episode_steps": steps} for steps in ("long", [1], None)),
    *({"map": text} for text in ("a.b", "..?", "..\n.", "aA@", "ab.\n.A.", "", [], [[]], 5, "é.", "0.")),
    {"map": "aA", "agents_xy": [[0, 0]], "targets_xy": [[0, 1]]},
    *({"map": rows} for rows in ([["."]], [None], [[None]], [["x", "y"]])),
    *({"agents_xy": [[0, 8]], "num_agents": 1, "targets_xy": goals} for goals in ([[0, 0]], None)),
    *({"num_agents": 1, "agents_xy": [[0, 0]], "targets_xy": [[row, 0]]} for row in (8, -1, 100)),
    *({"targets_xy": goals, "num_agents": 1} for goals in ([], [[]], 5, "a", [1], [[0]], [[0, 0, 0]], [[0.5, 0]])),
    *(
        {"targets_xy": goals, "num_agents": 1}
        for goals in ([[[0, 0]]], [[[0, 0], [0]]], [[[0, 0], 1]], [[0, 0], [[0, 0]]])
    ),
    *({"agents_xy": starts, "num_agents": 1} for starts in (5, [1], [[0]], [[0, 0, 0]], [[0.5, 0]], [None])),
    *({"agents_xy": starts} for starts in ([[0]], [[0.5, 0]], 5, [["0", "1"]])),
    {"on_target": "restart", "targets_xy": [[0, 1]], "agents_xy": [[0, 0]]},
    {"on_target": "restart", "targets_xy": [[[0, 1], [8, 8]]], "agents_xy": [[0, 0]]},
)
"""Configs that both packages reject on construction."""

UNPLAYABLE: tuple[Fields, ...] = (
    {"size": 3, "num_agents": 5, "density": 0.0},
    {"size": 4, "num_agents": 2, "density": 1.0},
    {"map": "##\n##"},
    {"map": "...", "agents_xy": [[0, 0]], "targets_xy": [[0, 1], [0, 2]]},
    {"map": "...", "agents_xy": [[0, 0]], "targets_xy": [[0, 1]], "num_agents": 2},
    {"map": "@.$", "num_agents": 3},
    {"map": "...", "possible_agents_xy": [[0, 0]], "possible_targets_xy": [[0, 1]], "num_agents": 2},
)
"""Configs that both packages reject at the reset."""

ACCEPTED: tuple[Fields, ...] = (
    {"seed": "5", "size": "4", "num_agents": "2", "density": "0.2", "obs_radius": "2"},
    {"seed": 3.9, "size": 4.7, "num_agents": 2.5, "obs_radius": 2.0, "max_episode_steps": 3.7},
    {"seed": True, "num_agents": True, "density": False, "size": 5},
    *({"size": 4, "persistent": flag, "seed": 1} for flag in ("yes", "ON", "f", 0, 1, 1.0, "False", "t")),
    {"size": 4, "width": 3, "height": 5, "seed": 2},
    {"width": 1, "height": 2, "density": 0.0, "seed": 2, "max_episode_steps": 4},
    {"FREE": 0, "OBSTACLE": 1, "seed": 1, "size": 3, "density": 0.0},
    {"MOVES": [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]], "seed": 1, "size": 3, "density": 0.0},
    {"map": ("..", ".."), "seed": 1, "num_agents": 1},
    {"map": ((0, 0), (0, 1)), "seed": 1, "num_agents": 1},
    {"map": "@@.@", "seed": 4, "num_agents": 1},
    {"map": "@@@@", "seed": 4, "num_agents": 1},
    {"map": "a.A\nb.B", "num_agents": 1, "obs_radius": 1},
    {"map": "b.A\na.B", "obs_radius": 1, "agents_xy": [[0, 1]], "seed": 1},
    {"map": "aaAA", "obs_radius": 1},
    {"map": "@.$", "seed": 1, "possible_agents_xy": [[0, 1]], "possible_targets_xy": [[0, 1]]},
    {"agents_xy": ([0, 0], (0, 1)), "targets_xy": ((1, 1), [1, 0]), "size": 3, "seed": 5},
    {
        "agents_xy": [[0, 0], [1, 1], [2, 2]],
        "targets_xy": [[1, 0], [0, 1], [0, 0]],
        "num_agents": 2,
        "size": 3,
        "seed": 5,
    },
    {"agents_xy": [], "seed": 1, "size": 3, "density": 0.0},
    {"map": "...", "agents_xy": [[0, 1]], "targets_xy": [[0, 1]], "obs_radius": 1},
    {"map": "...", "agents_xy": [[0, 1]], "targets_xy": [[[0, 1], [0, 1], [0, 2]]], "on_target": "restart"},
    {"map": [[1, 0, 0]], "agents_xy": [[0, 0]], "targets_xy": [[0, 2]], "obs_radius": 1},
    {
        "map": [[1, 0, 1]],
        "agents_xy": [[0, 0]],
        "targets_xy": [[0, 2]],
        "obs_radius": 1,
        "empty_outside": False,
        "seed": 1,
    },
    {"map": "..#..", "agents_xy": [[0, 0]], "targets_xy": [[[0, 4], [0, 3]]], "on_target": "restart", "seed": 1},
    {"integration": None, "auto_reset": None, "map_name": None, "seed": 1, "size": 3, "density": 0.0},
    {"integration": "SampleFactory", "auto_reset": "yes", "seed": 1, "size": 3, "density": 0.0},
    {"map_name": "not registered", "seed": 1, "size": 3, "density": 0.0},
    {"map_name": 17, "seed": 1, "size": 3, "density": 0.0},
    {"unheard_of": 3, "seed": 1, "size": 3, "density": 0.0},
    {"density": 1e-300, "size": 3, "seed": 8},
    {"seed": None, "map": "a.A", "obs_radius": 1},
    {"seed": None, "map": "...", "agents_xy": [[0, 1]], "targets_xy": [[[0, 0], [0, 2]]], "on_target": "restart"},
)
"""Odd configs that both packages accept."""


def rejected(draw: Draw) -> Fields:
    """Returns a config with one group of fields from `REJECTED`."""
    draw.note("rejected config")
    odd: dict[str, Any] = dict(draw.one(REJECTED))
    if draw.chance(0.5):
        odd = {"seed": 3, "obs_radius": 2, "collision_system": "soft", **odd}
    return odd
