"""LSwitcher: the values of EPOM and of RePlan, in crowds whose agents follow either.

Source: Skrynnik et al., "When to switch: planning and learning for partially observable multi-agent pathfinding", 2023
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Optional

import numpy as np
import torch
from torch import nn

from pogema_rs import policies
from pogema_rs._encoder import Encoder
from pogema_rs.baselines import _networks
from pogema_rs.baselines._config import TrainingConfig, ValueConfig
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.baselines._record import Record, lanes_of
from pogema_rs.baselines._schedules import decay
from pogema_rs.baselines._targets import lambda_returns, last_steps
from pogema_rs.policies import Policy
from pogema_rs.vec_env import VecEnv

#: The outputs of the network: the value of EPOM, and that of RePlan.
NUM_VALUES = 2
EPOM, REPLAN = range(NUM_VALUES)

#: The number of steps for which LSwitcher's agents follow the same policy before they may change.
LEAST_STEPS = 50


class Crowd:
    """The agents of a training episode, which follow EPOM or RePlan.

    Some agents draw a policy in the first step, and again whenever they may change. The others follow the policy with
    the larger value, by the rules of LSwitcher. An agent draws EPOM with a probability that all drawing agents of its
    environment share, so that the network sees crowds of all mixtures.
    """

    def __init__(self, network: AgentNetwork, drawn: float, seed: int) -> None:
        self._network, self._drawn = network, drawn
        self._rng = np.random.default_rng(seed)
        self._policies = [policies.load(name="epom", seed=seed), _planner(seed)]
        self._draws: np.ndarray = np.zeros(0)
        self._shares: np.ndarray = np.zeros(0)
        #: The policies that the agents follow, `EPOM` or `REPLAN`, in each step so far.
        self.followed: list[np.ndarray] = []
        # The number of steps since an agent could change before, without the first step.
        self._waited: np.ndarray = np.zeros(0)

    def choose(self, env: VecEnv[Any], windows: np.ndarray, scalars: np.ndarray) -> np.ndarray:
        """Returns the actions of the next step of an episode. Shape: `(lanes, agents)`, int64."""
        if not self.followed:
            lanes, agents = windows.shape[:2]
            self._draws = self._rng.random((lanes, agents)) < self._drawn
            self._shares = self._rng.random((lanes, 1))
            self._waited = np.zeros((lanes, agents), dtype=np.int64)
            followed = self._wanted(windows, scalars)
        else:
            followed = self.followed[-1]
            may_change = self._waited >= LEAST_STEPS
            if may_change.any():
                wanted = self._wanted(windows, scalars)
                changes = may_change & ((wanted != followed) | self._draws)
                followed = np.where(changes, wanted, followed)
                self._waited[changes] = 0
            self._waited += 1
        self.followed.append(followed)
        actions = [policy.act(env) for policy in self._policies]
        return np.where(followed == EPOM, actions[EPOM], actions[REPLAN])

    @torch.no_grad()
    def _wanted(self, windows: np.ndarray, scalars: np.ndarray) -> np.ndarray:
        """Returns which policy each agent would follow if it could change."""
        lanes, agents = windows.shape[:2]
        seen, beside = (torch.from_numpy(part).view(1, lanes * agents, -1) for part in (windows, scalars))
        values = self._network.policy(self._network.features(seen, beside)[0]).view(lanes, agents, NUM_VALUES)
        preferred = np.where((values[..., EPOM] > values[..., REPLAN]).numpy(), EPOM, REPLAN)
        drawn = np.where(self._rng.random((lanes, agents)) < self._shares, EPOM, REPLAN)
        return np.where(self._draws, drawn, preferred)


class ValueLearner:
    """Learns the discounted returns of agents that follow EPOM, with the weights of the package, or RePlan."""

    #: LSwitcher draws EPOM's actions.
    sampling = "softmax"
    masks = False
    #: The policy that plays the trained network.
    policy_name = "lswitcher"

    def __init__(self, config: TrainingConfig, map_size: tuple[int, int], generator: torch.Generator) -> None:
        assert isinstance(config.learner, ValueConfig)
        self.config, self.learner, self._generator = config, config.learner, generator
        self.network = AgentNetwork(config.encoder, config.network, has_value=False, num_outputs=NUM_VALUES)
        self.optimizer = torch.optim.Adam(self.network.parameters(), self.learner.learning_rate)
        # The agents of the last training episodes.
        self._crowd: Optional[Crowd] = None

    def open(self, folder: Path) -> None:
        """Does nothing: no episode is kept."""

    def save(self) -> None:
        """Does nothing: no episode is kept."""

    def actor(self) -> Crowd:
        """Returns the agents of the next training episodes."""
        seed = int(torch.randint(2**31, (1,), generator=self._generator))
        self._crowd = Crowd(self.network, self.learner.drawn, seed)
        return self._crowd

    def trained(self) -> AgentNetwork:
        """Returns the network."""
        return self.network

    def judge(self, generator: torch.Generator) -> Policy:
        """Returns the policy of the validation episodes."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "values.safetensors"
            policies.export(self.network, self.config.encoder, path, name=self.policy_name)
            return policies.load(path, name=self.policy_name, seed=generator.initial_seed())

    def learn(self, record: Record) -> dict[str, float]:
        """Updates the network on the episodes that the last actor played; returns the mean loss."""
        losses = []
        parts = _networks.tensors(record)
        counted = parts["active"][:-1] & parts["played"].unsqueeze(-1)
        followed = self._followed(record)
        returns = self._returns(record, followed)
        for _ in range(self.learner.epochs):
            order = torch.randperm(record.shape[1], generator=self._generator)
            for lanes in torch.tensor_split(order, self.learner.minibatches):
                if len(lanes):
                    values = self._values(lanes_of(record, lanes.numpy()), followed[:, lanes])[:-1]
                    losses.append(self._update(values, returns[:, lanes], counted[:, lanes]))
        decay(self.optimizer, self.learner.half_life)
        return {"loss": sum(losses) / len(losses)}

    def _followed(self, record: Record) -> torch.Tensor:
        """Returns the policy that each agent follows in each state; in the last state, that of the last step.

        Shape: `(steps + 1, lanes, agents)`, int64
        """
        assert self._crowd is not None
        played = np.stack(self._crowd.followed)
        steps, lanes, agents = record.shape
        whole = np.zeros((steps + 1, lanes, agents), dtype=np.int64)
        # The record has room for more steps and agents than this crowd has played with.
        whole[: len(played), :, : played.shape[2]] = played
        whole[len(played) :, :, : played.shape[2]] = played[-1]
        return torch.from_numpy(whole)

    def _values(self, record: Record, followed: torch.Tensor) -> torch.Tensor:
        """Returns the values of the followed policies in all states of a record.

        Shape: `(steps + 1, lanes, agents)`
        """
        values = self.network.policy(self.network.of_record(record))
        return torch.gather(values, -1, followed.unsqueeze(-1)).squeeze(-1)

    @torch.no_grad()
    def _returns(self, record: Record, followed: torch.Tensor) -> torch.Tensor:
        """Returns the returns of a record, which continue after the last step with the value of the last state."""
        parts = _networks.tensors(record)
        rewards = parts["rewards"]
        ended = last_steps(parts["played"]).unsqueeze(-1).expand_as(rewards)
        later = self._values(record, followed)[1:]
        return lambda_returns(self.learner.discount, 1.0, later, rewards, parts["terminated"], ended)

    def _update(self, values: torch.Tensor, returns: torch.Tensor, counted: torch.Tensor) -> float:
        loss = ((values - returns).square() * counted).sum() / counted.sum().clamp(min=1)
        self.optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.learner.max_gradient)
        self.optimizer.step()
        return float(loss.detach())

    def state(self) -> dict[str, Any]:
        """Returns everything that a checkpoint must hold."""
        modules: tuple[Any, ...] = (self.network, self.optimizer)
        return {"modules": [one.state_dict() for one in modules]}

    def restore(self, state: dict[str, Any]) -> None:
        """Restores what `state` returned."""
        modules: tuple[Any, ...] = (self.network, self.optimizer)
        for module, values in zip(modules, state["modules"]):
            module.load_state_dict(values)


def _planner(seed: int) -> Policy:
    """Returns RePlan: LSwitcher with a network that always prefers it."""
    encoder = Encoder(radius=1, channels=("obstacles",))
    values = np.zeros(NUM_VALUES)
    values[REPLAN] = 1
    tensors = {"values.weight": np.zeros((NUM_VALUES, 9)), "values.bias": values}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "planner.safetensors"
        policies.save(path, encoder, ["flatten"], tensors, actions="values", name="lswitcher")
        return policies.load(path, name="lswitcher", seed=seed)
