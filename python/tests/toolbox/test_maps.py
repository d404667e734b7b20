"""Tests of the maps and scenarios of suites."""

import json
import os
import subprocess
import sys

import pytest
from small_suite import SUITE, Still, metrics

from pogema_rs import BatchAStarAgent
from pogema_rs._engine import Evaluation
from pogema_rs.toolbox._work import play
from pogema_rs.toolbox.create_env import Environment, create_env_base
from pogema_rs.toolbox.evaluator import EvaluationError, _task, evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry


@pytest.mark.oracle
def test_maps_of_the_toolbox_are_read_from_its_installation():
    code = """
import sys
import pogema_rs
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.toolbox.create_env import Environment, create_env_base
before = dict(ToolboxRegistry.get_maps())
pogema_rs.install_as_pogema(toolbox=True)
try:
    create_env_base(Environment(map_name="pogema-.*"))
except KeyError as error:
    print(error)
print(before, sorted(ToolboxRegistry.get_maps()))
"""
    outputs = []
    for folder in ("", os.environ["POGEMA_TOOLBOX_FOLDER"]):
        done = subprocess.run(
            [sys.executable, "-B", "-c", code], env={**os.environ, "PYTHONPATH": folder}, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        outputs.append(done.stdout.splitlines())
    missing = (
        "no map matches `pogema-.*`; `pogema-logo` is part of pogema-toolbox: `pip install --no-deps pogema-toolbox`"
    )
    assert outputs == [[missing, "{} []"], ["{} ['four-rooms', 'pogema-logo']"]]


@pytest.mark.parametrize("grid", ["..\n\n..", [[0, 0], [0, 0]], ["..", ".."]])
def test_registered_maps_stay_as_they_are(tmp_path, grid, caplog):
    name = "maze(1"
    ToolboxRegistry.register_maps({name: grid})
    ToolboxRegistry.register_algorithm("Policy", Still)
    before = dict(ToolboxRegistry.get_maps())
    environment = {**SUITE["environment"], "map_name": name, "num_agents": 2}
    with caplog.at_level("WARNING", "pogema_rs.toolbox"):
        assert len(evaluation({**SUITE, "environment": environment}, tmp_path / "out")) == 2
    assert ToolboxRegistry.get_maps() == before and not caplog.messages


def test_nearest_map_is_named():
    ToolboxRegistry.register_maps({"hall": "..", "cellar": ".."})
    with pytest.raises(KeyError, match="no map matches `hal`; did you mean `hall`?"):
        create_env_base(Environment(map_name="hal"))


def open_suite(folder, **changes):
    """Writes a suite on an open map with a scenario, and returns its path."""
    folder.mkdir()
    (folder / "maps.yaml").write_text("open: |\n" + "  ........\n" * 8)
    agents = [(0, 0, 7, 7, 14), (7, 0, 0, 7, 14), (3, 3, 4, 4, 2)]
    rows = ["\t".join(map(str, (0, "open.map", 8, 8, *agent))) for agent in agents]
    (folder / "agents.scen").write_text("\n".join(["version 1", *rows]) + "\n")
    environment = {
        **SUITE["environment"],
        "collision_system": "soft",
        "observation_type": "POMAPF",
        "max_episode_steps": 64,
        "map_name": "open",
        "scenario": "agents.scen",
    }
    (folder / "suite.yaml").write_text(json.dumps({**SUITE, "environment": {**environment, **changes}}))
    return folder / "suite.yaml"


def test_every_algorithm_plays_the_scenario(tmp_path, monkeypatch):
    path = open_suite(tmp_path / "set")
    ToolboxRegistry.register_algorithm("Policy", BatchAStarAgent)
    policy = {"name": "Policy", "num_process": 2}
    algorithms = {
        "Built-in": {"name": "astar"},
        "Here": {**policy, "parallel_backend": "sequential"},
        "Processes": {**policy, "parallel_backend": "multiprocessing"},
    }
    path.write_text(json.dumps({**json.loads(path.read_text()), "algorithms": algorithms}))
    rows = evaluation(path, tmp_path / "out")
    of = {key: metrics(row for row in rows if row["algorithm"] == key) for key in algorithms}
    assert of["Here"] == of["Processes"] == of["Built-in"] and len(of["Here"]) == 4
    assert {row["SoC"] for row in of["Here"][:2]} == {28}
    # Play a built-in algorithm as a Dask worker does, in another folder.
    suite = Evaluation(str(path), None, str(tmp_path / "out"), [], [])
    monkeypatch.chdir(tmp_path)
    tasks = [_task(suite, index, "Built-in", {"name": "astar"}, is_built_in=True) for index in range(4)]
    played = [{name: value for name, value in play(task).metrics.items() if name != "runtime"} for task in tasks]
    assert played == of["Built-in"]


def test_a_scenario_fails_only_the_episodes_that_it_does_not_fit(tmp_path):
    path = open_suite(tmp_path / "set", num_agents={"grid_search": [2, 3]}, seed={"grid_search": [0, 1]})
    # The third agent starts on the cell of the first one, so the scenario fits only two agents.
    (tmp_path / "set" / "same_start.scen").write_text(
        (tmp_path / "set" / "agents.scen").read_text().replace("3\t3\t4\t4", "0\t0\t4\t4")
    )
    suite = json.loads(path.read_text())
    suite["environment"]["scenario"] = {"grid_search": ["agents.scen", "same_start.scen"]}
    path.write_text(json.dumps(suite))
    ToolboxRegistry.register_algorithm("Policy", Still)
    with pytest.raises(EvaluationError, match="2 episodes could not be played"):
        evaluation(path, tmp_path / "out")
    failed = [json.loads(line) for line in (tmp_path / "out" / "Policy.failed.jsonl").read_text().splitlines()]
    assert {(row["config"]["num_agents"], row["config"]["scenario"]) for row in failed} == {(3, "same_start.scen")}


def test_maps_of_one_evaluation_are_unknown_to_the_next(tmp_path):
    played = []

    def run(env, policy):
        env.reset()
        played.append(env.unwrapped.grid_config.map)
        return {"steps": 1}

    ToolboxRegistry.register_run_func("note_map", run)
    ToolboxRegistry.register_algorithm("Policy", Still)
    settings = {"name": "Policy", "parallel_backend": "sequential", "run_episode_func": "note_map"}
    environment = {**SUITE["environment"], "map_name": "m"}
    suite = {"environment": environment, "algorithms": {"Policy": settings}}
    before = dict(ToolboxRegistry.get_maps())
    for width in (4, 8):
        (tmp_path / "a.yaml").write_text("m: |\n" + f"  {'.' * width}\n" * 3)
        evaluation(suite, tmp_path / f"out-{width}", maps=[tmp_path / "a.yaml"], html=tmp_path / "page.html")
        assert {len(rows[0]) for rows in played} == {width}
        assert ToolboxRegistry.get_maps() == before
        played.clear()


def test_replaced_maps_are_reported(tmp_path, caplog):
    for name, columns in (("a", 4), ("b", 5)):
        (tmp_path / f"{name}.yaml").write_text("m: |\n" + f"  {'.' * columns}\n" * 3)
    suite = {"environment": {**SUITE["environment"], "map_name": "m"}, "algorithms": {"A": {"name": "stay"}}}
    maps = [tmp_path / "a.yaml", tmp_path / "b.yaml"]
    evaluation(suite, tmp_path / "out-1", maps=maps)
    assert caplog.messages == [f"{maps[1]}: a second map named `m` replaces the first"]
    caplog.clear()
    ToolboxRegistry.register_maps({"m": "....\n....\n...."})
    evaluation(suite, tmp_path / "out-2", maps=maps[:1])
    assert caplog.messages == []
    evaluation(suite, tmp_path / "out-3", maps=maps[1:])
    assert caplog.messages == ["the registered map `m` replaces another map of that name"]


def test_every_algorithm_plays_the_starts_and_goals_of_a_map(tmp_path):
    # A map text cannot hold the start of one agent and the goal of another in one cell.
    ToolboxRegistry.register_algorithm("Policy", BatchAStarAgent)
    ToolboxRegistry.register_maps({"lettered": "aB.A\n.#.#\nC.cb"})
    before = dict(ToolboxRegistry.get_maps())
    algorithms = {
        "Built-in": {"name": "astar"},
        "Here": {"name": "Policy", "parallel_backend": "sequential"},
        "Processes": {"name": "Policy", "parallel_backend": "multiprocessing"},
    }
    names = ["puzzle-comb", "puzzle-deep-hostage", "lettered", "puzzle-(f|p).*"]
    fields = {"observation_type": "POMAPF", "max_episode_steps": 16, "map_name": {"grid_search": names}}
    environment = {**SUITE["environment"], **fields, "num_agents": {"grid_search": [1, 2]}}
    rows = evaluation({"environment": environment, "algorithms": algorithms}, tmp_path / "out")
    of = {key: metrics(row for row in rows if row["algorithm"] == key) for key in algorithms}
    assert of["Here"] == of["Processes"] == of["Built-in"] and len(of["Here"]) == 16
    assert ToolboxRegistry.get_maps() == before
    # Play a built-in algorithm as a Dask worker does.
    suite = Evaluation(
        "suite", json.dumps({"environment": environment, "algorithms": algorithms}), "none", list(before.items()), []
    )
    task = _task(suite, 0, "Built-in", algorithms["Built-in"], is_built_in=True)
    assert play(task).metrics["ISR"] == of["Built-in"][0]["ISR"]
