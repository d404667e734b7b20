"""The critic of methods whose agents estimate state values from their own observations."""

from __future__ import annotations

import torch
from torch import nn

from pogema_rs.baselines._config import TrainingConfig
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._record import Record


#: Whether the agents' network has an output for the value.
HAS_VALUE = True


class OwnValue(nn.Module):
    """Returns the value that the agent's network computes."""

    def forward(self, network: AgentNetwork, features: torch.Tensor, record: Record) -> torch.Tensor:
        """Returns the values of all states. Shape: `(steps + 1, lanes, agents)`."""
        assert network.value is not None
        values: torch.Tensor = network.value(features).squeeze(-1)
        return values


def make_critic(config: TrainingConfig, map_size: tuple[int, int]) -> nn.Module:
    """Returns the critic of the method."""
    return OwnValue()
