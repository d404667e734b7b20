"""QPLEX: a duplex dueling mixer that represents every team value maximized by the agents' individually best actions.

Source: Wang et al., "QPLEX: duplex dueling multi-agent Q-learning", 2021
"""

from __future__ import annotations

import torch
from torch import nn
from torch.nn import functional

from pogema_rs.baselines._config import QLearningConfig, TrainingConfig
from pogema_rs.vec_env import NUM_ACTIONS

#: Added to `w_i` and `l_i`, and to the keys of `l_i`, to keep them positive.
_SMALLEST = 1e-6


def _perceptron(inputs: int, hidden: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(inputs, hidden), nn.ReLU(), nn.Linear(hidden, outputs))


class Duplex(nn.Module):
    """Adds transformed values and weighted advantages of the agents.

    The team's value is the sum over agents of `w_i V_i + b_i + l_i w_i A_i`, where `V_i = max Q_i` and
    `A_i = Q_i - V_i`. `w_i > 0` and `b_i` depend on the state, `l_i > 0` also on the joint action. The last term is at
    most 0, and 0 for the best action of each agent, so these actions form the best joint action. `l_i` is a sum over
    kernels. Each kernel is the product of a positive key and of two shares, one for the agent and one for the actions.
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
