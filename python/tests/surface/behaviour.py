"""Plays scenarios with POGEMA, or with pogema_rs installed as POGEMA, and pickles the results: behaviour.py PACKAGE

Each scenario uses names of POGEMA that random cases (`tests/oracle`) do not reach.
"""

from __future__ import annotations

import copy
import importlib
import itertools
import pickle
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "oracle"))
from player import described, greedy

SCENARIOS: dict[str, Callable[[], Any]] = {}
MODES = ("finish", "nothing", "restart")


def scenario(function: Callable[[], Any]) -> Callable[[], Any]:
    """Adds a function to the scenarios."""
    SCENARIOS[function.__name__] = function
    return function


def outcome(call: Callable[..., Any], *arguments: Any, **keywords: Any) -> Any:
    """Returns what a call returns, or the classes of its error."""
    try:
        return described(call(*arguments, **keywords))
    except Exception as error:  # noqa: BLE001 - the errors are what is compared
        return ("error", [kind.__name__ for kind in type(error).__mro__])


def config(**fields: Any) -> Any:
    """Returns a small config, changed by `fields`."""
    from pogema import GridConfig

    small = {"size": 6, "num_agents": 4, "obs_radius": 2, "density": 0.2, "seed": 3, "max_episode_steps": 12}
    return GridConfig(**{**small, **fields})


def bare(**fields: Any) -> Any:
    """Returns an environment without wrappers."""
    from pogema import envs

    made = config(**fields)
    classes = {"finish": envs.Pogema, "nothing": envs.PogemaCoopFinish, "restart": envs.PogemaLifeLong}
    return classes[made.on_target](made)


def pogema_made(**fields: Any) -> Any:
    """Returns an environment with a time limit and metrics."""
    from pogema import pogema_v0

    return pogema_v0(config(**fields))


def played(env: Any, num_steps: int, num_random: int = 3) -> Iterator[Any]:
    """Yields what an environment returns, with random actions first."""
    generator = np.random.default_rng(5)
    yield described(env.reset())
    for step in range(num_steps):
        count = env.unwrapped.get_num_agents()
        yield described(env.step(generator.integers(5, size=count).tolist() if step < num_random else greedy(env)))


@scenario
def environment_without_wrappers() -> Any:
    """An environment without wrappers has neither a time limit nor metrics."""
    return [list(played(bare(on_target=mode, max_episode_steps=4), 9)) for mode in MODES]


@scenario
def metric_wrappers() -> Any:
    """The wrappers count in the same way as the metrics of `pogema_v0`, also after an episode that did not end."""
    from pogema.wrappers import metrics
    from pogema.wrappers.multi_time_limit import MultiTimeLimit

    names = {
        "finish": ("ISRMetric", "CSRMetric", "EpLengthMetric"),
        "nothing": (
            *("NonDisappearISRMetric", "NonDisappearCSRMetric", "NonDisappearEpLengthMetric"),
            "SumOfCostsAndMakespanMetric",
        ),
        "restart": ("LifeLongAverageThroughputMetric",),
    }
    seen = []
    for mode in MODES:
        for num_agents in (1, 4):
            env = MultiTimeLimit(bare(on_target=mode, num_agents=num_agents), 12)
            for name in names[mode]:
                env = getattr(metrics, name)(env)
            seen += [list(played(env, num_steps)) for num_steps in (4, 13, 15)]
    return seen


CHANGES: dict[str, Any] = {
    "on_target": ["finish", "nothing", "restart"],
    "collision_system": ["soft", "priority", "block_both"],
    "observation_type": ["POMAPF", "MAPF"],
    "integration": ["gymnasium"],
    **{name: [3] for name in ("seed", "obs_radius", "max_episode_steps", "FREE", "OBSTACLE")},
    **{name: [7] for name in ("num_agents", "width", "height", "size")},
    **{name: [[(0, 0), (1, 1), (2, 2), (3, 3), (4, 4)] * 2] for name in ("possible_agents_xy", "possible_targets_xy")},
    **{"density": [0.0], "map": [[[0] * 5] * 5], "persistent": [True], "auto_reset": [False], "empty_outside": [False]},
}
"""New values of the fields of a config."""


@scenario
def changes_of_the_config() -> Any:
    """Whether a change has an effect, or is rejected, before the next reset; also what the next episode returns."""
    seen = []
    for mode in MODES:
        for name, values in CHANGES.items():
            for value in values:
                fields = {"on_target": mode, "num_agents": 10, "density": 0.0, "seed": 1, "size": 5}
                unchanged, env = pogema_made(**fields), pogema_made(**fields)
                generator = np.random.default_rng(2)
                unchanged.reset(), env.reset()
                setattr(env.unwrapped.grid_config, name, value)
                is_noticed = False
                for _ in range(12):
                    actions = generator.integers(5, size=10).tolist()
                    expected = described(unchanged.step([*actions]))
                    is_noticed |= outcome(env.step, [*actions]) != expected
                # At every reset, our package rejects other values of these two.
                later = None if name in ("FREE", "OBSTACLE") else outcome(lambda env=env: list(played(env, 3)))
                seen.append((mode, name, is_noticed, later))
    return seen


@scenario
def lists_changed_in_place() -> Any:
    """Whether a change inside a list of the config has an effect or is rejected before the next reset."""
    cells = [[0, column] for column in range(5)]
    goals = [[[4, 0], [4, 4]], [[4, 1], [4, 3]]]
    lists = {
        "agents_xy": {"agents_xy": [[0, 0], [0, 1]], "targets_xy": goals},
        "targets_xy": {"agents_xy": [[0, 0], [0, 1]], "targets_xy": goals},
        "possible_targets_xy": {"possible_agents_xy": cells, "possible_targets_xy": [[4, 0], [4, 2], [4, 4]]},
        "possible_agents_xy": {"possible_agents_xy": cells, "possible_targets_xy": [[4, 0], [4, 2], [4, 4]]},
    }
    changes: dict[str, Callable[[Any], Any]] = {
        "inner": lambda values: values[0].__setitem__(slice(None), [[3, 0], [3, 4]]),
        "cell": lambda values: values[0].__setitem__(-1, [3, 3] if isinstance(values[0][0], list) else 3),
        "removed": lambda values: values.pop(0),
    }
    seen = []
    for (name, given), (what, change) in itertools.product(lists.items(), changes.items()):
        if name == "agents_xy" and what == "inner":
            continue
        fields = {"on_target": "restart", "num_agents": 2, "density": 0.0, "seed": 1, "size": 5, **given}
        unchanged, env = pogema_made(**copy.deepcopy(fields)), pogema_made(**copy.deepcopy(fields))
        unchanged.reset(), env.reset()
        change(getattr(env.unwrapped.grid_config, name))
        is_noticed = False
        for action in (2, 2, 2, 2, 4, 4, 4, 4, 3, 3, 3, 3, 2):
            expected = described(unchanged.step([action] * 2))
            is_noticed |= outcome(env.step, [action] * 2) != expected
        seen.append((name, what, is_noticed))
    return seen


@scenario
def own_metric() -> Any:
    """A subclass of `AbstractMetric` gets the step, the agents on goals, and whether the episode has ended."""
    from pogema import pogema_v0
    from pogema.wrappers.metrics import AbstractMetric

    calls: list[Any] = []

    class Own(AbstractMetric):
        def _compute_stats(self, step: int, is_on_goal: Any, finished: bool) -> Any:
            calls.append((step, list(is_on_goal), finished))
            return {"on_goal": sum(is_on_goal)} if step % 2 else None

    return [[*played(Own(pogema_v0(config(on_target=mode))), 14), described(calls)] for mode in MODES]


@scenario
def metric_without_stats() -> Any:
    """A step of an `AbstractMetric` that does not override `_compute_stats` raises an error."""
    from pogema import pogema_v0
    from pogema.wrappers.metrics import AbstractMetric

    env = AbstractMetric(pogema_v0(config()))
    env.reset()
    return outcome(env.step, [0] * 4)


@scenario
def agents_density() -> Any:
    """`count_agents` can be called with observations."""
    from pogema import pogema_v0
    from pogema.wrappers.metrics import AgentsDensityWrapper

    env = AgentsDensityWrapper(pogema_v0(config(observation_type="POMAPF")))
    seen, _ = env.reset()
    env.count_agents(seen)
    env.count_agents(seen[:1])
    ends = [env.step([0] * 4) for _ in range(12)]
    return described([infos for *_, infos in ends])


@scenario
def time_limit_wrapper() -> Any:
    """The limit counts from the reset, and the elapsed steps can be set if the config is persistent."""
    from pogema.wrappers.multi_time_limit import MultiTimeLimit

    seen = []
    for persistent in (False, True):
        env = MultiTimeLimit(bare(persistent=persistent), 6)
        seen += [*played(env, 8), *played(env, 3)]
        seen += [outcome(env.set_elapsed_steps, steps) for steps in (-1, 5)]
        seen += [described(env.step([0] * 4)), described(env.step([0] * 4))]
    return seen


@scenario
def history_wrapper() -> Any:
    """The history that a wrapper keeps for any environment, shifted by an offset."""
    from pogema import pogema_v0
    from pogema.wrappers.persistence import PersistentWrapper

    seen = []
    for mode in MODES:
        for offset in (None, -1):
            env = PersistentWrapper(pogema_v0(config(on_target=mode)), xy_offset=offset)
            seen += [outcome(env.get_history), outcome(env.get_full_history)]
            seen += [*played(env, 7), described(env.get_history()), described(env.get_full_history())]
            seen += [described(env.decompress_history(env.get_history())), outcome(env.step_back)]
    return seen


@scenario
def history_wrapper_steps_back() -> Any:
    """With `persistent` in the config, steps can be taken back."""
    from pogema.wrappers.persistence import PersistentWrapper
    from pogema.wrappers.multi_time_limit import MultiTimeLimit

    env = PersistentWrapper(MultiTimeLimit(bare(persistent=True), 12))
    seen = list(played(env, 8))
    while env.step_back():
        seen.append(described([env.get_history(), env.get_agents_xy(), env.get_targets_xy(), env.grid.is_active]))
    return [*seen, *(described(env.step([step % 5] * 4)) for step in range(14))]


@scenario
def history_of_a_monitor() -> Any:
    """The history of a monitor has the coordinates of the drawing, and does not require `persistent` in the config."""
    from pogema import AnimationMonitor

    seen = []
    for persistent in (False, True):
        env = AnimationMonitor(pogema_made(persistent=persistent))
        seen += [*played(env, 5), described(env.get_history()), described(env.get_full_history())]
    return seen


@scenario
def overridden_methods() -> Any:
    """A method that a subclass overrides is called as in POGEMA."""
    from pogema import envs

    seen, calls = [], list[str]()
    for base, mode in zip((envs.Pogema, envs.PogemaCoopFinish, envs.PogemaLifeLong), ("finish", "nothing", "restart")):

        class Observed(base):  # type: ignore[misc, valid-type]
            def _obs(self) -> Any:
                return [self.was_on_goal, *super()._obs()]

        class Windows(base):  # type: ignore[misc, valid-type]
            def _get_agents_obs(self, agent_id: int = 0) -> Any:
                return super()._get_agents_obs(agent_id)[1:] + agent_id

        class Places(base):  # type: ignore[misc, valid-type]
            def _pomapf_obs(self) -> Any:
                return [{"agent": agent, **one} for agent, one in enumerate(super()._pomapf_obs())]

        class Order(base):  # type: ignore[misc, valid-type]
            def _obs(self) -> Any:
                calls.append("observations")
                return super()._obs()

            def _get_infos(self) -> Any:
                calls.append("infos")
                return super()._get_infos()

        class Infos(base):  # type: ignore[misc, valid-type]
            def _get_infos(self) -> Any:
                return [{**info, "extra": agent} for agent, info in enumerate(super()._get_infos())]

        for kind in ("default", "POMAPF", "MAPF"):
            for made in (Observed, Windows, Places, Infos, Order):
                seen += played(made(config(on_target=mode, observation_type=kind)), 6)
    return [seen, calls]


@scenario
def base_class() -> Any:
    """An environment that a user derives from POGEMA's base class."""
    from pogema.envs import PogemaBase
    from pogema.grid import Grid

    class Own(PogemaBase):
        def reset(self, **keywords: Any) -> Any:
            self.grid = Grid(self.grid_config)
            return self._get_agents_obs(1), keywords

    env = Own(config())
    seen = [outcome(env.check_reset), outcome(env.render), outcome(env.step, [0])]
    seen += [outcome(env.reset, seed=1), outcome(env.check_reset), outcome(env.sample_actions)]
    return [*seen, env.get_num_agents(), env.metadata, outcome(PogemaBase().reset), PogemaBase().get_num_agents()]


@scenario
def components_of_a_grid() -> Any:
    """The components by cell and the cells by component, with the types of all values."""
    seen = []
    for fields in ({}, {"empty_outside": False}, {"density": 0.5, "num_agents": 2}, {"obs_radius": 1}):
        env = bare(on_target="restart", **fields)
        env.reset()
        grid = env.grid
        seen += [described(dict(grid.component_to_points)), described(grid.point_to_component)]
    return seen


@scenario
def generator_of_a_grid() -> Any:
    """The generator continues where the drawing of the border ended."""
    seen = []
    for empty_outside in (True, False):
        env = bare(empty_outside=empty_outside)
        env.reset()
        seen.append(described(env.grid.rnd.integers(1000, size=5)))
    return seen


def generator_states(env: Any) -> Any:
    """Returns the states of the generators of goals; `uinteger` counts only while `has_uint32` is set."""
    states = [generator.bit_generator.state for generator in env.random_generators]
    return [(state["state"], state["has_uint32"] and state["uinteger"]) for state in states]


LIFELONG: tuple[dict[str, Any], ...] = (
    {},
    {"collision_system": "soft", "observation_type": "MAPF", "empty_outside": False},
    {"map": "@.$@\n.$@.\n$..@", "num_agents": 3},
    {"persistent": True},
)


@scenario
def generators_of_goals() -> Any:
    """Drawing from the generators between steps changes later goals, and a reset makes new generators."""
    seen: list[Any] = [outcome(lambda: bare(on_target="restart").random_generators)]
    for fields in LIFELONG:
        env = pogema_made(on_target="restart", max_episode_steps=64, **fields)
        for episode in range(2):
            seen += [described(env.reset()), generator_states(env)]
            kept = env.random_generators
            for step in range(40):
                if step % 5 == 1:
                    owner = kept[step % len(kept)]
                    seen.append(described([owner.integers(10, size=step % 3), owner.random(), owner.integers(7)]))
                if step == 20 and episode:
                    env.random_generators[1] = np.random.default_rng(11)
                if step == 30 and episode:
                    env.random_generators = [np.random.default_rng(number) for number in range(len(kept))]
                if step % 11 == 10 and fields.get("persistent"):
                    seen.append(env.step_back())
                seen += [described(env.step(greedy(env))), generator_states(env), described(env.get_targets_xy())]
            seen += [kept is env.random_generators, described(env.get_lifelong_targets_xy())]
    return seen


@scenario
def generators_beside_sequences() -> Any:
    """With sequences of goals, the generators exist, but the environment does not draw from them."""
    env = bare(map="....", agents_xy=[[0, 0]], targets_xy=[[[0, 1], [0, 0]]], on_target="restart", num_agents=1, seed=6)
    env.reset()
    seen = [generator_states(env), described(env.random_generators[0].random(3))]
    for _ in range(5):
        seen += [described(env.step(greedy(env))), generator_states(env)]
    return seen


@scenario
def copies_of_generators() -> Any:
    """A copy of an environment has its own generators."""
    env = bare(on_target="restart")
    env.reset()
    foretold = copy.deepcopy(env.random_generators)
    env.random_generators[0].random()
    copies = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    copies[0].random_generators[1].integers(9)
    seen = [described([generator.random() for generator in foretold])]
    for one in (env, *copies):
        seen += [[described(one.step(greedy(one))), generator_states(one)] for _ in range(25)]
    return seen


@scenario
def elapsed_steps() -> Any:
    """A reset sets the elapsed steps to 0, also if they were set before the first reset."""
    env = pogema_made(persistent=True, max_episode_steps=6)
    seen = [outcome(env.set_elapsed_steps, 4), described(env.reset())]
    seen += [described(env.step([0] * 4)) for _ in range(7)]
    env.reset()
    for number in (5, 2**70, 0, -1, 3):
        seen += [outcome(env.set_elapsed_steps, number), described(env.step([0] * 4)[2:4])]
    return [*seen, outcome(pogema_made().set_elapsed_steps, 1)]


@scenario
def sequences_of_goals() -> Any:
    """The index of each agent's current goal in its sequence."""
    sequences = [[[0, 1], [0, 0]], [[1, 2], [1, 3], [1, 2]]]
    env = bare(map="....\n....", agents_xy=[[0, 0], [1, 3]], targets_xy=sequences, on_target="restart", num_agents=2)
    other = bare(on_target="restart")
    seen: list[Any] = [env.has_custom_sequences, other.has_custom_sequences, env.current_goal_indices]
    for current in (env, other):
        current.reset()
        for _ in range(9):
            current.step(greedy(current))
            seen.append(list(current.current_goal_indices))
    env.reset()
    return described([*seen, env.current_goal_indices])


@scenario
def actions_of_the_caller() -> Any:
    """Under `soft`, a step writes the executed actions into the caller's actions."""
    from pogema import pogema_v0

    seen = []
    generator = np.random.default_rng(9)
    for collisions in ("soft", "priority", "block_both"):
        for mode in MODES:
            for container in (list, np.array, lambda plan: [np.int64(action) for action in plan]):
                env = pogema_v0(config(on_target=mode, collision_system=collisions, size=4, density=0.1, seed=1))
                env.reset()
                for step in range(12):
                    plan = generator.integers(5, size=4).tolist() if step < 4 else greedy(env)
                    actions = container(plan)
                    env.step(actions)
                    seen.append([int(action) for action in actions])
    return described(seen)


def elements(text: str) -> Any:
    """Returns the elements of an SVG without its style, which may differ between the packages."""
    found = ElementTree.fromstring(text.encode()).iter()
    return [(one.tag, sorted(one.items())) for one in found if not one.tag.endswith("style")]


@scenario
def svg_elements() -> Any:
    """Elements with attributes and animations, and a drawing of them."""
    from pogema.svg_animation import animation_drawer as drawer
    from pogema.svg_animation import svg_objects as objects

    made = [
        objects.Circle(cx=1, cy=2, r=3, stroke_width=4, **{"class": "agent"}),
        objects.Line(x1=0, y1=1.5, x2=2, y2=-3),
        objects.Rectangle(x=1, y=2, width=3, height=4, fill="none"),
        objects.RectangleHref(x=1, y=2, height=4, opacity=0.5),
    ]
    made[0].add_animation(objects.Animation(attributeName="cx", values="1;2", dur="1s"))
    drawing = drawer.Drawing(300, 500, drawer.SvgSettings())
    for element in made:
        drawing.add_element(element)
    attributes = [sorted(element.attributes.items()) for element in made]
    text = objects.SvgObject.render_attributes({"b_c": 1, "a": "x"})
    return described([attributes, text, elements(drawing.render())])


@scenario
def drawings_of_episodes() -> Any:
    """The elements of an animation and of a frame, egocentric or not, with a subclass and other settings."""
    from pogema import AnimationConfig, AnimationMonitor
    from pogema.svg_animation import animation_drawer as drawer

    class Green(drawer.AnimationDrawer):
        def create_agents(self, grid_holder: Any) -> Any:
            agents = super().create_agents(grid_holder)
            for agent in agents:
                agent.attributes["fill"] = "green"
            return agents

    class Near(drawer.AnimationDrawer):
        @staticmethod
        def check_in_radius(x1: int, y1: int, x2: int, y2: int, r: int) -> bool:
            return (x1, y1) == (x2, y2)

    seen: list[Any] = []
    for mode in MODES:
        made = pogema_made(on_target=mode, obs_radius=1 + len(seen) % 3)
        env = AnimationMonitor(made, AnimationConfig(save_every_idx_episode=None))
        seen += [env.history, vars(env.svg_settings)]
        list(played(env, 14))
        seen.append(described(env.decompress_history(env.history)) if mode != "restart" else len(env.history))
        for options in (
            *({}, {"egocentric_idx": 0}, {"static": True, "frame_idx": 3}, {"show_agents": False}),
            *({"egocentric_idx": 0, "static": True, "frame_idx": 2}, {"show_grid_lines": False}),
        ):
            for kind, settings in (
                (drawer.AnimationDrawer, {}),
                (Near, {}),
                (Green, {"time_scale": 0.5, "ego_color": "red"}),
            ):
                trim = env.grid_config.obs_radius - 1
                obstacles = env.get_obstacles()[trim : -trim or None, trim : -trim or None]
                history = env.decompress_history(env.history)
                holder = drawer.GridHolder(
                    width=len(obstacles), height=len(obstacles[0]), obstacles=obstacles, history=history,
                    episode_length=len(history[0]), obs_radius=env.grid_config.obs_radius, on_target=mode,
                    colors=dict(enumerate(drawer.SvgSettings().colors)), config=AnimationConfig(**options),
                    svg_settings=drawer.SvgSettings(**settings),
                )  # fmt: skip
                seen.append(elements(kind().create_animation(holder).render()))
    return described(seen)


@scenario
def parts_of_a_drawer() -> Any:
    """The helpers that subclasses call."""
    from pogema.svg_animation.animation_drawer import AnimationDrawer as Drawer

    tokens: list[str] = ["a"]
    times: list[int] = [2]
    for count in (1, 2, 5):
        Drawer.wisely_add("b", count, tokens, times)
    seen = [tokens, times, *(Drawer.compress_tokens(list(text)) for text in ("", "a", "aab", "abbbbca"))]
    seen += [elements(Drawer.compressed_anim("cx", list(text), 0.25).render()) for text in ("aab", "abbbbca")]
    seen += [Drawer.fix_point(1, 2, 5), [Drawer.check_in_radius(2, 2, row, 4, 2) for row in range(7)]]
    return described(seen)


@scenario
def map_texts() -> Any:
    """The reader of map texts, for configs and for registered maps."""
    from pogema import GridConfig
    from pogema.grid_registry import GRID_STR_REGISTRY, RegisteredGrid

    texts = ("", "..\n.#", "a.\n.A", "aB", "abBA\n#...", "a..a A..A", "ab A.", "@.$ ..!", "@@", "a@ $A", "!!")
    texts += ("..\n...", "x.", "?.")
    seen = []
    for number, text in enumerate(texts):
        seen += [outcome(GridConfig.str_map_to_list, text, free, obstacle) for free, obstacle in ((0, 1), (7, "x"))]
        seen.append(outcome(lambda: vars(RegisteredGrid(f"text {number}", text))))  # noqa: B023 - called immediately
        GRID_STR_REGISTRY.pop(f"text {number}", None)
    return seen


@scenario
def checks_of_maps() -> Any:
    """Starts and goals that do not fit each other or the map."""
    from pogema import GridConfig, utils
    from pogema.grid_registry import GRID_STR_REGISTRY, RegisteredGrid

    pairs: list[Any] = [
        (None, None), ([], []), ([[0, 0]], None), (None, [[0, 0]]), ([[0, 0]], [[0, 1]]), ([[0, 0]], [[0, 1], [0, 2]]),
        ([[0, 0], [0, 0]], [[0, 1], [0, 2]]), ([[1, 1]], [[0, 1]]), ([[0, 1]], [[1, 1]]), ([[5, 5]], [[0, 0]]),
        ([(0, 0), (0, 1)], [(0, 2), (0, 2)]),
    ]  # fmt: skip
    obstacles = np.array([[0, 0, 0], [0, 1, 0]])
    seen = [outcome(utils.check_grid, obstacles, *pair) for pair in pairs]
    for pair in pairs:
        seen.append(outcome(lambda: vars(RegisteredGrid("checked", "...\n.#.", *pair))))  # noqa: B023
        GRID_STR_REGISTRY.pop("checked", None)
    RegisteredGrid("twice", "...")
    seen += [outcome(RegisteredGrid, "twice", "..."), outcome(RegisteredGrid, "letters", "a.A", [[0, 1]], None)]
    GRID_STR_REGISTRY.pop("twice")
    cells = ([[0, 0]], [(1, 2)], [[2, 0]], [[0, 3]], [[-1, 0]], [[0]], [[0.0, 1]], ["ab"], [None])
    seen += [outcome(GridConfig.check_positions, cell, 3, 2) for cell in cells]
    return [*seen, described(utils.CommonSettings().dict())]


@scenario
def texts_and_parts_of_a_config() -> Any:
    """The JSON of a config, and copies without some of its fields."""
    made = config(map=[[0, 0, 0], [0, 1, 0]], num_agents=1)
    options: list[dict[str, Any]] = [
        {}, {"sort_keys": True}, {"indent": 2}, {"separators": (",", ":")}, {"exclude": {"seed", "map"}},
        {"include": {"size"}, "indent": 1}, {"exclude_unset": True}, {"exclude_defaults": True}, {"encoder": str},
        {"exclude_none": True, "ensure_ascii": False},
    ]  # fmt: skip
    seen = [outcome(made.json, **option) for option in options]
    parts: list[dict[str, Any]] = [
        {}, {"exclude": {"seed"}}, {"include": {"seed", "size"}}, {"update": {"seed": 5}},
        {"exclude": {"map"}, "update": {"seed": 6}, "deep": True},
    ]  # fmt: skip
    return [*seen, *(outcome(lambda: made.copy(**part).dict()) for part in parts)]  # noqa: B023


@scenario
def search_of_the_policy() -> Any:
    """The memory and the search of the A* policy."""
    from pogema import a_star_policy as policy

    generator, seen = np.random.default_rng(4), []
    for number in range(60):
        memory = policy.GridMemory(start_r=int(generator.integers(1, 9)))
        for _ in range(4):
            window = generator.binomial(1, 0.3, (5, 5))
            memory.update(*generator.integers(-9, 10, size=2).tolist(), window)
        places = [(row, col) for row in range(-40, 40, 3) for col in range(-40, 40)]
        seen.append(described([bool(memory.is_obstacle(*place)) for place in places]))
        start, goal = (tuple(generator.integers(-9, 10, size=2).tolist()) for _ in range(2))
        seen += [outcome(policy.a_star, start, goal, memory, steps) for steps in (10000, number, 0)]
        seen.append(outcome(policy.h, start, goal))
    node = policy.Node()
    return [*seen, described([node.i, node.j, node.g, node.h, node.f, policy.INF, node < policy.Node((1, 1))])]


def main(package: str) -> None:
    """Plays all scenarios."""
    out, sys.stdout = sys.stdout.buffer, sys.stderr
    warnings.simplefilter("ignore")
    if package == "pogema_rs":
        importlib.import_module(package).install_as_pogema()
    pickle.dump({name: play() for name, play in SCENARIOS.items()}, out)


if __name__ == "__main__":
    main(*sys.argv[1:])
