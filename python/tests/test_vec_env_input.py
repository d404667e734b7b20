"""Tests that `VecEnv` rejects wrong input without changing its state; also tests processes, threads and memory."""

import copy
import gc
import os
import pickle
import threading
import time
import tracemalloc
import warnings

import numpy as np
import pytest
from pogema_rs import GridConfig, errors
from pogema_rs.grid_registry import GRID_STR_REGISTRY, RegisteredGrid
from pogema_rs.vec_env import Film, VecEnv
from vec_helpers import CONFIG

SHAPE = (2, 5, 3, 5, 5)


@pytest.fixture
def env():
    env = VecEnv(CONFIG, 2)
    env.reset(seed=0)
    return env


def readonly():
    array = np.zeros(SHAPE, np.float32)
    array.flags.writeable = False
    return array


class Tensor:
    """A stand-in for the tensors of other libraries."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.array, dtype)


class Capsule:
    """A stand-in for objects that only support DLPack."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **kwargs):
        return self.array.__dlpack__(**kwargs)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


BAD_ACTIONS = [
    (np.zeros((2, 4), int), ValueError, "shape (2, 4), expected (2, 5)"),
    (np.zeros(10, int), ValueError, "shape (10,), expected (2, 5)"),
    (3, ValueError, "shape (), expected (2, 5)"),
    ([[1, 2], [3]], ValueError, "expected whole numbers in the shape (envs, agents)"),
    (np.zeros((2, 5)), TypeError, "type float64, expected whole numbers 0 to 4"),
    (np.full((2, 5), np.nan), TypeError, "type float64, expected whole numbers 0 to 4"),
    ([[0, 0, 0, 0, float("nan")]] * 2, TypeError, "expected whole numbers"),
    (np.zeros((2, 5), bool), TypeError, "type bool, expected whole numbers"),
    ([["up"] * 5] * 2, TypeError, "expected whole numbers"),
    (None, TypeError, "type object, expected whole numbers"),
    ([[2**70] * 5] * 2, TypeError, "type object, expected whole numbers"),
    ([[0] * 5, [0, 0, 0, 5, 9]], ValueError, "action of environment 1, agent 3 is `5`, expected 0 (stay), 1 (up)"),
    ([[0] * 5, [0, 0, -1, 0, 0]], ValueError, "action of environment 1, agent 2 is `-1`, expected 0"),
    (np.full((2, 5), 2**64 - 1, np.uint64), ValueError, "agent 0 is `9223372036854775807`, expected 0"),
    (Tensor(np.full((2, 5), 7)), ValueError, "agent 0 is `7`"),
]


@pytest.mark.parametrize(("actions", "error", "text"), BAD_ACTIONS)
def test_wrong_actions_raise_and_nothing_is_played(env, actions, error, text):
    observations, _ = env.reset(seed=0)
    kept = observations.copy()
    with pytest.raises(error) as raised:
        env.step(actions)
    assert text in str(raised.value) and "\n" not in str(raised.value)
    assert (observations == kept).all()
    for _ in range(8):
        assert not env.step(np.zeros((2, 5), int))[3].any()
    assert env.step(np.zeros((2, 5), int))[3].all()


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "<i4", ">i4", "u4", "i8", "u8", ">i8"])
def test_actions_may_have_any_integer_type_and_layout(env, dtype):
    actions = np.arange(10).reshape(2, 5) % 5
    expected = env.step(actions)[0].copy()
    numbers = actions.astype(dtype)
    given = [numbers, np.asfortranarray(numbers), numbers[:, ::-1][:, ::-1], numbers.tolist(), Tensor(numbers)]
    if numbers.dtype.isnative:
        given.append(Capsule(numbers))
    for one in given:
        env.reset(seed=0)
        np.testing.assert_array_equal(env.step(one)[0], expected)


BAD_OUT = [
    ([0], TypeError, f"list, expected a numpy array of float32 with shape {SHAPE}"),
    (np.zeros(SHAPE), TypeError, "float64, expected float32"),
    (np.zeros(SHAPE, ">f4"), TypeError, ">f4, expected float32"),
    (np.zeros((1, *SHAPE[1:]), np.float32), ValueError, f"expected {SHAPE}"),
    (np.zeros((4, *SHAPE[1:]), np.float32)[::2], ValueError, "expected a C-contiguous array"),
    (np.asfortranarray(np.zeros(SHAPE, np.float32)), ValueError, "expected a C-contiguous array"),
    (np.zeros(751 * 4, np.uint8)[1:-3].view(np.float32).reshape(SHAPE), ValueError, "not contiguous in memory"),
    (readonly(), ValueError, "expected a writeable array"),
]


@pytest.mark.parametrize(("out", "error", "text"), BAD_OUT)
def test_wrong_buffers_raise_and_nothing_is_played(env, out, error, text):
    seeds = env.episode_seeds.tolist()
    for call in (lambda: env.step(np.zeros((2, 5), int), out=out), lambda: env.reset(seed=1, out=out)):
        with pytest.raises(error) as raised:
            call()
        assert text in str(raised.value)
    assert env.episode_seeds.tolist() == seeds
    for _ in range(8):
        assert not env.step(np.zeros((2, 5), int))[3].any()
    assert env.step(np.zeros((2, 5), int))[3].all()


BAD_RESETS = [
    ({"seed": -1}, ValueError, "seed is -1, expected 0 to 9223372036854775806"),
    ({"seed": 2**63 - 1}, ValueError, "expected 0 to 9223372036854775806"),
    ({"seed": 1.0}, TypeError, "seed is 1.0, expected a whole number"),
    ({"seed": True}, TypeError, "seed is True, expected a whole number"),
    ({"seed": "1"}, TypeError, "expected a whole number"),
    ({"seed": [1]}, ValueError, "seed holds 1 seed, expected 2, one per environment"),
    ({"seed": [1, None]}, TypeError, "seed[1] is None, expected a whole number"),
    ({"seed": [1, -3]}, ValueError, "seed[1] is -3, expected 0"),
    ({"options": {"mask": 1}}, ValueError, "options has `mask`, expected only `reset_mask`"),
    ({"options": {"reset_mask": [True, False]}}, TypeError, "has type list, expected a numpy array of bool"),
    ({"options": {"reset_mask": np.array([1, 0])}}, TypeError, "has type int64, expected a numpy array of bool"),
    ({"options": {"reset_mask": np.array([True])}}, ValueError, "has shape (1,), expected (2,)"),
    ({"options": {"reset_mask": np.zeros(2, bool)}}, ValueError, "expected at least one True"),
]


@pytest.mark.parametrize(("arguments", "error", "text"), BAD_RESETS)
def test_wrong_resets_raise_and_change_nothing(env, arguments, error, text):
    fresh = VecEnv(CONFIG, 2)
    fresh.reset(seed=0)
    with pytest.raises(error) as raised:
        env.reset(**arguments)
    assert text in str(raised.value)
    # The first and the next episodes equal those of `fresh`, which did not get the wrong reset.
    for actions in np.random.default_rng(0).integers(5, size=(12, 2, 5)):
        assert env.episode_seeds.tolist() == fresh.episode_seeds.tolist()
        for got, expected in zip(env.step(actions)[:4], fresh.step(actions)):
            np.testing.assert_array_equal(got, expected)


BAD_ARGUMENTS = [
    ({"num_envs": 0}, ValueError, "num_envs is 0, expected at least 1"),
    ({"num_envs": 2.0}, TypeError, "num_envs is 2.0, expected a whole number"),
    ({"num_threads": 1025}, ValueError, "num_threads is 1025, expected 1 to 1024"),
    ({"num_threads": 0}, ValueError, "num_threads is 0, expected 1 to"),
    ({"dtype": "float64"}, ValueError, "dtype is 'float64', expected 'float32', 'uint8' or 'bits'"),
    ({"autoreset_mode": "often"}, ValueError, "expected one of 'next_step', 'same_step', 'disabled'"),
    ({"semantics": "3"}, ValueError, "semantics is '3', expected '1.4.0' or '2.0'"),
    ({"grid_config": 7}, TypeError, "grid_config holds a value of type int, expected a GridConfig or a dict"),
    ({"grid_config": []}, ValueError, "grid_config is an empty list, expected at least one config"),
    ({"grid_config": [CONFIG] * 3}, ValueError, "num_envs is 2, expected 3, one for each config of the list"),
    ({"grid_config": [CONFIG, {**CONFIG, "obs_radius": 3}]}, ValueError, "`obs_radius` is `3`, expected 2"),
    ({"grid_config": [CONFIG, {**CONFIG, "on_target": "nothing"}]}, ValueError, "environment 1 must share it"),
    (
        {"grid_config": [CONFIG, {**CONFIG, "observation_type": "MAPF"}]},
        ValueError,
        '`observation_type` is `"MAPF"`, expected "default", because environment 1 must share it',
    ),
    (
        {"grid_config": {**CONFIG, "observation_type": "MAPF"}, "dtype": "bits"},
        ValueError,
        "dtype is 'bits', expected 'float32' or 'uint8' with observation_type 'MAPF'",
    ),
    ({"rewards": np.array(["own", "own"])}, ValueError, "expected 'own', 'shared', 'dense' or a function"),
    ({"rewards": ["own"]}, ValueError, "rewards is ['own'], expected 'own', 'shared', 'dense' or a function"),
    ({"rewards": "team"}, ValueError, "rewards is 'team', expected 'own', 'shared', 'dense' or a function"),
    ({"grid_config": {**CONFIG, "persistent": True}}, ValueError, "expected false"),
    ({"grid_config": {**CONFIG, "obs_radius": 0}}, ValueError, "`obs_radius` is `0`, expected"),
]


@pytest.mark.parametrize(("arguments", "error", "text"), BAD_ARGUMENTS)
def test_wrong_constructor_arguments_raise(arguments, error, text):
    with pytest.raises(error) as raised:
        VecEnv(**{"grid_config": CONFIG, "num_envs": 2, **arguments})
    assert text in str(raised.value)


def test_first_reset_names_an_environment_without_room():
    env = VecEnv([CONFIG, {**CONFIG, "size": 2}])
    with pytest.raises(errors.InstanceError, match="environment 1, episode 0, seed [0-9]+: .*num_agents"):
        env.reset(seed=0)
    with pytest.raises(errors.NotResetError):
        env.step(np.zeros((2, 5), int))


def test_config_may_be_any_object_with_a_dict_method():
    class Config:
        def dict(self):
            return {**CONFIG, "integration": "SampleFactory", "auto_reset": True, "map": None}

    expected = VecEnv(CONFIG, 2).reset(seed=2)[0]
    for config in (Config(), GridConfig(**CONFIG), [CONFIG, Config()]):
        np.testing.assert_array_equal(VecEnv(config, 2).reset(seed=2)[0], expected)


def test_config_may_name_a_registered_map():
    rows = [".#.", "...", "#.."]
    config = {"num_agents": 2, "obs_radius": 2, "max_episode_steps": 5}
    RegisteredGrid("three by three", "\n".join(rows))
    try:
        named = VecEnv({**config, "map_name": "three by three"}, 2)
    finally:
        del GRID_STR_REGISTRY["three by three"]
    given = VecEnv({**config, "map": "\n".join(rows)}, 2)
    np.testing.assert_array_equal(named.reset(seed=2)[0], given.reset(seed=2)[0])


def test_map_name_has_to_be_registered():
    RegisteredGrid("rooms of a batch", "....\n....")
    try:
        with pytest.raises(ValueError, match="named 'room of a batch' is registered; did you mean `rooms of a batch`"):
            VecEnv(GridConfig(map_name="room of a batch"), 2)
        VecEnv(GridConfig(map_name="rooms of a batch"), 2).close()
    finally:
        del GRID_STR_REGISTRY["rooms of a batch"]
    with pytest.raises(ValueError, match="no map named 'rooms of a batch' is registered; register it with"):
        VecEnv(GridConfig(map_name="rooms of a batch"), 2)


def test_calls_before_a_reset_or_after_close_are_rejected():
    env = VecEnv(CONFIG, 2)
    actions, some = np.zeros((2, 5), int), {"reset_mask": np.array([True, False])}
    calls = [lambda: env.step(actions), env.action_masks, lambda: env.episode_seeds, lambda: env.reset(options=some)]
    for call in calls:
        with pytest.raises(errors.NotResetError, match="not been reset yet"):
            call()
    env.reset()
    env.close()
    env.close()
    for call in [*calls, env.reset]:
        with pytest.raises(RuntimeError, match="this VecEnv is closed"):
            call()


def test_pickling_and_copying_are_rejected(env):
    for way in (pickle.dumps, copy.copy, copy.deepcopy):
        with pytest.raises(TypeError, match="make a new one of the same config, in each process"):
            way(env)


def wait_for(child):
    """Returns the exit code of a child, or "hung" after 60 seconds."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    os.kill(child, 9)
    os.waitpid(child, 0)
    return "hung"


def in_child(env):
    """Returns 0 if every call in a forked child raises and a new `VecEnv` works there."""
    calls = [lambda: env.step(np.zeros((2, 5), int)), env.reset, env.action_masks, lambda: env.episode_seeds]
    for call in calls:
        try:
            call()
            return 1
        except RuntimeError as error:
            if "made before the process forked" not in str(error):
                return 2
    own = VecEnv(CONFIG, 2, num_threads=2)
    own.reset(seed=0)
    own.step(own.sample_actions())
    own.close()
    env.close()
    return 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system cannot fork")
@pytest.mark.parametrize(("num_threads", "films"), [(1, False), (2, False), (2, True)])
def test_calls_in_a_forked_child_raise_and_the_parent_continues(num_threads, films, tmp_path):
    env = VecEnv(CONFIG, 2, num_threads=num_threads, film=Film(tmp_path) if films else None)
    env.reset(seed=0)
    with warnings.catch_warnings():
        # This test forks a multi-threaded process, and Python 3.12 warns about this.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        code = 3
        try:
            code = in_child(env)
            del env
            gc.collect()
        finally:
            os._exit(code)
    for _ in range(20):
        env.step(env.sample_actions())
    assert wait_for(child) == 0
    env.step(env.sample_actions())


def test_concurrent_threads_get_an_error():
    env = VecEnv({**CONFIG, "num_agents": 32, "size": 24, "max_episode_steps": 10_000}, 64, num_threads=1)
    env.reset(seed=0)
    actions, messages, played = np.zeros((64, 32), int), [], []

    def step():
        for _ in range(20_000):
            try:
                env.step(actions)
                played.append(1)
            except errors.StateError as error:
                messages.append(str(error))
            if messages:
                return

    threads = [threading.Thread(target=step) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert messages and all("another thread is using this VecEnv" in text for text in messages)
    env.step(actions)
    assert played


def resident():
    """Returns the resident memory of this process in bytes, or 0 if it is unknown."""
    if not os.path.exists("/proc/self/statm"):
        return 0
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_memory_does_not_grow_with_steps():
    env = VecEnv({**CONFIG, "on_target": "restart"}, 8, masks=True)
    env.reset(seed=0)

    def play(num_steps):
        for _ in range(num_steps):
            env.step(env.sample_actions())
        gc.collect()

    play(100)
    tracemalloc.start()
    play(100)
    held, grown = resident(), []
    for _ in range(3):
        traced = tracemalloc.get_traced_memory()[0]
        play(4_000)
        grown.append(tracemalloc.get_traced_memory()[0] - traced)
    # Python may keep some memory in one of the rounds, so the smallest growth counts. A leak of one byte per step and
    # environment would add 32,000 bytes in each round.
    assert min(grown) < 3_200
    tracemalloc.stop()
    # The allocator reserves pages per thread and fills them gradually.
    assert resident() - held < 4 << 20


def test_more_threads_than_cores_trigger_a_warning_and_change_no_result():
    with pytest.warns(UserWarning, match="num_threads is 1024, but the machine has only"):
        many = VecEnv(CONFIG, 2, num_threads=1024)
    one = VecEnv(CONFIG, 2, num_threads=1)
    for env in (many, one):
        env.reset(seed=3)
    actions = np.ones((2, CONFIG["num_agents"]), dtype=np.int64)
    np.testing.assert_array_equal(many.step(actions)[0], one.step(actions)[0])
    many.close()
    one.close()
