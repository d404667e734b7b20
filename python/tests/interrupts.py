"""Interrupts long calls of compiled entries: interrupts.py CASE [SCALE]

Prints each interrupted entry with the time from the signal to the exception, for a person to read. The delays of
signals to entries are multiplied by `SCALE`. If a call ends before its signal, the exit status is `ENDED_FIRST`: on
such a fast machine, the case needs a smaller scale. `SHORT` lists the entries that no case interrupts, because they end
soon.
"""

import json
import os
import pickle
import signal
import sys
import tempfile
import threading
import time
import traceback
from pathlib import Path

import numpy as np
from pogema_rs import AnimationMonitor, GridConfig, _engine, pogema_v0
from pogema_rs._engine import restore_engine
from pogema_rs._vec_configs import engine_config
from pogema_rs.errors import NotResetError
from pogema_rs.planners import PlannerAgents, plan
from pogema_rs.imitation import collect
from pogema_rs.policies import Encoder, load, save
from pogema_rs.toolbox.evaluator import evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.toolbox.views import show
from pogema_rs.vec_env import Film, VecEnv

EMPTY = np.zeros((48, 48), int)
#: Every cell of the first rows, and of the last rows in reverse: no planner solves this in seconds.
STARTS = [(row, col) for row in range(12) for col in range(48)]
GOALS = [(47 - row, 47 - col) for row, col in STARTS]


#: The cases by name, each with the entries of `_engine.pyi` that it interrupts.
CASES = {}

#: The other entries by the reason why they end soon. Python handles a signal when they return.
SHORT = {
    "their work is linear in the agents, cells or goals that they read or return": {
        "Engine.__new__", "Engine.__reduce__", "Engine.active", "Engine.cells", "Engine.executed",
        "Engine.goal_generators", "Engine.goals", "Engine.history", "Engine.infos", "Engine.is_drawn",
        "Engine.obstacles", "Engine.observe", "Engine.occupied", "Engine.on_goal", "Engine.pools", "Engine.reseed",
        "Engine.set_goal_generators", "Engine.starts", "Engine.step_back", "derive_config",
    },
    "they play or observe at most one step": {
        "AStarAgent.act", "Batch.ended", "Policy.logits", "Batch.global_state", "Batch.mask_actions",
        "Batch.mask_agents", "Engine.step",
    },
    "their work is linear in the environments": {"Batch.close", "Batch.films", "Batch.metrics"},
    "they read or write the files of an evaluation once": {
        "Evaluation.__new__", "Evaluation.begin", "Evaluation.check_algorithms", "Evaluation.finish",
        "Evaluation.keep", "Evaluation.note", "Evaluation.open", "Evaluation.picks", "Evaluation.whole_environment",
    },
    "they read or write the files of one network once": {"Policy.__new__", "write_network"},
    "they read or set a few values": {
        "AStarAgent.__new__", "AStarAgent.__reduce__", "AStarAgent.clear_state", "restore_astar", "Batch.film",
        "Batch.num_threads", "Batch.observation_type", "Batch.sizes",
        "Batch.take_film_failures", "Engine.clear_metrics", "Engine.elapsed", "Engine.film",
        "Engine.is_filmed", "Engine.is_free_outside", "Engine.measure", "Engine.num_steps", "Engine.size",
        "Evaluation.algorithms", "Evaluation.dask", "Evaluation.environment",
        "Evaluation.has_views", "Evaluation.is_foreign", "Evaluation.map", "Evaluation.num_episodes",
        "Evaluation.release", "Evaluation.warnings", "PlanFollower.__new__", "PlanFollower.reset",
        "Policy.encoder", "Policy.reset", "Policy.sampling", "_force_panic", "check_views", "machine", "did_you_mean",
        "num_cores", "Stop.__new__", "Stop.is_set", "Stop.set",
    },
}  # fmt: skip


ENDED_FIRST = 3
SCALE = 1.0


class EndedFirst(Exception):
    """A call ended before its signal."""


def interrupts(*entries):
    """Registers a case and the entries that it interrupts."""

    def register(case):
        CASES[case.__name__.strip("_")] = (case, entries)
        return case

    return register


def interrupt(entry, call, delay=0.3, *, is_abandoned=False):
    """Calls a function and sends SIGINT after a delay; raises `EndedFirst` if the call of the entry ends first.

    With `is_abandoned`, another thread must do the work, and must still be working after the exception.
    """
    sent = []

    def send():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(delay * SCALE, send)
    timer.start()
    try:
        call()
    except KeyboardInterrupt as error:
        frames = traceback.extract_tb(error.__traceback__)
        # Before its work, an entry calls functions of `threading`. A signal that arrives there prevents the work.
        has_begun = frames[-1].filename != threading.__file__
        if is_abandoned and has_begun:
            check_abandoned(entry)
        print(f"{entry}: KeyboardInterrupt after {time.monotonic() - sent[0]:.3f} s")
        name = entry.removesuffix(".__new__").split(".")[-1]
        line = [frame.line for frame in frames if frame.filename != threading.__file__][-1]
        assert f"{name}(" in line or f"{name})" in line, f"the signal reached `{line}`, not {entry}"
        return
    timer.cancel()
    raise EndedFirst(f"{entry} ended before it was interrupted")


def threads_named(name):
    """Returns the number of threads of this process with a name, or `None` if the system has no `/proc`."""
    threads = Path("/proc/self/task")
    if not threads.exists():
        return None
    return [path.read_text().strip() for path in threads.glob("*/comm")].count(name)


def check_abandoned(entry):
    assert threads_named("pogema work") != 0, f"{entry} was complete before the exception"


@interrupts("make_plan")
def planners():
    for planner in ["lacam", "cbs", "ecbs", "pbs"]:
        interrupt("make_plan", lambda: plan(EMPTY, STARTS, GOALS, planner, seconds=100.0))  # noqa: B023 - called immediately
    assert plan(EMPTY, [(0, 0)], [(3, 3)]).makespan == 6


@interrupts("PlanFollower.act")
def planner_agents():
    seen = [{"global_obstacles": EMPTY, "global_xy": a, "global_target_xy": b} for a, b in zip(STARTS, GOALS)]
    for planner, lifelong in [("lacam", False), ("rhcr", True), ("rhcr-pbs", True), ("rhcr-ecbs", True)]:
        agents = PlannerAgents(planner, seconds=100.0, nodes=10**9, lifelong=lifelong)
        interrupt("PlanFollower.act", lambda: [agents.act(seen) for _ in range(10**6)])  # noqa: B023 - called immediately
        one = [{**seen[0], "global_target_xy": (1, 0)}]
        assert agents.act(one) == [2], planner


#: Every step ends an episode.
SMALL = {"size": 8, "num_agents": 1, "seed": 5, "obs_radius": 1, "max_episode_steps": 1}


def batch(num_envs, **config):
    return VecEnv({"size": 64, "num_agents": 16, "seed": 5, "on_target": "restart", **config}, num_envs, dtype="uint8")


@interrupts("Batch.__new__")
def batch_construction():
    interrupt("Batch.__new__", lambda: batch(300_000, size=8, num_agents=1, obs_radius=1), 0.1)
    batch(2).reset()


@interrupts("Batch.reset")
def batch_reset():
    env, twin = batch(4000), batch(4000)
    interrupt("Batch.reset", env.reset)
    try:
        env.episode_seeds  # noqa: B018 - raises
        raise AssertionError("the first reset was only partly undone")
    except NotResetError:
        pass
    env.reset()
    twin.reset()
    for arguments in [{"seed": 7}, {"seed": 7, "options": {"reset_mask": np.arange(4000) < 3999}}]:
        interrupt("Batch.reset", lambda: env.reset(**arguments))  # noqa: B023 - called immediately
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


@interrupts("Batch.episode_seeds")
def batch_episode_seeds():
    env = batch(4000)
    env.reset()
    interrupt("Batch.episode_seeds", lambda: env.episode_seeds, 0.1)


@interrupts("Batch.step")
def batch_step():
    env, twin = batch(8000, max_episode_steps=1), batch(8000, max_episode_steps=1)
    env.reset()
    # All episodes end, and all lanes need their next instances.
    interrupt("Batch.step", lambda: env.step(np.zeros((8000, 16), int)), 0.1)
    twin.reset()
    check_equal(env, twin)


def encoded():
    config = {"size": 400, "num_agents": 400, "density": 0.1, "seed": 5, "on_target": "restart", "max_episode_steps": 1}
    return VecEnv(config, 2, encoder=Encoder(1, ["cost_to_go", "seen_obstacles"]))


@interrupts("Batch.reset", "Batch.step")
def batch_encoders():
    # The costs of all goals take seconds.
    env, twin = encoded(), encoded()
    interrupt("Batch.reset", env.reset, 0.6)
    env.reset(seed=1)
    twin.reset(seed=1)
    interrupt("Batch.reset", lambda: env.reset(seed=2), 0.6)
    interrupt("Batch.step", lambda: env.step(np.zeros((2, 400), int)), 0.6)
    check_equal(env, twin)


@interrupts("Batch.step")
def batch_dense_rewards():
    config = {"size": 600, "num_agents": 400, "density": 0.1, "seed": 5, "obs_radius": 1, "max_episode_steps": 4}
    env, twin = VecEnv(config, 2, rewards="dense"), VecEnv(config, 2, rewards="dense")
    for each in (env, twin):
        each.reset(seed=1)
    # The distances to all goals take seconds.
    interrupt("Batch.step", lambda: env.step(np.zeros((2, 400), int)), 0.4)
    check_equal(env, twin)


@interrupts("Batch.reset")
def batch_abandoned_encoders():
    # Every agent begins beside its goal, so that one step ends all episodes before their limit.
    places = {"agents_xy": [(2 * agent, 1) for agent in range(8)], "targets_xy": [(2 * agent, 2) for agent in range(8)]}
    config = {"size": 64, "num_agents": 8, "density": 0.3, "on_target": "finish", "max_episode_steps": 64, **places}
    env, old, new = (VecEnv(config, 256, encoder=Encoder(2, ["cost_to_go"]), num_threads=1) for _ in range(3))
    began = time.monotonic()
    new.reset(seed=1)
    taken = time.monotonic() - began
    for each in (env, old):
        each.reset(seed=0)
    # Near its end, a reset cannot be interrupted: Python then raises the exception after the reset.
    interrupt("Batch.reset", lambda: env.reset(seed=1), taken / 2)
    # The new episodes have other maps than those of the abandoned reset.
    for action in (4, 0):
        seen, expected, other = (each.step(np.full((256, 8), action)) for each in (env, old, new))
        if not np.array_equal(seen[0], expected[0]):
            np.testing.assert_array_equal(seen[0], other[0])
            raise EndedFirst("the reset was complete before the exception")
        assert action == 0 or seen[2].all()


@interrupts("Policy.act_batch", "Policy.act")
def policy_actions():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.safetensors"
        rng = np.random.default_rng(0)
        tensors = {
            "a.weight": rng.normal(size=(2000, 121)),
            "b.weight": rng.normal(size=(2000, 2000)),
            "policy.weight": rng.normal(size=(5, 2000)),
        }
        biases = {name.replace("weight", "bias"): np.zeros(len(weight)) for name, weight in tensors.items()}
        save(
            path,
            Encoder(5, ["obstacles"]),
            ["flatten", {"dense": "a"}, "elu", {"dense": "b"}, "elu"],
            {**tensors, **biases},
        )
        env, policy, twin = batch(400), load(path), load(path)
        env.reset()
        interrupt("Policy.act_batch", lambda: policy.act(env))
        small = VecEnv({"size": 64, "num_agents": 16, "seed": 5}, 3)
        small.reset()
        policy.reset_states()
        np.testing.assert_array_equal(policy.act(small), twin.act(small))
        env = pogema_v0(GridConfig(size=64, num_agents=300, density=0.1, seed=5, observation_type="MAPF"))
        seen, _ = env.reset()
        for each in (policy, twin):
            each.reset_states()
        interrupt("Policy.act", lambda: policy.act(seen))
        for _ in range(2):
            actions = policy.act(seen)
            assert actions == twin.act(seen)
            seen, *_ = env.step(actions)


@interrupts("Batch.set_configs")
def batch_configs():
    def ended():
        env = VecEnv(dict(SMALL), 4000, autoreset_mode="next_step", map_size=256)
        env.reset()
        env.step(np.zeros((4000, 1), int))
        return env

    env, twin = ended(), ended()
    # The next step begins all next episodes, so their instances are needed now.
    interrupt("Batch.set_configs", lambda: env.set_configs({**SMALL, "size": 256}))
    check_equal(env, twin)


@interrupts("Batch.finish_films")
def films():
    with tempfile.TemporaryDirectory() as folder:
        config = {
            "size": 128,
            "num_agents": 2000,
            "density": 0.1,
            "seed": 5,
            "max_episode_steps": 300,
            "on_target": "restart",
        }
        env = VecEnv(config, 1, film=Film(folder))
        env.reset()
        for _ in range(4 * 300):
            env.step(env.sample_actions())
        interrupt("Batch.finish_films", env.close, 0.05)
        assert env.closed


@interrupts("Engine.reset")
def reset():
    env = pogema_v0(GridConfig(size=12, num_agents=2, seed=1))
    env.reset()
    before = env.get_agents_xy()
    env.grid_config = GridConfig(size=4096, num_agents=2, seed=1, on_target="restart")
    interrupt("Engine.reset", env.reset, 0.1)
    assert env.get_agents_xy() == before
    assert len(env.step([0, 0])[0]) == 2


def _filmed():
    env = AnimationMonitor(
        pogema_v0(GridConfig(size=64, num_agents=400, seed=1, max_episode_steps=1500, on_target="restart"))
    )
    env.reset()
    ended = False
    while not ended:
        ended = all(env.step(env.sample_actions())[3])
    return env


@interrupts("Engine.pack_film", "Engine.draw_svg", "Engine.draw_html")
def animation():
    env = _filmed()
    engine = env.unwrapped._engine
    interrupt("Engine.pack_film", lambda: engine.pack_film(), 0.1)
    interrupt("Engine.draw_svg", lambda: engine.draw_svg(), 0.1)
    interrupt("Engine.draw_html", lambda: engine.draw_html("a film"), 0.1)


@interrupts("restore_engine")
def pickle_():
    env = pogema_v0(GridConfig(size=64, num_agents=400, seed=1, max_episode_steps=3000, persistent=True))
    env.reset()
    for _ in range(1000):
        env.step([0] * 400)
    engine = env.unwrapped._engine
    saved = engine.__reduce__()[1][0]
    interrupt("restore_engine", lambda: restore_engine(saved), 0.1, is_abandoned=True)
    assert pickle.loads(pickle.dumps(engine)).cells(0) == engine.cells(0)
    assert restore_engine(saved).cells(0) == engine.cells(0)


def suite(seeds, **algorithm):
    environment = {
        "name": "Environment", "on_target": "restart", "size": 24, "num_agents": 32, "max_episode_steps": 512,
        "collision_system": "soft", "observation_type": "POMAPF", "seed": {"grid_search": list(range(seeds))},
    }  # fmt: skip
    return {"environment": environment, "algorithms": {"A": algorithm}}


@interrupts("Evaluation.run_built_in")
def built_in_evaluation():
    config = suite(200, name="pibt")
    interrupt("Evaluation.run_built_in", lambda: evaluation(config, "out"))
    assert not Path("out/A.json").exists()
    interrupt("Evaluation.run_built_in", lambda: evaluation(config, "out", begin="resume"))
    evaluation(config, "out", begin="resume")
    evaluation(config, "whole")
    assert Path("out/A.json").read_bytes() == Path("whole/A.json").read_bytes()


@interrupts("Evaluation.run_built_in")
def long_episode():
    config = suite(1, name="rhcr", seconds=100.0, nodes=10**9)
    interrupt("Evaluation.run_built_in", lambda: evaluation(config, "out"))
    assert not Path("out/A.jsonl").read_bytes() and not Path("out/A.failed.jsonl").exists()
    config["algorithms"]["A"] = {"name": "stay"}
    assert len(evaluation(config, "out", begin="anew")) == 1


@interrupts("Evaluation.write_report")
def page():
    # The page plays the episode again.
    config = suite(1, name="rhcr", seconds=0.01)
    config["environment"]["max_episode_steps"] = 200
    began = time.monotonic()
    evaluation(config, "out")
    taken = time.monotonic() - began
    interrupt("Evaluation.write_report", lambda: evaluation(config, "out", begin="resume", html="page.html"), taken / 2)
    assert not Path("page.html").exists()
    evaluation(config, "out", begin="resume", html="page.html")
    assert Path("page.html").exists()


class Sleepy:
    """A policy whose actions take minutes."""

    def act(self, observations):
        """Sleeps."""
        time.sleep(100)

    def reset_states(self):
        """Does nothing."""


@interrupts()
def process_pool():
    ToolboxRegistry.register_algorithm("Sleepy", Sleepy)
    for backend in ["multiprocessing", "dask"]:
        config = suite(8, name="Sleepy", parallel_backend=backend, num_process=2)
        timer = threading.Timer(5.0, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        try:
            evaluation(config, backend)
            raise AssertionError("the evaluation ended before it was interrupted")
        except KeyboardInterrupt:
            pass
        config["algorithms"]["A"] = {"name": "stay"}
        assert len(evaluation(config, backend, begin="anew")) == 8


@interrupts("play_built_in")
def one_episode():
    config = json.dumps(suite(1, name="rhcr", seconds=100.0, nodes=10**9))
    interrupt("play_built_in", lambda: _engine.play_built_in(config, []), is_abandoned=True)


@interrupts()
def expert_episodes():
    config = GridConfig(size=48, density=0.0, num_agents=576, seed=5, max_episode_steps=200, collision_system="soft")
    timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    began = time.monotonic()
    try:
        list(collect(config, "episodes", 64, planner="cbs", seconds=100.0))
        raise AssertionError("all episodes were collected before the interrupt")
    except KeyboardInterrupt:
        print(f"collect ended after {time.monotonic() - began:.3f} s", file=sys.stderr)
    written = [path.name for path in Path("episodes").iterdir()]
    assert not written, written
    # If these threads continued, the program would wait for them.
    for thread in threading.enumerate():
        if thread is not threading.current_thread():
            thread.join(20)
            assert not thread.is_alive(), thread.name
    assert len(list(collect(config, "episodes", 2, planner="cbs", nodes=1))) == 1


@interrupts("show_views")
def views():
    config = suite(4, name="stay")
    config["results_views"] = {"Plot": {"type": "plot", "x": "seed", "y": "avg_throughput"}}
    evaluation(config, "out")
    # The bands of the plot need a thousand bootstrap samples of all rows.
    path = Path("out/A.json")
    path.write_text(json.dumps(json.loads(path.read_text()) * 100_000))
    interrupt("show_views", lambda: show("out"), 0.5, is_abandoned=True)


@interrupts("random_map", "maze", "warehouse", "warehouse_cells", "movingai_map")
def maps():
    row = "." * 8000
    shelves = "\n".join([row] * 8000)
    file = f"type octile\nheight 8000\nwidth 8000\nmap\n{shelves}"
    for entry, call in {
        "random_map": lambda: _engine.random_map((8000, 8000), 0.3, 1),
        "maze": lambda: _engine.maze((4001, 4001), 0.9, 100, 0.8, 1),
        "warehouse": lambda: _engine.warehouse([10, 2, 1000, 2000, 5, 1, 5]),
        "warehouse_cells": lambda: _engine.warehouse_cells(shelves, 5, 5),
        "movingai_map": lambda: _engine.movingai_map(file, True),
    }.items():
        interrupt(entry, call, 0.02, is_abandoned=True)


@interrupts("make_instances")
def instances():
    fields, registered = engine_config(GridConfig(size=16, num_agents=8, on_target="restart"), "own")
    interrupt("make_instances", lambda: _engine.make_instances(fields, registered, list(range(100_000)), 10_000), 0.05)
    # This call lists the goals of a single instance. The abandoned thread ends soon, too.
    interrupt("make_instances", lambda: _engine.make_instances(fields, registered, [0], 10**8), 0.1)
    while threads_named("pogema work"):
        time.sleep(0.01)


@interrupts("cost_to_go", "check_plan")
def distances_and_validation():
    interrupt(
        "cost_to_go", lambda: _engine.cost_to_go(np.zeros((4096, 4096), np.float32), (0, 0)), 0.05, is_abandoned=True
    )
    places = np.array([(row, 0) for row in range(4000)])
    steps = np.tile(places, (4000, 1, 1))
    obstacles = np.zeros((4000, 1), np.float32)
    interrupt("check_plan", lambda: _engine.check_plan(obstacles, places, places, steps), 0.02, is_abandoned=True)


@interrupts("Engine.foretold_goals")
def foretold_goals():
    env = pogema_v0(GridConfig(size=8, num_agents=2, seed=1, on_target="restart", max_episode_steps=10**8))
    env.reset()
    engine = env.unwrapped._engine
    interrupt("Engine.foretold_goals", lambda: engine.foretold_goals())
    assert len(env.step([0, 0])[0]) == 2


@interrupts()
def one_step():
    # A signal during a step arrives after it: the step is complete, and its results are lost.
    config = GridConfig(size=500, num_agents=40_000, density=0.1, obs_radius=1, seed=1, on_target="restart")
    env, twin = pogema_v0(config), pogema_v0(config)
    env.reset()
    twin.reset()
    num_steps, actions = 0, [1] * 40_000
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        while True:
            env.step(actions)
            num_steps += 1
    except KeyboardInterrupt:
        pass
    num_played = env.unwrapped._engine.num_steps
    assert num_steps <= num_played <= num_steps + 1, (num_steps, num_played)
    for _ in range(num_played):
        twin.step(actions)
    assert env.get_agents_xy() == twin.get_agents_xy()
    for one, other in zip(env.step(actions)[:4], twin.step(actions)[:4]):
        np.testing.assert_array_equal(one, other)


if __name__ == "__main__":
    # A shell starts a background process with SIGINT ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    SCALE = float(sys.argv[2]) if len(sys.argv) > 2 else SCALE
    try:
        CASES[sys.argv[1]][0]()
    except EndedFirst as error:
        print(error, file=sys.stderr)
        sys.exit(ENDED_FIRST)
