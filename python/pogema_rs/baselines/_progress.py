"""The lines that a training run prints."""

from __future__ import annotations

import time

from pogema_rs.baselines._curve import Curve


class Progress:
    """Prints a line after each validation: the time used and left, the agent steps, the speed and the score."""

    def __init__(self, method: str, share: float) -> None:
        self._method, self._first, self._began = method, share, time.perf_counter()

    def tell(self, share: float, seconds: float, agent_steps: int, curve: Curve) -> None:
        """Prints the line for the last row of a curve; `share` is the used share of the budget."""
        row = curve.rows[-1]
        spent, done = time.perf_counter() - self._began, share - self._first
        left = spent / done * max(0.0, 1 - share) if done > 0 else float("nan")
        speed = agent_steps / max(seconds, 1e-9)
        print(
            f"{self._method}: {seconds / 60:6.1f} min, {min(share, 1):4.0%}, {left / 60:5.1f} min left, "
            f"{agent_steps:>11,} agent steps, {speed:8,.0f}/s, {curve.score} {row[curve.score]:.3f}, "
            f"best {curve.best:.3f}",
            flush=True,
        )
