"""Prints which overridden methods a package calls: overrides.py PACKAGE FOLDER... < JSON

PACKAGE is `pogema`, or `pogema_rs`, which is then installed as `pogema`. For each method of each class with a scenario,
the script overrides the method in a subclass and plays the scenario. The result maps `module.Class.method` to `called`,
`not called`, `no such class` or an error. In a run with `pogema`, it also maps each class without a scenario to
`no scenario`. If standard input holds the result of such a run, the script overrides the methods in that result.
Otherwise it overrides those that the package defines.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import io
import itertools
import json
import logging
import os
import pkgutil
import sys
import tempfile
import types
import warnings
from collections.abc import Callable
from typing import Any

FIELDS = {"num_agents": 2, "size": 6, "seed": 1, "density": 0.1, "max_episode_steps": 4, "obs_radius": 2}
# For names that must be new.
numbers = itertools.count()
OWN = ("pogema", "pogema_toolbox", "pogema_rs")


def config(**fields: Any) -> Any:
    return importlib.import_module("pogema").GridConfig(**{**FIELDS, **fields})


def made(**fields: Any) -> Any:
    return importlib.import_module("pogema").pogema_v0(config(**fields))


def play(env: Any) -> Any:
    """Plays an episode, and a step after it."""
    env.reset(seed=1)
    for action in (1, 2, 3, 4, 0):
        last = env.step([action, 0])
    return last


def play_env(kind: type, **fields: Any) -> None:
    for observation in ("default", "POMAPF", "MAPF"):
        env = kind(config(observation_type=observation, **fields))
        play(env)
        env.sample_actions()
        env.get_num_agents()
        env.get_agents_xy_relative()


def build_grid(kind: type) -> None:
    grid = kind(grid_config=config())
    grid.get_obstacles()
    grid.get_agents_xy(ignore_borders=True)
    grid.get_targets_xy(ignore_borders=True)
    grid.get_state(as_dict=True)
    grid.get_obstacles_for_agent(0)
    grid.get_positions(0)
    grid.get_square_target(0)
    grid.get_target(0)
    grid.render()


def build_config(kind: type) -> None:
    kind(**FIELDS)
    kind(map="a.A\n.#.", seed=1)
    kind(map=[[0, 1], [0, 0]], agents_xy=[[0, 0]], targets_xy=[[1, 1]])
    kind(agents_xy=[[0, 0]], targets_xy=[[1, 1]], size=4)
    kind(on_target="restart", targets_xy=[[[1, 1], [0, 0]]], agents_xy=[[0, 0]], size=4)
    kind(possible_agents_xy=[[0, 0]], possible_targets_xy=[[1, 1]], size=4, num_agents=1).update_config(seed=2)


def persist(kind: type) -> None:
    env = kind(made(persistent=True))
    play(env)
    env.step_back()
    env.get_full_history()
    env.decompress_history(env.get_history())


def monitor(kind: type) -> None:
    settings = importlib.import_module("pogema").AnimationConfig(directory="films/", save_every_idx_episode=1)
    env = kind(made(), animation_config=settings)
    play(env)
    env.save_animation("film.svg")


def draw(kind: type) -> None:
    animations = importlib.import_module("pogema.svg_animation.animation_wrapper")
    env = animations.AnimationMonitor(made(density=0.3, num_agents=1))
    env.reset(seed=1)
    env.step([1])
    for fields in ({}, {"egocentric_idx": 0}, {"static": True}, {"egocentric_idx": 0, "static": True}):
        holder = animations.GridHolder(
            width=8, height=8, obstacles=env.get_obstacles(ignore_borders=False)[1:-1, 1:-1],
            episode_length=2, history=[list(states) for states in env.decompress_history(env.history)],
            obs_radius=2, on_target="finish", colors={0: "red"},
            config=animations.AnimationConfig(**fields),
            svg_settings=animations.SvgSettings(),
        )  # fmt: skip
        # POGEMA draws no static pictures without an agent in the middle.
        with contextlib.suppress(TypeError):
            kind().create_animation(holder).render()


def memory(kind: type) -> None:
    importlib.import_module("pogema.a_star_policy").a_star((0, 0), (2, 1), kind(), 100)


def agent(kind: type) -> None:
    env = made(observation_type="POMAPF")
    observations, _ = env.reset(seed=1)
    one = kind()
    for _ in range(3):
        one.act(observations[0])
        observations, *_ = env.step([1, 0])
    one.clear_state()


def agents(kind: type) -> None:
    env = made(observation_type="POMAPF")
    observations, _ = env.reset(seed=1)
    many = kind()
    many.act(observations)
    many.reset_states()


def pymarl(kind: type) -> None:
    env = kind(config())
    env.reset()
    env.get_env_info()
    env.get_obs()
    env.get_avail_actions()
    env.get_state()
    env.step([0, 0])


def maze(kind: type) -> None:
    kind.generate_maze(8, 8, 0.3, 3, 0.8, 1)


def registry(kind: type) -> None:
    # Our registry has one logger for all its subclasses; the first message sets up this logger.
    logging.getLogger("pogema_rs.toolbox").handlers.clear()
    name = f"walked{next(numbers)}"
    kind.register_maps({name: "...\n..."})
    kind.get_maps()
    kind.register_env(name, lambda *_, **fields: made(), dict)
    kind.create_env(name)
    kind.register_algorithm(name, lambda *_, **fields: object(), dict, dict)
    kind.create_algorithm(name)
    kind.create_algorithm_config(name)
    kind.recreate_from_state(kind.get_state())


def hold(kind: type) -> None:
    results = kind()
    results.after_step([{"metrics": {"ISR": 1.0}}])
    results.get_final()
    repr(results)


def register(kind: type) -> None:
    grid = kind(f"walked{next(numbers)}", "a.\n.A")
    grid.get_obstacles()
    grid.get_agents_xy()
    grid.get_targets_xy()
    str(grid)


def one_agent(kind: type) -> None:
    env = kind(made(num_agents=1))
    env.reset(seed=1)
    env.step(0)
    env.render()


def parallel(kind: type) -> None:
    env = kind(config())
    env.reset(seed=1)
    env.observation_space(env.agents[0])
    env.action_space(env.agents[0])
    env.state()
    env.step(dict.fromkeys(env.agents, 0))


def element(kind: type) -> None:
    objects = importlib.import_module("pogema.svg_animation.svg_objects")
    one = kind(x=1, y=1, width=2, height=2, cx=1, cy=1, r=1, x1=0, y1=0, x2=1, y2=1)
    one.add_animation(objects.Animation(attributeName="x", dur="1s", values="1;2"))
    one.render()


def sheet(kind: type) -> None:
    drawing = kind(10, 10, importlib.import_module("pogema.svg_animation.animation_drawer").SvgSettings())
    drawing.add_element(importlib.import_module("pogema.svg_animation.svg_objects").Circle(cx=1, cy=1, r=1))
    drawing.render()


def several_maps(kind: type) -> None:
    importlib.import_module("pogema_toolbox.registry").ToolboxRegistry.register_maps({"walk": "...\n..."})
    env = kind(made(map_name="walk"))
    env.reset(seed=1)
    env.step([0, 0])


def aggregate(kind: type) -> None:
    kind()(importlib.import_module("numpy").array([1.0, 2.0, 3.0]))


def provide(kind: type) -> None:
    env = kind(made())
    play(env)
    env.get_global_obstacles()
    env.get_global_agents_xy()
    env.get_global_targets_xy()


def wrap(kind: type) -> None:
    play(kind(made(observation_type="POMAPF")))


SCENARIOS: dict[str, Callable[[type], None]] = {
    "pogema.envs.Pogema": play_env,
    "pogema.envs.PogemaCoopFinish": lambda kind: play_env(kind, on_target="nothing"),
    "pogema.envs.PogemaLifeLong": lambda kind: play_env(kind, on_target="restart", collision_system="block_both"),
    "pogema.envs.ActionsSampler": lambda kind: kind(5, seed=1).sample_actions(2),
    "pogema.grid.Grid": build_grid,
    "pogema.grid.GridLifeLong": build_grid,
    "pogema.grid.CooperativeGrid": build_grid,
    "pogema.grid_config.GridConfig": build_config,
    "pogema.grid_registry.RegisteredGrid": register,
    "pogema.wrappers.persistence.PersistentWrapper": persist,
    "pogema.wrappers.persistence.AgentState": lambda kind: str(kind(0, 0, 1, 1, 0, True)),
    "pogema.wrappers.multi_time_limit.MultiTimeLimit": lambda kind: play(
        kind(importlib.import_module("pogema.envs").Pogema(config()), 3)
    ),
    "pogema.svg_animation.animation_wrapper.AnimationMonitor": monitor,
    "pogema.svg_animation.animation_drawer.AnimationDrawer": draw,
    "pogema.a_star_policy.GridMemory": memory,
    "pogema.a_star_policy.AStarAgent": agent,
    "pogema.a_star_policy.BatchAStarAgent": agents,
    "pogema.integrations.pymarl.PyMarlPogema": pymarl,
    "pogema.integrations.make_pogema.SingleAgentWrapper": one_agent,
    "pogema.integrations.pettingzoo.PogemaParallel": parallel,
    "pogema.svg_animation.animation_drawer.Drawing": sheet,
    **{
        f"pogema.svg_animation.svg_objects.{name}": element
        for name in ("Animation", "Circle", "Line", "Rectangle", "RectangleHref", "SvgObject")
    },
    "pogema_toolbox.views.view_tabular.Aggregator": aggregate,
    "pogema_toolbox.create_env.Environment": build_config,
    "pogema_toolbox.create_env.MultiMapWrapper": several_maps,
    "pogema_toolbox.create_env.ProvideGlobalObstacles": provide,
    "pogema_toolbox.generators.maze_generator.MazeRangeSettings": lambda kind: kind().sample(1),
    "pogema_toolbox.generators.random_generator.MapRangeSettings": lambda kind: kind().sample(1),
    "pogema_toolbox.generators.maze_generator.MazeGenerator": maze,
    "pogema_toolbox.registry.ToolboxRegistry": registry,
    "pogema_toolbox.results_holder.ResultsHolder": hold,
    **{
        f"pogema.wrappers.metrics.{name}": wrap
        for name in (
            *(
                "ISRMetric",
                "CSRMetric",
                "EpLengthMetric",
                "SumOfCostsAndMakespanMetric",
                "LifeLongAverageThroughputMetric",
            ),
            *(
                "LifeLongAttritionMetric",
                "NonDisappearCSRMetric",
                "NonDisappearEpLengthMetric",
                "NonDisappearISRMetric",
            ),
            *("AgentsDensityWrapper", "RuntimeMetricWrapper"),
        )
    },
    **{
        f"pogema.integrations.sample_factory.{name}": wrap
        for name in ("AutoResetWrapper", "IsMultiAgentWrapper", "MetricsForwardingWrapper")
    },
}


def load(path: str) -> type | None:
    """Returns a class, or None if it does not exist."""
    module, _, name = path.rpartition(".")
    found = getattr(importlib.import_module(module), name, None)
    return found if isinstance(found, type) else None


def methods(kind: type) -> list[str]:
    """Returns the methods that a class and its bases in the packages define."""
    names = set()
    for base in kind.__mro__:
        if base.__module__.partition(".")[0] in OWN:
            kinds = (types.FunctionType, staticmethod, classmethod)
            names |= {name for name, value in vars(base).items() if isinstance(value, kinds)}
    # Leaves out special methods, for example constructors. Also leaves out validators, because pydantic makes its own
    # functions for them.
    validators = getattr(kind, "__pydantic_decorators__", None)
    generated = set() if validators is None else {*validators.field_validators, *validators.validators}
    return sorted(name for name in names - generated if not name.startswith("__"))


def overridden(kind: type, name: str, calls: list[str]) -> type:
    """Returns a subclass whose method notes the calls that do not come from this file."""
    found = next((vars(base)[name] for base in kind.__mro__ if name in vars(base)), None)
    function = getattr(found, "__func__", found)

    def noted(*arguments: Any, **named: Any) -> Any:
        if sys._getframe(1).f_code.co_filename != __file__:
            calls.append(name)
        if function is None:
            raise AttributeError(f"{kind.__name__} has no {name} to call")
        return function(*arguments, **named)

    if function is not None:
        functools.update_wrapper(noted, function)
    own = type(found)(noted) if isinstance(found, (staticmethod, classmethod)) else noted
    return type(kind.__name__, (kind,), {name: own, "__module__": __name__})


def outcome(path: str, name: str) -> str:
    kind, calls = load(path), []
    if kind is None:
        return "no such class"
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            SCENARIOS[path](overridden(kind, name, calls))
    except Exception as error:  # noqa: BLE001 - which error it is does not matter
        if calls:
            return "called"
        return "OverrideError" if "OverrideError" in {base.__name__ for base in type(error).__mro__} else repr(error)
    return "called" if calls else "not called"


def without_scenario() -> list[str]:
    """Returns the classes of the packages that have methods and no scenario."""
    found = []
    for package in ("pogema", "pogema_toolbox"):
        root = importlib.import_module(package)
        for entry in pkgutil.walk_packages(root.__path__, f"{package}."):
            try:
                module = importlib.import_module(entry.name)
            except ImportError:  # an adapter whose framework is not installed
                continue
            kinds = [value for value in vars(module).values() if isinstance(value, type)]
            found += [
                f"{entry.name}.{kind.__name__}" for kind in kinds if kind.__module__ == entry.name and methods(kind)
            ]
    return sorted(set(found) - SCENARIOS.keys())


def main(package: str, *folders: str) -> None:
    """Overrides every method of every class with a scenario."""
    sys.path += folders
    warnings.simplefilter("ignore")
    theirs = {} if sys.stdin.isatty() else json.loads(sys.stdin.read() or "{}")
    if package == "pogema_rs":
        importlib.import_module(package).install_as_pogema(toolbox=True)
    os.chdir(tempfile.mkdtemp())
    found = {}
    for path in SCENARIOS:
        kind = load(path)
        own = methods(kind) if kind else []
        given = [key.rpartition(".")[2] for key in theirs if key.rpartition(".")[0] == path]
        for name in given if theirs else own:
            found[f"{path}.{name}"] = outcome(path, name)
    if package == "pogema":
        found.update(dict.fromkeys(without_scenario(), "no scenario"))
    json.dump(found, sys.stdout, indent=1)


if __name__ == "__main__":
    main(*sys.argv[1:])
