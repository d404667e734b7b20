"""The training of train_ppo.py on POGEMA 1.4.0, as users of Sample Factory and of TorchRL would write it.

Both frameworks get the environments, the network, the rollout size and the minibatch size of `training_worker.py`.
`sample_factory` and `torchrl` return agent steps per second, without the time before the first update. See
`training_task.serve`. This script runs in its own process, because TorchRL changes how Python starts processes.
"""

import sys
import tempfile
import time

import numpy as np
import pogema
import torch
from sample_factory.algo.runners.runner import AlgoObserver
from sample_factory.algo.utils.context import global_model_factory
from sample_factory.cfg.arguments import parse_full_cfg, parse_sf_args
from sample_factory.envs.env_utils import register_env
from sample_factory.model.encoder import Encoder
from sample_factory.train import make_runner
from tensordict import TensorDict
from tensordict.nn import TensorDictModule, TensorDictSequential
from torch import nn
from torch.distributions import Categorical
from torchrl.collectors import Collector
from torchrl.data import Bounded, Categorical as CategoricalSpec, Composite, Unbounded
from torchrl.envs import EnvBase, ParallelEnv, SerialEnv
from torchrl.modules import ProbabilisticActor
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

sys.path.insert(0, __file__.rpartition("/")[0])
from training_task import CONFIG, NUM_AGENTS, NUM_ENVS, PARAMS, SIDE, serve, train_ppo

SHAPE = (3, SIDE, SIDE)
#: One process per core of a machine with two cores, as both frameworks recommend.
NUM_WORKERS = 2


class Features(Encoder):
    """The layers of train_ppo.py before its outputs."""

    def __init__(self, cfg, obs_space):
        super().__init__(cfg)
        self.body = train_ppo.Policy(int(np.prod(SHAPE)), PARAMS.hidden).body

    def forward(self, obs_dict):
        """Returns the features of each agent."""
        return self.body(obs_dict["obs"])

    def get_out_size(self):
        """Returns the number of features."""
        return PARAMS.hidden // 2


class Clock(AlgoObserver):
    """Measures the speed of a training run after its first update, and ends the run."""

    def __init__(self, seconds):
        self.seconds, self.first, self.last = seconds, None, None

    def on_training_step(self, runner, training_iteration_since_resume):
        """Notes the time and the agent steps of an update."""
        self.last = time.perf_counter(), runner.env_steps[0]
        self.first = self.first or self.last
        if self.last[0] - self.first[0] >= self.seconds:
            runner.cfg.train_for_env_steps = 0


def make_team(name, cfg, env_config, render_mode):
    """Returns an environment of POGEMA for Sample Factory."""
    return pogema.pogema_v0(pogema.GridConfig(**CONFIG, integration="SampleFactory"))


def sample_factory(seconds):
    """Trains with Sample Factory."""
    register_env("pogema", make_team)
    global_model_factory().register_encoder_factory(Features)
    clock = Clock(seconds)
    with tempfile.TemporaryDirectory() as folder:
        given = [
            *("--env=pogema", "--device=cpu", f"--train_dir={folder}", "--experiment=peer", "--use_rnn=False"),
            *(f"--num_workers={NUM_WORKERS}", f"--num_envs_per_worker={NUM_ENVS // NUM_WORKERS}"),
            *(f"--rollout={PARAMS.num_steps}", "--recurrence=1", f"--batch_size={PARAMS.batch_size}"),
            f"--num_epochs={PARAMS.num_epochs}",
            f"--num_batches_per_epoch={NUM_ENVS * NUM_AGENTS * PARAMS.num_steps // PARAMS.batch_size}",
            *("--normalize_input=False", "--normalize_returns=False", "--save_every_sec=100000"),
        ]
        cfg, runner = make_runner(parse_full_cfg(parse_sf_args(given, evaluation=False)[0], given))
        runner.register_observer(clock)
        runner.init()
        runner.run()
    (began, first), (ended, last) = clock.first, clock.last
    return (last - first) / (ended - began)


class Teams(EnvBase):
    """An environment of POGEMA; the agents are the first axis of its observations, actions and rewards."""

    def __init__(self):
        super().__init__(batch_size=())
        self._env = pogema.pogema_v0(pogema.GridConfig(**CONFIG))
        agents = (NUM_AGENTS,)
        self.observation_spec = Composite(observation=Bounded(0, 1, (*agents, *SHAPE)))
        self.action_spec = CategoricalSpec(5, shape=agents)
        self.reward_spec = Unbounded((*agents, 1))

    def _reset(self, tensordict=None):
        return TensorDict({"observation": self._stack(self._env.reset()[0])})

    def _step(self, tensordict):
        seen, rewards, terminated, truncated, _ = self._env.step(tensordict["action"].tolist())
        values = {
            "observation": self._stack(seen),
            "reward": torch.tensor(rewards, dtype=torch.float32).unsqueeze(-1),
            "terminated": torch.tensor([all(terminated)]),
            "truncated": torch.tensor([all(truncated)]),
        }
        return TensorDict({**values, "done": values["terminated"] | values["truncated"]})

    def _set_seed(self, seed):
        self._env.grid_config.seed = seed

    @staticmethod
    def _stack(seen):
        return torch.from_numpy(np.stack(seen))


class Outputs(nn.Module):
    """The network of train_ppo.py for all agents of many environments."""

    def __init__(self, policy, has_value):
        super().__init__()
        self.policy, self.has_value = policy, has_value

    def forward(self, seen):
        """Returns the logits or the value of each agent."""
        features = self.policy.body(seen.reshape(-1, *SHAPE)).view(*seen.shape[:-3], -1)
        return (self.policy.value if self.has_value else self.policy.actions)(features)


def teams():
    """Returns the environments of one process."""
    return SerialEnv(NUM_ENVS // NUM_WORKERS, Teams)


def torchrl(seconds):
    """Trains with TorchRL."""
    policy = train_ppo.Policy(int(np.prod(SHAPE)), PARAMS.hidden)
    logits = TensorDictModule(Outputs(policy, False), in_keys=["observation"], out_keys=["logits"])
    actor = ProbabilisticActor(
        logits,
        in_keys=["logits"],
        distribution_class=Categorical,
        return_log_prob=True,
        default_interaction_type="random",
    )
    critic = TensorDictModule(Outputs(policy, True), in_keys=["observation"], out_keys=["state_value"])
    objective = ClipPPOLoss(
        actor, critic, clip_epsilon=PARAMS.clip, entropy_coeff=PARAMS.entropy, critic_coeff=PARAMS.value,
        loss_critic_type="l2",
    )  # fmt: skip
    advantages = GAE(gamma=PARAMS.discount, lmbda=PARAMS.gae, value_network=critic)
    optimizer = torch.optim.Adam(policy.parameters(), PARAMS.learning_rate, eps=1e-5)
    num_steps = NUM_ENVS * PARAMS.num_steps
    collector = Collector(
        ParallelEnv(NUM_WORKERS, teams), TensorDictSequential(actor), frames_per_batch=num_steps, total_frames=-1
    )
    began, count = None, -1
    for batch in collector:
        learn(batch, advantages, objective, optimizer)
        count += 1
        began = time.perf_counter() if began is None else began
        if count and time.perf_counter() - began >= seconds:
            break
    spent = time.perf_counter() - began
    collector.shutdown()
    return count * num_steps * NUM_AGENTS / spent


def learn(batch, advantages, objective, optimizer):
    """Updates the policy on a batch of steps of all environments."""
    flags = ("done", "terminated")
    for name in flags:
        flag = batch["next", name].unsqueeze(-1)
        batch["next", name] = flag.expand(batch["next", "reward"].shape).contiguous()
    with torch.no_grad():
        advantages(batch)
    flat = batch.select("observation", "action", "action_log_prob", "advantage", "value_target").reshape(-1)
    size = PARAMS.batch_size // NUM_AGENTS
    for _ in range(PARAMS.num_epochs):
        for part in torch.split(torch.randperm(len(flat)), size):
            losses = objective(flat[part])
            loss = losses["loss_objective"] + losses["loss_critic"] + losses["loss_entropy"]
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(objective.parameters(), 0.5)
            optimizer.step()


if __name__ == "__main__":
    FRAMEWORKS = {"sample_factory": sample_factory, "torchrl": torchrl}
    serve(lambda name, seconds: FRAMEWORKS[name](seconds))
