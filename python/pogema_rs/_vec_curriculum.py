"""The configs of a `VecEnv` that a function chooses at the ends of episodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

if TYPE_CHECKING:
    from pogema_rs._engine import Batch

# A function of the index of an environment and the metrics of its last episode. Returns the config of the following
# episodes, or `None` to keep the current one.
Curriculum = Callable[[int, dict[str, float]], Any]


class NextEpisodes:
    """Chooses the configs of the next episodes. With `begins_ended`, also begins them, because the batch does not.

    `set_configs` changes the configs of a list of environments.
    """

    def __init__(
        self,
        batch: Batch,
        curriculum: Curriculum,
        begins_ended: bool,
        set_configs: Callable[[list[Any], list[int]], None],
    ) -> None:
        if not callable(curriculum):
            raise TypeError(f"curriculum has type {type(curriculum).__name__}, expected a function")
        self._batch, self._curriculum, self._set_configs = batch, curriculum, set_configs
        self._begins_ended = begins_ended
        # The environments that have no next episode, and the reason.
        self._stuck: list[int] = []
        self._reason: Optional[Exception] = None

    def follow(self, ended: list[int], state: Any) -> Optional[Exception]:
        """Applies the curriculum after a step that ended episodes; `state` holds the arrays of the step.

        Returns the error that the step raises after it is complete. An error of the curriculum changes no config.
        """
        failure: Optional[Exception] = None
        try:
            changed = {}
            for env, metrics in zip(ended, self._batch.metrics(ended)):
                config = self._curriculum(env, metrics)
                if config is not None:
                    changed[env] = config
            self._set_configs(list(changed.values()), list(changed))
        except Exception as error:  # noqa: BLE001 - raised later
            failure = error
        finally:
            # Even if Ctrl-C interrupts the function, the environments continue.
            if self._begins_ended:
                failure = self._begin(ended, state) or failure
        return failure

    def check(self) -> None:
        """Raises the reason if an environment has no next episode."""
        if self._stuck and self._reason is not None:
            raise self._reason

    def follow_reset(self, chosen: Optional[list[bool]]) -> None:
        """Continues after a reset of the chosen environments [default: all]."""
        self._stuck = [] if chosen is None else [env for env in self._stuck if not chosen[env]]

    def _begin(self, ended: list[int], state: Any) -> Optional[Exception]:
        """Begins the next episodes of some environments, or returns the error that prevents them."""
        chosen = np.zeros(len(state[1]), dtype=np.bool_)
        chosen[ended] = True
        try:
            self._batch.reset(state, chosen.tolist())
        except Exception as error:  # noqa: BLE001 - the next call raises it
            self._stuck, self._reason = ended, error
            return error
        return None
