"""Adds a reward for each step that brings an agent closer to its goal.

    python custom_reward.py
"""

import gymnasium
import numpy as np
from pogema_rs import GridConfig, pogema_v0


class DistanceReward(gymnasium.Wrapper):
    """Adds `scale` times the decrease of the Manhattan distance between an agent and its goal."""

    def __init__(self, env, scale=0.1):
        super().__init__(env)
        self.scale = scale

    def _distances(self):
        grid = self.env.unwrapped.grid
        return np.abs(np.subtract(grid.positions_xy, grid.finishes_xy)).sum(axis=1)

    def reset(self, **kwargs):
        """Resets the inner environment."""
        result = self.env.reset(**kwargs)
        self.before = self._distances()
        return result

    def step(self, action):
        """Plays one step of the inner environment, and changes the rewards."""
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        now = self._distances()
        rewards = [reward + self.scale * int(decrease) for reward, decrease in zip(rewards, self.before - now)]
        self.before = now
        return observations, rewards, terminated, truncated, infos


def main():
    env = DistanceReward(pogema_v0(GridConfig(num_agents=3, seed=1)))
    env.reset()
    for step in range(5):
        _, rewards, *_ = env.step(env.unwrapped.sample_actions())
        print(f"step {step + 1}: rewards {', '.join(f'{reward:+.1f}' for reward in rewards)}")


if __name__ == "__main__":
    main()
