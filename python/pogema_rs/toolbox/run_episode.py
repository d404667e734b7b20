"""The default episode runner."""

from __future__ import annotations

from typing import Any

from pogema_rs.toolbox.results_holder import ResultsHolder

__all__ = ["run_episode"]


def run_episode(env: Any, algo: Any) -> dict[str, Any]:
    """Plays an episode with the seed of the environment's config, and returns its metrics by name.

    Source: pogema-toolbox 0.1.1, `run_episode.py`, `run_episode`
    """
    algo.reset_states()
    results = ResultsHolder()
    observations, _ = env.reset(seed=env.unwrapped.grid_config.seed)
    while True:
        observations, _, terminated, truncated, infos = env.step(algo.act(observations))
        results.after_step(infos)
        if all(terminated) or all(truncated):
            return results.get_final()
