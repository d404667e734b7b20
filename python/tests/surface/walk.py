"""Prints the public surface of POGEMA and pogema-toolbox, or of pogema_rs under their names: walk.py PACKAGE FOLDER...

PACKAGE is `pogema` or `pogema_rs`, and the folders hold pogema-toolbox and what it imports.

The result is JSON. It maps a path, such as `pogema.grid.Grid.move`, to its kind. The kind of a function is a list of
parameters. A path that begins with `<` is an attribute of an instance, for example of an environment before its first
reset.
"""

from __future__ import annotations

import importlib
import inspect
import json
import pkgutil
import sys
import types
import warnings
from collections.abc import Iterator
from typing import Any

PACKAGES = ("pogema", "pogema_toolbox")
OURS = "pogema_rs"
# Our packages and theirs; the first one that fits counts.
NAMES = {"pogema_rs.toolbox": "pogema_toolbox", "pogema_rs": "pogema"}
MODES = ("finish", "nothing", "restart")

# Private methods that users override, and the private factory that they call.
HOOKS = (
    *("_obs", "_get_agents_obs", "_pomapf_obs", "_get_infos", "_initialize_grid", "_revert_action"),
    *("_generate_new_target", "_compute_stats", "_make_pogema"),
)


def main(package: str, *folders: str) -> None:
    """Walks the modules and the instances of a package."""
    sys.path += folders
    warnings.simplefilter("ignore")
    if package == OURS:
        importlib.import_module(package).install_as_pogema(toolbox=True)
    found = [entry for name in PACKAGES for entry in of_package(name)]
    json.dump(dict(sorted([*found, *of_instances()])), sys.stdout, indent=1)


def of_package(package: str) -> Iterator[tuple[str, Any]]:
    """Yields all names of all modules of a package."""
    root = importlib.import_module(package)
    names = [package, *(found.name for found in pkgutil.walk_packages(root.__path__, f"{package}."))]
    for name in names:
        try:
            module = importlib.import_module(name)
        except ImportError:  # an adapter whose framework is not installed
            continue
        yield name, "module"
        for attribute in public(dir(module)):
            value = getattr(module, attribute)
            if is_own(value):
                yield from of_value(f"{name}.{attribute}", value, is_at_home(value, name))


def is_own(value: Any) -> bool:
    """Returns whether a value belongs to the packages: their classes and functions, and all plain data."""
    if isinstance(value, (type, types.FunctionType)):
        return value.__module__.partition(".")[0] in (*PACKAGES, OURS)
    return isinstance(value, (str, int, float, tuple, dict, list))


def is_at_home(value: Any, module: str) -> bool:
    """Returns whether a module defines a class or function, and does not only import it."""
    home = str(getattr(value, "__module__", module))
    theirs = next((home.replace(our, name, 1) for our, name in NAMES.items() if home.startswith(our)), home)
    # Our package may define in a private module what POGEMA's public module offers.
    return theirs == module or home.rpartition(".")[2].startswith("_")


def public(names: list[str]) -> list[str]:
    """Returns the public names and the hooks."""
    return [name for name in names if not name.startswith("_") or name in HOOKS]


def of_value(path: str, value: Any, is_home: bool) -> Iterator[tuple[str, Any]]:
    """Yields the path and kind of a value.

    If `is_home` is true, also yields the members of a class, and the kind of a function is its parameters.
    """
    if isinstance(value, type):
        yield path, "class"
        if is_home:
            yield f"{path}()", parameters(value)
            for name in sorted({name for base in own_bases(value) for name in public(list(vars(base)))}):
                yield f"{path}.{name}", of_member(inspect.getattr_static(value, name))
    elif callable(value):
        yield path, parameters(value) if is_home else "function"
    else:
        yield path, kind(value)


def own_bases(value: type) -> list[type]:
    """Returns a class and its bases that belong to the packages."""
    return [base for base in value.__mro__ if is_own(base)]


def of_member(member: Any) -> Any:
    """Returns the parameters of a method, or the kind of another member."""
    function = inspect.unwrap(getattr(member, "__func__", member))
    if not callable(function):
        return kind(function)
    # A class method is called without its class.
    return parameters(function)[isinstance(member, classmethod) :]


def parameters(function: Any) -> list:
    """Returns the name, kind and default of each parameter."""
    try:
        found = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return []
    return [[one.name, one.kind.name, default(one)] for one in found]


def default(parameter: inspect.Parameter) -> Any:
    """Returns a default in a form that both packages share: plain data as text, any other object as `object`."""
    value = parameter.default
    if value is inspect.Parameter.empty:
        return None
    return repr(value) if isinstance(value, (str, int, float, tuple, list, type(None))) else "object"


def kind(value: Any) -> str:
    """Returns the kind of a value, the same for values that are used in the same way."""
    if isinstance(value, property):
        return "attribute"
    for name, types_ in (("flag", bool), ("number", (int, float)), ("text", str), ("list", list), ("dict", dict)):
        if isinstance(value, types_):
            return name
    return "none" if value is None else type(value).__name__


def of_instances() -> Iterator[tuple[str, Any]]:
    """Yields the attributes of instances, with the kinds that users see."""
    for label, value in instances():
        for name in sorted(attributes(value)):
            try:
                found = getattr(value, name)
            except AttributeError:
                continue
            yield f"<{label}>.{name}", "method" if callable(found) else kind(found)


def attributes(value: Any) -> set[str]:
    """Returns the names of an instance and of everything that it wraps, without those of other packages."""
    names = set(public(list(getattr(value, "__dict__", {}))))
    for base in own_bases(type(value)):
        names |= set(public(list(vars(base))))
    return names | (attributes(value.__dict__["env"]) if "env" in names else set())


def instances() -> Iterator[tuple[str, Any]]:
    """Yields labelled instances."""
    pogema = importlib.import_module(PACKAGES[0])
    envs, wrappers = importlib.import_module("pogema.envs"), importlib.import_module("pogema.wrappers.metrics")
    for on_target in MODES:
        config = pogema.GridConfig(num_agents=2, size=6, seed=1, density=0.1, on_target=on_target)
        env = pogema.pogema_v0(config)
        yield f"env {on_target} before reset", env
        env.reset()
        yield f"env {on_target}", env
        yield f"env.grid {on_target}", env.grid
        raw = {"finish": envs.Pogema, "nothing": envs.PogemaCoopFinish, "restart": envs.PogemaLifeLong}[on_target]
        yield f"raw env {on_target}", raw(config)
    fields = {"num_agents": 2, "size": 6, "seed": 1, "density": 0.1, "observation_type": "POMAPF"}
    kept = pogema.pogema_v0(pogema.GridConfig(persistent=True, **fields))
    kept.reset()
    yield "persistent env", kept
    yield "history", kept.get_history()[0][0]
    monitor = pogema.AnimationMonitor(pogema.pogema_v0(pogema.GridConfig(**fields)))
    monitor.reset()
    yield "monitor", monitor
    for name in ("AgentsDensityWrapper", "RuntimeMetricWrapper"):
        env = getattr(wrappers, name)(pogema.pogema_v0(pogema.GridConfig(**fields)))
        env.reset()
        yield name, env
    yield "config", pogema.GridConfig(**fields)
    yield "AnimationConfig", pogema.AnimationConfig()
    yield "AStarAgent", pogema.AStarAgent()
    yield "BatchAStarAgent", pogema.BatchAStarAgent()
    yield from of_toolbox(fields)
    yield "registered grid", importlib.import_module("pogema.grid_registry").RegisteredGrid("walked", "a.\n.A")
    yield "actions sampler", envs.ActionsSampler(5)
    for integration in ("SampleFactory", "PyMARL", "gymnasium", "PettingZoo"):
        made = pogema.pogema_v0(pogema.GridConfig(num_agents=2, size=6, seed=1, integration=integration))
        made.reset()
        yield integration, made


def of_toolbox(fields: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yields labelled instances of pogema-toolbox."""
    classes = {
        "create_env": ("Environment",),
        "algorithm_config": ("AlgoBase",),
        "results_holder": ("ResultsHolder",),
        "views.view_utils": ("View",),
        "views.view_tabular": ("TabularView", "Aggregator"),
        "views.view_plot": ("PlotView",),
        "views.view_multi_plot": ("MultiPlotView",),
        "generators.maze_generator": ("MazeRangeSettings", "MazeGenerator"),
        "generators.random_generator": ("MapRangeSettings",),
        "generators.warehouse_generator": ("WarehouseConfig",),
    }
    for module, names in classes.items():
        for name in names:
            yield name, getattr(importlib.import_module(f"pogema_toolbox.{module}"), name)()
    create_env = importlib.import_module("pogema_toolbox.create_env")
    env = create_env.create_env_base(create_env.Environment(**fields))
    env.reset()
    yield "env of a suite", env


if __name__ == "__main__":
    main(*sys.argv[1:])
