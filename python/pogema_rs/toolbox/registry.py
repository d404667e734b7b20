"""What suites name: algorithms, environments, maps, and ways to run an episode."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Mapping
from typing import Any, Optional

from pogema_rs.toolbox.algorithm_config import AlgoBase
from pogema_rs.toolbox.run_episode import run_episode

__all__ = ["ToolboxRegistry"]

_Make = Callable[..., Any]
_LOGGER = logging.getLogger("pogema_rs.toolbox")
_FORMAT = "%(asctime)s | Toolbox %(levelname)s | %(message)s"


class ToolboxRegistry:
    """Algorithms, environments, maps and ways to run an episode, by the names that suites have for them.

    Source: pogema-toolbox 0.1.1, `registry.py`, `ToolboxRegistry`
    """

    _maps: dict[str, Any] = {}
    _algorithms: dict[str, tuple[_Make, Optional[_Make], Optional[_Make]]] = {}
    _envs: dict[str, tuple[_Make, Optional[_Make]]] = {}
    _run_episode_funcs: dict[str, Callable[[Any, Any], dict[str, Any]]] = {"default": run_episode}

    @classmethod
    def setup_logger(cls, level: str = "INFO", sink: Any = None) -> None:
        """Lets messages from a level on go to a stream, or to a file."""
        is_file = isinstance(sink, str) or hasattr(sink, "__fspath__")
        handler = logging.FileHandler(sink) if is_file else logging.StreamHandler(sink or sys.stderr)
        handler.setFormatter(logging.Formatter(_FORMAT))
        _LOGGER.handlers = [handler]
        _LOGGER.propagate = False
        _LOGGER.setLevel(level if level != "SUCCESS" else "INFO")

    @classmethod
    def debug(cls, message: str) -> None:
        """Tells what only those want to know who look for a fault."""
        _LOGGER.debug(message)

    @classmethod
    def info(cls, message: str) -> None:
        """Tells how it goes."""
        _LOGGER.info(message)

    @classmethod
    def success(cls, message: str) -> None:
        """Tells that something went well."""
        _LOGGER.info(message)

    @classmethod
    def warning(cls, message: str) -> None:
        """Tells of something that may be wrong."""
        _LOGGER.warning(message)

    @classmethod
    def error(cls, message: str) -> None:
        """Tells of something that is wrong."""
        _LOGGER.error(message)

    @classmethod
    def get_state(cls) -> dict[str, Any]:
        """All that is registered, for another process."""
        return {
            "maps": cls._maps,
            "algorithms": cls._algorithms,
            "envs": cls._envs,
            "run_episode": cls._run_episode_funcs,
        }

    @classmethod
    def recreate_from_state(cls, state: Mapping[str, Any]) -> None:
        """Takes over what is registered in another process."""
        cls._maps = dict(state.get("maps", {}))
        cls._algorithms = dict(state.get("algorithms", {}))
        cls._envs = dict(state.get("envs", {}))
        cls._run_episode_funcs = dict(state.get("run_episode", {"default": run_episode}))

    @classmethod
    def register_algorithm(
        cls,
        name: str,
        make_func: _Make,
        config_make_func: Optional[_Make] = None,
        preprocessing_make_func: Optional[_Make] = None,
    ) -> None:
        """Registers an algorithm: a class with `act` and `reset_states`, its settings, and a wrapper for environments."""
        cls._told_twice("algorithm", name, cls._algorithms)
        cls._algorithms[name] = make_func, config_make_func, preprocessing_make_func

    @classmethod
    def create_algorithm(cls, algo_name: str, **kwargs: Any) -> Any:
        """An algorithm of some settings.

        Errors: KeyError with the names that there are.
        """
        make, make_config, _ = cls._known("algorithm", algo_name, cls._algorithms)
        return make(cls.create_algorithm_config(algo_name, **kwargs)) if make_config else make()

    @classmethod
    def create_algorithm_config(cls, algo_name: str, **kwargs: Any) -> Any:
        """The settings of an algorithm."""
        make_config = cls._known("algorithm", algo_name, cls._algorithms)[1]
        return (make_config or AlgoBase)(**kwargs)

    @classmethod
    def create_algorithm_preprocessing(cls, env_to_wrap: Any, algo_name: str, **kwargs: Any) -> Any:
        """The environment as an algorithm wants it."""
        _, make_config, preprocess = cls._known("algorithm", algo_name, cls._algorithms)
        if preprocess is None:
            raise KeyError(f"`{algo_name}` is registered without a preprocessing")
        if make_config is None:
            return preprocess(env_to_wrap)
        return preprocess(env_to_wrap, cls.create_algorithm_config(algo_name, **kwargs))

    @classmethod
    def register_env(cls, name: str, make_func: _Make, config_make_func: Optional[_Make] = None) -> None:
        """Registers an environment and its settings."""
        cls._told_twice("environment", name, cls._envs)
        cls._envs[name] = make_func, config_make_func

    @classmethod
    def create_env(cls, env_name: str, **kwargs: Any) -> Any:
        """An environment of some settings.

        Errors: KeyError with the names that there are.
        """
        if env_name == "Environment" and env_name not in cls._envs:
            from pogema_rs.toolbox.create_env import Environment, create_env_base

            return create_env_base(Environment(**kwargs))
        make, make_config = cls._known("environment", env_name, cls._envs)
        return make(make_config(**kwargs)) if make_config else make()

    @classmethod
    def get_maps(cls) -> dict[str, Any]:
        """The registered maps, by name."""
        return cls._maps

    @classmethod
    def register_maps(cls, maps: Mapping[str, Any]) -> None:
        """Registers maps: texts, or lists of rows."""
        for name, grid in maps.items():
            if cls._maps.get(name, grid) != grid:
                cls.warning(f"a second map named {name} takes the place of the first")
            cls._maps[name] = grid

    @classmethod
    def register_run_func(cls, name: str, run_func: Callable[[Any, Any], dict[str, Any]]) -> None:
        """Registers a way to run an episode: from an environment and an algorithm to metrics."""
        cls._told_twice("way to run an episode", name, cls._run_episode_funcs)
        cls._run_episode_funcs[name] = run_func

    @classmethod
    def run_episode(cls, env: Any, algo: Any, run_func_name: str = "default") -> dict[str, Any]:
        """The metrics of an episode."""
        return cls._known("way to run an episode", run_func_name, cls._run_episode_funcs)(env, algo)

    @classmethod
    def _told_twice(cls, what: str, name: str, known: Mapping[str, Any]) -> None:
        if name in known:
            cls.warning(f"a second {what} named {name} takes the place of the first")

    @staticmethod
    def _known(what: str, name: str, known: Mapping[str, Any]) -> Any:
        if name not in known:
            raise KeyError(f"no {what} is registered as `{name}`, expected one of {sorted(known)}")
        return known[name]
