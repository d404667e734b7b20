"""Calls the functions that draw instances, which both packages have."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
from player import Described, described

NUM_CASES = 40


def drawn(generator: ModuleType, config_class: Any, number: int) -> list[Described]:
    """Returns the results of all functions that draw instances, for the config with this number."""
    rng = np.random.default_rng([11, number])
    size, density = int(rng.integers(2, 9)), float(rng.choice([0.0, 0.2, 0.5, 0.9]))
    config = config_class(size=size, density=density, seed=number, num_agents=int(rng.integers(1, 5)))
    obstacles = generator.generate_obstacles(config)
    results = [described(obstacles), described(generator.generate_obstacles(config, np.random.default_rng(number + 1)))]
    grid = obstacles.copy()
    results += [described(generator.bfs(grid, tuple(config.MOVES), 2, 0)), described(grid)]
    starts, goals = generator.generate_positions_and_targets_fast(obstacles, config)
    results.append(described([starts, goals]))
    points, labels = generator.get_components(config, obstacles, starts, goals)
    results += [described(dict(points)), described(labels)]
    rnd = np.random.default_rng(number)
    for start, goal in zip(starts, goals):
        if goal != (-1, -1):
            results.append(described(generator.generate_new_target(rnd, labels, points, start)))
    cells = [(row, col) for row in range(size) for col in range(size)]
    results.append(described(generator.generate_from_possible_targets(rnd, cells, (0, 0))))
    config.possible_agents_xy, config.possible_targets_xy = list(cells), [list(cell) for cell in cells]
    results.append(described(generator.generate_from_possible_positions(config)))
    return [*results, described([config.possible_agents_xy, config.possible_targets_xy])]
