"""The critic of methods whose agents judge their states by what they see themselves."""

from __future__ import annotations

import torch
from torch import nn

from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._record import Record


class OwnValue(nn.Module):
    """Returns the value that the agent's network computes."""

    def forward(self, network: AgentNetwork, features: torch.Tensor, record: Record) -> torch.Tensor:
        """Returns the values of all states. Shape: `(steps + 1, lanes, agents)`."""
        assert network.value is not None
        values: torch.Tensor = network.value(features).squeeze(-1)
        return values
