"""Answers requests with pogema-toolbox 0.1.1: reads a JSON list of requests from standard input and writes a JSON
object with the toolbox's version and a list of maps or names."""

import json
import sys
from importlib.metadata import version

from pogema_toolbox.create_env import Environment, MultiMapWrapper
from pogema_toolbox.generators.maze_generator import MazeGenerator, MazeRangeSettings
from pogema_toolbox.generators.random_generator import MapRangeSettings, generate_map
from pogema_toolbox.generators.warehouse_generator import WarehouseConfig, generate_warehouse, generate_wfi_warehouse
from pogema_toolbox.registry import ToolboxRegistry


def choose(maps, pattern, seed):
    """Returns the name of the map that a seed chooses, or None if no map matches."""
    from pogema import pogema_v0

    ToolboxRegistry._maps = dict(maps)
    env = pogema_v0(Environment(map_name=pattern, seed=seed))
    try:
        env = MultiMapWrapper(env)
    except KeyError:
        return None
    env.reset(seed=seed)
    return env.grid_config.map_name


def answer(request):
    kind, settings = request["kind"], request["settings"]
    if kind == "random":
        return generate_map(settings)
    if kind == "random ranges":
        return generate_map(MapRangeSettings(**settings).sample(request["seed"]))
    if kind == "maze":
        return MazeGenerator.generate_maze(**settings)
    if kind == "maze ranges":
        return MazeGenerator.generate_maze(**MazeRangeSettings(**settings).sample(request["seed"]))
    if kind == "shelves":
        return generate_warehouse(WarehouseConfig(**settings)).replace("!", ".")
    if kind == "bays":
        return generate_wfi_warehouse(WarehouseConfig(**settings))
    return choose(**settings)


if __name__ == "__main__":
    ToolboxRegistry.setup_logger(level="ERROR")
    answers = [answer(request) for request in json.load(sys.stdin)]
    json.dump({"version": version("pogema-toolbox"), "answers": answers}, sys.stdout)
