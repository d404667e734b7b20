"""Tests the rewards `dense` of `VecEnv` against distances that Python computes."""

import numpy as np
import pytest
from encoder_model import distances
from pogema_rs.vec_env import AutoresetMode, VecEnv
from vec_helpers import CONFIG, actions_of, of_env

NUM_ENVS = 4


def gained(before, after, size):
    """Returns what the agents of one environment gain by approaching their goals in the step between two states."""
    values = np.zeros(len(before["goals"]), dtype=np.float32)
    for agent, goal in enumerate(before["goals"]):
        of_cell = distances(before["obstacles"], tuple(goal))
        steps = [of_cell.get(tuple(state["positions"][agent])) for state in (before, after)]
        if None not in steps:
            values[agent] = np.float32(steps[0] - steps[1]) * (np.float32(1) / np.float32(sum(size)))
    return values


def check(env, own, num_steps, sizes):
    """Plays both environments, and returns the number of rewards that differ from the plain ones."""
    rng, num_paid = np.random.default_rng(4), 0
    for each in (env, own):
        each.reset(seed=3)
    for _ in range(num_steps):
        before, actions = env.state(), actions_of(rng, env)
        _, rewards, terminated, truncated, infos = env.step(actions)
        _, plain, *ends, _ = own.step(actions)
        np.testing.assert_array_equal(ends, (terminated, truncated))
        after = env.state()
        began = (before["obstacles"] != after["obstacles"]).any(axis=(1, 2)) | (
            (before["positions"] != after["positions"]).sum(axis=2) > 1
        ).any(axis=1)
        for index in range(NUM_ENVS):
            end = of_env(after, index)
            if env.autoreset_mode == AutoresetMode.SAME_STEP and "final_state" in infos:
                final = infos["final_state"][index]
                end = end if final is None else final
            elif began[index]:
                end = of_env(before, index)
            expected = plain[index] + gained(of_env(before, index), end, sizes[index])
            np.testing.assert_array_equal(rewards[index], expected)
            num_paid += int((expected != plain[index]).sum())
    return num_paid


@pytest.mark.parametrize("mode", ["same_step", "next_step", "disabled"])
@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_steps_towards_the_goal_are_rewarded(on_target, mode):
    config = {**CONFIG, "on_target": on_target}
    env, own = (VecEnv(config, NUM_ENVS, autoreset_mode=mode, rewards=rewards) for rewards in ("dense", "own"))
    assert check(env, own, 40, [(7, 7)] * NUM_ENVS) > 50


@pytest.mark.parametrize("num_threads", [1, 2])
def test_each_environment_has_its_own_map(num_threads):
    configs = [{**CONFIG, "size": size, "num_agents": agents} for size, agents in ((7, 5), (5, 2), (9, 4), (6, 1))]
    env, own = (VecEnv(configs, rewards=rewards, num_threads=num_threads) for rewards in ("dense", "own"))
    assert check(env, own, 30, [(7, 7), (5, 5), (9, 9), (6, 6)]) > 50


def test_goals_without_a_path_give_no_reward():
    config = {"map": "..#..\n..#..", "agents_xy": [[0, 0], [0, 4]], "targets_xy": [[0, 3], [1, 4]], "obs_radius": 1}
    env = VecEnv(config, 1, rewards="dense")
    env.reset(seed=0)
    rewards = [env.step(np.array([[action, 1 + number % 2]]))[1] for number, action in enumerate((4, 3, 2, 1))]
    assert not np.array(rewards)[:, 0, 0].any()


def test_the_rewards_along_a_path_sum_to_its_scaled_length():
    config = {"map": "....\n....", "agents_xy": [[0, 0]], "targets_xy": [[1, 3]], "obs_radius": 1}
    env = VecEnv(config, 1, rewards="dense", statistics=True)
    env.reset(seed=0)
    total = 0.0
    for action in (2, 1, 4, 4, 3, 4, 4, 2):
        _, rewards, terminated, _, infos = env.step(np.array([[action]]))
        total += float(rewards[0, 0])
    assert terminated.all()
    # The reward for the goal is 1. The path has 4 steps; the reward for each is 1 / (2 rows + 4 columns).
    assert total == pytest.approx(1 + 4 / 6, abs=1e-6) == float(infos["episode"]["r"][0])
