"""Generates maps, evaluates on them, then reads the results again and shows them."""

import json
from pathlib import Path

import numpy as np
import yaml
from pogema import BatchAStarAgent
from pogema_toolbox.create_env import Environment, create_env_base
from pogema_toolbox.evaluator import evaluation, run_views
from pogema_toolbox.generators.generator_utils import maps_dict_to_yaml
from pogema_toolbox.generators.maze_generator import MazeGenerator, MazeRangeSettings
from pogema_toolbox.generators.random_generator import MapRangeSettings, generate_map
from pogema_toolbox.registry import ToolboxRegistry
from pogema_toolbox.results_holder import ResultsHolder
from pogema_toolbox.views.view_multi_plot import MultiPlotView, process_multi_plot_view
from pogema_toolbox.views.view_plot import PlotView, process_plot_view
from pogema_toolbox.views.view_tabular import TabularView, preprocess_table, process_table_view
from pogema_toolbox.views.view_utils import check_seeds, load_from_folder

FOLDER = Path("results") / "mazes"


def run_half(env, algo):
    """Plays the first half of an episode."""
    algo.reset_states()
    holder = ResultsHolder()
    observations, _ = env.reset(seed=env.grid_config.seed)
    for _ in range(env.grid_config.max_episode_steps // 2):
        observations, _, terminated, truncated, infos = env.step(algo.act(observations))
        holder.after_step(infos)
        if all(terminated) or all(truncated):
            break
    return {"on_goal": sum(env.was_on_goal), "moved": int(env.get_agents_xy()[0][0]), **holder.get_final()}


def main():
    ToolboxRegistry.setup_logger("INFO", sink="log.txt")
    ToolboxRegistry.register_env("Environment", create_env_base, Environment)
    ToolboxRegistry.register_algorithm("A*", BatchAStarAgent)
    ToolboxRegistry.register_run_func("half", run_half)
    FOLDER.mkdir(parents=True)
    mazes = MazeRangeSettings(width_min=9, width_max=13, height_min=9, height_max=13, obstacle_density_max=0.5)
    maps = {f"maze-{seed}": MazeGenerator.generate_maze(**mazes.sample(seed)) for seed in range(2)}
    maps.update({f"random-{seed}": generate_map(MapRangeSettings().sample(seed)) for seed in range(2)})
    maps_dict_to_yaml(FOLDER / "maps.yaml", maps)
    ToolboxRegistry.register_maps(yaml.safe_load((FOLDER / "maps.yaml").read_text()))
    config = {
        "environment": {
            "name": "Environment",
            "on_target": "finish",
            "observation_type": "POMAPF",
            "max_episode_steps": 64,
            "map_name": {"grid_search": sorted(maps) + ["pogema-logo"]},
            "num_agents": {"grid_search": [2, 4]},
            "seed": {"grid_search": [5, 6]},
        },
        "algorithms": {
            "Whole": {"name": "A*", "parallel_backend": "sequential"},
            "Half": {"name": "A*", "parallel_backend": "sequential", "run_episode_func": "half"},
        },
    }
    (FOLDER / "mazes.yaml").write_text(yaml.safe_dump(config))
    evaluation(config, eval_dir=FOLDER)

    results, config = load_from_folder(FOLDER)
    results.sort(key=lambda row: row["algorithm"] == "Half")
    check_seeds(results)
    run_views(results, config, eval_dir=FOLDER)
    whole = [row for row in results if row["algorithm"] == "Whole"]
    np.random.seed(7)
    view = TabularView(drop_keys=["seed", "map_name"], print_results=True, rename_fields={"num_agents": "Agents"})
    process_table_view(whole, view)
    table = preprocess_table(whole, view)
    (FOLDER / "table.txt").write_text(json.dumps(table.astype(str).to_dict("split")))
    process_plot_view(whole, PlotView(x="num_agents", y="ISR", by="algorithm"), FOLDER / "ISR.png")
    process_multi_plot_view(whole, MultiPlotView(x="num_agents", y="ISR", over="map_name"), FOLDER / "panels.pdf")


if __name__ == "__main__":
    main()
