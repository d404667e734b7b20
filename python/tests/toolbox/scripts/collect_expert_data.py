"""Collects the actions of an expert on a map set, with one goal and in lifelong mode, and makes a dataset of them.

Uses POGEMA and pogema-toolbox as the data collector of the public repository CognitiveAISystems/MAPF-GPT does: wrappers
log the executed actions and foretell the goals. An evaluation runs the expert. The script splits the results by map
and filters them.
"""

import hashlib
import json
from collections import deque
from copy import deepcopy
from pathlib import Path
from typing import Literal

import gymnasium
import numpy as np
import yaml
from pogema import GridConfig, pogema_v0
from pogema.generator import generate_from_possible_targets, generate_new_target
from pogema.wrappers.metrics import AgentsDensityWrapper, RuntimeMetricWrapper
from pogema_toolbox.algorithm_config import AlgoBase
from pogema_toolbox.create_env import Environment, MultiMapWrapper
from pogema_toolbox.eval_utils import initialize_wandb, save_evaluation_results
from pogema_toolbox.evaluator import evaluation
from pogema_toolbox.generators.maze_generator import MazeGenerator
from pogema_toolbox.generators.random_generator import generate_map
from pogema_toolbox.registry import ToolboxRegistry
from pydantic import Extra

MOVES = [tuple(move) for move in GridConfig().MOVES]
DATA, DATASET = Path("expert_data"), Path("dataset")


class ForetellsGoals(gymnasium.Wrapper):
    """Adds the goals of an episode to the first observations in lifelong mode."""

    def goals(self):
        generators, config = deepcopy(self.random_generators), self.grid_config
        foretold = []
        for agent, goal in enumerate(self.grid.get_targets_xy()):
            distance, goals = 0, [goal]
            while distance < config.max_episode_steps + 10:
                if config.possible_targets_xy is None:
                    components = self.grid.point_to_component, self.grid.component_to_points
                    after = generate_new_target(generators[agent], *components, goal)
                else:
                    row, col = generate_from_possible_targets(generators[agent], config.possible_targets_xy, goal)
                    after = row + config.obs_radius, col + config.obs_radius
                distance += abs(goal[0] - after[0]) + abs(goal[1] - after[1])
                goal = after
                goals.append(goal)
            foretold.append(goals)
        return foretold

    def reset(self, **kwargs):
        observations, infos = self.env.reset(seed=self.grid_config.seed)
        observations[0]["after_reset"] = True
        if self.grid_config.on_target == "restart":
            for seen, goals in zip(observations, self.goals()):
                seen["goals"] = goals
        return observations, infos


class LogsActions(gymnasium.Wrapper):
    """Adds the executed actions, the starts and the goals to the metrics."""

    def step(self, actions):
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        for agent, action in enumerate(actions):
            self.made[agent].append(action)
        if all(terminated) or all(truncated):
            infos[0]["metrics"]["made_actions"] = self.made
            infos[0]["metrics"]["starts"] = self.starts
            infos[0]["metrics"]["goals"] = self.goals
        return observations, rewards, terminated, truncated, infos

    def reset(self, **kwargs):
        observations, infos = self.env.reset(**kwargs)
        self.made = [[] for _ in observations]
        self.starts = [[int(number) for number in seen["global_xy"]] for seen in observations]
        self.goals = [[[int(number) for number in goal] for goal in seen.get("goals", [])] for seen in observations]
        return observations, infos


def create_env(config):
    env = AgentsDensityWrapper(pogema_v0(grid_config=config))
    return RuntimeMetricWrapper(LogsActions(MultiMapWrapper(ForetellsGoals(env))))


class ExpertConfig(AlgoBase, extra=Extra.forbid):
    name: Literal["Expert"] = "Expert"
    timeouts: list = [1.0, 5.0]
    num_process: int = 2
    device: str = None


class Expert:
    """Moves each agent along a shortest path to its goal. In lifelong mode, continues to the next goals."""

    def __init__(self, config):
        self.config = config
        self.reset_states()

    def reset_states(self):
        self.paths = None

    def plan(self, observations):
        blocked = np.array(observations[0]["global_obstacles"])
        self.paths = []
        for seen in observations:
            here, cells = tuple(seen["global_xy"]), []
            for goal in seen.get("goals", [seen["global_target_xy"]]):
                cells += self.path(blocked, here, tuple(goal))
                here = tuple(goal)
            self.paths.append([tuple(seen["global_xy"]), *cells])

    @staticmethod
    def path(blocked, start, goal):
        came_from, waiting = {start: start}, deque([start])
        while goal not in came_from:
            cell = waiting.popleft()
            for down, right in MOVES[1:]:
                after = cell[0] + down, cell[1] + right
                if after not in came_from and not blocked[after]:
                    came_from[after] = cell
                    waiting.append(after)
        cells = []
        while goal != start:
            cells.append(goal)
            goal = came_from[goal]
        return cells[::-1]

    def act(self, observations):
        if self.paths is None:
            assert observations[0]["after_reset"]
            self.plan(observations)
        actions = []
        for cells, seen in zip(self.paths, observations):
            here = tuple(seen["global_xy"])
            if len(cells) > 1 and here == cells[1]:
                cells.pop(0)
            ahead = cells[1] if len(cells) > 1 else here
            actions.append(MOVES.index((ahead[0] - here[0], ahead[1] - here[1])))
        return actions


def collect(on_target, maps):
    """Runs the expert and returns the file of its results."""
    folder = DATA / on_target
    folder.mkdir(parents=True)
    config = {
        "environment": {
            "name": "Environment",
            "on_target": on_target,
            "collision_system": "soft",
            "observation_type": "MAPF",
            "max_episode_steps": 32,
            "map_name": {"grid_search": sorted(maps)},
            "num_agents": {"grid_search": [4, 8]},
            "seed": {"grid_search": [0, 1]},
        },
        "algorithms": {"Expert": {"name": "Expert", "parallel_backend": "balanced_multiprocessing"}},
        "results_views": {},
    }
    initialize_wandb(config, folder, True, "Dataset")
    evaluation(config, eval_dir=folder)
    save_evaluation_results(folder)
    return folder / "Expert.json"


def samples(results):
    """Yields what an agent knew before each action, and the action."""
    for result in results:
        places = [list(start) for start in result["metrics"]["starts"]]
        for actions in zip(*result["metrics"]["made_actions"]):
            for place, action in zip(places, actions):
                known = sorted([other[0] - place[0], other[1] - place[1]] for other in places)
                yield np.array(known, dtype=np.int8), action
            for place, action in zip(places, actions):
                place[0] += MOVES[action][0]
                place[1] += MOVES[action][1]


def make_dataset(results, name):
    """Writes the distinct samples of a map in random order."""
    hashes, kept = set(), []
    for known, action in samples(results):
        key = hashlib.sha256(known.tobytes()).hexdigest()
        if key not in hashes:
            hashes.add(key)
            kept.append([key, action])
    np.random.seed(len(kept))
    order = np.arange(len(kept))
    np.random.shuffle(order)
    (DATASET / f"{name}.json").write_text(json.dumps([kept[index] for index in order]))


def main():
    ToolboxRegistry.setup_logger("WARNING", sink="log.txt")
    ToolboxRegistry.register_env("Environment", create_env, Environment)
    ToolboxRegistry.register_algorithm("Expert", Expert, ExpertConfig)
    maps = {f"mazes-{seed}": MazeGenerator.generate_maze(12, 11, 0.4, 3, 0.8, seed) for seed in range(2)}
    maps["random-0"] = generate_map({"width": 10, "height": 10, "obstacle_density": 0.2, "seed": 3})
    Path("maps.yaml").write_text(yaml.safe_dump(maps))
    ToolboxRegistry.register_maps(yaml.safe_load(Path("maps.yaml").read_text()))
    DATASET.mkdir()
    for on_target in ("nothing", "restart"):
        file = collect(on_target, maps)
        results = json.loads(file.read_text())
        for result in results:
            result["metrics"].pop("runtime")
        file.write_text(json.dumps(results))
        for name in maps:
            own = [result for result in results if result["env_grid_search"]["map_name"] == name]
            make_dataset(own, f"{on_target}-{name}")


if __name__ == "__main__":
    main()
