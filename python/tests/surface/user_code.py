"""Plays scenarios of user code with POGEMA, or with pogema_rs installed as POGEMA: user_code.py PACKAGE FOLDER...

Pickles what the scenarios return.
"""

from __future__ import annotations

import importlib
import pickle
import sys
import warnings
from typing import Any

from behaviour import config, described, outcome, pogema_made


def own_map_reader() -> Any:
    from pogema import GridConfig

    class Signs(GridConfig):
        @staticmethod
        def str_map_to_list(str_map: str, free: int, obstacle: int) -> tuple:
            if str_map == "pools":
                return [[free, obstacle, free, free]], [], [], [(0, 0), (0, 2)], [(0, 3)]
            if str_map == "both":
                return [[free, free]], [[0, 0]], [[0, 1]], [(0, 0)], [(0, 1)]
            return [[free, obstacle], [free, free]], [[0, 0]], [[1, 1]], None, None

    def fields(text: Any, **others: Any) -> dict[str, Any]:
        return Signs(map=text, obs_radius=2, seed=1, **others).dict()

    given = {"agents_xy": [[0, 0]], "targets_xy": [[0, 1]]}
    return [
        outcome(fields, "letters"),
        outcome(fields, "pools"),
        outcome(fields, "both"),
        outcome(fields, "letters", **given),
        outcome(fields, "letters", agents_xy=[[1, 0]]),
        outcome(fields, [[0, 0], [0, 1]], **given),
        outcome(fields, None, size=4),
    ]


def own_check_of_positions() -> Any:
    from pogema import GridConfig

    calls: list[Any] = []

    class Corner(GridConfig):
        @classmethod
        def check_positions(cls, v: Any, width: int, height: int) -> None:
            calls.append(([list(cell) for cell in v], width, height))
            if [0, 0] in [list(cell) for cell in v]:
                raise IndexError("the corner is taken")

    places = {"agents_xy": [[1, 1]], "targets_xy": [[0, 1]]}
    sequences = {"agents_xy": [[1, 1]], "targets_xy": [[[0, 1], [2, 2]]], "on_target": "restart"}
    results = [
        outcome(lambda fields=fields: Corner(size=4, **fields).num_agents)
        for fields in ({}, places, sequences, {**places, "agents_xy": [[0, 0]]}, {**places, "targets_xy": [[0, 0]]})
    ]
    return results, calls


def own_states() -> Any:
    from pogema.wrappers.persistence import AgentState, PersistentWrapper

    class Shifted(PersistentWrapper):
        def _get_agent_state(self, grid: Any, agent_idx: int) -> AgentState:
            state = super()._get_agent_state(grid, agent_idx)
            return AgentState(state.x + 100, state.y, state.tx, state.ty, state.step, state.active)

        @staticmethod
        def agent_state_to_full_list(agent_states: Any, num_steps: int) -> Any:
            return [str(state) for state in agent_states], num_steps

    env = Shifted(pogema_made())
    env.reset()
    for _ in range(3):
        env.step([1, 2, 3, 4])
    shown = [[str(state) for state in states] for states in env.get_history()]
    return shown, env.get_full_history(), env.decompress_history(env.get_history())


def own_agent() -> Any:
    from pogema import AStarAgent

    class Counting(AStarAgent):
        def clear_state(self) -> None:
            super().clear_state()
            self.num_episodes = getattr(self, "num_episodes", 0) + 1

    agent = Counting(seed=2)
    before = agent.num_episodes
    agent.clear_state()
    return before, agent.num_episodes


def own_grid() -> Any:
    from pogema.grid import Grid

    class Corner(Grid):
        def get_agents_xy(self, *arguments: Any, **named: Any) -> Any:
            return [(2, 2) for _ in super().get_agents_xy(*arguments, **named)]

    return described(Corner(grid_config=config()).get_state(as_dict=True))


def own_results() -> Any:
    from pogema_toolbox.results_holder import ResultsHolder

    class Rounded(ResultsHolder):
        def get_final(self) -> dict[str, Any]:
            return {name: round(value) for name, value in super().get_final().items()}

    results = Rounded()
    results.after_step([{"metrics": {"ISR": 0.9}}])
    return repr(results)


def own_maze() -> Any:
    from pogema_toolbox.generators.maze_generator import MazeGenerator

    class Inverted(MazeGenerator):
        @classmethod
        def array_to_string(cls, array_maze: Any) -> str:
            return super().array_to_string(1 - array_maze)

    return Inverted.generate_maze(9, 9, 0.4, 4, 0.8, 3)


def classes_of_environments() -> Any:
    """The class of an environment, not the config, decides what happens when an agent reaches its goal."""
    from pogema import GridConfig, envs

    seen = []
    for kind in (envs.Pogema, envs.PogemaCoopFinish):
        for on_target in ("finish", "nothing"):
            env = kind(GridConfig(map="aA.\n...\nb.B", obs_radius=1, on_target=on_target))
            env.reset()
            seen += [described(env.step(actions)) for actions in ([4, 4], [0, 4], [0, 0])]
    for kind in (envs.Pogema, envs.PogemaLifeLong):
        for on_target in ("finish", "restart"):
            env = kind(config(on_target=on_target, num_agents=2, density=0.0, size=3))
            env.reset()
            seen += [described(env.step([1 + step % 4, 2])) for step in range(20)]
    return seen


def given_fields() -> Any:
    """The fields that `exclude_unset` keeps."""
    import copy

    from pogema import GridConfig

    made = [GridConfig(), GridConfig(seed=1), GridConfig(map="aA.\n..."), config(size=5)]
    made += [copy.deepcopy(made[1]), GridConfig(**{**made[1].dict(exclude_unset=True), "size": 32})]
    return [(sorted(each.dict(exclude_unset=True)), each.size, each.num_agents) for each in made]


def submodules() -> Any:
    """The modules that `import pogema` loads."""
    import pogema

    packages = {
        "wrappers": ("metrics", "multi_time_limit", "persistence"),
        "svg_animation": ("animation_drawer", "animation_wrapper", "svg_objects"),
        "integrations": ("make_pogema",),
    }
    return [
        getattr(getattr(pogema, package), name) is not None for package, names in packages.items() for name in names
    ]


def custom_wrappers() -> Any:
    """Wrappers ask the wrapper below them, not the environment."""
    import gymnasium
    from pogema.integrations.sample_factory import IsMultiAgentWrapper
    from pogema.wrappers import metrics
    from pogema.wrappers.multi_time_limit import MultiTimeLimit

    class Doubled(gymnasium.Wrapper):
        def get_num_agents(self) -> int:
            return 6

        @property
        def was_on_goal(self) -> list[bool]:
            return [True] * 6

        def __getattr__(self, name: str) -> Any:
            return getattr(self.env, name)

    def made() -> Any:
        return Doubled(pogema_made(num_agents=3, max_episode_steps=4))

    limited = MultiTimeLimit(made(), 2)
    limited.reset()
    seen = [IsMultiAgentWrapper(made()).num_agents, [limited.step([0] * 3)[3] for _ in range(2)]]
    for name in ("ISRMetric", "CSRMetric", "NonDisappearISRMetric", "SumOfCostsAndMakespanMetric"):
        env = getattr(metrics, name)(made())
        env.reset()
        seen.append([env.step([0] * 3)[4][0].get("metrics") for _ in range(4)][-1])
    return described(seen)


def grids_of_earlier_episodes() -> Any:
    """After a reset, the earlier grid still shows the last state of its episode."""
    env = pogema_made()
    env.reset()
    grid = env.grid
    env.step([1, 2, 3, 4])
    shown = [grid.get_agents_xy(), grid.get_targets_xy(), grid.get_obstacles()]
    env.unwrapped.grid_config.seed = 8
    env.reset()
    env.step([4, 3, 2, 1])
    after = [grid.get_agents_xy(), grid.get_targets_xy(), grid.get_obstacles()]
    return described([shown, after, env.grid.get_agents_xy()])


def own_save_animation() -> Any:
    """The folder exists when an overridden `save_animation` writes its file."""
    import tempfile
    from pathlib import Path

    from pogema import AnimationConfig, AnimationMonitor

    class Plain(AnimationMonitor):
        def save_animation(self, name: str = "render.svg", *_: Any) -> None:
            Path(name).write_text("drawn", encoding="utf-8")

    with tempfile.TemporaryDirectory() as folder:
        settings = AnimationConfig(directory=f"{folder}/films/", save_every_idx_episode=1)
        env = Plain(pogema_made(max_episode_steps=2), animation_config=settings)
        env.reset()
        for _ in range(2):
            env.step([0] * 4)
        return sorted(path.name for path in Path(folder, "films").iterdir())


SCENARIOS = {
    each.__name__: each
    for each in (
        *(own_map_reader, own_check_of_positions, own_states, own_agent, own_grid, own_results, own_maze),
        *(classes_of_environments, given_fields, submodules, custom_wrappers, grids_of_earlier_episodes),
        own_save_animation,
    )
}


def main(package: str, *folders: str) -> None:
    """Plays all scenarios."""
    sys.path += folders
    out, sys.stdout = sys.stdout.buffer, sys.stderr
    warnings.simplefilter("ignore")
    if package == "pogema_rs":
        importlib.import_module(package).install_as_pogema(toolbox=True)
    pickle.dump({name: play() for name, play in SCENARIOS.items()}, out)


if __name__ == "__main__":
    main(*sys.argv[1:])
