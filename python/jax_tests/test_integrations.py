"""Plays environments of JaxMARL and gymnax in lockstep with those of POGEMA's interface."""

import jax
import jax.numpy as jnp
import jaxmarl
import numpy as np
import pogema_rs
import pogema_rs.jax as pj
import pytest
from flax import linen as nn
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
    env, plain = PogemaJaxMARL(pool, flatten=False), pogema_rs.pogema_v0(config)
    observations, state = env.reset(jax.random.key(0))
    np.testing.assert_array_equal([observations[agent] for agent in env.agents], plain.reset()[0])
    rng, num_ends = np.random.default_rng(1), 0
    for number in range(80):
        actions = rng.integers(0, 5, 5)
        named = {agent: jnp.int32(action) for agent, action in zip(env.agents, actions)}
        observations, state, rewards, dones, infos = env.step(jax.random.key(number), state, named)
        expected, paid, terminated, truncated, expected_infos = plain.step(actions.tolist())
        np.testing.assert_array_equal([rewards[agent] for agent in env.agents], paid)
        np.testing.assert_array_equal([dones[agent] for agent in env.agents], np.logical_or(terminated, truncated))
        assert dones["__all__"] == (all(terminated) or all(truncated))
        assert all(values.shape == (5,) for values in infos.values())
        found = {name: float(values[0]) for name, values in infos.items()}
        if dones["__all__"]:
            num_ends += 1
            assert found == pytest.approx(expected_infos[0]["metrics"], rel=1e-6)
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


def made_by_jaxmarl(on_target="finish", num=20):
    config, _ = one_instance(on_target)
    return jaxmarl.make("pogema", config=config.model_dump(), num=num)


def test_jaxmarl_makes_pogema_and_its_own_environments():
    env = made_by_jaxmarl()
    assert isinstance(env, PogemaJaxMARL) and isinstance(env, MultiAgentEnv)
    assert "pogema" in jaxmarl.registered_envs
    assert env.observation_space("agent_0").shape == (75,)
    assert env.action_space("agent_0").n == 5
    images = jaxmarl.make("pogema", config={"num_agents": 2, "obs_radius": 2}, num=2, flatten=False)
    assert images.observation_space("agent_0").shape == images.reset(jax.random.key(0))[0]["agent_1"].shape == (3, 5, 5)
    assert jaxmarl.make("switch_riddle").name != env.name
    with pytest.raises(ValueError, match="pogena is not in registered"):
        jaxmarl.make("pogena")


def test_a_wrong_action_of_jaxmarl_is_named():
    env = made_by_jaxmarl()
    _, state = env.reset(jax.random.key(0))
    right = {agent: jnp.int32(0) for agent in env.agents}
    with pytest.raises(ValueError, match=r"actions\['agent_2'\] has shape \(2,\), expected one action"):
        env.step(jax.random.key(0), state, {**right, "agent_2": jnp.zeros(2, jnp.int32)})
    with pytest.raises(TypeError, match="actions has type float32"):
        env.step(jax.random.key(0), state, {agent: jnp.float32(0) for agent in env.agents})
    with pytest.raises(KeyError, match="agent_4"):
        env.step(jax.random.key(0), state, {agent: right[agent] for agent in env.agents[:4]})


def stacked(values, agents):
    """Returns the values of all agents as one array of rows, as JaxMARL's IPPO does."""
    return jnp.stack([values[agent] for agent in agents]).reshape(len(agents) * values[agents[0]].shape[0], -1)


def test_independent_ppo_of_jaxmarl_plays_and_learns_from_the_environment():
    """Makes the calls of JaxMARL's script: one dense network for all agents, and actions with an axis of length 1."""
    env, num_envs = LogWrapper(made_by_jaxmarl("restart")), 8
    num_actors = env.num_agents * num_envs
    actor = nn.Dense(env.action_space(env.agents[0]).n)
    weights = actor.init(jax.random.key(0), jnp.zeros(env.observation_space(env.agents[0]).shape))
    observations, state = jax.vmap(env.reset)(jax.random.split(jax.random.key(1), num_envs))

    def advance(carry, key):
        observations, state = carry
        rows = stacked(observations, env.agents)
        actions = jax.random.categorical(key, actor.apply(weights, rows))
        by_agent = dict(zip(env.agents, actions.reshape(env.num_agents, num_envs, -1)))
        keys = jax.random.split(key, num_envs)
        observations, state, rewards, dones, infos = jax.vmap(env.step)(keys, state, by_agent)
        infos = jax.tree.map(lambda values: values.reshape(num_actors), infos)
        results = stacked(rewards, env.agents).squeeze(), stacked(dones, env.agents).squeeze(), dones["__all__"]
        return (observations, state), (rows, actions, *results, infos, state.env_state.instance)

    run = jax.jit(lambda carry, keys: jax.lax.scan(advance, carry, keys))
    keys = jax.random.split(jax.random.key(2), 61)
    rows, actions, rewards, dones, ends, infos, instances = run((observations, state), keys)[1]
    assert rewards.shape == dones.shape == (61, num_actors) and float(rewards.sum()) > 0
    assert np.flatnonzero(np.asarray(ends).all(axis=1)).tolist() == [29, 59]
    assert len(set(np.asarray(instances).ravel().tolist())) > 8, "resets draw too few instances"
    # Metrics of the step that ended the episodes, and the returns that `LogWrapper` adds.
    assert float(infos["avg_throughput"][29].sum()) > 0 and float(infos["returned_episode_returns"][29].sum()) > 0

    def loss(weights):
        chosen = jax.nn.log_softmax(actor.apply(weights, rows))
        return -(rewards * jnp.take_along_axis(chosen, actions[..., None], axis=-1)[..., 0]).mean()

    gradient = jax.grad(loss)(weights)
    assert max(float(jnp.abs(leaf).max()) for leaf in jax.tree.leaves(gradient)) > 0


def test_qmix_of_jaxmarl_mixes_values_by_the_state_of_the_environment():
    """Makes the calls of JaxMARL's script: action masks and a mixer whose weights come from the state of all agents."""
    env = made_by_jaxmarl()
    manager = CTRolloutManager(LogWrapper(env), batch_size=4)
    # JaxMARL knows the masks only of its own environments.
    manager.get_valid_actions = jax.vmap(env.get_avail_actions)
    observations, state = manager.batch_reset(jax.random.key(1))
    assert observations["agent_0"].shape == (4, 75 + 5) and observations["__all__"].shape == (4, 5 * 75)
    agent, mixer = nn.Dense(manager.max_action_space), nn.Dense(len(env.agents))
    agent_weights = agent.init(jax.random.key(2), jnp.zeros(manager.obs_size))
    mixer_weights = mixer.init(jax.random.key(3), observations["__all__"])
    for number in range(31):
        masks = manager.get_valid_actions(state.env_state)
        values = {name: agent.apply(agent_weights, observations[name]) for name in env.agents}
        best = {name: jnp.where(masks[name], values[name], -jnp.inf).max(axis=-1) for name in env.agents}
        total = jnp.stack(list(best.values()), axis=-1) * jnp.abs(mixer.apply(mixer_weights, observations["__all__"]))
        assert np.isfinite(np.asarray(total.sum(axis=-1))).all()
        actions = {name: jnp.where(masks[name], values[name], -jnp.inf).argmax(axis=-1) for name in env.agents}
        observations, state, rewards, dones, _ = manager.batch_step(jax.random.key(number), state, actions)
        assert rewards["__all__"].shape == dones["__all__"].shape == (4,)
        assert not np.asarray(state.env_state.num_clipped).any()
    sampled = {name: manager.batch_sample(jax.random.key(9), name) for name in env.agents}
    assert all(((values >= 0) & (values < 5)).all() for values in sampled.values())


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
        expected, paid, is_terminated, is_truncated, expected_infos = plain.step([action])
        assert (float(reward), bool(terminated), bool(truncated)) == (paid[0], is_terminated[0], is_truncated[0])
        np.testing.assert_array_equal(info["final_observation"], expected[0])
        if terminated or truncated:
            num_ends = [num_ends[0] + bool(terminated), num_ends[1] + bool(truncated)]
            assert {name: float(info[name]) for name in expected_infos[0]["metrics"]} == pytest.approx(
                expected_infos[0]["metrics"], rel=1e-6
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


def test_gymnax_rejects_several_agents():
    _, pool = one_instance("finish")
    with pytest.raises(ValueError, match="num_agents is 5, expected 1"):
        PogemaGymnax(pool)
