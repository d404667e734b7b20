"""The choice of actions while episodes are played."""

from __future__ import annotations

from typing import Optional

import numpy as np
import torch

from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.vec_env import NUM_ACTIONS

#: The logit of a masked action; finite, because minus infinity times 0 is NaN.
LEAST = -1e9


class Actor:
    """Chooses the actions of one call of `Collector.play`; the recurrent state begins with zeros.

    With `epsilon`, actions are greedy or, with this probability, random; without it they are drawn from the softmax.
    Masked actions are only chosen if `masks` is False.
    """

    def __init__(
        self, network: AgentNetwork, generator: torch.Generator, epsilon: Optional[float], masks: bool = True
    ) -> None:
        self._network, self._generator = network, generator
        self._epsilon, self._masks = epsilon, masks
        self._state: Optional[torch.Tensor] = None

    @torch.no_grad()
    def __call__(self, windows: np.ndarray, scalars: np.ndarray, masks: np.ndarray) -> np.ndarray:
        """Returns the actions. Shape: `(lanes, agents)`, int64."""
        lanes, agents = windows.shape[:2]
        seen = torch.from_numpy(windows).view(1, lanes * agents, -1)
        beside = torch.from_numpy(scalars).view(1, lanes * agents, -1)
        features, self._state = self._network.features(seen, beside, self._state)
        outputs = self._network.policy(features[0])
        allowed = torch.from_numpy(masks).view(-1, NUM_ACTIONS) != 0
        if self._masks:
            outputs = outputs.masked_fill(~allowed, LEAST)
        if self._epsilon is None:
            chosen = torch.multinomial(torch.softmax(outputs, dim=-1), 1, generator=self._generator).squeeze(-1)
        else:
            chosen = self._explore(outputs.argmax(dim=-1), allowed)
        return np.asarray(chosen.view(lanes, agents).numpy())

    def _explore(self, greedy: torch.Tensor, allowed: torch.Tensor) -> torch.Tensor:
        if not self._epsilon:
            return greedy
        shares = allowed.float() if self._masks else torch.ones(allowed.shape)
        random = torch.multinomial(shares, 1, generator=self._generator).squeeze(-1)
        explores = torch.rand(len(greedy), generator=self._generator) < self._epsilon
        return torch.where(explores, random, greedy)
