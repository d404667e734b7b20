"""LSwitcher: the values of EPOM and of RePlan, in episodes that each of them plays alone.

Source: Skrynnik et al., "When to switch: planning and learning for partially observable multi-agent pathfinding", 2023
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Optional

import numpy as np
import torch
from torch import nn

from pogema_rs import policies
from pogema_rs._encoder import Encoder
from pogema_rs.baselines import _networks
from pogema_rs.baselines._config import TrainingConfig, ValueConfig
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._record import Record, lanes_of, without_padding
from pogema_rs.baselines._schedules import decay
from pogema_rs.baselines._targets import lambda_returns, last_steps
from pogema_rs.baselines._workers import Workers
from pogema_rs.policies import Policy

#: The outputs of the network: the value of EPOM, and that of RePlan.
NUM_VALUES = 2


class ValueLearner:
    """Learns the discounted returns of two policies, of which one plays each iteration.

    The policies are EPOM with the weights of the package, and RePlan. LSwitcher plays each of them, with a network that
    always prefers that policy.
    """

    #: LSwitcher draws EPOM's actions.
    sampling = "softmax"
    masks = False
    #: The policy that plays the trained network.
    policy_name = "lswitcher"

    def __init__(
        self,
        config: TrainingConfig,
        map_size: tuple[int, int],
        generator: torch.Generator,
        workers: Optional[Workers] = None,
    ) -> None:
        assert isinstance(config.learner, ValueConfig)
        self.config, self.learner, self._generator = config, config.learner, generator
        self.network = AgentNetwork(
            config.encoder, config.network, has_value=False, num_outputs=NUM_VALUES, workers=workers
        )
        self.optimizer = torch.optim.Adam(self.network.parameters(), self.learner.learning_rate)
        self._iteration = 0
        # The last loss of each policy.
        self._losses: dict[int, float] = {}

    @property
    def player(self) -> int:
        """The index of the policy that plays the next iteration; in each kind of episodes, the policies take turns."""
        return self._iteration // len(self.config.environment.kinds) % NUM_VALUES

    def open(self, folder: Path) -> None:
        """Does nothing: no episode is kept."""

    def save(self) -> None:
        """Does nothing: no episode is kept."""

    def actor(self) -> Policy:
        """Returns the policy of the training episodes."""
        seed = int(torch.randint(2**31, (1,), generator=self._generator))
        return _alone(self.player, seed)

    def trained(self) -> AgentNetwork:
        """Returns the network."""
        return self.network

    def validation_actor(self, generator: torch.Generator) -> Policy:
        """Returns the policy of the validation episodes."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "values.safetensors"
            policies.export(self.network, self.config.encoder, path, name=self.policy_name)
            return policies.load(path, name=self.policy_name, seed=generator.initial_seed())

    def learn(self, record: Record) -> dict[str, float]:
        """Updates the network on the episodes; returns the mean of the policies' last losses."""
        player, losses = self.player, []
        record = without_padding(record)
        acted = torch.from_numpy(record.acted)
        returns = self._returns(record, player)
        for _ in range(self.learner.epochs):
            order = torch.randperm(record.shape[1], generator=self._generator)
            for lanes in torch.tensor_split(order, self.learner.minibatches):
                if len(lanes):
                    values = self._values(lanes_of(record, lanes.numpy()), player)[:-1]
                    losses.append(self._update(values, returns[:, lanes], acted[:, lanes]))
        decay(self.optimizer, self.learner.half_life)
        self._iteration += 1
        self._losses[player] = sum(losses) / len(losses)
        return {"loss": sum(self._losses.values()) / len(self._losses)}

    def _values(self, record: Record, player: int) -> torch.Tensor:
        """Returns the values of all states of a record. Shape: `(steps + 1, lanes, agents)`."""
        values: torch.Tensor = self.network.policy(self.network.of_record(record))[..., player]
        return values

    @torch.no_grad()
    def _returns(self, record: Record, player: int) -> torch.Tensor:
        """Returns the discounted returns of a record.

        If only the time limit ends an episode, its returns bootstrap from the value of the last state.
        """
        parts = _networks.tensors(record)
        rewards = parts["rewards"]
        ended = last_steps(parts["played"]).unsqueeze(-1).expand_as(rewards)
        later = self._values(record, player)[1:]
        return lambda_returns(self.learner.discount, 1.0, later, rewards, parts["terminated"], ended)

    def _update(self, values: torch.Tensor, returns: torch.Tensor, counted: torch.Tensor) -> float:
        loss = ((values - returns).square() * counted).sum() / counted.sum().clamp(min=1)
        self.optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.learner.max_gradient)
        self.optimizer.step()
        return float(loss.detach())

    def state(self) -> dict[str, Any]:
        """Returns everything that a checkpoint must hold."""
        modules: tuple[Any, ...] = (self.network, self.optimizer)
        counts = {"iteration": self._iteration, "losses": self._losses}
        return {"modules": [one.state_dict() for one in modules], **counts}

    def restore(self, state: dict[str, Any]) -> None:
        """Restores what `state` returned."""
        modules: tuple[Any, ...] = (self.network, self.optimizer)
        for module, values in zip(modules, state["modules"]):
            module.load_state_dict(values)
        self._iteration, self._losses = state["iteration"], dict(state["losses"])


def _alone(player: int, seed: int) -> Policy:
    """Returns LSwitcher with a network that always prefers the policy with this index."""
    encoder = Encoder(radius=1, channels=("obstacles",))
    values = np.zeros(NUM_VALUES)
    values[player] = 1
    tensors = {"values.weight": np.zeros((NUM_VALUES, 9)), "values.bias": values}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "alone.safetensors"
        policies.save(path, encoder, ["flatten"], tensors, actions="values", name="lswitcher")
        return policies.load(path, name="lswitcher", seed=seed)
