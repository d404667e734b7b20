"""IPPO: each agent learns by PPO from its own rewards and windows; all agents share parameters.

Source: de Witt et al., "Is independent learning all you need in the StarCraft multi-agent challenge?", 2020
"""

from __future__ import annotations

from pogema_rs.baselines._own_value import HAS_VALUE, make_critic

__all__ = ["HAS_VALUE", "make_critic"]
