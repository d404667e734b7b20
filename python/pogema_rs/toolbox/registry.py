"""The registry of algorithms, environments, maps and episode runners that suites name."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Mapping
from typing import Any, Optional

from pogema_rs._never_called import reject_overrides
from pogema_rs.install import is_installed
from pogema_rs.toolbox._toolbox_maps import toolbox_maps
from pogema_rs.toolbox.algorithm_config import AlgoBase
from pogema_rs.toolbox.run_episode import run_episode

__all__ = ["ToolboxRegistry"]

_Make = Callable[..., Any]
_LOGGER = logging.getLogger("pogema_rs.toolbox")
# The methods of pogema-toolbox that are never called, with what a user does instead.
_NOT_CALLED = {"_ensure_logger": "override `setup_logger`", "_initialize_maps": "override `get_maps`"}
_FORMAT = "%(asctime)s | Toolbox %(levelname)s | %(message)s"


class _Calls(logging.Handler):
    """A handler that calls a function with each line."""

    def __init__(self, function: Callable[[str], Any]) -> None:
        super().__init__()
        self._function = function

    def emit(self, record: logging.LogRecord) -> None:
        self._function(self.format(record) + "\n")


def _handler(sink: Any) -> logging.Handler:
    if isinstance(sink, (str, os.PathLike)):
        return logging.FileHandler(sink)
    return logging.StreamHandler(sink) if hasattr(sink, "write") else _Calls(sink)


class ToolboxRegistry:
    """Algorithms, environments, maps and episode runners, keyed by their names in suites.

    Source: pogema-toolbox 0.1.1, `registry.py`, `ToolboxRegistry`
    """

    _maps: dict[str, Any] = {}
    # Whether `_maps` includes those of pogema-toolbox.
    _has_toolbox_maps = False
    _algorithms: dict[str, tuple[_Make, Optional[_Make], Optional[_Make]]] = {}
    _envs: dict[str, tuple[_Make, Optional[_Make]]] = {}
    _run_episode_funcs: dict[str, Callable[[Any, Any], dict[str, Any]]] = {"default": run_episode}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        reject_overrides(cls, _NOT_CALLED)

    @classmethod
    def setup_logger(cls, level: str = "INFO", sink: Any = None) -> None:
        """Sends messages at or above a level to a stream, a file, a function or a handler [default: stderr]."""
        handler = sink if isinstance(sink, logging.Handler) else _handler(sink or sys.stderr)
        handler.setFormatter(logging.Formatter(_FORMAT))
        _LOGGER.handlers = [handler]
        _LOGGER.propagate = False
        # pogema-toolbox uses loguru, which has more levels than `logging`.
        _LOGGER.setLevel({"TRACE": "DEBUG", "SUCCESS": "INFO"}.get(level, level))

    @classmethod
    def debug(cls, message: str) -> None:
        """Logs a debug message."""
        cls._log(logging.DEBUG, message)

    @classmethod
    def info(cls, message: str) -> None:
        """Logs a progress message."""
        cls._log(logging.INFO, message)

    @classmethod
    def success(cls, message: str) -> None:
        """Logs a success."""
        cls._log(logging.INFO, message)

    @classmethod
    def warning(cls, message: str) -> None:
        """Logs a warning."""
        cls._log(logging.WARNING, message)

    @classmethod
    def error(cls, message: str) -> None:
        """Logs an error."""
        cls._log(logging.ERROR, message)

    @classmethod
    def _log(cls, level: int, message: str) -> None:
        # If the program has not set up Python's logging, sets up the logger as pogema-toolbox does.
        if not _LOGGER.hasHandlers():
            cls.setup_logger()
        _LOGGER.log(level, message)

    @classmethod
    def get_state(cls) -> dict[str, Any]:
        """Returns everything registered, for another process."""
        return {
            "maps": cls.get_maps(),
            "algorithms": cls._algorithms,
            "envs": cls._envs,
            "run_episode": cls._run_episode_funcs,
        }

    @classmethod
    def recreate_from_state(cls, state: Mapping[str, Any]) -> None:
        """Replaces the registry with that of another process."""
        cls._maps, cls._has_toolbox_maps = dict(state.get("maps", {})), True
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
        """Registers an algorithm: a class with `act` and `reset_states`, settings, and an environment wrapper."""
        cls._warn_if_registered("algorithm", name, cls._algorithms)
        cls._algorithms[name] = make_func, config_make_func, preprocessing_make_func
        cls.debug(f"registered the algorithm {name}")

    @classmethod
    def create_algorithm(cls, algo_name: str, **kwargs: Any) -> Any:
        """Makes an algorithm from settings.

        Errors: KeyError for an unknown name; it lists the known names.
        """
        make, make_config, _ = cls._known("algorithm", algo_name, cls._algorithms)
        return make(cls.create_algorithm_config(algo_name, **kwargs)) if make_config else make()

    @classmethod
    def create_algorithm_config(cls, algo_name: str, **kwargs: Any) -> Any:
        """Makes the settings of an algorithm."""
        make_config = cls._known("algorithm", algo_name, cls._algorithms)[1]
        return (make_config or AlgoBase)(**kwargs)

    @classmethod
    def create_algorithm_preprocessing(cls, env_to_wrap: Any, algo_name: str, **kwargs: Any) -> Any:
        """Wraps an environment in the preprocessing of an algorithm."""
        _, make_config, preprocess = cls._known("algorithm", algo_name, cls._algorithms)
        if preprocess is None:
            raise KeyError(f"`{algo_name}` is registered without preprocessing, expected `preprocessing_make_func`")
        if make_config is None:
            return preprocess(env_to_wrap)
        return preprocess(env_to_wrap, cls.create_algorithm_config(algo_name, **kwargs))

    @classmethod
    def register_env(cls, name: str, make_func: _Make, config_make_func: Optional[_Make] = None) -> None:
        """Registers an environment and its settings."""
        cls._warn_if_registered("environment", name, cls._envs)
        cls._envs[name] = make_func, config_make_func
        cls.debug(f"registered the environment {name}")

    @classmethod
    def create_env(cls, env_name: str, **kwargs: Any) -> Any:
        """Makes an environment from settings.

        Errors: KeyError for an unknown name; it lists the known names.
        """
        if env_name == "Environment" and env_name not in cls._envs:
            from pogema_rs.toolbox.create_env import Environment, create_env_base

            return create_env_base(Environment(**kwargs))
        make, make_config = cls._known("environment", env_name, {"Environment": None, **cls._envs})
        return make(make_config(**kwargs)) if make_config else make()

    @classmethod
    def get_maps(cls) -> dict[str, Any]:
        """Returns the registered maps, by name.

        If pogema-toolbox is installed, they include its maps after `install_as_pogema(toolbox=True)`.
        """
        if is_installed("pogema_toolbox") and not cls._has_toolbox_maps:
            cls._maps, cls._has_toolbox_maps = {**toolbox_maps(), **cls._maps}, True
        return cls._maps

    @classmethod
    def register_maps(cls, maps: Mapping[str, Any]) -> None:
        """Registers maps, each as text, as a list of rows of text, or as a list of rows of 0 and 1."""
        known = cls.get_maps()
        for name, grid in maps.items():
            if not isinstance(grid, str) and all(isinstance(row, str) for row in grid):
                grid = "\n".join(grid)
            if known.get(name, grid) != grid:
                cls.warning(f"a second map named {name} replaces the first one")
            known[name] = grid
            cls.debug(f"registered the map {name}")

    @classmethod
    def register_run_func(cls, name: str, run_func: Callable[[Any, Any], dict[str, Any]]) -> None:
        """Registers an episode runner: a function from an environment and an algorithm to metrics."""
        cls._warn_if_registered("episode runner", name, cls._run_episode_funcs)
        cls._run_episode_funcs[name] = run_func
        cls.debug(f"registered the episode runner {name}")

    @classmethod
    def run_episode(cls, env: Any, algo: Any, run_func_name: str = "default") -> dict[str, Any]:
        """Runs an episode and returns its metrics."""
        return cls._known("episode runner", run_func_name, cls._run_episode_funcs)(env, algo)

    @classmethod
    def _warn_if_registered(cls, what: str, name: str, known: Mapping[str, Any]) -> None:
        if name in known:
            cls.warning(f"a second {what} named {name} replaces the first one")

    @staticmethod
    def _known(what: str, name: str, known: Mapping[str, Any]) -> Any:
        if name not in known:
            raise KeyError(f"no {what} is registered as `{name}`, expected one of {sorted(known)}")
        return known[name]
