"""QMIX: the team's value is a monotone function of the agents' values, whose weights depend on the global state.

Source: Rashid et al., "QMIX: monotonic value function factorisation for deep multi-agent reinforcement learning", 2018
"""

from __future__ import annotations

import torch
from torch import nn
from torchrl.modules import QMixer

from pogema_rs.baselines._config import QLearningConfig, TrainingConfig


class Monotone(nn.Module):
    """Mixes the agents' values with TorchRL's mixer."""

    def __init__(self, num_values: int, hidden: int, num_agents: int) -> None:
        super().__init__()
        self.mixer = QMixer(state_shape=(num_values,), mixing_embed_dim=hidden, n_agents=num_agents, device="cpu")

    def forward(
        self, chosen: torch.Tensor, best: torch.Tensor, actions: torch.Tensor, states: torch.Tensor
    ) -> torch.Tensor:
        """Returns the team's value. Shape: `(..., agents)` and `(..., values)` to `(..., 1)`."""
        mixed: torch.Tensor = self.mixer(chosen.unsqueeze(-1), states)
        return mixed


def make_mixer(config: TrainingConfig, num_values: int) -> nn.Module:
    """Returns the mixer of the method."""
    assert isinstance(config.learner, QLearningConfig)
    return Monotone(num_values, config.learner.mixer_hidden, max(config.environment.num_agents))
