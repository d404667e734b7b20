"""MAPPO: PPO with a critic that sees the global state; the agents' network sees only its windows.

Source: Yu et al., "The surprising effectiveness of PPO in cooperative multi-agent games", 2022
"""

from __future__ import annotations

import torch
from torch import nn

from pogema_rs.baselines._config import PPOConfig, TrainingConfig
from pogema_rs.baselines._networks import AgentNetwork, global_states, num_state_values
from pogema_rs.baselines._record import Record

#: Whether the agents' network has an output for the value.
HAS_VALUE = False


class GlobalCritic(nn.Module):
    """Estimates the value of each agent's state from the global state, its own cell, goal and network features."""

    def __init__(self, num_values: int, width: int, hidden: int) -> None:
        super().__init__()
        # The first layer is split: the part of the global state is computed once for all agents.
        self.team = nn.Linear(num_values, hidden)
        self.own = nn.Linear(4 + width, hidden)
        self.rest = nn.Sequential(nn.ReLU(), nn.Linear(hidden, hidden), nn.ReLU(), nn.Linear(hidden, 1))

    def forward(self, network: AgentNetwork, features: torch.Tensor, record: Record) -> torch.Tensor:
        """Returns the values of all states. Shape: `(steps + 1, lanes, agents)`."""
        places = torch.from_numpy(record.places).float() / max(record.maps.shape[1:])
        # The critic must not change what the agents' network computes for the policy.
        own = self.own(torch.cat([places, features.detach()], dim=-1))
        values: torch.Tensor = self.rest(self.team(global_states(record)).unsqueeze(-2) + own)
        return values.squeeze(-1)


def make_critic(config: TrainingConfig, map_size: tuple[int, int]) -> nn.Module:
    """Returns the critic of the method."""
    assert isinstance(config.learner, PPOConfig)
    network = config.network
    width = network.recurrent or network.hidden
    num_values = num_state_values(max(config.environment.num_agents))
    return GlobalCritic(num_values, width, config.learner.critic_hidden)
