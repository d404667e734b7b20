"""Evaluates policies: prints mean and standard deviation of their metrics over seeds.

    python evaluate_policy.py --seeds 100
"""

import argparse
from collections import defaultdict

import numpy as np
from pogema_rs import BatchAStarAgent, GridConfig, pogema_v0


class Greedy:
    """A greedy policy; any object with `act` and `reset_states` is a policy."""

    MOVES = ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))

    def reset_states(self):
        """Forgets the last episode; this policy has no state."""

    def act(self, observations):
        """Returns for each agent the move that brings it closest to its goal."""
        return [self._act(seen) for seen in observations]

    def _act(self, seen):
        centre = seen["obstacles"].shape[0] // 2
        toward = np.subtract(seen["target_xy"], seen["xy"])

        def distance(action):
            row, col = self.MOVES[action]
            if seen["obstacles"][centre + row, centre + col]:
                return np.inf
            return np.abs(toward - (row, col)).sum()

        return min(range(len(self.MOVES)), key=distance)


def evaluate(policy, config, seeds):
    """Returns the metrics of one episode per seed, as lists by name."""
    metrics = defaultdict(list)
    env = pogema_v0(GridConfig(**config), semantics="2.0")
    for seed in seeds:
        policy.reset_states()
        observations, infos = env.reset(seed=seed)
        while "metrics" not in infos[0]:
            observations, _, _, _, infos = env.step(policy.act(observations))
        for name, value in infos[0]["metrics"].items():
            metrics[name].append(value)
    return metrics


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100, help="number of episodes")
    arguments = parser.parse_args()
    config = {
        "size": 16,
        "num_agents": 16,
        "density": 0.2,
        "on_target": "nothing",
        "collision_system": "soft",
        "observation_type": "POMAPF",
        "max_episode_steps": 128,
    }
    for name, policy in {"greedy": Greedy(), "A*": BatchAStarAgent()}.items():
        metrics = evaluate(policy, config, range(arguments.seeds))
        shown = [f"{metric} {np.mean(values):.3f} ± {np.std(values):.3f}" for metric, values in metrics.items()]
        print(f"{name:8}", "  ".join(shown))


if __name__ == "__main__":
    main()
