"""Deep recurrent Q-learning on whole episodes, with a mixer and target networks: IQL, VDN, QMIX and QPLEX."""

from __future__ import annotations

import copy
import importlib
from pathlib import Path
from typing import Any, Optional

import torch
from torch import nn

from pogema_rs.baselines import _networks
from pogema_rs.baselines._acting import LEAST, Actor
from pogema_rs.baselines._config import QLearningConfig, TrainingConfig
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._record import Record
from pogema_rs.baselines._replay import Replay
from pogema_rs.baselines._schedules import decay, move_average
from pogema_rs.baselines._targets import lambda_returns, last_steps
from pogema_rs.baselines._workers import Workers


class QLearner:
    """Learns the values of actions: double Q-learning with TD(lambda) returns.

    Source: the learner of PyMARL2, reimplemented; Hu et al., "Rethinking the implementation tricks and monotonicity
    constraint in cooperative multi-agent reinforcement learning", 2021
    """

    #: Whether the trained network never moves into obstacles.
    masks = True
    #: The policy that plays the trained network.
    policy_name = "network"

    def __init__(
        self,
        config: TrainingConfig,
        map_size: tuple[int, int],
        generator: torch.Generator,
        workers: Optional[Workers] = None,
    ) -> None:
        assert isinstance(config.learner, QLearningConfig)
        self.config, self.learner, self._generator = config, config.learner, generator
        self._map_size = map_size
        self.network = AgentNetwork(config.encoder, config.network, has_value=False, workers=workers)
        num_values = _networks.num_state_values(max(config.environment.num_agents))
        module = importlib.import_module(f"pogema_rs.baselines._{config.method}")
        self.mixer: nn.Module = module.make_mixer(config, num_values)
        self.target_network, self.target_mixer = copy.deepcopy(self.network), copy.deepcopy(self.mixer)
        self.average = copy.deepcopy(self.network)
        self._parameters = [*self.network.parameters(), *self.mixer.parameters()]
        self.optimizer = torch.optim.Adam(self._parameters, self.learner.learning_rate)
        self.replay: Any = None
        self._steps = self._copied = self._episodes = 0

    def open(self, folder: Path) -> None:
        """Opens the replay buffer below the folder of the run."""
        spare = self.config.schedule.lanes * self.config.schedule.checkpoint_every
        sizes = (self.learner.replay, spare)
        self.replay = Replay(folder / "replay", self.config, self._map_size, sizes, self._episodes)

    @property
    def epsilon(self) -> float:
        """The probability of a random action."""
        share = min(1.0, self._steps / self.learner.epsilon_steps)
        return self.learner.epsilon_start + share * (self.learner.epsilon_end - self.learner.epsilon_start)

    def actor(self) -> Actor:
        """Returns the actor of the training episodes."""
        return Actor(self.network, self._generator, self.epsilon)

    @property
    def sampling(self) -> str:
        """The rule by which the trained network plays."""
        return "softmax" if self.learner.temperature else "greedy"

    def trained(self) -> AgentNetwork:
        """Returns the network with logits for the rule of `sampling`: the values, divided by a positive temperature."""
        network = copy.deepcopy(self.average)
        if not self.learner.temperature:
            return network
        with torch.no_grad():
            for parameter in network.policy.parameters():
                parameter /= self.learner.temperature
        return network

    def validation_actor(self, generator: torch.Generator) -> Actor:
        """Returns the actor of the validation episodes."""
        return Actor(self.trained(), generator, None if self.learner.temperature else 0.0)

    def learn(self, record: Record) -> dict[str, float]:
        """Adds the episodes to the replay buffer and updates the networks; returns the mean loss and epsilon."""
        self.replay.add(record)
        self._episodes = self.replay.count
        self._steps += int(record.played.sum())
        losses = []
        for _ in range(self.learner.updates):
            batch = min(self.learner.batch, len(self.replay))
            draws = torch.randint(len(self.replay), (batch,), generator=self._generator)
            losses.append(self._update(self.replay.sample(draws.numpy())))
        decay(self.optimizer, self.learner.half_life)
        move_average(self.average, self.network, self.learner.averaging)
        if self._episodes - self._copied >= self.learner.target_episodes:
            self.target_network.load_state_dict(self.network.state_dict())
            self.target_mixer.load_state_dict(self.mixer.state_dict())
            self._copied = self._episodes
        return {"loss": sum(losses) / len(losses), "epsilon": self.epsilon}

    def _update(self, record: Record) -> float:
        loss = self.loss(record)
        self.optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call, unused-ignore]
        nn.utils.clip_grad_norm_(self._parameters, self.learner.max_gradient)
        self.optimizer.step()
        return float(loss.detach())

    def loss(self, record: Record) -> torch.Tensor:
        """Returns the mean squared error of the mixed values, plus `own_loss` times that of the agents' own values."""
        parts = _networks.tensors(record)
        states, active, actions = _networks.global_states(record), parts["active"], parts["actions"]
        values = self.network.policy(self.network.of_record(record))
        chosen = values[:-1].gather(-1, actions.unsqueeze(-1)).squeeze(-1)
        best = values[:-1].masked_fill(~parts["masks"][:-1], LEAST).amax(dim=-1)
        with torch.no_grad():
            greedy = values.masked_fill(~parts["masks"], LEAST).argmax(dim=-1)
            later, later_best = self._next_values(record, greedy)
            # The value of a finished agent is 0.
            later, later_best = later * active[1:], later_best * active[1:]
            mixed_later = self.target_mixer(later, later_best, greedy[1:], states[1:])
        mixed = self.mixer(chosen * active[:-1], best * active[:-1], actions, states[:-1])
        loss = self._error(parts, mixed, mixed_later)
        if self.learner.own_loss and self.config.method != "iql":
            loss = loss + self.learner.own_loss * self._error(parts, chosen, later)
        return loss

    def _next_values(self, record: Record, greedy: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns the target network's values of `greedy` and of its own best actions, in the state after each step."""
        values = self.target_network.policy(self.target_network.of_record(record))[1:]
        best = values.masked_fill(~torch.from_numpy(record.masks[1:]), LEAST).amax(dim=-1)
        return values.gather(-1, greedy[1:].unsqueeze(-1)).squeeze(-1), best

    def _error(self, parts: dict[str, torch.Tensor], values: torch.Tensor, later: torch.Tensor) -> torch.Tensor:
        """Returns the mean squared error of values against their returns, over all steps that were played.

        Values whose last axis has length 1 are those of the team. The team's reward is the sum of the agents' rewards,
        divided by the largest number of agents in an episode.
        """
        rewards, terminated = parts["rewards"], parts["terminated"]
        counts = parts["played"].unsqueeze(-1)
        ended = last_steps(parts["played"]).unsqueeze(-1)
        if values.shape[-1] == 1:
            rewards, terminated = rewards.mean(dim=-1, keepdim=True), terminated.all(dim=-1, keepdim=True)
        else:
            counts = counts & parts["active"][:-1]
        settings = self.learner.discount, self.learner.td_lambda
        returns = lambda_returns(*settings, later, rewards, terminated, ended.expand_as(rewards))
        loss: torch.Tensor = ((values - returns).square() * counts).sum() / counts.sum().clamp(min=1)
        return loss

    def state(self) -> dict[str, Any]:
        """Returns everything that a checkpoint must hold, besides the files of the replay buffer."""
        return {
            "modules": [module.state_dict() for module in self._modules()],
            "counts": [self._steps, self._copied, self._episodes],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restores what `state` returned."""
        for module, values in zip(self._modules(), state["modules"]):
            module.load_state_dict(values)
        self._steps, self._copied, self._episodes = state["counts"]

    def _modules(self) -> tuple[Any, ...]:
        """Returns the modules and the optimizer, whose states are tensors."""
        return self.network, self.mixer, self.target_network, self.target_mixer, self.average, self.optimizer

    def save(self) -> None:
        """Writes the replay buffer to the disk."""
        self.replay.flush()
