"""Tests that sizes beyond the memory raise MemoryError; also tests unaligned and strided arrays, and threads."""

import pickle
import re
import subprocess
import sys
import threading

import numpy as np
import pytest
from pogema_rs import AStarAgent, GridConfig, _engine, pogema_v0
from pogema_rs.errors import StateError
from pogema_rs.planners import cost_to_go, plan, validate
from pogema_rs.vec_env import VecEnv


def limited(code):
    """Runs code in a process with 4 GB of address space, and returns the last line on stderr, or the status."""
    program = f"import resource; resource.setrlimit(resource.RLIMIT_AS, (4_000_000_000,) * 2)\n{code}"
    done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, timeout=60)
    return done.stderr.strip().splitlines()[-1] if done.stderr.strip() else f"status {done.returncode}"


@pytest.mark.parametrize("num_envs", [10**7, 10**9, 10**18, 10**30])
def test_too_many_environments_raise_memory_error(num_envs):
    said = limited(f"from pogema_rs.vec_env import VecEnv\nVecEnv({{'size': 8, 'num_agents': 1}}, {num_envs})")
    assert re.fullmatch(r"MemoryError: not enough memory: the batch needs (\d+ bytes|more .* counted)", said), said


@pytest.mark.parametrize(
    "config",
    [
        {"size": 8, "num_agents": 1, "obs_radius": 1},
        {"size": 64, "num_agents": 64, "obs_radius": 1, "on_target": "restart"},
        pytest.param({"size": 500, "num_agents": 2, "obs_radius": 3, "max_episode_steps": 2}, marks=pytest.mark.slow),
    ],
)
def test_a_memory_error_leaves_the_process_running(config):
    code = f"""
from pogema_rs.vec_env import VecEnv
resource.setrlimit(resource.RLIMIT_AS, (1_200_000_000,) * 2)
num_envs = 10
while True:
    env = VecEnv({config}, num_envs, dtype="uint8", num_threads=2)
    env.reset(seed=1)
    for _ in range(3):
        env.step(env.sample_actions())
    env.close()
    num_envs = num_envs * 3 // 2
"""
    assert "MemoryError: " in limited(code)


def test_array_beyond_the_memory_raises_memory_error():
    code = """
from pogema_rs import GridConfig, pogema_v0
env = pogema_v0(GridConfig(size=1500, num_agents=200_000, obs_radius=30, density=0.0))
env.reset()
"""
    assert re.fullmatch(r"MemoryError: not enough memory: an array needs \d+ bytes", limited(code)), limited(code)


@pytest.mark.parametrize(
    ("what", "code"),
    [
        (
            "the list of goals",
            "env = pogema_v0(GridConfig(size=8, num_agents=1, on_target='restart', max_episode_steps=10**9))\n"
            "env.reset()\nenv.get_lifelong_targets_xy()",
        ),
        ("the search", "planners.cost_to_go(np.zeros((9000, 9000)), (0, 0))"),
        (
            "the plan",
            "planners.plan(np.zeros((3000, 3000)), [(0, n) for n in range(2000)], [(1, n) for n in range(2000)])",
        ),
        ("the map", "_engine.random_map((60000, 60000), 0.3, 1)"),
        ("the map", "_engine.maze((60001, 60001), 0.3, 4, 0.8, 1)"),
        ("the map", "_engine.warehouse([1, 1, 29000, 29000, 1, 1, 1])"),
    ],
)
def test_long_work_beyond_the_memory_raises_memory_error(what, code):
    imports = "import numpy as np\nfrom pogema_rs import GridConfig, _engine, planners, pogema_v0\n"
    assert re.fullmatch(rf"MemoryError: not enough memory: {what} needs \d+ bytes", limited(imports + code))


def test_given_goals_need_no_memory_for_the_steps_of_the_episode():
    goals = [[[0, 1], [1, 1]]]
    places = {"agents_xy": [[0, 0]], "targets_xy": goals, "obs_radius": 1}
    env = pogema_v0(GridConfig(size=3, on_target="restart", max_episode_steps=10**18, **places))
    env.reset()
    assert env.get_lifelong_targets_xy() == [[[1, 2], [2, 2]]]


def unaligned(array):
    """Returns an unaligned copy of an array: its elements are not at multiples of their size."""
    array = np.asarray(array)
    raw = np.zeros(array.nbytes + 1, np.uint8)[1:].view(array.dtype).reshape(array.shape)
    raw[...] = array
    assert not raw.flags.aligned
    return raw


def test_unaligned_arrays_are_errors_or_copied():
    free, start, goal = np.zeros((4, 4), np.float32), np.zeros((1, 2), np.int64), np.ones((1, 2), np.int64)
    expected = "is `an unaligned array`, expected an aligned array"
    for arguments in [(unaligned(free), start, goal), (free, unaligned(start), goal), (free, start, unaligned(goal))]:
        with pytest.raises(ValueError, match=expected):
            plan(*arguments)
    with pytest.raises(ValueError, match=expected):
        cost_to_go(unaligned(free), (0, 0))
    with pytest.raises(ValueError, match=expected):
        validate(free, start, goal, unaligned(np.zeros((1, 1, 2), np.int64)))
    with pytest.raises(ValueError, match=expected):
        _engine.AStarAgent(0).act((0, 0), (1, 1), unaligned(np.zeros((3, 3), np.float32)))
    env, twin = VecEnv({"size": 8, "seed": 1}, 3), VecEnv({"size": 8, "seed": 1}, 3)
    actions = np.ones((3, 1), np.int64)
    for one in (env, twin):
        one.reset()
    np.testing.assert_array_equal(env.step(unaligned(actions))[0], twin.step(actions)[0])


def test_strided_arrays_are_read_like_copies():
    grid = np.zeros((8, 10), np.float32)
    grid[2, 4] = grid[6, 2] = 1
    for strided in [grid[::2, ::2], grid[::-1, ::-1], grid.T, grid[1:6, 1:6], np.asfortranarray(grid)]:
        copy = np.ascontiguousarray(strided)
        places = np.array([[0, 9, 0], [0, 9, 1]])[:, ::2]
        assert places.strides != np.ascontiguousarray(places).strides
        for one, other in [
            (cost_to_go(strided, (0, 1)), cost_to_go(copy, (0, 1))),
            (plan(strided, places[:1], places[1:]).cells, plan(copy, places[:1], places[1:]).cells),
        ]:
            np.testing.assert_array_equal(one, other)
        steps = np.zeros((3, 2, 4), np.int64)[:, :1, ::2]
        assert validate(strided, places[:1], places[:1], steps) is None
    # The path leads around the obstacles of the window, which differ in its transpose.
    window = np.zeros((9, 9), np.float32)
    window[2:5, 6] = window[2, 5] = 1
    for strided in [window[2:7, 2:7], window.T[2:7, 2:7], window[::-1][2:7, 2:7]]:
        seen = {"xy": (2, 2), "target_xy": (0, 4)}
        actions = [
            AStarAgent(seed=0).act({**seen, "obstacles": array, "agents": array})
            for array in (strided, np.ascontiguousarray(strided))
        ]
        assert actions[0] == actions[1]


def test_pickling_during_a_step_of_another_thread_is_a_state_error():
    env = pogema_v0(GridConfig(size=256, num_agents=4000, density=0.1, max_episode_steps=10**6, on_target="restart"))
    env.reset()
    engine, is_over, said = env.unwrapped._engine, threading.Event(), []

    def play():
        while not is_over.is_set():
            env.step([1] * 4000)

    thread = threading.Thread(target=play)
    thread.start()
    try:
        for _ in range(300):
            try:
                pickle.dumps(engine)
            except StateError as error:
                said.append(str(error))
                break
    except RuntimeError as error:
        said.append(f"{type(error).__name__}: {error}")
    finally:
        is_over.set()
        thread.join()
    assert said == ["another thread is using this environment, expected one thread at a time"]
