"""Times one package: each line of JSON on stdin names the work, and the reply on stdout is its rate per second.

python worker.py pogema|pogema_rs
"""

import importlib
import json
import sys
import time

import numpy as np

SECONDS = 0.3
RUNS = 3
ACTIONS = 64

package = importlib.import_module(sys.argv[1])


def fastest(work):
    """Returns calls of `work` per second in the fastest of several runs, since other jobs can only slow a run down."""
    best = 0.0
    for _ in range(RUNS):
        calls, start = 0, time.perf_counter()
        while (spent := time.perf_counter() - start) < SECONDS or calls == 0:
            work()
            calls += 1
        best = max(best, calls / spent)
    return best


def random_actions(*shape):
    return np.random.default_rng(0).integers(0, 5, (ACTIONS, *shape))


def config(num_agents):
    return package.GridConfig(
        num_agents=num_agents,
        size=32,
        density=0.3,
        obs_radius=5,
        seed=0,
        collision_system="soft",
        on_target="nothing",
        max_episode_steps=10**9,
    )


def environment(num_agents):
    env = package.pogema_v0(grid_config=config(num_agents))
    env.reset()
    return env


def step(num_agents):
    """Returns steps per second, with observations."""
    env, actions, at = environment(num_agents), random_actions(num_agents).tolist(), 0

    def work():
        nonlocal at
        env.step(list(actions[at % ACTIONS]))
        at += 1

    return fastest(work)


def reset(num_agents):
    """Returns resets per second, each with another seed."""
    env = environment(num_agents)

    def work():
        env.grid_config.seed += 1
        env.reset()

    return fastest(work)


def batch_steps(env):
    """Returns steps of a whole VecEnv per second, with random actions."""
    env.reset(seed=0)
    actions, at = random_actions(env.num_envs, env.num_agents), 0

    def work():
        nonlocal at
        env.step(actions[at % ACTIONS])
        at += 1

    return fastest(work)


def lifelong(num_agents):
    """Returns the config fields of lifelong episodes of 256 steps."""
    return {**config(num_agents).model_dump(), "on_target": "restart", "max_episode_steps": 256}


def vector(num_envs, num_agents, num_threads, dtype="float32", is_lifelong=False):
    """Returns steps of the whole VecEnv per second, with observations."""
    fields = (lifelong if is_lifelong else config)(num_agents)
    return batch_steps(package.VecEnv(fields, num_envs, num_threads=num_threads, dtype=dtype))


def encoded(num_envs, num_agents, num_threads):
    """Returns steps of the whole VecEnv per second, with encoder windows, new goals and new episodes."""
    encoder = {"radius": 5, "channels": ["obstacles", "cost_to_go", "agents"]}
    env = package.VecEnv(lifelong(num_agents), num_envs, num_threads=num_threads, encoder=encoder)
    return batch_steps(env)


WORKS = {"step": step, "reset": reset, "vector": vector, "encoded": encoded}
for line in sys.stdin:
    name, *sizes = json.loads(line)
    print(json.dumps(WORKS[name](*sizes)), flush=True)
