"""What changes after each iteration, besides the network: the learning rate and the averaged network."""

from __future__ import annotations

import torch
from torch import nn
from torch.optim import Optimizer


def decay(optimizer: Optimizer, half_life: int) -> None:
    """Lowers the learning rate after an iteration, so that it halves in `half_life` iterations; 0 keeps it constant.

    A checkpoint needs nothing more than the optimizer's state, which holds the rate.
    """
    if half_life:
        for group in optimizer.param_groups:
            group["lr"] *= 0.5 ** (1 / half_life)


@torch.no_grad()
def move_average(average: nn.Module, network: nn.Module, averaging: float) -> None:
    """Moves an averaged network towards the network; the average keeps the share `averaging` of itself."""
    for mean, parameter in zip(average.parameters(), network.parameters()):
        mean.lerp_(parameter, 1 - averaging)
