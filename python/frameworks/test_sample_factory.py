"""Tests of the batched adapter for Sample Factory, including a training run with it."""

from pathlib import Path

import numpy as np
import pytest
import torch
from page_blocks import blocks
from pogema_rs import GridConfig, VecEnv
from pogema_rs.integrations.sample_factory_batched import PogemaSampleFactory
from sample_factory.algo.utils.make_env import make_env_func_batched
from sample_factory.algo.utils.misc import ExperimentStatus
from sample_factory.cfg.arguments import parse_full_cfg, parse_sf_args
from sample_factory.algo.utils.context import global_model_factory
from sample_factory.envs.env_utils import register_env
from sample_factory.model.encoder import Encoder
from sample_factory.train import make_runner

CONFIG = GridConfig(size=8, num_agents=4, max_episode_steps=20, density=0.2)


def make(name, cfg, env_config, render_mode):
    return PogemaSampleFactory(CONFIG, 3, semantics="2.0")


class Flat(Encoder):
    """A dense encoder, because Sample Factory's encoders need larger images than these windows."""

    def __init__(self, cfg, obs_space):
        super().__init__(cfg)
        shape = obs_space["obs"].shape
        self.layers = torch.nn.Sequential(torch.nn.Flatten(), torch.nn.Linear(int(np.prod(shape)), 32), torch.nn.ReLU())

    def forward(self, obs_dict):
        """Returns the features of each actor."""
        return self.layers(obs_dict["obs"])

    def get_out_size(self):
        """Returns the number of features."""
        return 32


def settings(*more):
    register_env("pogema", make)
    global_model_factory().register_encoder_factory(Flat)
    given = ["--env=pogema", "--batched_sampling=True", "--device=cpu", "--num_envs_per_worker=1", *more]
    return parse_full_cfg(parse_sf_args(given, evaluation=False)[0], given)


@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_rows_equal_those_of_vec_env(on_target):
    config = CONFIG.model_copy(update={"on_target": on_target})
    env, plain = PogemaSampleFactory(config, 3), VecEnv(config, 3)
    seen, infos = env.reset(seed=5)
    expected, _ = plain.reset(seed=5)
    assert (env.num_agents, env.is_multiagent, infos) == (12, True, {})
    num_ended = 0
    for actions in np.random.default_rng(1).integers(5, size=(100, 12)):
        assert np.array_equal(seen["obs"], expected.reshape(12, *expected.shape[2:]))
        seen, rewards, terminated, truncated, infos = env.step(actions.astype(np.int32))
        expected, own_rewards, own_terminated, own_truncated, state = plain.step(actions.reshape(3, 4))
        assert np.array_equal(rewards, own_rewards.ravel())
        done = (terminated | truncated).reshape(3, 4)
        assert np.array_equal(done.all(axis=1), done.any(axis=1))
        assert np.array_equal(done[:, 0], state.get("_metrics", np.zeros(3, dtype=bool)))
        assert np.array_equal(terminated.reshape(3, 4)[done[:, 0]], own_terminated[done[:, 0]])
        assert not (terminated & truncated).any()
        assert bool(infos) == done.any()
        for name, values in infos.items():
            assert np.array_equal(values.reshape(3, 4)[done[:, 0], 1], state["metrics"][name][done[:, 0]])
        num_ended += done[:, 0].sum()
    assert num_ended > 10


def test_sample_factory_accepts_it():
    env = make_env_func_batched(settings(), None)
    env.seed(3)
    seen, _ = env.reset()
    assert seen["obs"].shape == (12, 3, 11, 11) and isinstance(seen["obs"], torch.Tensor)
    seen, rewards, terminated, truncated, _ = env.step(np.zeros(12, dtype=np.int32))
    assert rewards.dtype == torch.float32 and terminated.dtype == truncated.dtype == torch.bool
    assert env.num_agents == 12


def test_training_runs_and_reports_metrics(tmp_path):
    cfg = settings(
        *("--train_for_env_steps=1500", "--num_workers=1", "--batch_size=192", "--rollout=16", "--recurrence=1"),
        *("--use_rnn=False", "--serial_mode=True", "--async_rl=False", f"--train_dir={tmp_path}", "--experiment=first"),
        "--worker_num_splits=1",
    )
    cfg, runner = make_runner(cfg)
    assert runner.init() == ExperimentStatus.SUCCESS
    assert runner.run() == ExperimentStatus.SUCCESS
    assert {"ISR", "CSR", "ep_length", "reward", "len"} <= set(runner.policy_avg_stats)
    shares = list(runner.policy_avg_stats["ISR"][0])
    assert len(shares) > 12 and all(0 <= share <= 1 for share in shares)
    assert all(length <= 20 for length in runner.policy_avg_stats["len"][0])


@pytest.mark.parametrize("actions", [[0] * 11, [[0] * 12], [5] * 12, [0.5] * 12])
def test_wrong_actions_change_nothing(actions):
    env = PogemaSampleFactory(CONFIG, 3)
    before = env.reset(seed=1)[0]["obs"].copy()
    with pytest.raises((ValueError, TypeError), match="expected"):
        env.step(actions)
    fresh = VecEnv(CONFIG, 3)
    assert np.array_equal(fresh.reset(seed=1)[0].reshape(before.shape), before)
    for moves in np.random.default_rng(4).integers(5, size=(25, 3, 4)):
        for got, expected in zip(env.envs.step(moves)[:4], fresh.step(moves)):
            assert np.array_equal(got, expected)


def test_other_observation_types_are_rejected():
    with pytest.raises(ValueError, match="expected 'default'"):
        PogemaSampleFactory(CONFIG.model_copy(update={"observation_type": "MAPF"}), 1)


def test_block_of_the_guide_runs():
    guide = Path(__file__).resolve().parent.parent.parent / "docs" / "guide" / "python.md"
    (code,) = [code for framework, code in blocks(guide) if framework == "sample_factory"]
    names = {}
    exec(code, names)
    assert names["cfg"].batched_sampling and names["make"]("pogema", names["cfg"], None, None).num_agents == 512
