"""Prints POGEMA 1.4.0's observations and resets per second for the JSON config on stdin.

Actions are sampled beforehand, so the time of a step does not include sampling. The fastest of several intervals
counts.
"""

import json
import sys
import time

import numpy as np
from pogema import GridConfig, pogema_v0

INTERVALS = 5
SECONDS = 0.3
ACTIONS = 64


def fastest(work):
    """Returns the calls of `work` per second, in the fastest interval."""
    best = 0.0
    for _ in range(INTERVALS):
        calls, start = 0, time.perf_counter()
        while (spent := time.perf_counter() - start) < SECONDS or calls == 0:
            work()
            calls += 1
        best = max(best, calls / spent)
    return best


def measure(config):
    """Returns the observations and resets per second of a config."""
    env = pogema_v0(GridConfig(**config))
    env.reset()
    generator = np.random.default_rng(0)
    actions = generator.integers(0, 5, (ACTIONS, config["num_agents"])).tolist()
    state = {"step": 0}

    def step():
        env.step(list(actions[state["step"] % ACTIONS]))
        state["step"] += 1

    steps = fastest(step)
    return {"observations": steps * config["num_agents"], "resets": fastest(env.reset)}


print(json.dumps(measure(json.load(sys.stdin))))
