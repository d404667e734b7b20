"""PPO on whole episodes, with TorchRL's loss: IPPO, MAPPO, Follower and EPOM."""

from __future__ import annotations

import copy
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Optional

import numpy as np
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torch import nn
from torch.distributions import Categorical
from torchrl.modules import ProbabilisticActor
from torchrl.objectives import ClipPPOLoss

from pogema_rs.baselines import _networks
from pogema_rs.baselines._acting import LEAST, Actor
from pogema_rs.baselines._config import PPOConfig, TrainingConfig
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._record import Record, lanes_of, without_padding
from pogema_rs.baselines._schedules import decay, move_average
from pogema_rs.baselines._targets import estimate_advantages, last_steps
from pogema_rs.baselines._workers import Workers


class PPOLearner:
    """Learns a policy by clipped ratios, on the episodes of one iteration at a time.

    Source: Schulman et al., "Proximal policy optimization algorithms", 2017
    """

    #: The rule by which the trained network plays.
    sampling = "softmax"
    #: The policy that plays the trained network.
    policy_name = "network"

    def __init__(
        self,
        config: TrainingConfig,
        map_size: tuple[int, int],
        generator: torch.Generator,
        workers: Optional[Workers] = None,
    ) -> None:
        assert isinstance(config.learner, PPOConfig)
        self.config, self.learner, self._generator = config, config.learner, generator
        #: Whether the trained network never moves into obstacles.
        self.masks = config.learner.masks
        # The methods `follower-small` and `follower-large` differ from `follower` only in their hyperparameters.
        module = importlib.import_module(f"pogema_rs.baselines._{config.method.partition('-')[0]}")
        self.critic: nn.Module = module.make_critic(config, map_size)
        self.network = AgentNetwork(config.encoder, config.network, has_value=module.HAS_VALUE, workers=workers)
        nn.init.orthogonal_(self.network.policy.weight, 0.01)
        self.average = copy.deepcopy(self.network)
        self._parameters = [*self.network.parameters(), *self.critic.parameters()]
        self.optimizer = torch.optim.Adam(self._parameters, self.learner.learning_rate, eps=1e-5)
        self._objective = _objective(self.learner)

    def open(self, folder: Path) -> None:
        """Does nothing: no episode is kept."""

    def save(self) -> None:
        """Does nothing: no episode is kept."""

    def actor(self) -> Actor:
        """Returns the actor of the training episodes."""
        return Actor(self.network, self._generator, None, self.masks)

    def trained(self) -> AgentNetwork:
        """Returns the network with logits for the rule of `sampling`."""
        return self.average

    def validation_actor(self, generator: torch.Generator) -> Actor:
        """Returns the actor of the validation episodes."""
        return Actor(self.average, generator, None, self.masks)

    def learn(self, record: Record) -> dict[str, float]:
        """Updates the networks on the episodes; returns means of the updates."""
        record = self._read_by_critic(record)
        advantages, returns, log_probs = self._targets(record)
        acted = torch.from_numpy(record.acted)
        if acted.sum() > 1:  # a single sample has no spread
            spread, mean = torch.std_mean(advantages[acted])
            advantages = (advantages - mean) / (spread + 1e-8)
        return self._run_minibatches(record, self._update, (advantages, returns, log_probs, acted))

    def imitate(self, record: Record, advice: np.ndarray) -> dict[str, float]:
        """Trains the policy to imitate the advice of a teacher; returns means of the updates.

        The critic has the same targets as in PPO.

        Shape: `advice` `(steps, lanes, agents)`
        """
        record = self._read_by_critic(record)
        _, returns, _ = self._targets(record)
        advised = torch.from_numpy(advice[:, :, : record.shape[2]]).long()
        arrays = advised, returns, torch.from_numpy(record.acted)
        return self._run_minibatches(record, self._imitate, arrays)

    def _read_by_critic(self, record: Record) -> Record:
        """Returns a record as the critic reads it: without padding, unless the critic reads global states."""
        # The number of agents in a global state is fixed.
        return record if self.network.value is None else without_padding(record)

    def _run_minibatches(
        self, record: Record, update: Callable[..., dict[str, float]], arrays: tuple[torch.Tensor, ...]
    ) -> dict[str, float]:
        """Calls `update` on every minibatch of lanes in every epoch; returns the means of its results."""
        sums: dict[str, float] = {}
        count = self.learner.epochs * min(self.learner.minibatches, record.shape[1])
        for _ in range(self.learner.epochs):
            order = torch.randperm(record.shape[1], generator=self._generator)
            for lanes in torch.tensor_split(order, self.learner.minibatches):
                if len(lanes):
                    parts = [array[:, lanes] for array in arrays]
                    for name, value in update(lanes_of(record, lanes.numpy()), *parts).items():
                        sums[name] = sums.get(name, 0.0) + value / count
        decay(self.optimizer, self.learner.half_life)
        move_average(self.average, self.network, self.learner.averaging)
        return sums

    def _outputs(self, record: Record) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns the logits of all states and their values. Shape: `(steps + 1, lanes, agents, ...)`."""
        features = self.network.of_record(record)
        logits = self.network.policy(features)
        if self.masks:
            logits = logits.masked_fill(~torch.from_numpy(record.masks), LEAST)
        values: torch.Tensor = self.critic(self.network, features, record)
        return logits, values

    @torch.no_grad()
    def _targets(self, record: Record) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Returns the advantages, the returns and the log-probabilities of the actions that were taken."""
        parts = _networks.tensors(record)
        logits, values = self._outputs(record)
        log_probs = torch.log_softmax(logits[:-1], dim=-1).gather(-1, parts["actions"].unsqueeze(-1)).squeeze(-1)
        ended = last_steps(parts["played"]).unsqueeze(-1).expand_as(parts["rewards"])
        settings = self.learner.discount, self.learner.gae_lambda
        advantages, returns = estimate_advantages(*settings, values, parts["rewards"], parts["terminated"], ended)
        return advantages, returns, log_probs

    def _update(
        self,
        record: Record,
        advantages: torch.Tensor,
        returns: torch.Tensor,
        log_probs: torch.Tensor,
        acted: torch.Tensor,
    ) -> dict[str, float]:
        logits, values = self._outputs(record)
        actions = torch.from_numpy(record.actions).long()[acted]
        batch = TensorDict(
            {
                "logits": logits[:-1][acted],
                "value": values[:-1][acted].unsqueeze(-1),
                "action": actions,
                "action_log_prob": log_probs[acted],
                "advantage": advantages[acted].unsqueeze(-1),
                "value_target": returns[acted].unsqueeze(-1),
            },
            batch_size=actions.shape,
        )
        losses = self._objective(batch)
        # TorchRL leaves out a part whose weight is 0.
        parts = {name: losses.get(f"loss_{name}", torch.zeros(())) for name in ("objective", "critic", "entropy")}
        self._descend(parts["objective"] + parts["critic"] + parts["entropy"])
        return {name: float(loss.detach()) for name, loss in parts.items()}

    def _imitate(
        self, record: Record, advice: torch.Tensor, returns: torch.Tensor, acted: torch.Tensor
    ) -> dict[str, float]:
        logits, values = self._outputs(record)
        imitation = nn.functional.cross_entropy(logits[:-1][acted], advice[acted])
        critic = self.learner.value * (values[:-1][acted] - returns[acted]).square().mean()
        self._descend(imitation + critic)
        return {"imitation": float(imitation.detach()), "critic": float(critic.detach())}

    def _descend(self, loss: torch.Tensor) -> None:
        self.optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._parameters, self.learner.max_gradient)
        self.optimizer.step()

    def state(self) -> dict[str, Any]:
        """Returns everything that a checkpoint must hold."""
        return {"modules": [module.state_dict() for module in self._modules()]}

    def restore(self, state: dict[str, Any]) -> None:
        """Restores what `state` returned."""
        for module, values in zip(self._modules(), state["modules"]):
            module.load_state_dict(values)

    def _modules(self) -> tuple[Any, ...]:
        """Returns the modules and the optimizer, whose states are tensors."""
        return self.network, self.critic, self.average, self.optimizer


def _objective(learner: PPOConfig) -> ClipPPOLoss:
    """Returns TorchRL's loss for outputs that are already computed."""
    logits = TensorDictModule(nn.Identity(), in_keys=["logits"], out_keys=["logits"])
    actor = ProbabilisticActor(logits, in_keys=["logits"], distribution_class=Categorical, return_log_prob=True)
    critic = TensorDictModule(nn.Identity(), in_keys=["value"], out_keys=["state_value"])
    return ClipPPOLoss(
        actor,
        critic,
        clip_epsilon=learner.clip,
        entropy_coeff=learner.entropy,
        critic_coeff=learner.value,
        loss_critic_type="l2",
    )
