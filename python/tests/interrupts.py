"""Interrupts one long call: interrupts.py CASE. Without a case, lists all of them.

Prints the time from the signal to the exception, for a person to read.
"""

import os
import pickle
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
from pogema_rs import AnimationMonitor, GridConfig, pogema_v0
from pogema_rs._engine import restore_engine
from pogema_rs.errors import NotResetError
from pogema_rs.planners import PlannerAgents, plan
from pogema_rs.toolbox.evaluator import evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.vec_env import VecEnv

EMPTY = np.zeros((48, 48), int)
#: Every cell of the first rows, and of the last rows in reverse: no planner solves this in seconds.
STARTS = [(row, col) for row in range(12) for col in range(48)]
GOALS = [(47 - row, 47 - col) for row, col in STARTS]


def interrupt(call, delay=0.3):
    """Calls a function and sends SIGINT after a delay; fails if the call ends first."""
    sent = []

    def send():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(delay, send)
    timer.start()
    try:
        call()
    except KeyboardInterrupt:
        print(f"{call.__qualname__}: KeyboardInterrupt after {time.monotonic() - sent[0]:.3f} s")
        return
    timer.cancel()
    raise AssertionError(f"{call.__qualname__} ended before it was interrupted")


def planners():
    for planner in ["lacam", "cbs", "ecbs", "pbs"]:
        interrupt(lambda: plan(EMPTY, STARTS, GOALS, planner, seconds=100.0))  # noqa: B023 - called immediately
    assert plan(EMPTY, [(0, 0)], [(3, 3)]).makespan == 6


def planner_agents():
    seen = [{"global_obstacles": EMPTY, "global_xy": a, "global_target_xy": b} for a, b in zip(STARTS, GOALS)]
    for planner, lifelong in [("lacam", False), ("rhcr", True), ("rhcr-pbs", True), ("rhcr-ecbs", True)]:
        agents = PlannerAgents(planner, seconds=100.0, nodes=10**9, lifelong=lifelong)
        interrupt(lambda: [agents.act(seen) for _ in range(10**6)])  # noqa: B023 - called immediately
        one = [{**seen[0], "global_target_xy": (1, 0)}]
        assert agents.act(one) == [2], planner


def batch(num_envs, **config):
    return VecEnv({"size": 64, "num_agents": 16, "seed": 5, "on_target": "restart", **config}, num_envs, dtype="uint8")


def batch_construction():
    interrupt(lambda: batch(300_000, size=8, num_agents=1, obs_radius=1), 0.1)
    batch(2).reset()


def batch_reset():
    env, twin = batch(4000), batch(4000)
    interrupt(env.reset)
    try:
        env.episode_seeds  # noqa: B018 - raises
        raise AssertionError("the first reset was only partly undone")
    except NotResetError:
        pass
    env.reset()
    twin.reset()
    for arguments in [{"seed": 7}, {"seed": 7, "options": {"reset_mask": np.arange(4000) < 3999}}]:
        interrupt(lambda: env.reset(**arguments))  # noqa: B023 - called immediately
        check_equal(env, twin)
    env.reset(seed=8)
    twin.reset(seed=8)
    check_equal(env, twin)


def check_equal(env, twin):
    np.testing.assert_array_equal(env.episode_seeds, twin.episode_seeds)
    actions = np.random.default_rng(0).integers(5, size=(env.num_envs, env.num_agents))
    for one, other in zip(env.step(actions)[:4], twin.step(actions)[:4]):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(env.episode_seeds, twin.episode_seeds)


def batch_step():
    env, twin = batch(8000, max_episode_steps=1), batch(8000, max_episode_steps=1)
    env.reset()
    # All episodes end, and all lanes need their next instances.
    interrupt(lambda: env.step(np.zeros((8000, 16), int)), 0.1)
    twin.reset()
    check_equal(env, twin)


def reset():
    env = pogema_v0(GridConfig(size=12, num_agents=2, seed=1))
    env.reset()
    before = env.get_agents_xy()
    env.grid_config = GridConfig(size=4096, num_agents=2, seed=1, on_target="restart")
    interrupt(env.reset, 0.1)
    assert env.get_agents_xy() == before
    assert len(env.step([0, 0])[0]) == 2


def _filmed():
    env = AnimationMonitor(pogema_v0(GridConfig(size=64, num_agents=400, seed=1, max_episode_steps=1500, on_target="restart")))
    env.reset()
    ended = False
    while not ended:
        ended = all(env.step(env.sample_actions())[3])
    return env


def animation():
    env = _filmed()
    interrupt(env.unwrapped._engine.pack_film, 0.1)
    interrupt(lambda: env.unwrapped._engine.draw_svg(), 0.1)


def pickle_():
    env = pogema_v0(GridConfig(size=64, num_agents=400, seed=1, max_episode_steps=3000, persistent=True))
    env.reset()
    for _ in range(1000):
        env.step([0] * 400)
    engine = env.unwrapped._engine
    interrupt(lambda: [pickle.dumps(engine) for _ in range(100)], 0.1)
    saved = engine.__reduce__()[1][0]
    interrupt(lambda: [restore_engine(saved) for _ in range(100)], 0.1)
    assert restore_engine(saved).cells(0) == engine.cells(0)


def suite(seeds, **algorithm):
    environment = {
        "name": "Environment", "on_target": "restart", "size": 24, "num_agents": 32, "max_episode_steps": 512,
        "collision_system": "soft", "observation_type": "POMAPF", "seed": {"grid_search": list(range(seeds))},
    }  # fmt: skip
    return {"environment": environment, "algorithms": {"A": algorithm}}


def built_in_evaluation():
    config = suite(200, name="pibt")
    interrupt(lambda: evaluation(config, "out"))
    assert not Path("out/A.json").exists()
    interrupt(lambda: evaluation(config, "out", begin="resume"))
    evaluation(config, "out", begin="resume")
    evaluation(config, "whole")
    assert Path("out/A.json").read_bytes() == Path("whole/A.json").read_bytes()


def long_episode():
    config = suite(1, name="rhcr", seconds=100.0, nodes=10**9)
    interrupt(lambda: evaluation(config, "out"))
    assert not Path("out/A.jsonl").read_bytes() and not Path("out/A.failed.jsonl").exists()
    config["algorithms"]["A"] = {"name": "stay"}
    assert len(evaluation(config, "out", begin="anew")) == 1


def page():
    # The page plays the episode again.
    config = suite(1, name="rhcr", seconds=0.01)
    config["environment"]["max_episode_steps"] = 200
    began = time.monotonic()
    evaluation(config, "out")
    taken = time.monotonic() - began
    interrupt(lambda: evaluation(config, "out", begin="resume", html="page.html"), taken / 2)
    assert not Path("page.html").exists()
    evaluation(config, "out", begin="resume", html="page.html")
    assert Path("page.html").exists()


class Sleepy:
    """A policy whose first action takes minutes."""

    def act(self, observations):
        """Sleeps."""
        time.sleep(100)

    def reset_states(self):
        """Does nothing."""


def process_pool():
    ToolboxRegistry.register_algorithm("Sleepy", Sleepy)
    for backend in ["multiprocessing", "dask"]:
        config = suite(8, name="Sleepy", parallel_backend=backend, num_process=2)
        interrupt(lambda: evaluation(config, backend), 5.0)  # noqa: B023 - called immediately
        config["algorithms"]["A"] = {"name": "stay"}
        assert len(evaluation(config, backend, begin="anew")) == 8


CASES = {
    case.__name__.strip("_"): case
    for case in [
        animation, batch_construction, batch_reset, batch_step, built_in_evaluation, long_episode, page, pickle_,
        planner_agents, planners, process_pool, reset,
    ]
}  # fmt: skip


if __name__ == "__main__":
    if len(sys.argv) > 1:
        # A shell starts a background process with SIGINT ignored.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        CASES[sys.argv[1]]()
    else:
        print(*CASES)
