"""Collects expert episodes of a planner: python imitation_data.py [--episodes N] [--folder FOLDER]."""

import argparse

import numpy as np
from pogema_rs import GridConfig
from pogema_rs.imitation import collect

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--episodes", type=int, default=256)
parser.add_argument("--folder", default="expert")
arguments = parser.parse_args()

config = GridConfig(num_agents=8, size=16, density=0.2, on_target="nothing", collision_system="soft")
num_steps = 0
for path in collect(config, arguments.folder, arguments.episodes, planner="lacam", nodes=2000):
    data = np.load(path)
    observations, actions = data["observations"], data["actions"]
    num_steps += len(actions)
    shares = np.bincount(actions[data["is_active"]], minlength=5) / data["is_active"].sum()
    print(f"{path}: observations {observations.shape}, shares of the actions {np.round(shares, 2)}")
print(f"{num_steps} steps of {config.num_agents} agents")
