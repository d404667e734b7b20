"""VDN: the team's value is the sum of the agents' values.

Source: Sunehag et al., "Value-decomposition networks for cooperative multi-agent learning", 2018
"""

from __future__ import annotations

import torch
from torch import nn
from torchrl.modules import VDNMixer

from pogema_rs.baselines._config import TrainingConfig


class Sum(nn.Module):
    """Returns the sum of the agents' values, by TorchRL's mixer, divided by the largest number of agents.

    The team's reward is divided by the same number. If the sum were not divided too, each agent's value would be too
    small by that factor.
    """

    def __init__(self, num_agents: int) -> None:
        super().__init__()
        self.num_agents = num_agents
        self.mixer = VDNMixer(n_agents=num_agents, device="cpu")

    def forward(
        self, chosen: torch.Tensor, best: torch.Tensor, actions: torch.Tensor, states: torch.Tensor
    ) -> torch.Tensor:
        """Returns the team's value. Shape: `(..., agents)` to `(..., 1)`."""
        mixed: torch.Tensor = self.mixer(chosen.unsqueeze(-1))
        return mixed / self.num_agents


def make_mixer(config: TrainingConfig, num_values: int) -> nn.Module:
    """Returns the mixer of the method."""
    return Sum(max(config.environment.num_agents))
