"""Updates after each iteration: the decay of the learning rate, and the moving average of the network."""

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
    """Updates the exponential moving average of a network, in which the old average has the weight `averaging`."""
    for mean, parameter in zip(average.parameters(), network.parameters()):
        mean.lerp_(parameter, 1 - averaging)
