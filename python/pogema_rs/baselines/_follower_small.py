"""Follower with a network of Follower-lite's size: PPO on the windows and with the reward of `follower`.

Source: Skrynnik et al., "Learn to Follow: decentralized lifelong multi-agent pathfinding via planning and learning",
2024
"""

from __future__ import annotations

from pogema_rs.baselines._own_value import HAS_VALUE, make_critic

__all__ = ["HAS_VALUE", "make_critic"]
