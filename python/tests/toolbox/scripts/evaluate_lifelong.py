"""Evaluates a policy in lifelong mode, with its own settings, preprocessing wrapper and environment."""

from pathlib import Path
from typing import Optional

import gymnasium
import yaml
from pogema import AnimationConfig, AnimationMonitor, GridConfig, pogema_v0
from pogema_toolbox.algorithm_config import AlgoBase
from pogema_toolbox.create_env import MultiMapWrapper, ProvideGlobalObstacles
from pogema_toolbox.evaluator import evaluation
from pogema_toolbox.generators.warehouse_generator import WarehouseConfig, generate_wfi_warehouse
from pogema_toolbox.registry import ToolboxRegistry
from pydantic import Extra

MOVES = GridConfig().MOVES
FOLDER = Path("experiments") / "02-lifelong"


class LifelongConfig(GridConfig):
    use_maps: bool = True
    with_animation: bool = False


class GreedyConfig(AlgoBase, extra=Extra.forbid):
    name: str = "Greedy"
    num_process: int = 2
    num_threads: int = None
    cautious: Optional[bool] = False


class Greedy:
    """Moves each agent to the free cell that is nearest to its goal: its own or one of those around it."""

    def __init__(self, config):
        self.config = config
        self.steps = 0

    def act(self, observations):
        self.steps += 1
        return [self.action(agent, seen) for agent, seen in enumerate(observations)]

    def action(self, agent, seen):
        if self.config.cautious and (self.steps + agent) % 3 == 0:
            return 0
        (row, col), goal = seen["global_xy"], seen["global_target_xy"]
        blocked = seen["global_obstacles"]
        ways = []
        for action, (down, right) in enumerate(MOVES):
            place = row + down, col + right
            if not blocked[place[0]][place[1]]:
                ways.append((abs(place[0] - goal[0]) + abs(place[1] - goal[1]), (action + self.steps) % 5, action))
        return min(ways)[2]

    def reset_states(self):
        self.steps = 0


class HidesAgents(gymnasium.ObservationWrapper):
    """Removes agents from the windows; reads attributes of the inner environment."""

    def observation(self, observations):
        assert len(observations) == self.get_num_agents() == self.grid_config.num_agents
        assert self.get_global_agents_xy()[0] == tuple(observations[0]["global_xy"])
        return [{**seen, "agents": seen["agents"] * 0} for seen in observations]


def hide_agents(env, config):
    assert config.preprocessing == "HidesAgents"
    return HidesAgents(env)


def create_env(config):
    env = ProvideGlobalObstacles(pogema_v0(grid_config=config))
    if config.use_maps:
        env = MultiMapWrapper(env)
    if config.with_animation:
        env = AnimationMonitor(env, AnimationConfig(save_every_idx_episode=None))
    return env


def main():
    ToolboxRegistry.setup_logger(level="INFO", sink="log.txt")
    ToolboxRegistry.register_env("Lifelong", create_env, LifelongConfig)
    ToolboxRegistry.register_algorithm("Greedy", Greedy, GreedyConfig, hide_agents)
    ToolboxRegistry.register_maps({"wfi_warehouse": generate_wfi_warehouse(WarehouseConfig(wall_width=4))})
    with open(FOLDER / "02-lifelong.yaml") as file:
        evaluation(yaml.safe_load(file), eval_dir=FOLDER)


if __name__ == "__main__":
    main()
