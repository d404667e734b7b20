"""IQL: each agent learns the values of its own actions.

Source: Tan, "Multi-agent reinforcement learning: independent vs. cooperative agents", 1993; the recurrent network of
Rashid et al., "QMIX", 2018
"""

from __future__ import annotations

import torch
from torch import nn

from pogema_rs.baselines._config import TrainingConfig


class Independent(nn.Module):
    """Leaves the values of the agents as they are."""

    def forward(
        self, chosen: torch.Tensor, best: torch.Tensor, actions: torch.Tensor, states: torch.Tensor
    ) -> torch.Tensor:
        """Returns `chosen`."""
        return chosen


def make_mixer(config: TrainingConfig, num_values: int) -> nn.Module:
    """Returns the mixer of the method."""
    return Independent()
