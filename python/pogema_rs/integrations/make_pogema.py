"""Factories of environments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Optional, Union, cast

from pogema_rs import _engine
from pogema_rs._forward import forwarded
from pogema_rs._types import Observation
from pogema_rs.envs import Pogema, _make_pogema
from pogema_rs.errors import AutoResetError, UnknownIntegrationError
from pogema_rs.grid_config import GridConfig
from pogema_rs.semantics import Semantics
from pogema_rs.wrappers.forwarding import Wrapper

__all__ = ["SingleAgentWrapper", "make_pogema", "make_single_agent_gym", "pogema_v0"]

# POGEMA's module offers these names too.
__getattr__, __dir__ = forwarded(
    __name__,
    {
        "AutoResetWrapper": "integrations.sample_factory",
        "IsMultiAgentWrapper": "integrations.sample_factory",
        "MetricsForwardingWrapper": "integrations.sample_factory",
        "PyMarlPogema": "integrations.pymarl",
        "parallel_env": "integrations.pettingzoo",
    },
)


class SingleAgentWrapper(Wrapper):
    """An environment with the interface of agent 0; the other agents take random actions from the action space.

    With the semantics "2.0", `reset(seed=...)` also seeds the action space.
    """

    def reset(  # type: ignore[override]
        self, seed: Optional[int] = None, return_info: bool = True, options: Optional[dict] = None
    ) -> Any:
        """Begins an episode and returns the observation and info of agent 0."""
        environment = self.unwrapped
        if seed is not None and environment.semantics.reset_takes_seed:
            environment.action_space.seed(seed)
        observations, infos = self.env.reset(seed=seed, options=options)
        return (observations[0], infos[0]) if return_info else observations[0]

    def step(  # type: ignore[override]
        self, action: int
    ) -> Any:
        """Plays one step and returns the results of agent 0."""
        others = [int(self.env.action_space.sample()) for _ in range(self.get_num_agents() - 1)]
        return tuple(values[0] for values in self.env.step([action, *others]))


def read_config(grid_config: Union[GridConfig, Mapping[str, Any], None]) -> GridConfig:
    """Returns a config as a `GridConfig`; it may be given as a mapping of fields [default: `GridConfig()`]."""
    if grid_config is None:
        return GridConfig()
    return GridConfig(**grid_config) if isinstance(grid_config, Mapping) else grid_config


def make_single_agent_gym(
    grid_config: Union[GridConfig, Mapping[str, Any], None] = None,
    semantics: Union[str, Semantics] = Semantics.RELEASED,
    **_: Any,
) -> SingleAgentWrapper:
    """Makes an environment for a single agent, like `gymnasium.make("Pogema-v0")`."""
    return SingleAgentWrapper(_make_pogema(read_config(grid_config), semantics))


def make_pogema(
    grid_config: Union[GridConfig, Mapping[str, Any], None] = None,
    *args: Any,
    semantics: Union[str, Semantics] = Semantics.RELEASED,
    **kwargs: Any,
) -> Pogema[Observation]:
    """Makes an environment from a config, for the framework that its `integration` names.

    Type checkers always see a `Pogema`, which is the result for configs without `integration`. Its observations are
    arrays unless you annotate the variable, for example with `Pogema[dict[str, Any]]` for `POMAPF`. To make a typed
    environment for PettingZoo or PyMARL, call `parallel_env` or `PyMarlPogema`.

    `semantics` is "1.4.0" [default] or "2.0". With "2.0", no agent vanishes from the windows, `reset(seed=...)` chooses
    the episode, each reset clears the metrics, and `set_elapsed_steps` does not need `persistent`.

    Errors: `KeyError` for `auto_reset` without Sample Factory, and for an unknown integration; `NotImplementedError`
    for `rllib`, as in POGEMA.

    Source: POGEMA 1.4.0, `integrations/make_pogema.py`
    """
    config = read_config(grid_config)
    name = config.integration
    if config.auto_reset and name != "SampleFactory":
        raise AutoResetError(f"auto_reset is set with the integration {name}, expected `SampleFactory`")
    if name is None:
        return _make_pogema(config, semantics)
    if name == "SampleFactory":
        from pogema_rs.integrations.sample_factory import (
            AutoResetWrapper,
            IsMultiAgentWrapper,
            MetricsForwardingWrapper,
        )

        env = IsMultiAgentWrapper(MetricsForwardingWrapper(_make_pogema(config, semantics)))
        return cast(Any, env if config.auto_reset is False else AutoResetWrapper(env))
    if name == "gymnasium":
        return cast(Any, make_single_agent_gym(config, semantics))
    if name == "PyMARL":
        from pogema_rs.integrations.pymarl import PyMarlPogema

        kwargs["semantics"] = semantics
        return cast(Any, PyMarlPogema(config, *args, **kwargs))
    if name == "PettingZoo":
        from pogema_rs.integrations.pettingzoo import parallel_env

        return cast(Any, parallel_env(config, semantics))
    if name == "rllib":
        raise NotImplementedError("integration is `rllib`, expected `PettingZoo`, which RLlib can wrap")
    raise UnknownIntegrationError(f"integration is {name!r}, expected one of {', '.join(_engine.WORDS['integration'])}")


pogema_v0 = make_pogema
