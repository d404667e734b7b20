"""Tests `VecEnv` against single engines that are reset by hand, and with Gymnasium's own helpers."""

import gymnasium
import numpy as np
import pytest
from pogema_rs import _engine, errors
from pogema_rs.vec_env import AutoresetMode, VecEnv
from vec_helpers import CONFIG, Plain, actions_of, check_step, derived_seed, own_seeds, reset_ended, shared_seed

MODES = list(AutoresetMode)


def check_episodes(env, plain, num_steps, mode):
    """Compares a `VecEnv` to single engines step by step; with DISABLED, resets ended environments every few steps."""
    rng, num_ended = np.random.default_rng(0), 0
    for step in range(num_steps):
        actions = actions_of(rng, env)
        got = env.step(actions)
        num_ended += check_step(got, plain, mode, actions, env.episode_seeds)
        if mode == AutoresetMode.DISABLED and step % 4 == 0:
            reset_ended(env, plain)
    assert num_ended > 2 * env.num_envs


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
@pytest.mark.parametrize("dtype", ["float32", "uint8"])
def test_every_autoreset_mode_equals_single_engines(mode, on_target, dtype):
    config = {**CONFIG, "on_target": on_target}
    env = VecEnv(config, 4, autoreset_mode=mode, dtype=dtype, masks=True)
    observations, infos = env.reset(seed=11)
    names = {"is_active", "agent_mask", "action_masks"}
    assert observations.dtype == dtype and set(infos) == names | {f"_{name}" for name in names}
    assert infos["agent_mask"].all() and infos["agent_mask"].shape == (4, 5)
    plain = [Plain(config, index, shared_seed(11)) for index in range(4)]
    np.testing.assert_array_equal(observations, [one.observe() for one in plain])
    np.testing.assert_array_equal(infos["action_masks"], [one.masks() for one in plain])
    check_episodes(env, plain, 45, mode)
    np.testing.assert_array_equal(env.action_masks(), [one.masks() for one in plain])


@pytest.mark.parametrize("mode", MODES)
def test_environments_may_differ_in_map_and_seed(mode):
    shapes = [{"size": 7}, {"width": 12, "height": 5}, {"map": "\n".join(["....", ".#..", "...."])}, {"size": 40}]
    configs = [{**CONFIG, **shape} for shape in shapes]
    for config, shape in zip(configs, shapes):
        if "size" not in shape:
            del config["size"]
    env = VecEnv(configs, autoreset_mode=mode, masks=True, semantics="2.0")
    seeds = [5, 2**63 - 2, 0, 5]
    env.reset(seed=seeds)
    plain = [Plain(config, index, own_seeds(seeds), exact=True) for index, config in enumerate(configs)]
    check_episodes(env, plain, 30, mode)


def test_seeds_follow_the_config_then_the_last_seeded_reset():
    configs = [{**CONFIG, "seed": 3}, {**CONFIG, "seed": 4}]
    env = VecEnv(configs)
    env.reset()
    assert env.episode_seeds.tolist() == [shared_seed(3)(0, 0), shared_seed(4)(1, 0)]
    env.reset()
    env.reset(options={"reset_mask": np.array([False, True])})
    assert env.episode_seeds.tolist() == [shared_seed(3)(0, 1), shared_seed(4)(1, 2)]
    env.reset(seed=9, options={"reset_mask": np.array([True, False])})
    assert env.episode_seeds.tolist() == [shared_seed(9)(0, 0), shared_seed(4)(1, 2)]
    env.reset()
    assert env.episode_seeds.tolist() == [shared_seed(9)(0, 1), shared_seed(4)(1, 3)]
    env.reset(seed=np.array([6, 7]))
    assert env.episode_seeds.tolist() == [6, 7]


#: About one map in six has no room for all agents.
CROWDED = {"size": 8, "num_agents": 16, "density": 0.4}


def first_attempt(config, tried):
    """Returns the index of the first seed whose map has room, and the observations of its first state."""
    for attempt, seed in enumerate(tried):
        engine = _engine.Engine({**config, "seed": seed}, None, False)
        try:
            engine.reset()
        except OverflowError:
            continue
        return attempt, engine.observe()
    raise AssertionError("no map has room")


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("own", [False, True])
def test_an_episode_without_room_is_drawn_again(mode, own):
    config = {**CONFIG, **CROWDED, "max_episode_steps": 1}
    seeds = [3, 5, 8]  # their own maps have room
    env = VecEnv(config, 3, autoreset_mode=mode)
    observations, _ = env.reset(seed=seeds if own else 5)
    num_redrawn = 0
    for episode in range(12):
        for index, seed in enumerate(env.episode_seeds):
            parent, key = (seeds[index], (episode,)) if own else (5, (index, episode))
            tried = [derived_seed(parent, key), *(derived_seed(parent, (*key, attempt)) for attempt in range(1, 100))]
            if own and episode == 0:
                tried = [parent]
            attempt, expected = first_attempt(config, tried)
            assert seed == tried[attempt]
            np.testing.assert_array_equal(observations[index], expected)
            num_redrawn += attempt > 0
        observations = env.step(np.zeros((3, CROWDED["num_agents"]), int))[0]
        if mode != AutoresetMode.SAME_STEP:
            observations, _ = env.reset()
    assert 3 <= num_redrawn <= 30


def test_a_chosen_seed_without_room_raises():
    config = {**CONFIG, **CROWDED}
    without_room = next(seed for seed in range(100) if first_attempt(config, [seed, 3])[0] > 0)
    env = VecEnv(config, 2)
    env.reset(seed=1)
    before = env.episode_seeds
    with pytest.raises(errors.InstanceError, match=f"environment 1, episode 0, seed {without_room}: .*no room"):
        env.reset(seed=[3, without_room])
    np.testing.assert_array_equal(env.episode_seeds, before)


def test_unseeded_vec_envs_play_different_episodes():
    one, other = VecEnv(CONFIG, 2), VecEnv(CONFIG, 2)
    for env in (one, other):
        env.reset()
    assert len({*one.episode_seeds, *other.episode_seeds}) == 4


def play(num_envs, num_threads, seed=21):
    env = VecEnv(CONFIG, num_envs, num_threads=num_threads, masks=True)
    seen, rng = [env.reset(seed=seed)[0][:3].copy()], np.random.default_rng(1)
    for _ in range(40):
        actions = rng.integers(5, size=(9, env.num_agents))[:num_envs]
        observations, *ends, infos = env.step(actions)
        seen += [part[:3].copy() for part in (observations, *ends, infos["is_active"], infos["action_masks"])]
    return seen


def test_episodes_are_independent_of_other_environments_and_threads():
    expected = play(3, 1)
    for num_envs, num_threads in [(3, 2), (3, 3), (9, 1), (9, 2), (9, 8)]:
        for one, other in zip(expected, play(num_envs, num_threads)):
            np.testing.assert_array_equal(one, other)


def test_spaces_contain_observations_and_actions():
    env = VecEnv(CONFIG, 3, dtype="uint8", autoreset_mode="next_step")
    assert isinstance(env, gymnasium.vector.VectorEnv) and repr(env).startswith("VecEnv(")
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.observation_space.shape == (3, 5, 3, 5, 5) and env.single_observation_space.shape == (5, 3, 5, 5)
    assert env.single_action_space == gymnasium.spaces.MultiDiscrete([5] * 5) and env.action_space.shape == (3, 5)
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations) and env.single_observation_space.contains(observations[1])
    actions = env.sample_actions()
    assert env.action_space.contains(actions) and env.single_action_space.contains(actions[0])
    observations, rewards, terminated, truncated, infos = env.step(env.action_space.sample())
    assert (rewards.dtype, terminated.dtype, truncated.dtype) == (np.float32, np.bool_, np.bool_)
    assert rewards.shape == terminated.shape == truncated.shape == infos["is_active"].shape == (3, 5)
    assert observations.flags.c_contiguous and env.action_masks().shape == (3, 5, 5)
    assert env.action_masks().dtype == np.int8 and "action_masks" not in infos


def test_sampled_actions_follow_the_seed():
    env = VecEnv(CONFIG, 3)
    drawn = []
    for seed in (4, 4, 5, [1, 2, 3], [1, 2, 3], [1, 2, 4]):
        env.reset(seed=seed)
        drawn.append(env.sample_actions())
    for first, same, other in (drawn[:3], drawn[3:]):
        assert (first == same).all() and (first != other).any()


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
def test_gymnasium_helpers_accept_vec_env(mode):
    performance = pytest.importorskip("gymnasium.utils.performance")
    if not hasattr(performance, "benchmark_vector_step"):
        pytest.skip("this version of Gymnasium has no benchmark_vector_step")
    env = VecEnv({**CONFIG, "max_episode_steps": 2}, 3, autoreset_mode=mode)
    assert performance.benchmark_vector_step(env, target_duration=0, seed=1) > 0
    listed = gymnasium.wrappers.vector.DictInfoToList(env)
    infos = [listed.reset(seed=0)[1]] + [listed.step(env.sample_actions())[4] for _ in range(4)]
    assert [len(step) for step in infos] == [3] * 5
    assert infos[2][0]["metrics"]["ISR"] <= 1 and infos[2][0]["is_active"].shape == (5,)
    assert ("final_obs" in infos[2][0]) == (mode == AutoresetMode.SAME_STEP)


def test_observations_are_overwritten_without_double_buffer():
    env = VecEnv(CONFIG, 2)
    first, _ = env.reset(seed=0)
    assert env.step(env.sample_actions())[0] is first
    env = VecEnv(CONFIG, 2, double_buffer=True)
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second = env.step(np.full((2, 5), 1))[0]
    assert second is not first and (first == kept).all() and (second != kept).any()
    with pytest.raises(ValueError):
        env.step(np.full((2, 5), 9))
    assert env.step(np.zeros((2, 5), int))[0] is first and (second != kept).any()


def test_observations_are_written_to_the_callers_buffer():
    env, other = VecEnv(CONFIG, 2, double_buffer=True), VecEnv(CONFIG, 2)
    own, _ = env.reset(seed=0)
    kept, out = own.copy(), np.full(own.shape, 7, np.float32)
    other.reset(seed=0)
    for _ in range(12):
        actions = env.sample_actions()
        assert env.step(actions, out=out)[0] is out
        np.testing.assert_array_equal(out, other.step(actions)[0])
    assert (own == kept).all()
    assert env.reset(seed=0, out=out)[0] is out and (out == kept).all()
    tall = np.zeros((4, *own.shape[1:]), np.float32)
    np.testing.assert_array_equal(env.reset(seed=0, out=tall[1:3])[0], kept)
    assert not tall[0].any() and not tall[3].any()
