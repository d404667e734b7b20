"""What all trainings of training.py share: the task and the sizes of train_ppo.py, with more agents."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "python" / "examples"))
import train_ppo

NUM_ENVS, NUM_AGENTS, SIDE = 64, 16, 11
PARAMS = train_ppo.Params(num_envs=NUM_ENVS)
CONFIG = train_ppo.CONFIG
CONFIG.update(size=16, num_agents=NUM_AGENTS, on_target="restart", max_episode_steps=128)
