"""The settings that all algorithms of a suite share."""

from __future__ import annotations

from typing import Literal, Optional

from pogema_rs._models import Model

__all__ = ["AlgoBase"]


class AlgoBase(Model):
    """The settings of an algorithm; extend this class to add settings.

    Source: pogema-toolbox 0.1.1, `algorithm_config.py`, `AlgoBase`
    """

    name: Optional[str] = None
    num_process: int = 3
    device: str = "cuda"
    parallel_backend: Literal["dask", "sequential", "balanced_dask", "balanced_multiprocessing", "multiprocessing"] = (
        "balanced_multiprocessing"
    )
    run_episode_func: str = "default"
    seed: Optional[int] = 0
    preprocessing: Optional[str] = None
