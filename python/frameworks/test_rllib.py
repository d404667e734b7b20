"""Tests of the adapter for RLlib, including RLlib's own checker."""

import pytest
from pogema_rs.integrations.rllib import PogemaMultiAgentEnv
from ray.rllib.utils.pre_checks.env import check_multiagent_environments


@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_rllib_checker_passes(on_target):
    check_multiagent_environments(PogemaMultiAgentEnv({"num_agents": 4, "on_target": on_target}))


def test_finished_agents_leave_and_the_last_step_has_metrics():
    env = PogemaMultiAgentEnv({"map": "aA..\nb..B", "num_agents": 2, "max_episode_steps": 9})
    observations, _ = env.reset(seed=3)
    assert set(observations) == set(env.agents) == {"player_0", "player_1"}
    _, rewards, terminated, truncated, _ = env.step({"player_0": 4, "player_1": 4})
    assert rewards == {"player_0": 1.0, "player_1": 0.0}
    assert terminated == {"player_0": True, "player_1": False, "__all__": False}
    assert not truncated["__all__"]
    assert env.agents == ["player_1"]
    env.step({"player_1": 4})
    observations, _, terminated, _, infos = env.step({"player_1": 4})
    assert set(observations) == {"player_1"}
    assert terminated["__all__"]
    assert infos["player_1"]["metrics"]["ISR"] == 1.0
    assert env.agents == []


def test_seeds_choose_the_episode():
    first, second, third = (
        PogemaMultiAgentEnv({"num_agents": 3}).reset(seed=seed)[0]["player_0"] for seed in (1, 1, 2)
    )
    assert (first == second).all()
    assert (first != third).any()
