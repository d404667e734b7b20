"""Follower: PPO on a window with the path of an own planner; the reward is to follow it, and to reach goals.

Source: Skrynnik et al., "Learn to Follow: decentralized lifelong multi-agent pathfinding via planning and learning",
2024
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
