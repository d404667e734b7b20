"""EPOM: PPO on windows that show the obstacles that the agent remembers, and on scalars for its cell and goal.

Source: Skrynnik et al., "When to switch: planning and learning for partially observable multi-agent pathfinding", 2023
"""

from __future__ import annotations

from pogema_rs.baselines._own_value import HAS_VALUE, make_critic

__all__ = ["HAS_VALUE", "make_critic"]
