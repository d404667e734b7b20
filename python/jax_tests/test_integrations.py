"""Plays environments of JaxMARL and gymnax beside those of POGEMA's interface."""

import jax
import jax.numpy as jnp
import numpy as np
import pogema_rs
import pogema_rs.jax as pj
import pytest
from gymnax.environments.environment import Environment
from jaxmarl.environments.multi_agent_env import MultiAgentEnv
from jaxmarl.wrappers.baselines import CTRolloutManager, LogWrapper
from pogema_rs import GridConfig
from pogema_rs.integrations.gymnax import PogemaGymnax
from pogema_rs.integrations.jaxmarl import PogemaJaxMARL

GOALS = ("finish", "nothing", "restart")


def one_instance(on_target, **changes):
    fields = {
        "size": 6,
        "num_agents": 5,
        "density": 0.2,
        "obs_radius": 2,
        "seed": 3,
        "max_episode_steps": 30,
        **changes,
    }
    config = GridConfig(on_target=on_target, collision_system="soft", **fields)
    return config, pj.InstancePool(config, 1, [config.seed])


@pytest.mark.parametrize("on_target", GOALS)
def test_jaxmarl_plays_the_episodes_of_pogema(on_target):
    config, pool = one_instance(on_target)
    env, plain = PogemaJaxMARL(pool), pogema_rs.pogema_v0(config)
    observations, state = env.reset(jax.random.key(0))
    np.testing.assert_array_equal([observations[agent] for agent in env.agents], plain.reset()[0])
    rng, num_ends = np.random.default_rng(1), 0
    for number in range(80):
        actions = rng.integers(0, 5, 5)
        named = {agent: jnp.int32(action) for agent, action in zip(env.agents, actions)}
        observations, state, rewards, dones, infos = env.step(jax.random.key(number), state, named)
        expected, paid, terminated, truncated, told = plain.step(actions.tolist())
        np.testing.assert_array_equal([rewards[agent] for agent in env.agents], paid)
        np.testing.assert_array_equal([dones[agent] for agent in env.agents], np.logical_or(terminated, truncated))
        assert dones["__all__"] == (all(terminated) or all(truncated))
        assert all(values.shape == (5,) for values in infos.values())
        found = {name: float(values[0]) for name, values in infos.items()}
        if dones["__all__"]:
            num_ends += 1
            assert found == pytest.approx(told[0]["metrics"], rel=1e-6)
            expected = plain.reset()[0]
        else:
            assert set(found.values()) == {0.0}
        np.testing.assert_array_equal([observations[agent] for agent in env.agents], expected)
    assert num_ends >= 2


@pytest.mark.parametrize("on_target", GOALS)
def test_action_masks_are_those_of_vec_env(on_target):
    config, pool = one_instance(on_target, size=5, obs_radius=1, density=0.4, num_agents=4)
    env, plain = PogemaJaxMARL(pool), pogema_rs.VecEnv(config, 1)
    plain.reset(seed=[3])
    state, rng = env.reset(jax.random.key(0))[1], np.random.default_rng(2)
    for _ in range(29):
        masks = env.get_avail_actions(state)
        np.testing.assert_array_equal([masks[agent] for agent in env.agents], plain.action_masks()[0])
        actions = rng.integers(0, 5, 4)
        done = plain.step(actions[None])
        state = env.step_env(None, state, dict(zip(env.agents, actions)))[1]
        if (done[2] | done[3]).all():
            break


def test_wrappers_of_jaxmarl_scripts_play_the_environment():
    config, _ = one_instance("restart")
    env = PogemaJaxMARL(pj.InstancePool(config, 20))
    assert isinstance(env, MultiAgentEnv)
    assert env.observation_space("agent_0").shape == (3, 5, 5)
    assert env.action_space("agent_0").n == 5

    # As IPPO does it.
    logged = LogWrapper(env)
    reset, step = jax.jit(jax.vmap(logged.reset)), jax.jit(jax.vmap(logged.step))
    _, state = reset(jax.random.split(jax.random.key(0), 8))
    starts = set()
    for number in range(61):
        keys = jax.random.split(jax.random.key(number), 8)
        actions = {agent: jax.random.randint(keys[0], (8,), 0, 5) for agent in env.agents}
        _, state, _, dones, infos = step(keys, state, actions)
        assert {values.shape for values in infos.values()} == {(8, 5)}
        assert dones["__all__"].all() == (number % 30 == 29)
        starts.update(np.asarray(state.env_state.instance).tolist())
    assert len(starts) > 8, "resets draw too few instances"

    # As QMIX does it.
    manager = CTRolloutManager(env, batch_size=4)
    observations, state = manager.batch_reset(jax.random.key(1))
    assert observations["agent_0"].shape == (4, 3 * 5 * 5 + 5)
    actions = {agent: jnp.zeros(4, jnp.int32) for agent in env.agents}
    observations, state, rewards, dones, _ = manager.batch_step(jax.random.key(2), state, actions)
    assert rewards["__all__"].shape == dones["__all__"].shape == (4,)


@pytest.mark.parametrize("on_target", GOALS)
def test_gymnax_plays_the_episodes_of_pogema(on_target):
    config, pool = one_instance(on_target, num_agents=1, density=0.1, size=4, max_episode_steps=12)
    env, plain = PogemaGymnax(pool), pogema_rs.pogema_v0(config)
    assert isinstance(env, Environment)
    assert (env.num_actions, env.action_space().n, env.observation_space().shape) == (5, 5, (3, 5, 5))
    observation, state = env.reset(jax.random.key(0), env.default_params)
    np.testing.assert_array_equal(observation, plain.reset()[0][0])
    rng, num_ends = np.random.default_rng(1), [0, 0]
    for number in range(120):
        action = int(rng.integers(0, 5))
        observation, state, reward, terminated, truncated, info = env.step(jax.random.key(number), state, action)
        expected, paid, is_terminated, is_truncated, told = plain.step([action])
        assert (float(reward), bool(terminated), bool(truncated)) == (paid[0], is_terminated[0], is_truncated[0])
        np.testing.assert_array_equal(info["final_observation"], expected[0])
        if terminated or truncated:
            num_ends = [num_ends[0] + bool(terminated), num_ends[1] + bool(truncated)]
            assert {name: float(info[name]) for name in told[0]["metrics"]} == pytest.approx(
                told[0]["metrics"], rel=1e-6
            )
            expected = plain.reset()[0]
        np.testing.assert_array_equal(observation, expected[0])
    assert num_ends[1] > 0 and (num_ends[0] > 0 or on_target == "restart")


def test_gymnax_plays_many_environments_in_a_compiled_loop():
    config, _ = one_instance("finish", num_agents=1)
    env = PogemaGymnax(pj.InstancePool(config, 20))
    _, states = jax.vmap(env.reset, (0, None))(jax.random.split(jax.random.key(0), 16), env.default_params)

    def advance(states, key):
        actions = jax.random.randint(key, (16,), 0, 5)
        keys = jax.random.split(key, 16)
        _, states, rewards, *_ = jax.vmap(env.step, (0, 0, 0, None))(keys, states, actions, env.default_params)
        return states, rewards

    _, rewards = jax.jit(lambda states, keys: jax.lax.scan(advance, states, keys))(
        states, jax.random.split(jax.random.key(1), 200)
    )
    assert rewards.sum() > 10


def test_gymnax_refuses_several_agents():
    _, pool = one_instance("finish")
    with pytest.raises(ValueError, match="num_agents is 5, expected 1"):
        PogemaGymnax(pool)
