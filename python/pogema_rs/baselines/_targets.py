"""Returns and advantages, by TorchRL.

All tensors have the axes `(steps, ...)`. `ended` is True at the last step of an episode, and `terminated` at a step
after which no reward follows; if only the time limit ends an episode, its returns bootstrap from the value of the last
state.
"""

from __future__ import annotations

import torch
from torchrl.objectives.value.functional import generalized_advantage_estimate, td_lambda_return_estimate


def lambda_returns(
    discount: float,
    lmbda: float,
    next_values: torch.Tensor,
    rewards: torch.Tensor,
    terminated: torch.Tensor,
    ended: torch.Tensor,
) -> torch.Tensor:
    """Returns TD(lambda) returns, where `lmbda` is lambda."""
    flags = (ended | terminated).unsqueeze(-1), terminated.unsqueeze(-1)
    numbers = next_values.unsqueeze(-1), rewards.unsqueeze(-1)
    returns: torch.Tensor = td_lambda_return_estimate(discount, lmbda, *numbers, *flags, time_dim=0).squeeze(-1)
    return returns


def estimate_advantages(
    discount: float,
    lmbda: float,
    values: torch.Tensor,
    rewards: torch.Tensor,
    terminated: torch.Tensor,
    ended: torch.Tensor,
) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns advantages by GAE, and the returns; `values` has one step more than the rest."""
    flags = (ended | terminated).unsqueeze(-1), terminated.unsqueeze(-1)
    numbers = values[:-1].unsqueeze(-1), values[1:].unsqueeze(-1), rewards.unsqueeze(-1)
    found, returns = generalized_advantage_estimate(discount, lmbda, *numbers, *flags, time_dim=0)
    return found.squeeze(-1), returns.squeeze(-1)


def last_steps(played: torch.Tensor) -> torch.Tensor:
    """Returns which steps are the last of their episode. Shape: `(steps, lanes)`, bool."""
    after = torch.cat([played[1:], torch.zeros_like(played[:1])])
    return played & ~after
