"""Tests of the adapter for PufferLib, with its buffers and its native, serial and multiprocessing backends."""

import numpy as np
import pufferlib
import pufferlib.vector
import pytest
from pogema_rs import GridConfig, VecEnv
from pogema_rs.integrations.pufferlib import PogemaPuffer

CONFIG = GridConfig(size=8, num_agents=4, max_episode_steps=20, density=0.2)


def buffers(env):
    return [env.observations, env.rewards, env.terminals, env.truncations, env.masks]


def test_episodes_equal_those_of_vec_env_and_are_written_to_the_buffers():
    env, plain = PogemaPuffer(CONFIG, 3), VecEnv(CONFIG, 3)
    assert isinstance(env, pufferlib.PufferEnv)
    assert (env.num_agents, env.single_action_space.n) == (12, 5)
    addresses = [buffer.ctypes.data for buffer in buffers(env)]
    observations, infos = env.reset(seed=5)
    expected, state = plain.reset(seed=5)
    assert infos == []
    assert env.masks.all()
    is_active, num_ended, num_masked = state["is_active"].ravel(), 0, 0
    for actions in np.random.default_rng(1).integers(5, size=(200, 12)):
        assert np.array_equal(observations, expected.reshape(12, *expected.shape[2:]))
        observations, rewards, terminals, truncations, infos = env.step(actions)
        expected, *values, state = plain.step(actions.reshape(3, 4))
        for got, value in zip((rewards, terminals, truncations), values):
            assert np.array_equal(got, value.ravel())
        was_active, is_active = is_active, state["is_active"].ravel()
        assert np.array_equal(env.masks, was_active | is_active)
        ended = np.flatnonzero(state.get("_metrics", []))
        names = ("CSR", "ISR", "ep_length")
        assert infos == [{name: state["metrics"][name][one] for name in names} for one in ended]
        num_ended += len(infos)
        num_masked += np.sum(~env.masks)
    assert num_ended > 20 and num_masked > 20
    assert addresses == [buffer.ctypes.data for buffer in buffers(env)]
    env.close()


def test_finished_agents_are_reported_once_and_then_masked():
    config = GridConfig(map="aA..\nb..B", num_agents=2, max_episode_steps=9)
    env = PogemaPuffer(config, dtype="uint8")
    env.reset(seed=0)
    _, rewards, terminals, _, _ = env.step(np.array([4, 4]))
    assert (list(rewards), list(terminals), list(env.masks)) == ([1, 0], [True, False], [True, True])
    env.step(np.array([4, 4]))
    assert list(env.masks) == [False, True]
    _, _, terminals, _, infos = env.step(np.array([4, 4]))
    assert terminals.all()
    assert infos[0]["ISR"] == 1.0
    assert env.masks.all()


def play(vec, seed, num_steps=50):
    vec.async_reset(seed)
    seen = [np.copy(vec.recv()[0])]
    for actions in np.random.default_rng(2).integers(5, size=(num_steps, vec.num_agents)):
        vec.send(actions.astype(np.int32).reshape(vec.action_space.shape))
        seen.append(np.copy(vec.recv()[0]))
    vec.close()
    return np.stack(seen)


def test_native_and_serial_vectorization_play_the_same():
    kwargs = {"grid_config": CONFIG, "num_envs": 2, "num_threads": 1}
    native = play(pufferlib.vector.make(PogemaPuffer, env_kwargs=kwargs), 3)
    serial = play(pufferlib.vector.make(PogemaPuffer, env_kwargs=kwargs, backend=pufferlib.vector.Serial), 3)
    assert np.array_equal(native, serial)


def test_several_processes_play_the_same_as_one():
    kwargs = {"grid_config": CONFIG, "num_envs": 2, "num_threads": 1}
    vec = [
        pufferlib.vector.make(PogemaPuffer, env_kwargs=kwargs, num_envs=2, backend=backend, **options)
        for backend, options in (
            (pufferlib.vector.Serial, {}),
            (pufferlib.vector.Multiprocessing, {"num_workers": 2, "overwork": True}),
        )
    ]
    seen = [play(each, 3) for each in vec]
    assert seen[0].shape == seen[1].shape == (51, 16, 3, 11, 11)
    assert np.array_equal(*seen)


@pytest.mark.parametrize("actions", [[0] * 7, [[0] * 8], [5] * 8, [0.5] * 8])
def test_wrong_actions_change_nothing(actions):
    env, fresh = PogemaPuffer(CONFIG, 2), PogemaPuffer(CONFIG, 2)
    for each in (env, fresh):
        each.reset(seed=1)
    before = [np.copy(buffer) for buffer in buffers(env)]
    with pytest.raises((ValueError, TypeError), match="expected"):
        env.step(actions)
    assert all(np.array_equal(one, other) for one, other in zip(before, buffers(env)))
    for moves in np.random.default_rng(4).integers(5, size=(25, 8)):
        for got, expected in zip(env.step(moves), fresh.step(moves)):
            assert np.array_equal(got, expected)
