"""Plays whole episodes in all lanes of a `VecEnv`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Optional, Union

import numpy as np

from pogema_rs.baselines import _record
from pogema_rs.baselines._config import OCCUPANCIES, RewardConfig, TrainingConfig
from pogema_rs.baselines._record import Record
from pogema_rs.baselines._teacher import Teacher, cells_ahead
from pogema_rs.policies import Policy
from pogema_rs.vec_env import AutoresetMode, VecEnv

#: Chooses the actions of a step: `(windows, scalars, masks) -> actions`, all of shape `(lanes, agents, ...)`; or a
#: policy that plays in Rust.
Act = Union[Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray], Policy]


class Collector:
    """Plays and records one episode at a time in each lane; all have the same goal rule and the same number of agents.

    Each call of `play` begins new episodes, so no state of an environment outlives a call. A training run can therefore
    resume from the number of its iteration, without the state of an environment.
    """

    def __init__(self, config: TrainingConfig, map_size: tuple[int, int], lanes: int, threads: int) -> None:
        self._config, self._map_size, self._lanes, self._threads = config, map_size, lanes, threads
        self._env: Optional[VecEnv[Any]] = None
        seen = config.encoder.channels
        hidden = [one for one in _reward_channels(config.rewards) if one not in seen]
        #: What the environments encode: what the network sees, and the channels that only the reward reads.
        self._encoder = dataclasses.replace(config.encoder, channels=(*seen, *hidden))
        #: The windows of the last state, as whole numbers.
        self._shown = np.zeros(0, dtype=np.float32)
        #: For each agent, how many steps farther it is from its goal now than at its nearest cell so far.
        self._retreats = np.zeros((lanes, 0), dtype=np.float32)

    def play(
        self, configs: list[dict[str, Any]], seeds: Sequence[int], act: Act, teacher: Optional[Teacher] = None
    ) -> tuple[Record, dict[str, float]]:
        """Plays the episodes of the configs and seeds; returns them and the means of their metrics.

        The teacher sees every state.
        """
        env = self._begin(configs)
        seen, infos = env.reset(seed=list(seeds))
        whole = _record.empty(self._config, self._map_size, self._lanes)
        num_agents = configs[0]["num_agents"]
        # The rows of padding are inactive, and have no later reward.
        whole.terminated[:, :, num_agents:] = True
        record = _record.first_agents(whole, num_agents)
        metrics: dict[str, np.ndarray] = {}
        state = self._note(record, 0, seen, infos, env)
        # The engine's map is as large as the largest map so far; the rest of the record's map is obstacles.
        record.maps[:] = 1
        obstacles = state["obstacles"]
        record.maps[:, : obstacles.shape[1], : obstacles.shape[2]] = obstacles
        is_over = np.zeros(self._lanes, dtype=np.bool_)
        self._retreats = np.zeros(record.actions.shape[1:], dtype=np.float32)
        for step in range(len(record.actions)):
            if is_over.all():
                break
            windows, scalars = parts(seen)
            before = self._shown
            if teacher is not None:
                positions, goals = record.places[step, ..., :2], record.places[step, ..., 2:]
                teacher.advise(step, record.maps, positions, self._goals_ahead(positions, goals))
            if isinstance(act, Policy):
                actions = act.act(env)
            else:
                actions = act(windows[:, :, : len(self._config.encoder.channels)], scalars, infos["action_masks"])
            record.actions[step], record.played[step] = actions, ~is_over
            seen, own, terminated, truncated, infos = env.step(actions)
            self._note(record, step + 1, seen, infos, env)
            self._reward(record, step, before, own, configs[0]["on_target"])
            record.terminated[step] = terminated
            is_over |= (terminated.all(axis=1)) | (truncated.all(axis=1))
            if "metrics" in infos:
                _keep(metrics, infos["metrics"], infos["_metrics"])
        means = {name: float(values.mean()) for name, values in metrics.items()}
        return whole, {**means, "reward": float(record.rewards.sum() / max(1, record.acted.sum()))}

    @property
    def shape(self) -> tuple[int, int, int]:
        """The numbers of steps, lanes and agents of a record."""
        environment = self._config.environment
        return environment.max_episode_steps, self._lanes, max(environment.num_agents)

    def close(self) -> None:
        """Frees the environments."""
        if self._env is not None:
            self._env.close()
            self._env = None

    def _begin(self, configs: list[dict[str, Any]]) -> VecEnv[Any]:
        if self._env is None:
            self._env = VecEnv(
                configs,
                num_threads=self._threads,
                autoreset_mode=AutoresetMode.DISABLED,
                masks=True,
                map_size=self._map_size,
                semantics=OCCUPANCIES[self._config.environment.occupancy],
                encoder=self._encoder,
            )
        else:
            self._env.set_configs(configs)
        return self._env

    def _note(self, record: Record, step: int, seen: Any, infos: dict[str, Any], env: VecEnv[Any]) -> dict[str, Any]:
        """Writes what agents see in a state into the record, and returns the global state."""
        windows, scalars = parts(seen)
        self._shown = np.rint(windows * (2.0 * self._config.encoder.radius))
        seen_by_network = self._shown[:, :, : len(self._config.encoder.channels)]
        record.windows[step] = seen_by_network.reshape(*windows.shape[:2], -1)
        record.scalars[step], record.masks[step] = scalars, infos["action_masks"]
        record.active[step] = infos["is_active"]
        state = env.state()
        record.places[step] = np.concatenate([state["positions"], state["goals"]], axis=2)
        return state

    def _reward(self, record: Record, step: int, before: np.ndarray, own: np.ndarray, on_target: str) -> None:
        """Writes the rewards of a step into the record; `before` are the windows before the step."""
        weights = self._config.rewards
        rewards = np.full(own.shape, weights.step, dtype=np.float32)
        if on_target == "nothing":
            places = record.places[step + 1]
            rewards += weights.goal * (places[..., :2] == places[..., 2:]).all(axis=2)
        else:
            rewards += weights.goal * own
        for weight, channel in ((weights.progress, "cost_to_go"), (weights.path, "follower_path")):
            if weight:
                rewards += weight * self._at_next_cell(record, step, before, channel)
        if weights.approach:
            rewards += weights.approach * self._approaches(record, step, before)
        # A finished agent earns no reward, but gets that of its team.
        rewards *= record.active[step] & record.played[step][:, None]
        if weights.team:
            rewards = np.broadcast_to(rewards.mean(axis=1, keepdims=True), rewards.shape)
        record.rewards[step] = rewards

    def _approaches(self, record: Record, step: int, before: np.ndarray) -> np.ndarray:
        """Returns 1 for each agent that came nearer to its goal than ever before, else 0."""
        ahead = self._at_next_cell(record, step, before, "cost_to_go") - self._retreats
        self._retreats = np.maximum(-ahead, 0)
        has_new_goal = (record.places[step + 1, ..., 2:] != record.places[step, ..., 2:]).any(axis=2)
        self._retreats[has_new_goal] = 0
        return np.asarray(np.maximum(ahead, 0))

    def _goals_ahead(self, positions: np.ndarray, goals: np.ndarray) -> np.ndarray:
        """Returns the goals for a teacher: the cells ahead on Follower's paths, if the config asks for them."""
        if self._config.imitation.ahead == 0:
            return goals
        window = self._shown[:, :, self._encoder.channels.index("follower_path")]
        side = self._encoder.shape[1]
        offsets = cells_ahead(window.reshape(*window.shape[:2], side, side) > 0, self._config.imitation.ahead)
        has_path = offsets.any(axis=2, keepdims=True)
        return np.where(has_path, positions + offsets, goals)

    def _at_next_cell(self, record: Record, step: int, before: np.ndarray, channel: str) -> np.ndarray:
        """Returns, for each agent, the value that its new cell had in a channel before the step; 0 if the agent stayed.

        For `cost_to_go` the unit is one step towards the goal.
        """
        encoder = self._encoder
        _, side, _ = encoder.shape
        moves = record.places[step + 1, ..., :2].astype(np.int64) - record.places[step, ..., :2]
        cells = (moves[..., 0] + encoder.radius) * side + moves[..., 1] + encoder.radius
        window = before[:, :, encoder.channels.index(channel)].reshape(*moves.shape[:2], side * side)
        values = np.take_along_axis(window, cells[..., None], axis=2)[..., 0]
        has_moved = moves.any(axis=2)
        scale = 1.0 if channel == "cost_to_go" else 2.0 * encoder.radius
        return np.asarray(has_moved * values / scale, dtype=np.float32)


def parts(seen: Any) -> tuple[np.ndarray, np.ndarray]:
    """Returns the windows and the scalars of observations."""
    if isinstance(seen, dict):
        return seen["windows"], seen["scalars"]
    lanes, agents = seen.shape[:2]
    return seen, np.zeros((lanes, agents, 0), dtype=np.float32)


def _reward_channels(rewards: RewardConfig) -> list[str]:
    """Returns the channels that the parts of the reward read."""
    needs_costs = rewards.progress != 0 or rewards.approach != 0
    return ["cost_to_go"] * needs_costs + ["follower_path"] * (rewards.path != 0)


def _keep(metrics: dict[str, np.ndarray], found: dict[str, np.ndarray], ended: np.ndarray) -> None:
    """Adds the metrics of the episodes that ended."""
    for name, values in found.items():
        if not name.startswith("_"):
            kept = metrics.setdefault(name, np.full(len(values), np.nan))
            kept[ended] = values[ended]
