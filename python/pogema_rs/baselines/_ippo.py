"""IPPO: each agent learns by PPO from its own rewards and windows; all agents share parameters.

Source: de Witt et al., "Is independent learning all you need in the StarCraft multi-agent challenge?", 2020
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
