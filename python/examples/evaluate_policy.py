"""Evaluates policies: prints the mean and the standard deviation of their metrics over seeds.

python evaluate_policy.py --seeds 100
"""

import argparse
from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np
from pogema_rs import BatchAStarAgent, GridConfig, pogema_v0
from pogema_rs.envs import Pogema

Seen = dict[str, Any]


class Policy(Protocol):
    """The methods that an evaluation needs from a policy."""

    def reset_states(self) -> None:
        """Forgets the last episode."""

    def act(self, observations: list[Seen]) -> Sequence[int]:
        """Returns an action for each agent."""


class Greedy:
    """A greedy policy; any object with `act` and `reset_states` is a policy."""

    MOVES = ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))

    def reset_states(self) -> None:
        """Forgets the last episode; this policy has no state."""

    def act(self, observations: list[Seen]) -> list[int]:
        """Returns for each agent the move that brings it closest to its goal."""
        return [self._act(seen) for seen in observations]

    def _act(self, seen: Seen) -> int:
        centre = seen["obstacles"].shape[0] // 2
        toward = np.subtract(seen["target_xy"], seen["xy"])

        def distance(action: int) -> float:
            row, col = self.MOVES[action]
            if seen["obstacles"][centre + row, centre + col]:
                return float("inf")
            return float(np.abs(toward - (row, col)).sum())

        return min(range(len(self.MOVES)), key=distance)


def evaluate(policy: Policy, config: dict[str, Any], seeds: Iterable[int]) -> dict[str, list[float]]:
    """Returns the metrics of one episode per seed, as lists by name."""
    metrics: dict[str, list[float]] = defaultdict(list)
    env: Pogema[Seen] = pogema_v0(GridConfig(**config), semantics="2.0")
    for seed in seeds:
        policy.reset_states()
        observations, infos = env.reset(seed=seed)
        while "metrics" not in infos[0]:
            observations, _, _, _, infos = env.step(policy.act(observations))
        for name, value in infos[0]["metrics"].items():
            metrics[name].append(value)
    return metrics


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100, help="number of episodes [default: 100]")
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
    policies: dict[str, Policy] = {"greedy": Greedy(), "A*": BatchAStarAgent()}
    for name, policy in policies.items():
        metrics = evaluate(policy, config, range(arguments.seeds))
        shown = [f"{metric} {np.mean(values):.3f} ± {np.std(values):.3f}" for metric, values in metrics.items()]
        print(f"{name:8}", "  ".join(shown))


if __name__ == "__main__":
    main()
