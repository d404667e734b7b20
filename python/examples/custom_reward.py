"""Rewards each step that brings an agent closer to its goal, and penalizes each step that leads away from it.

python custom_reward.py
"""

from collections.abc import Sequence
from typing import Any, Union

import numpy as np
from pogema_rs import GridConfig, Wrapper, pogema_v0
from pogema_rs.envs import Pogema

Infos = list[dict[str, Any]]


class DistanceReward(Wrapper):
    """Adds `scale` times the decrease of the Manhattan distance between an agent and its goal."""

    def __init__(self, env: Pogema, scale: float = 0.1) -> None:
        super().__init__(env)
        self.scale = scale

    def _distances(self) -> np.ndarray:
        places, goals = np.array(self.env.get_agents_xy()), np.array(self.env.get_targets_xy())
        distances: np.ndarray = np.abs(places - goals).sum(axis=1)
        return distances

    # Gymnasium's types describe one agent.

    def reset(  # type: ignore[override]
        self, **kwargs: Any
    ) -> tuple[list[np.ndarray], Infos]:
        """Resets the inner environment."""
        observations, infos = self.env.reset(**kwargs)
        self.before = self._distances()
        return observations, infos

    def step(  # type: ignore[override]
        self, action: Union[Sequence[int], np.ndarray]
    ) -> tuple[list[np.ndarray], list[float], list[bool], list[bool], Infos]:
        """Plays one step of the inner environment, and changes the rewards."""
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        now = self._distances()
        rewards = [reward + self.scale * int(decrease) for reward, decrease in zip(rewards, self.before - now)]
        self.before = now
        return observations, rewards, terminated, truncated, infos


def main() -> None:
    env = DistanceReward(pogema_v0(GridConfig(num_agents=3, seed=1)))
    env.reset()
    for step in range(5):
        _, rewards, *_ = env.step(env.unwrapped.sample_actions())
        print(f"step {step + 1}: rewards {', '.join(f'{reward:+.1f}' for reward in rewards)}")


if __name__ == "__main__":
    main()
