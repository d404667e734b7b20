"""Evaluates the A* agent with the unmodified pogema-toolbox, and prints the results as JSON.

python evaluate.py pogema|pogema_rs FOLDER_OF_THE_TOOLBOX
"""

import json
import sys
import warnings

package, folder = sys.argv[1:]
sys.path.append(folder)
warnings.simplefilter("ignore")
if package == "pogema_rs":
    import pogema_rs

    pogema_rs.install_as_pogema()

from pogema import BatchAStarAgent  # noqa: E402 - imported after the package is chosen
from pogema_toolbox.create_env import Environment, create_env_base  # noqa: E402
from pogema_toolbox.evaluator import evaluation  # noqa: E402
from pogema_toolbox.registry import ToolboxRegistry  # noqa: E402

# Two rooms with a door, and a hall of pillars.
MAPS = {
    "rooms": "\n".join(["." * 7 + "#" + "." * 7] * 3 + ["." * 15] + ["." * 7 + "#" + "." * 7] * 3),
    "pillars": "\n".join(["." * 13, ".#" * 6 + "."] * 6 + ["." * 13]),
}


def main() -> None:
    ToolboxRegistry.setup_logger("WARNING")
    ToolboxRegistry.register_env("Environment", create_env_base, Environment)
    ToolboxRegistry.register_algorithm("A*", BatchAStarAgent)
    ToolboxRegistry.register_maps(MAPS)
    results = []
    for on_target, collisions in [("nothing", "soft"), ("restart", "priority"), ("finish", "block_both")]:
        environment = {
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
        }
        algorithms = {"A*": {"name": "A*", "num_process": 1, "parallel_backend": "sequential"}}
        results += evaluation({"environment": environment, "algorithms": algorithms, "results_views": {}})
    json.dump(results, sys.stdout)


main()
