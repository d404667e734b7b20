"""The learning rate, which may fall during a training."""

from __future__ import annotations

from torch.optim import Optimizer


def decay(optimizer: Optimizer, half_life: int) -> None:
    """Lowers the learning rate as after one iteration of `half_life`, in which it falls to half; 0 leaves it.

    A checkpoint needs nothing more than the optimizer's state, which holds the rate.
    """
    if half_life:
        for group in optimizer.param_groups:
            group["lr"] *= 0.5 ** (1 / half_life)
