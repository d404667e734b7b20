"""Learned policies, which play in Rust, and encoders, which define what a policy observes.

    from pogema_rs import VecEnv
    from pogema_rs.policies import load

    policy = load("weights.safetensors")
    env = VecEnv({"num_agents": 8}, 4)
    env.reset()
    env.step(policy.act(env))

`load` reads the weights of a network. `export` writes them from a PyTorch module, and `save` from NumPy arrays.
"""

from __future__ import annotations

from pogema_rs._encoder import Encoder
from pogema_rs._export import export, save
from pogema_rs._policy import LEARNED, Policy, load

__all__ = ["LEARNED", "Encoder", "Policy", "export", "load", "save"]
