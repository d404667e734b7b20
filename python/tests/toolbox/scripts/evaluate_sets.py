"""Evaluates A* and a random policy on suites; each suite has a folder with its maps and its results.

Uses pogema-toolbox as `algorithms/eval.py` of the public repository CognitiveAISystems/pogema-benchmark does.
"""

import argparse
from pathlib import Path

import numpy as np
import yaml
from pogema import BatchAStarAgent
from pogema_toolbox.algorithm_config import AlgoBase
from pogema_toolbox.create_env import Environment, create_env_base
from pogema_toolbox.eval_utils import create_and_push_summary_archive, initialize_wandb, save_evaluation_results
from pogema_toolbox.evaluator import evaluation
from pogema_toolbox.registry import ToolboxRegistry

PROJECT = "Halls"
BASE = Path("experiments")
SETS = ["01-halls"]


class RandomConfig(AlgoBase):
    name: str = "Random"
    first_seed: int = None


class RandomPolicy:
    def __init__(self, config):
        self.rng = np.random.default_rng(config.first_seed)

    def act(self, observations):
        return [int(self.rng.integers(5)) for _ in observations]

    def reset_states(self):
        pass


def main(disable_wandb):
    ToolboxRegistry.setup_logger("INFO", sink="log.txt")
    ToolboxRegistry.register_env("Environment", create_env_base, Environment)
    ToolboxRegistry.register_algorithm("A*", BatchAStarAgent)
    ToolboxRegistry.register_algorithm("Random", RandomPolicy, RandomConfig)
    for name in SETS:
        folder = BASE / name
        with open(folder / "maps.yaml") as file:
            ToolboxRegistry.register_maps(yaml.safe_load(file))
        with open(folder / f"{name}.yaml") as file:
            config = yaml.safe_load(file)
        initialize_wandb(config, folder, disable_wandb, PROJECT)
        np.random.seed(0)
        evaluation(config, eval_dir=folder)
        save_evaluation_results(folder)
    create_and_push_summary_archive(SETS, BASE, PROJECT)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--disable_wandb", action="store_true")
    main(parser.parse_args().disable_wandb)
