"""Evaluates A* and a random policy with pogema-toolbox, and prints the results and all files as JSON.

run_as.py runs this script. Each evaluation writes its results to the folder of its suite.
"""

import json
from pathlib import Path

import numpy as np
import yaml
from pogema import BatchAStarAgent
from pogema_toolbox.algorithm_config import AlgoBase
from pogema_toolbox.create_env import Environment, create_env_base
from pogema_toolbox.evaluator import evaluation
from pogema_toolbox.registry import ToolboxRegistry

# Two rooms with a door, and a hall of pillars.
MAPS = {
    "rooms": "\n".join(["." * 7 + "#" + "." * 7] * 3 + ["." * 15] + ["." * 7 + "#" + "." * 7] * 3),
    "pillars": "\n".join(["." * 13, ".#" * 6 + "."] * 6 + ["." * 13]),
}
MODES = [("nothing", "soft"), ("restart", "priority"), ("finish", "block_both")]


class RandomConfig(AlgoBase):
    """Settings of `Random`."""

    first_seed: int = 5


class Random:
    """A policy whose generator continues from one episode to the next."""

    def __init__(self, config):
        self.rng = np.random.default_rng(config.first_seed)

    def reset_states(self):
        """Does nothing."""

    def act(self, observations):
        """Returns a random action for each agent."""
        return self.rng.integers(5, size=len(observations)).tolist()


def suite(on_target, collisions, backends):
    """Returns a suite, with the random policy on some backends."""
    return {
        "environment": {
            "name": "Environment",
            "on_target": on_target,
            "collision_system": collisions,
            "observation_type": "POMAPF",
            "max_episode_steps": 64,
            "seed": {"grid_search": list(range(5))},
            "num_agents": {"grid_search": [4, 12]},
            "map_name": {"grid_search": ["rooms", "pillars", "rooms|pillars", None]},
            "size": 10,
            "density": 0.2,
        },
        "algorithms": {
            "A*": {"name": "A*", "num_process": 1, "parallel_backend": "sequential"},
            **{f"Random {name}": {"name": "Random", "num_process": 2, "parallel_backend": name} for name in backends},
        },
        "results_views": {},
    }


def main() -> None:
    ToolboxRegistry.setup_logger("WARNING", sink="log.txt")
    ToolboxRegistry.register_env("Environment", create_env_base, Environment)
    ToolboxRegistry.register_algorithm("A*", BatchAStarAgent)
    ToolboxRegistry.register_algorithm("Random", Random, RandomConfig)
    ToolboxRegistry.register_maps(MAPS)
    results, files = [], {}
    for mode in MODES:
        folder = Path(mode[0])
        folder.mkdir()
        backends = ["sequential", "multiprocessing", "balanced_multiprocessing"] if mode[0] == "restart" else []
        (folder / f"{folder}.yaml").write_text(yaml.safe_dump(suite(*mode, backends)))
        for _ in range(2):  # the second time, the results are replaced
            rows = evaluation(yaml.safe_load((folder / f"{folder}.yaml").read_text()), eval_dir=folder)
        results += rows
        files.update({str(path): path.read_text() for path in sorted(folder.iterdir())})
    print(json.dumps([results, files]))


if __name__ == "__main__":
    main()
