"""Code shared by all training runs of training.py: the network and the hyperparameters of train_ppo.py, with larger
maps and more agents."""

import json
import os
import sys
from pathlib import Path

import torch

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "python" / "examples"))
import train_ppo

NUM_ENVS, NUM_AGENTS, SIDE = 64, 16, 11
PARAMS = train_ppo.Params(num_envs=NUM_ENVS, bf16="--bf16" in sys.argv)
CONFIG = train_ppo.CONFIG
CONFIG.update(size=16, num_agents=NUM_AGENTS, on_target="restart", max_episode_steps=128)


def serve(time_one):
    """Answers each line of JSON on stdin, a name and a number of seconds, with agent steps per second on stdout."""
    # The output of the frameworks must not mix with the replies.
    replies = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    torch.set_num_threads(2)
    for line in sys.stdin:
        print(json.dumps(time_one(*json.loads(line))), file=replies, flush=True)
