"""Tests of the adapter for TorchRL, including TorchRL's own checker."""

import pytest
import torch
from pogema_rs import GridConfig
from pogema_rs.integrations.torchrl import PogemaTorchRL
from torchrl.envs import PettingZooWrapper
from torchrl.envs.utils import check_env_specs


def make(**fields):
    env = PogemaTorchRL(GridConfig(**fields))
    return PettingZooWrapper(env, use_mask=True, done_on_any=False, group_map={"agents": env.possible_agents})


@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_torchrl_checker_passes(on_target):
    check_env_specs(make(num_agents=4, on_target=on_target, max_episode_steps=30))


def test_action_masks_keep_random_policies_off_obstacles():
    env = make(num_agents=6, size=10, density=0.4, on_target="nothing", max_episode_steps=64)
    steps = env.rollout(64)["agents"]
    masks, actions = steps["action_mask"], steps["action"]
    assert masks.shape == (64, 6, 5)
    assert masks[..., 0].all()
    assert not masks.all()
    assert masks.gather(-1, actions.unsqueeze(-1)).all()
    assert len(actions.unique()) == 5


def test_finished_agents_are_masked_and_the_last_step_has_metrics():
    env = make(map="aA..\nb..B", num_agents=2, max_episode_steps=9)
    state = env.reset()
    for is_present in ([False, True], [False, True], [False, False]):
        state["agents", "action"] = torch.tensor([4, 4])
        state = env.step(state)
        state = state["next"]
        assert state["agents", "mask"].tolist() == is_present
        assert state["done"].item() == (is_present == [False, False])
        assert torch.isnan(state["agents", "info", "ISR"][1]) == any(is_present)
    assert state["agents", "info", "ISR"][1] == 1.0


def test_seeds_choose_the_episode():
    first, second, third = (make(num_agents=3) for _ in range(3))
    for env, seed in ((first, 1), (second, 1), (third, 2)):
        env.set_seed(seed)
    one, other, another = (env.reset()["agents", "observation"] for env in (first, second, third))
    assert (one == other).all()
    assert (one != another).any()
