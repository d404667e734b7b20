"""EPOM: PPO on windows that show the obstacles that the agent remembers, with the cell and the goal as numbers.

Source: Skrynnik et al., "When to switch: planning and learning for partially observable multi-agent pathfinding", 2023
"""

from __future__ import annotations

from torch import nn

from pogema_rs.baselines._config import TrainingConfig
from pogema_rs.baselines._own_value import OwnValue

#: Whether the agents' network has an output for the value.
HAS_VALUE = True


def make_critic(config: TrainingConfig, map_size: tuple[int, int]) -> nn.Module:
    """Returns the critic of the method."""
    return OwnValue()
