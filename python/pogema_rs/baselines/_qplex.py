"""QPLEX: a duplex dueling mixer, which represents all functions whose best joint action consists of best own actions.

Source: Wang et al., "QPLEX: duplex dueling multi-agent Q-learning", 2021
"""

from __future__ import annotations

import torch
from torch import nn
from torch.nn import functional

from pogema_rs.baselines._config import QLearningConfig, TrainingConfig
from pogema_rs.vec_env import NUM_ACTIONS

#: The smallest weight of a value or an advantage, which keeps both factors positive.
_SMALLEST = 1e-6


def _perceptron(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(inputs, hidden), nn.ReLU(), nn.Linear(hidden, outputs))


class Duplex(nn.Module):
    """Adds transformed values and weighted advantages of the agents.

    With `V_i = max Q_i` and `A_i = Q_i - V_i`, and with positive `w_i` and `l_i` that depend on the state, and on the
    joint action for `l_i`, the team's value is the sum over agents of `w_i V_i + b_i + l_i w_i A_i`. The last term is
    at most 0, and 0 for the best own actions, so these form the best joint action. `l_i` is a sum over kernels, each a
    product of a positive key and of shares of agents and actions.
    """

    def __init__(self, num_values: int, hidden: int, num_agents: int, kernels: int) -> None:
        super().__init__()
        self.num_agents, self.kernels = num_agents, kernels
        self.weights = _perceptron(num_values, hidden, num_agents)
        self.biases = _perceptron(num_values, hidden, num_agents)
        self.keys = _perceptron(num_values, hidden, kernels)
        self.agents = _perceptron(num_values, hidden, kernels * num_agents)
        self.actions = _perceptron(num_values + NUM_ACTIONS * num_agents, hidden, kernels * num_agents)

    def forward(
        self, chosen: torch.Tensor, best: torch.Tensor, actions: torch.Tensor, states: torch.Tensor
    ) -> torch.Tensor:
        """Returns the team's value.

        Shape: `chosen`, `best` and `actions` `(..., agents)`, `states` `(..., values)`; the result is `(..., 1)`
        """
        weights = functional.softplus(self.weights(states)) + _SMALLEST
        values = (weights * best + self.biases(states)).sum(dim=-1, keepdim=True)
        # The gradient of the advantages must not reach the maxima, which the values train.
        gaps = weights * (chosen - best.detach())
        mixed: torch.Tensor = values + (self._importance(actions, states) * gaps).sum(dim=-1, keepdim=True)
        return mixed

    def _importance(self, actions: torch.Tensor, states: torch.Tensor) -> torch.Tensor:
        joint = functional.one_hot(actions, NUM_ACTIONS).flatten(-2).to(states.dtype)
        shape = (*states.shape[:-1], self.kernels, self.num_agents)
        keys = functional.softplus(self.keys(states)).unsqueeze(-1) + _SMALLEST
        agents = torch.sigmoid(self.agents(states)).view(shape)
        shares = torch.sigmoid(self.actions(torch.cat([states, joint], dim=-1))).view(shape)
        importance: torch.Tensor = (keys * agents * shares).sum(dim=-2) + _SMALLEST
        return importance


def make_mixer(config: TrainingConfig, num_values: int) -> nn.Module:
    """Returns the mixer of the method."""
    assert isinstance(config.learner, QLearningConfig)
    learner = config.learner
    return Duplex(num_values, learner.mixer_hidden, max(config.environment.num_agents), learner.kernels)
