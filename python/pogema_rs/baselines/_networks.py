"""The network that each agent plays with. All agents share its parameters."""

from __future__ import annotations

import math
from typing import Any, Optional

import torch
from torch import nn

from pogema_rs._encoder import Encoder
from pogema_rs.baselines._config import NetworkConfig
from pogema_rs.baselines._record import Record
from pogema_rs.baselines._workers import Workers
from pogema_rs.vec_env import NUM_ACTIONS

#: The largest number of windows that go through the convolutions together.
ROWS_AT_ONCE = 256


class Residual(nn.Module):
    """Adds its input to the output of its layers."""

    def __init__(self, filters: int) -> None:
        super().__init__()
        self.residual = nn.Sequential(
            nn.Conv2d(filters, filters, 3, padding=1), nn.ReLU(), nn.Conv2d(filters, filters, 3, padding=1)
        )

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        added: torch.Tensor = values + self.residual(values)
        return added


class AgentNetwork(nn.Module):
    """Maps windows and scalars to one number per action, or to other outputs, and optionally to a value.

    Its attributes `body`, `core`, `policy` and `value` are those that `pogema_rs.policies.export` reads: convolutions
    and residual blocks, a dense layer, a GRU, and the outputs.
    """

    def __init__(
        self,
        encoder: Encoder,
        config: NetworkConfig,
        has_value: bool,
        num_outputs: int = NUM_ACTIONS,
        workers: Optional[Workers] = None,
    ) -> None:
        super().__init__()
        channels, side, _ = encoder.shape
        self.window = encoder.shape
        self.scale = 2.0 * encoder.radius
        self.has_convolutions = config.filters > 0
        layers: list[nn.Module] = []
        if config.filters:
            layers += [nn.Conv2d(channels, config.filters, 3, padding=1), nn.ReLU()]
            for _ in range(config.blocks):
                layers += [Residual(config.filters), nn.ReLU()]
            channels = config.filters
        layers.append(nn.Flatten())
        width = channels * side * side
        if config.hidden:
            layers += [nn.Linear(width, config.hidden), nn.ReLU()]
            width = config.hidden
        self.body = nn.Sequential(*layers)
        width += 2 * len(encoder.scalars)
        self.core: Optional[nn.Sequential] = None
        if encoder.scalars or config.recurrent:
            core: list[nn.Module] = []
            if encoder.scalars:
                core += [nn.Linear(width, config.hidden), nn.ReLU()]
                width = config.hidden
            if config.recurrent:
                core.append(nn.GRU(width, config.recurrent))
                width = config.recurrent
            self.core = nn.Sequential(*core)
        self.policy = nn.Linear(width, num_outputs)
        self.value = nn.Linear(width, 1) if has_value else None
        self.width = width
        self._workers = Workers(1) if workers is None else workers

    def features(
        self, windows: torch.Tensor, scalars: torch.Tensor, state: Optional[torch.Tensor] = None
    ) -> tuple[torch.Tensor, Optional[torch.Tensor]]:
        """Returns the inputs of the last layer, and the recurrent state after the last step.

        Shape: `windows` `(steps, rows, channels * side * side)`, `scalars` `(steps, rows, scalars)`; the result is
        `(steps, rows, width)`
        """
        parameters = [*self.body.parameters(), *(self.core.parameters() if self.core is not None else ())]
        return self._workers.features(self._features, parameters, windows, scalars, state)

    def _features(
        self, windows: torch.Tensor, scalars: torch.Tensor, state: Optional[torch.Tensor]
    ) -> tuple[torch.Tensor, Optional[torch.Tensor]]:
        steps, rows = windows.shape[:2]
        values = self._of_windows(windows.reshape(steps * rows, *self.window)).view(steps, rows, -1)
        if self.core is None:
            return values, None
        if scalars.shape[-1]:
            values = torch.cat([values, scalars], dim=-1)
        for layer in self.core:
            if isinstance(layer, nn.GRU):
                values, state = layer(values, state)
            else:
                values = layer(values)
        return values, state

    def _of_windows(self, windows: torch.Tensor) -> torch.Tensor:
        """Returns the outputs of the layers before the scalars are appended."""
        if not self.has_convolutions:
            whole: torch.Tensor = self.body(windows)
            return whole
        count = math.ceil(len(windows) / ROWS_AT_ONCE)
        # Convolutions are three times as fast on parts that fit the cache and have the channels-last layout.
        parts = [part.contiguous(memory_format=torch.channels_last) for part in windows.tensor_split(count)]
        return torch.cat([self.body(part) for part in parts])

    def of_record(self, record: Record) -> torch.Tensor:
        """Returns the features of all states of a record.

        Shape: `(steps + 1, lanes, agents, width)`
        """
        windows = torch.from_numpy(record.windows).flatten(1, 2).float().div_(self.scale)
        scalars = torch.from_numpy(record.scalars).flatten(1, 2)
        features, _ = self.features(windows, scalars)
        return features.view(*record.masks.shape[:3], -1)


#: The number of values of each agent in a global state.
STATE_VALUES = 7


def num_state_values(num_agents: int) -> int:
    """Returns the number of values of a global state."""
    return STATE_VALUES * num_agents


def global_states(record: Record) -> torch.Tensor:
    """Returns the global state of all states of a record.

    For each agent, the global state holds the agent's cell, its goal and the offset between both, all divided by the
    longer side of the record's maps, and whether the agent is on its goal. The map is left out: with it, the mixers
    memorize the episodes of the replay.

    Shape: `(steps + 1, lanes, values)`
    """
    places = torch.from_numpy(record.places).float() / max(record.maps.shape[1:])
    offsets = places[..., 2:] - places[..., :2]
    on_goal = (offsets == 0).all(dim=-1, keepdim=True).float()
    return torch.cat([places, offsets, on_goal], dim=-1).flatten(2)


def tensors(record: Record) -> dict[str, Any]:
    """Returns the arrays of a record that a loss reads, as tensors."""
    return {
        "actions": torch.from_numpy(record.actions).long(),
        "rewards": torch.from_numpy(record.rewards),
        "terminated": torch.from_numpy(record.terminated),
        "played": torch.from_numpy(record.played),
        "active": torch.from_numpy(record.active),
        "masks": torch.from_numpy(record.masks),
    }
