"""Tests the choice of rewards of `VecEnv`, and its episode statistics against Gymnasium's wrapper."""

import gymnasium
import numpy as np
import pytest
from pogema_rs.vec_env import AutoresetMode, VecEnv
from vec_helpers import CONFIG

NUM_ENVS = 4


def play(env, num_steps):
    """Returns what each step returned, without the observations."""
    rng = np.random.default_rng(2)
    env.reset(seed=3)
    return [env.step(rng.integers(5, size=(NUM_ENVS, 5)))[1:] for _ in range(num_steps)]


@pytest.mark.parametrize("on_target", ["finish", "restart"])
def test_shared_rewards_are_the_mean_of_the_agents_rewards(on_target):
    config = {**CONFIG, "on_target": on_target}
    own, shared = play(VecEnv(config, NUM_ENVS), 40), play(VecEnv(config, NUM_ENVS, rewards="shared"), 40)
    assert sum(step[0].sum() for step in own) > 5
    for one, other in zip(own, shared):
        assert other[0].dtype == np.float32
        mean = one[0].sum(axis=1, keepdims=True) / np.float32(5)
        np.testing.assert_array_equal(other[0], np.broadcast_to(mean, (NUM_ENVS, 5)))


def test_shared_rewards_with_on_target_nothing_are_the_share_of_agents_on_goals():
    config = {**CONFIG, "on_target": "nothing"}
    env, seen = VecEnv(config, NUM_ENVS, rewards="shared", autoreset_mode="next_step"), set()
    rng = np.random.default_rng(2)
    env.reset(seed=3)
    plays = np.ones(NUM_ENVS, dtype=bool)
    for _ in range(60):
        rewards, terminated, truncated = env.step(rng.integers(5, size=(NUM_ENVS, 5)))[1:4]
        state = env.state()
        on_goal = (state["positions"] == state["goals"]).all(axis=2).sum(axis=1, dtype=np.float32) / np.float32(5)
        # The step after the end of an episode only begins the next episode.
        np.testing.assert_array_equal(rewards[:, 0], np.where(plays, on_goal, 0))
        plays = ~(terminated.all(axis=1) | truncated.all(axis=1))
        seen.update(rewards[:, 0].tolist())
    assert len(seen) > 2


def test_a_function_changes_the_rewards():
    calls = []

    def change(rewards, terminated, truncated, infos):
        calls.append((rewards.copy(), terminated, truncated, infos))
        return rewards * 2 - np.float32(0.5)

    own = play(VecEnv(CONFIG, NUM_ENVS), 20)
    changed = play(VecEnv(CONFIG, NUM_ENVS, rewards=change), 20)
    assert len(calls) == 20
    for one, other, call in zip(own, changed, calls):
        np.testing.assert_array_equal(other[0], one[0] * 2 - np.float32(0.5))
        np.testing.assert_array_equal(call[0], one[0])
        assert call[1] is other[1] and call[2] is other[2] and call[3] is other[3]
        assert ("metrics" in one[3]) == ("metrics" in call[3])


WRONG = [
    (lambda *all: None, TypeError, "the function `rewards` returned a value of type NoneType, expected a numpy array"),
    (lambda rewards, *others: rewards.astype(float), TypeError, "returned an array of float64, expected float32"),
    (lambda rewards, *others: rewards[0], ValueError, r"returned shape \(5,\), expected \(4, 5\)"),
    (lambda rewards, *others: rewards.sum(axis=1), ValueError, r"returned shape \(4,\), expected \(4, 5\)"),
]


@pytest.mark.parametrize(("change", "error", "text"), WRONG)
def test_wrong_results_of_a_function_raise(change, error, text):
    env = VecEnv(CONFIG, NUM_ENVS, rewards=change)
    env.reset(seed=0)
    with pytest.raises(error, match=text):
        env.step(np.zeros((NUM_ENVS, 5), int))


def test_episode_lengths_stay_correct_if_the_function_of_rewards_raises():
    calls = []

    def change(rewards, *others):
        calls.append(rewards)
        if len(calls) in (3, 5):
            raise ArithmeticError("own")
        return rewards

    env = VecEnv({**CONFIG, "on_target": "restart", "max_episode_steps": 3}, 2, rewards=change, statistics=True)
    env.reset(seed=0)
    lengths = []
    for _ in range(9):
        try:
            infos = env.step(np.zeros((2, 5), int))[4]
            lengths += infos["episode"]["l"].tolist() if "episode" in infos else []
        except ArithmeticError:
            pass
    assert lengths == [3] * 4


class OneNumber(getattr(gymnasium.vector, "VectorWrapper", None) or gymnasium.vector.VectorEnvWrapper):
    """Returns one reward and one end per environment, as Gymnasium's wrappers expect."""

    def reset(self, **kwargs):
        return self.env.reset(**kwargs)

    def step(self, actions):
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        mean = rewards.mean(axis=1, dtype=np.float64)
        return observations, mean, terminated.all(axis=1), truncated.all(axis=1), infos


def recorder(env):
    """Returns the statistics wrapper of the installed release of Gymnasium."""
    vector = getattr(gymnasium.wrappers, "vector", None)
    if vector is not None:
        return vector.RecordEpisodeStatistics(env)
    return gymnasium.wrappers.RecordEpisodeStatistics(env)


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("rewards", ["own", "shared"])
def test_statistics_equal_those_of_gymnasium(mode, rewards):
    modern = hasattr(gymnasium.vector, "AutoresetMode")
    if mode != AutoresetMode.SAME_STEP and not modern:
        pytest.skip("this version of Gymnasium has one autoreset mode")
    made = {"autoreset_mode": mode, "rewards": rewards}
    env = VecEnv({**CONFIG, "on_target": "restart"}, NUM_ENVS, statistics=True, **made)
    other = recorder(OneNumber(VecEnv({**CONFIG, "on_target": "restart"}, NUM_ENVS, **made)))
    rng, num_ended, returns = np.random.default_rng(5), 0, 0.0
    env.reset(seed=4)
    other.reset(seed=4)
    for _ in range(60):
        actions = rng.integers(5, size=(NUM_ENVS, 5))
        *_, truncated, infos = env.step(actions)
        *_, expected = other.step(actions)
        assert ("episode" in infos) == ("metrics" in infos) == ("_episode" in infos)
        if "episode" in infos:
            np.testing.assert_array_equal(infos["_episode"], infos["_metrics"])
            np.testing.assert_array_equal(infos["_episode"], expected["_episode"])
            assert set(infos["episode"]) == {"r", "l", "t"} and (infos["episode"]["t"] >= 0).all()
            np.testing.assert_array_equal(infos["episode"]["l"], expected["episode"]["l"])
            np.testing.assert_allclose(infos["episode"]["r"], expected["episode"]["r"], rtol=1e-6)
            num_ended += infos["_episode"].sum()
            returns += infos["episode"]["r"].sum()
        if mode == AutoresetMode.DISABLED and truncated.any():
            mask = truncated.all(axis=1)
            for one in (env, other):
                one.reset(options={"reset_mask": mask.copy()})
    assert num_ended >= 5 * NUM_ENVS and returns > 0


def test_statistics_follow_changed_rewards_and_partial_resets():
    config = {**CONFIG, "on_target": "nothing"}
    env = VecEnv(config, 2, rewards=lambda rewards, *others: np.ones_like(rewards), statistics=True)
    env.reset(seed=0)
    for _ in range(4):
        assert "episode" not in env.step(np.zeros((2, 5), int))[4]
    env.reset(options={"reset_mask": np.array([False, True])})
    ended = [env.step(np.zeros((2, 5), int))[4] for _ in range(9)]
    first, second = ended[4], ended[8]
    assert first["_episode"].tolist() == [True, False] and second["_episode"].tolist() == [False, True]
    assert first["episode"]["l"].tolist() == first["episode"]["r"].tolist() == [9, 0]
    assert second["episode"]["l"].tolist() == second["episode"]["r"].tolist() == [0, 9]
    assert first["episode"]["t"][1] == 0
