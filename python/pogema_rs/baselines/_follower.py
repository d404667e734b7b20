"""Follower: PPO on two windows, one with the path of Follower's planner; only steps along the path are rewarded.

Source: Skrynnik et al., "Learn to Follow: decentralized lifelong multi-agent pathfinding via planning and learning",
2024
"""

from __future__ import annotations

from pogema_rs.baselines._own_value import HAS_VALUE, make_critic

__all__ = ["HAS_VALUE", "make_critic"]
