"""Times one toolbox: prints the seconds of an evaluation, and how many of them the policy takes, as JSON.

toolbox_worker.py pogema_toolbox|pogema_rs.toolbox NUM_SEEDS [FOLDER_OF_POGEMA_TOOLBOX]
"""

import importlib
import json
import sys
import tempfile
import time

name, num_seeds, *folder = sys.argv[1:]
sys.path += folder
evaluator, registry, create_env = (
    importlib.import_module(f"{name}.{module}") for module in ("evaluator", "registry", "create_env")
)
Registry = registry.ToolboxRegistry


class Stay:
    """A policy whose agents never move. Its own time is subtracted."""

    seconds = 0.0

    def reset_states(self):
        """Does nothing, because the policy has no state."""

    def act(self, observations):
        """Returns the action stay for every agent."""
        began = time.perf_counter()
        actions = [0] * len(observations)
        Stay.seconds += time.perf_counter() - began
        return actions


SUITE = {
    "environment": {
        "name": "Environment",
        "on_target": "restart",
        "collision_system": "soft",
        "max_episode_steps": 256,
        "obs_radius": 5,
        "size": 32,
        "density": 0.3,
        "seed": {"grid_search": list(range(int(num_seeds)))},
        "num_agents": {"grid_search": [16, 64]},
    },
    "algorithms": {"Stay": {"name": "Stay", "parallel_backend": "sequential", "num_process": 1}},
    "results_views": {},
}


def main():
    """Registers the policy, runs the evaluation and prints the times."""
    Registry.setup_logger("ERROR")
    Registry.register_env("Environment", create_env.create_env_base, create_env.Environment)
    Registry.register_algorithm("Stay", Stay)
    with tempfile.TemporaryDirectory() as out:
        began = time.perf_counter()
        evaluator.evaluation(SUITE, out)
        print(json.dumps([time.perf_counter() - began, Stay.seconds]))


main()
