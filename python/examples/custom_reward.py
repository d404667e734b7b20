"""Gives agents another reward: one for each step that brings them nearer to their goals.

    python custom_reward.py
"""

import gymnasium
import numpy as np
from pogema_rs import GridConfig, pogema_v0


class NearerIsBetter(gymnasium.Wrapper):
    """Adds `scale` times the steps that an agent came nearer to its goal, as the crow flies along the grid."""

    def __init__(self, env, scale=0.1):
        super().__init__(env)
        self.scale = scale

    def _distances(self):
        grid = self.env.unwrapped.grid
        return np.abs(np.subtract(grid.positions_xy, grid.finishes_xy)).sum(axis=1)

    def reset(self, **kwargs):
        """As the environment inside."""
        result = self.env.reset(**kwargs)
        self.before = self._distances()
        return result

    def step(self, action):
        """As the environment inside, but for the rewards."""
        observations, rewards, terminated, truncated, infos = self.env.step(action)
        now = self._distances()
        rewards = [reward + self.scale * int(nearer) for reward, nearer in zip(rewards, self.before - now)]
        self.before = now
        return observations, rewards, terminated, truncated, infos


def main():
    env = NearerIsBetter(pogema_v0(GridConfig(num_agents=3, seed=1)))
    env.reset()
    for step in range(5):
        _, rewards, *_ = env.step(env.unwrapped.sample_actions())
        print(f"step {step + 1}: rewards {', '.join(f'{reward:+.1f}' for reward in rewards)}")


if __name__ == "__main__":
    main()
