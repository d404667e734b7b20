"""Tests of evaluations: earlier results, backends, failures, views and messages; also of wrong input to the toolbox."""

import io
import json
import logging
import os
import subprocess
import sys
import time
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest
from small_suite import SUITE, Still, metrics

from pogema_rs import BatchAStarAgent
from pogema_rs._optional import import_optional
from pogema_rs.errors import InternalError
from pogema_rs.toolbox import _backends, eval_utils
from pogema_rs.toolbox.__main__ import main
from pogema_rs.toolbox._backends import process_pool
from pogema_rs.toolbox._work import Outcome, Task, play, play_with
from pogema_rs.toolbox.algorithm_config import AlgoBase
from pogema_rs.toolbox.config_variant_generator import generate_variants
from pogema_rs.toolbox.create_env import Environment, create_env_base
from pogema_rs.toolbox.evaluator import EvaluationError, evaluation, run_views
from pogema_rs.toolbox.generators.maze_generator import MazeGenerator, generate_and_save_mazes
from pogema_rs.toolbox.generators.random_generator import generate_map
from pogema_rs.toolbox.generators.warehouse_generator import WarehouseConfig, generate_warehouse
from pogema_rs.toolbox.moving_ai_ingestion import map_to_grid
from pogema_rs.toolbox.registry import ToolboxRegistry
from pogema_rs.toolbox.views import show
from pogema_rs.toolbox.views.view_plot import PlotView, process_plot_view
from pogema_rs.toolbox.views.view_tabular import Aggregator, TabularView, preprocess_table
from pogema_rs.toolbox.views.view_utils import load_from_folder


class Broken(Still):
    """A policy that fails with three agents."""

    def act(self, observations):
        """Raises an error if there are three agents."""
        if len(observations) == 3:
            raise ArithmeticError("three are too many")
        return super().act(observations)


@pytest.mark.parametrize("backend", ["sequential", "balanced_multiprocessing", "balanced_dask"])
def test_import_of_pogema_rs_keeps_earlier_results(tmp_path, backend):
    ToolboxRegistry.register_algorithm("Policy", Still)
    stored = evaluation(SUITE, tmp_path / "stored")
    with pytest.raises(OSError, match="has results already: begin='resume' "):
        evaluation(SUITE, tmp_path / "stored")
    # The folder may hold the suite and other files.
    suite = {**SUITE, "algorithms": {"Policy": {"name": "Policy", "parallel_backend": backend, "num_process": 2}}}
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "maps.yaml").write_text("{}")
    for _ in range(2):
        assert metrics(evaluation(suite, tmp_path / "set", begin="replace")) == metrics(stored)
        assert sorted(path.name for path in (tmp_path / "set").iterdir()) == ["Policy.json", "maps.yaml"]
    assert metrics(evaluation(SUITE)) == metrics(stored)
    with pytest.raises(FileExistsError, match="has the `about.json` of a run that can be resumed"):
        evaluation(SUITE, tmp_path / "stored", begin="replace")


def test_error_of_a_policy_ends_a_run_that_replaces_results(tmp_path):
    ToolboxRegistry.register_algorithm("Policy", Broken)
    for backend in ("sequential", "multiprocessing"):
        suite = {**SUITE, "algorithms": {"Policy": {"name": "Policy", "parallel_backend": backend}}}
        with pytest.raises(ArithmeticError, match="three are too many"):
            evaluation(suite, tmp_path, begin="replace")
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("begin", ["anew", "replace"])
@pytest.mark.parametrize("backend", ["sequential", "multiprocessing"])
def test_policy_that_replaces_another_one_is_played(tmp_path, begin, backend):
    if begin == "replace":
        (tmp_path / "suite.yaml").touch()
    suite = {**SUITE, "algorithms": {"Policy": {"name": "Policy", "parallel_backend": backend}}}
    seen = []
    for policy in (Still, BatchAStarAgent):
        ToolboxRegistry.register_algorithm("Policy", policy)
        environment = {**SUITE["environment"], "observation_type": "POMAPF"}
        seen.append(metrics(evaluation({**suite, "environment": environment}, tmp_path, begin=begin)))
    assert seen[0] != seen[1]


@pytest.mark.oracle
def test_toolbox_that_was_imported_before_is_reported():
    code = "import pogema_toolbox, pogema_rs; pogema_rs.install_as_pogema(toolbox=True)"
    done = subprocess.run(
        [sys.executable, "-B", "-c", code],
        env={**os.environ, "PYTHONPATH": os.environ["POGEMA_TOOLBOX_FOLDER"]},
        capture_output=True,
        text=True,
    )
    assert "RuntimeError: pogema_toolbox is already imported, expected a call of" in done.stderr, done.stderr


def test_missing_packages_are_reported_before_the_first_episode(tmp_path, monkeypatch):
    ToolboxRegistry.register_algorithm("Policy", Broken)
    monkeypatch.setitem(sys.modules, "pandas", None)
    views = {"Means": {"type": "tabular", "print_results": True}}
    with pytest.raises(ImportError, match="`tabular` with `print_results` needs `pip install pandas`"):
        evaluation({**SUITE, "results_views": views}, tmp_path, begin="replace")
    monkeypatch.setitem(sys.modules, "yaml", None)
    (tmp_path / "suite.yaml").write_text("{}")
    with pytest.raises(ImportError, match="`load_from_folder` needs `pip install PyYAML`"):
        load_from_folder(tmp_path)
    with pytest.raises(ModuleNotFoundError, match="wrong_part"):
        import_optional("json.wrong_part", "this test")


def test_wandb_is_needed_only_for_uploads(tmp_path):
    folder = tmp_path / "set"
    folder.mkdir()
    eval_utils.initialize_wandb({}, folder, True, "Project")
    eval_utils.save_evaluation_results(folder)
    assert (tmp_path / "set.zip").exists()
    with pytest.raises(ImportError, match="`initialize_wandb` needs `pip install wandb`"):
        eval_utils.initialize_wandb({}, folder, False, "Project")
    with pytest.raises(ImportError, match="`save_evaluation_results` needs `pip install wandb`"):
        eval_utils.save_evaluation_results(folder)
    with pytest.raises(ImportError, match="needs `pip install wandb`"):
        eval_utils.create_and_push_summary_archive(["set"], tmp_path, "Project")


def settings(**changes):
    """Returns the settings of a random map."""
    return {"width": 3, "height": 3, "obstacle_density": 0.1, "seed": 0, **changes}


WRONG = [
    (
        lambda: generate_map(settings(obstacle_density=1.5)),
        "`obstacle_density` is `1.5`, expected a number from 0 to 1",
    ),
    (lambda: generate_map(settings(obstacle_density=float("nan"))), "`obstacle_density` is `NaN`"),
    (lambda: generate_map(settings(seed=-1)), "seed is -1, expected 0 to 18446744073709551615"),
    (lambda: MazeGenerator.generate_maze_from_ranges(2**64), "seed is 18446744073709551616, expected 0 to"),
    (lambda: generate_map(settings(width=0)), "`width` is `0`, expected a whole number from 1 to"),
    (
        lambda: generate_warehouse(WarehouseConfig(walls_rows=-5)),
        "`walls_rows` is `-5`, expected a whole number from 0",
    ),
    (lambda: generate_and_save_mazes("none", range(0)), "`seed_range` is empty, expected at least one seed"),
    (lambda: list(generate_variants({"a": {"b": {"grid_search": 3}}})), "`a.b.grid_search` is `3`, expected a list"),
    (lambda: list(generate_variants({"a": {"grid_search": "xy"}})), "`a.grid_search` is `'xy'`, expected a list"),
    (lambda: map_to_grid(io.BytesIO(b"")), "line 1, column 1: found ``, expected `type octile`"),
    (
        lambda: map_to_grid(io.BytesIO(b"type octile\nheight x\n")),
        "line 2, column 8: found `x`, expected a whole number",
    ),
    (
        lambda: map_to_grid(io.BytesIO(b"type o\nheight 2\nwidth 1\nmap\n.\n")),
        "line 6, column 1: row 2 is missing, expected 2 rows",
    ),
    (lambda: process_plot_view([], PlotView(x="a", y="b"), "plot.gif"), "expected a name that ends in `.pdf`"),
    (lambda: evaluation(SUITE, begin="resume"), "`eval_dir` is `None` and `begin` is `resume`, expected a folder"),
    (lambda: evaluation(SUITE, html="a.html"), "`html` is given and `begin` is `replace`, expected `new`"),
    (lambda: evaluation({**SUITE, "algorithms": {"A": {"name": "None"}}}), "no algorithm is registered as `None`"),
    (lambda: create_env_base(Environment(map_name="b")), "no map matches `b`, and no map is registered"),
    (lambda: create_env_base(Environment(map_name="b(")), "no map matches `b(`, and no map is registered"),
    (lambda: preprocess_table([], TabularView()), "there are no results, expected at least one row"),
]


@pytest.mark.parametrize("number", range(len(WRONG)))
def test_wrong_input_is_reported_in_one_line(number):
    call, message = WRONG[number]
    with pytest.raises((ValueError, TypeError, KeyError, AssertionError)) as raised:
        call()
    assert message in str(raised.value) and "\n" not in str(raised.value)


def test_estimators_of_pandas_have_intervals():
    class Series(list):
        """The part of a pandas `Series` that a table reads."""

        def agg(self, name):
            return {"mean": np.mean}[name](self)

    values = Series([1.0, 2.0, 3.0, 6.0])
    texts = []
    for estimator in ("mean", np.mean):
        np.random.seed(0)
        texts.append(Aggregator(estimator=estimator, error_level=95)(values))
    assert texts[0] == texts[1] and texts[0].startswith("3.00 ± 1.")


def test_a_folder_with_a_slash_is_archived_beside_it(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    eval_utils.initialize_wandb({}, folder, disable_wandb=True, project_name="p")
    eval_utils.save_evaluation_results(f"{folder}/")
    assert (tmp_path / "results.zip").exists() and not list(folder.iterdir())


class Numbers(Still):
    """A policy whose runner returns a metric that JSON cannot hold, if there are three agents."""

    wrong = float("nan")

    @classmethod
    def run(cls, env, policy):
        """Returns the metrics of an episode."""
        observations, _ = env.reset()
        return {"steps": np.float32(1), "list": [np.float32(2)], "number": cls.wrong if len(observations) == 3 else 1}


@pytest.mark.parametrize("backend", ["sequential", "multiprocessing"])
@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), {1, 2}, Path("a"), lambda: 0])
def test_a_metric_that_json_cannot_hold_fails_only_its_episode(tmp_path, backend, wrong, monkeypatch):
    if backend != "sequential" and callable(wrong):
        pytest.skip("slow, and the other values test the same")
    monkeypatch.setattr(Numbers, "wrong", wrong)
    ToolboxRegistry.register_run_func("numbers", Numbers.run)
    ToolboxRegistry.register_algorithm("Policy", Numbers)
    settings = {"name": "Policy", "parallel_backend": backend, "num_process": 2, "run_episode_func": "numbers"}
    with pytest.raises(EvaluationError, match="2 episodes could not be played"):
        evaluation({**SUITE, "algorithms": {"Policy": settings}}, tmp_path / "out")
    failed = [json.loads(line) for line in (tmp_path / "out" / "Policy.failed.jsonl").read_text().splitlines()]
    assert [row["config"]["num_agents"] for row in failed] == [3, 3]
    assert all("the metric 'number' has type" in row["error"] for row in failed)
    kept = [json.loads(line) for line in (tmp_path / "out" / "Policy.jsonl").read_text().splitlines()]
    assert [row["metrics"] for row in kept] == [{"steps": 1.0, "list": [2.0], "number": 1}] * 2


def test_page_of_complete_results_replays_the_current_policy(tmp_path):
    acted = []

    class Noting(Still):
        def act(self, observations):
            acted.append(len(observations))
            return super().act(observations)

    ToolboxRegistry.register_algorithm("Policy", Still)
    evaluation(SUITE, tmp_path / "out")
    ToolboxRegistry.register_algorithm("Policy", Noting)
    evaluation(SUITE, tmp_path / "out", begin="resume", html=tmp_path / "page.html")
    assert acted


def test_policies_in_python_follow_the_fields_that_pogema_lacks(tmp_path):
    rewards = []

    def run(env, policy):
        observations, _ = env.reset()
        while True:
            observations, reward, terminated, truncated, infos = env.step(policy.act(observations))
            rewards.append(tuple(reward))
            if all(terminated) or all(truncated):
                policy.reset_states()
                return infos[0]["metrics"]

    ToolboxRegistry.register_algorithm("Policy", BatchAStarAgent)
    ToolboxRegistry.register_run_func("paid", run)
    crowd = {"size": 8, "num_agents": 20, "on_target": "restart", "collision_system": "soft", "max_episode_steps": 32}
    algorithms = {
        "Here": {"name": "Policy", "parallel_backend": "sequential", "run_episode_func": "paid"},
        "Built-in": {"name": "astar"},
    }
    densities = []
    for number, fields in enumerate([{}, {"occupancy": "exact"}, {"reward": "shared"}]):
        suite = {
            "environment": {**SUITE["environment"], "observation_type": "POMAPF", **crowd, **fields},
            "algorithms": algorithms,
        }
        rows = metrics(evaluation(suite, tmp_path / str(number)))
        assert rows[: len(rows) // 2] == rows[len(rows) // 2 :]
        densities.append(rows[0]["avg_agents_density"])
        assert (len({len(set(step)) for step in rewards}) == 1) == (fields == {"reward": "shared"})
        rewards.clear()
    assert densities[0] == densities[2] != densities[1]
    large = Environment(size=5000, limits="extended")
    assert large.size == 5000
    large.update_config(size=6000)
    assert (large.size, large.width) == (6000, 6000)
    with pytest.raises(ValueError, match="`size` is `70000`"):
        large.update_config(size=70_000)
    with pytest.raises(ValueError, match="`size` is `6000`, expected a whole number from 2 to 4096"):
        large.update_config(limits="as_released")
    assert (large.size, large.limits) == (6000, "extended")
    for wrong in ({"occupancy": "all"}, {"size": 5000}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            Environment(**wrong)


def test_built_in_algorithms_say_how_many_episodes_are_left(tmp_path, caplog):
    with caplog.at_level("INFO", "pogema_rs.toolbox"):
        evaluation({**SUITE, "algorithms": {"A": {"name": "stay"}}}, tmp_path / "out")
    assert "A: 4 of 4 episodes to play" in caplog.messages


def test_a_run_without_all_outcomes_is_an_error(tmp_path, monkeypatch):
    ToolboxRegistry.register_algorithm("Policy", Still)
    monkeypatch.setattr("pogema_rs.toolbox._backends.sequential", lambda tasks: map(play, list(tasks)[1:]))
    with pytest.raises(InternalError, match="`Policy` ended without all episodes"):
        evaluation(SUITE, tmp_path / "out")


class BreakingPool:
    """A process pool that breaks in some of its calls of `submit`.

    `done` holds the indices of the pending tasks that the pool completes before it breaks.
    """

    def __init__(self, breaks_at, done=()):
        self.breaks_at, self.done = list(breaks_at), done
        self.submitted = 0

    @contextmanager
    def open(self, _num_processes):
        """Stands in for `process_pool`."""
        self.futures = []
        yield self

    def submit(self, _function, task):
        """Returns a future, done or pending, or breaks the pool."""
        self.submitted += 1
        if self.submitted in self.breaks_at:
            for future, index in self.futures:
                if not future.done():
                    is_played = index in self.done
                    future.set_result(Outcome(index, {})) if is_played else future.set_exception(BrokenProcessPool())
            raise BrokenProcessPool
        future = Future()
        self.futures.append((future, task.index))
        if not self.breaks_at or self.submitted > self.breaks_at[-1]:
            future.set_result(Outcome(task.index, {}))
        elif len(self.futures) == 1:
            future.set_result(Outcome(task.index, {}))
        return future


TASKS = [Task(index, "A", {}, {}) for index in range(8)]


def test_no_episode_is_lost_if_a_process_dies_between_two_outcomes(monkeypatch):
    # The pool breaks when the parent submits the next episode after the first outcome.
    monkeypatch.setattr("pogema_rs.toolbox._backends.process_pool", BreakingPool([3]).open)
    outcomes = list(_backends.processes(TASKS, 1))
    assert sorted(outcome.index for outcome in outcomes) == list(range(8))
    assert not any(outcome.error for outcome in outcomes)


def test_an_episode_that_ended_before_the_third_death_is_kept(monkeypatch, caplog):
    pool = BreakingPool([1, 2, 6], done=(1,))
    monkeypatch.setattr("pogema_rs.toolbox._backends.process_pool", pool.open)
    with caplog.at_level("WARNING", "pogema_rs.toolbox"):
        outcomes = {outcome.index: outcome for outcome in _backends.processes(TASKS, 2)}
    assert sorted(outcomes) == list(range(8))
    assert [index for index, outcome in outcomes.items() if outcome.error] == [2]
    assert caplog.messages == [
        "a process died; playing 0 episodes again",
        "a process died; playing 0 episodes again",
        "processes died 3 times; failed episodes: 1",
    ]


def test_processes_ask_for_tasks_when_they_can_play_them():
    asked = []

    def tasks():
        for index in range(40):
            asked.append(index)
            yield Task(
                index, "Stay", {"name": "stay"}, {**SUITE["environment"], "num_agents": 2, "seed": index}, {}, True
            )

    outcomes = _backends.processes(tasks(), 1)
    first = next(outcomes)
    assert first.error == "" and len(asked) == _backends._AHEAD
    assert sorted([first.index, *(outcome.index for outcome in outcomes)]) == list(range(40))


def test_threads_of_a_process_share_no_algorithm():
    class Alone(Still):
        """A policy that notes how many episodes use it at the same time."""

        most = 0

        def __init__(self):
            self.num_users = 0

        def act(self, observations):
            self.num_users += 1
            Alone.most = max(Alone.most, self.num_users)
            time.sleep(0.002)
            self.num_users -= 1
            return super().act(observations)

    ToolboxRegistry.register_algorithm("Policy", Alone)
    state = ToolboxRegistry.get_state()
    environment = {**SUITE["environment"], "num_agents": 2, "seed": 0}
    tasks = [Task(index, "Policy", {"name": "Policy"}, environment) for index in range(8)]
    with ThreadPoolExecutor(4) as pool:
        outcomes = list(pool.map(lambda task: play_with(state, task), tasks))
    assert not any(outcome.error for outcome in outcomes) and Alone.most == 1


def test_workers_that_join_later_are_used(monkeypatch):
    in_flight = []

    class Client:
        """A client with a growing number of threads."""

        num_threads = 1

        def scatter(self, state, **_):
            return state

        def nthreads(self):
            return {"worker": self.num_threads}

        def submit(self, _function, _state, task, **_):
            in_flight.append(task.index)
            return SimpleNamespace(key=task.index, status="finished", result=lambda: Outcome(task.index, {}))

    client = Client()

    class Completed(list):
        def __iter__(self):
            while self:
                yield self.pop(0)

        update = list.extend

    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(as_completed=Completed))
    monkeypatch.setattr("pogema_rs.toolbox._backends.dask_client", lambda *_: nullcontext(client))
    outcomes = _backends.dask(TASKS, 1, None)
    next(outcomes)
    assert len(in_flight) == 2
    client.num_threads = 3
    next(outcomes)
    assert len(in_flight) == 7
    assert len(list(outcomes)) == 6
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match="a Dask backend needs `pip install distributed`"):
        next(_backends.dask(TASKS, 1, None))


def test_a_worker_that_has_just_ended_does_not_hide_the_error(monkeypatch):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    cluster = SimpleNamespace(workers={0: SimpleNamespace(pid=ended.pid)}, close=lambda: None)
    made = {"LocalCluster": lambda **_: cluster, "Client": lambda *_, **__: SimpleNamespace(close=lambda: None)}
    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(**made))
    with pytest.raises(ArithmeticError), _backends.dask_client(1, None):
        raise ArithmeticError


@pytest.mark.parametrize(
    "begin, wrong, message",
    [
        ("new", {"z": "SoC"}, "suite.yaml: line 1: unknown key `z` in view `Costs`"),
        ("replace", {"width": "wide"}, "width"),
        ("replace", {"y": "SoC", "error_bar": ["xx", 3]}, "error_bar"),
        ("replace", {"type": "plto"}, "did you mean `plot`?"),
        ("replace", {"type": "radar", "z": 1}, "unknown key `z` in view `Costs`"),
    ],
)
def test_wrong_view_is_rejected_before_play(tmp_path, begin, wrong, message):
    ToolboxRegistry.register_algorithm("Policy", Broken)
    views = {"Costs": {"type": "plot", "x": "num_agents", **wrong}}
    with pytest.raises(ValueError, match=message):
        evaluation({**SUITE, "results_views": views}, tmp_path / "out", begin=begin)
    assert not (tmp_path / "out").exists()


class DeepConfig(AlgoBase):
    """Settings with a number."""

    depth: int = 1


@pytest.mark.parametrize("begin", ["new", "anew", "replace"])
@pytest.mark.parametrize(
    "second, field",
    [
        ({"name": "Unknown"}, "Unknown"),
        ({"name": "Policy", "parallel_backend": "cloud"}, "parallel_backend"),
        ({"name": "Deep", "depth": "deep"}, "depth"),
        ({"name": "lacam", "nodez": 3}, "nodez"),
    ],
)
def test_a_wrong_second_algorithm_is_rejected_before_the_first_one_plays(tmp_path, second, field, begin):
    if field == "nodez" and begin == "replace":
        pytest.skip("plays registered algorithms only")
    out = tmp_path / "out"
    ToolboxRegistry.register_algorithm("Policy", Still)
    if begin == "anew":
        evaluation(SUITE, out)
    before = {path.name: path.read_bytes() for path in out.glob("*")}
    ToolboxRegistry.register_algorithm("Policy", Broken)
    ToolboxRegistry.register_algorithm("Deep", Still, DeepConfig)
    algorithms = {"First": {"name": "Policy", "parallel_backend": "sequential"}, "Second": second}
    with pytest.raises(KeyError if (field, begin) == ("Unknown", "replace") else ValueError, match=field):
        evaluation({**SUITE, "algorithms": algorithms}, out, begin=begin)
    assert {path.name: path.read_bytes() for path in out.glob("*")} == before


@pytest.mark.parametrize("begin", ["new", "replace"])
def test_values_of_numpy_and_names_with_slashes_are_written(tmp_path, begin):
    ToolboxRegistry.register_algorithm("Stay", Still)
    # `replace` passes all values unchanged to the environment. Like POGEMA's environment, this environment accepts no
    # arrays of cells.
    cells = np.array if begin == "new" else list
    places = {"grid_search": [cells([[0, 0], [4, 4]]), cells([[1, 1], [3, 3]])]}
    environment = {
        **SUITE["environment"],
        "num_agents": np.int64(2),
        "seed": {"grid_search": np.arange(2)},
        "map": [[0] * 5] * 5,
        "agents_xy": places,
        "targets_xy": cells([[0, 1], [4, 3]]),
    }
    suite = {
        "environment": MappingProxyType(environment),
        "algorithms": {1: {"name": "Stay", "parallel_backend": "sequential"}},
        "results_views": {"costs/plot": {"type": "plot", "x": "seed", "y": "SoC"}},
    }
    rows = evaluation(MappingProxyType(suite), tmp_path / "out", begin=begin)
    assert {row["algorithm"] for row in rows} == {"1"}
    stored = json.loads((tmp_path / "out" / "1.json").read_text())
    assert [row["env_grid_search"] for row in stored] == [
        {"seed": seed, "agents_xy": cells} for seed in (0, 1) for cells in ([[0, 0], [4, 4]], [[1, 1], [3, 3]])
    ]
    assert list((tmp_path / "out").rglob("*plot.*"))


def test_a_value_that_a_suite_cannot_hold_is_named(tmp_path):
    with pytest.raises(
        ValueError, match=r"suite: `algorithms\.A\.sizes\[1\]` has type set, expected a value that YAML"
    ):
        evaluation({**SUITE, "algorithms": {"A": {"name": "stay", "sizes": [1, {2}]}}}, tmp_path / "out", begin="new")


@pytest.mark.parametrize("error", [ArithmeticError, KeyboardInterrupt])
def test_a_failed_run_is_resumed_in_the_same_process(tmp_path, error):
    class Once(Still):
        """A policy that fails until it is fixed."""

        is_fixed = False

        def act(self, observations):
            if not Once.is_fixed:
                raise error
            return super().act(observations)

    ToolboxRegistry.register_algorithm("Policy", Once)
    # As in a notebook, the traceback keeps the local variables of the run.
    with pytest.raises((EvaluationError, KeyboardInterrupt)) as kept:
        evaluation(SUITE, tmp_path / "out")
    Once.is_fixed = True
    assert len(evaluation(SUITE, tmp_path / "out", begin="resume")) == 4
    assert kept.value.__traceback__ is not None


class Mute(Exception):
    """An exception without a text."""

    def __str__(self):
        raise RuntimeError("no text")


@pytest.mark.parametrize("backend", ["sequential", "multiprocessing"])
@pytest.mark.parametrize(
    "error, text",
    [
        (SystemExit(), "SystemExit: no message"),
        (Mute(), "Mute: no message"),
        (ValueError("\n\nwhy\n"), "ValueError: why"),
    ],
)
def test_any_error_of_a_policy_fails_only_its_episode(tmp_path, monkeypatch, backend, error, text):
    def act(self, observations):
        if len(observations) == 3:
            raise error
        return [0] * len(observations)

    monkeypatch.setattr(Still, "act", act)
    ToolboxRegistry.register_algorithm("Policy", Still)
    suite = {**SUITE, "algorithms": {"Policy": {"name": "Policy", "parallel_backend": backend, "num_process": 1}}}
    with pytest.raises(EvaluationError, match="2 episodes could not be played"):
        evaluation(suite, tmp_path / "out")
    failed = [json.loads(line) for line in (tmp_path / "out" / "Policy.failed.jsonl").read_text().splitlines()]
    assert [row["error"] for row in failed] == [text] * 2


def test_errors_have_the_classes_of_the_documentation(tmp_path):
    out = tmp_path / "out"
    stay = {**SUITE, "algorithms": {"A": {"name": "stay"}}}
    for kind, message, call in [
        (FileNotFoundError, "suite.yaml", lambda: evaluation(tmp_path / "suite.yaml", out, begin="new")),
        (FileNotFoundError, "none.yaml", lambda: evaluation(stay, out, maps=[tmp_path / "none.yaml"])),
        (
            ValueError,
            "unknown parameter `A.nodez`",
            lambda: evaluation({**SUITE, "algorithms": {"A": {"name": "lacam", "nodez": 3}}}, out),
        ),
        (
            FileNotFoundError,
            "none.safetensors",
            lambda: evaluation({**SUITE, "algorithms": {"A": {"name": "iql", "weights": "none.safetensors"}}}, out),
        ),
        (ValueError, "`begin` is `old`", lambda: evaluation(stay, out, begin="old")),
    ]:
        with pytest.raises(kind, match=message) as raised:
            call()
        assert type(raised.value) is kind and not out.exists()
    evaluation(stay, out)
    (tmp_path / "right.yaml").write_text("results_views: {A: {type: tabular}}\n")
    (tmp_path / "wrong.yaml").write_text("results_views: {A: {type: tabular, zz: 1}}\n")
    (tmp_path / "cut.yaml").write_text("results_views: {")
    for kind, message, call in [
        (ValueError, "zz", lambda: show(out, config=tmp_path / "wrong.yaml")),
        (ValueError, "cut.yaml", lambda: show(out, config=tmp_path / "cut.yaml")),
        (ValueError, "no view `B`", lambda: show(out, config=tmp_path / "right.yaml", names=["B"])),
        (FileNotFoundError, "none.yaml", lambda: show(out, config=tmp_path / "none.yaml")),
    ]:
        with pytest.raises(kind, match=message) as raised:
            call()
        assert type(raised.value) is kind
    (out / "A.json").write_text("[")
    with pytest.raises(OSError, match=r"A\.json: .*, expected the JSON that an earlier run wrote"):
        evaluation(stay, out, begin="resume")


MESSAGES = """
from pogema_rs.toolbox.registry import ToolboxRegistry
ToolboxRegistry.debug("hidden")
ToolboxRegistry.info("shown")
"""


@pytest.mark.parametrize("before, is_shown", [("", True), ("import logging; logging.basicConfig()", False)])
def test_messages_are_shown_unless_the_program_has_set_up_its_logging(before, is_shown):
    command = [sys.executable, "-B", "-c", before + MESSAGES]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and ("| shown" in done.stderr) == is_shown and "hidden" not in done.stderr, done.stderr


REGISTERED = """
import multiprocessing
from pogema_rs.toolbox.registry import ToolboxRegistry


class Stay:
    def reset_states(self):
        pass

    def act(self, observations):
        return [0] * len(observations)


ToolboxRegistry.register_algorithm("Policy", Stay)
if multiprocessing.get_start_method(allow_none=True) is None:
    multiprocessing.set_start_method("spawn")
"""


def test_command_line_plays_policies_of_a_script_in_spawned_processes(tmp_path):
    suite = {**SUITE, "algorithms": {"Policy": {"name": "Policy", "num_process": 1}}}
    (tmp_path / "suite.yaml").write_text(json.dumps(suite))
    (tmp_path / "policies.py").write_text(REGISTERED)
    command = [sys.executable, "-B", "-m", "pogema_rs.toolbox", "suite.yaml", "--out", "out", "--register"]
    done = subprocess.run([*command, "policies.py"], cwd=tmp_path, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    assert len(json.loads((tmp_path / "out" / "Policy.json").read_text())) == 4


def test_a_policy_that_spawned_processes_cannot_import_is_named(monkeypatch):
    monkeypatch.setattr("multiprocessing.get_start_method", lambda: "spawn")
    ToolboxRegistry.register_algorithm("Policy", Still)
    ToolboxRegistry.register_algorithm("Local", lambda: Still())
    with pytest.raises(ValueError, match="`Local` of the registered algorithms cannot be sent"), process_pool(1):
        pass


def test_command_line_reports_wrong_input_in_one_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("policies.py").write_text(REGISTERED.partition("if multi")[0])
    Path("broken.py").write_text("{}['key']")
    for name, settings, options, message in [
        ("unknown", {"name": "Unknown"}, ["policies.py"], "error: suite.yaml: line 1: `A.name`: `Unknown` is neither"),
        ("processes", {"name": "Policy", "num_process": "x"}, ["policies.py"], "error: suite.yaml: line 1: `A.num_pro"),
        ("seed", {"name": "Policy", "seed": "x"}, ["policies.py"], "error: seed: "),
        ("dask", {"name": "Policy", "parallel_backend": "dask"}, ["policies.py"], "error: a Dask backend needs `pip"),
        ("script", {"name": "Policy"}, ["none.py"], "error: none.py: file not found, expected a script"),
    ]:
        monkeypatch.setitem(sys.modules, "distributed", None)
        Path("suite.yaml").write_text(json.dumps({**SUITE, "algorithms": {"A": settings}}))
        with pytest.raises(SystemExit) as raised:
            main(["suite.yaml", "--out", name, *(part for script in options for part in ("--register", script))])
        assert str(raised.value).startswith(message) and "\n" not in str(raised.value)
    with pytest.raises(KeyError, match="key"):
        main(["suite.yaml", "--out", "broken", "--register", "broken.py"])


def test_files_of_views_are_found_from_the_current_folder(tmp_path, monkeypatch, caplog):
    monkeypatch.chdir(tmp_path)
    means = f"setting,dataset,algorithm,num_agents,ISR\nMAPF,{tmp_path.name},A,2,0.5\n"
    (tmp_path / "means.csv").write_text(means)
    rows = [{"metrics": {"ISR": 1.0}, "env_grid_search": {"num_agents": 2}, "algorithm": "A"}]
    view = {"type": "published", "file": "means.csv", "setting": "MAPF", "algorithm": "A", "metrics": ["ISR"]}
    for folder in (tmp_path, ".", None):
        caplog.clear()
        with caplog.at_level("INFO", "pogema_rs.toolbox"):
            run_views(rows, {"results_views": {"Beside": view}}, eval_dir=folder)
        assert "0.5" in caplog.text


def test_returned_rows_hold_the_time_of_the_network(tmp_path):
    algorithms = {"IQL": {"name": "iql"}, "Stay": {"name": "stay"}}
    rows = evaluation({**SUITE, "algorithms": algorithms}, tmp_path / "out", begin="new")
    assert len(rows) == 8
    for row in rows:
        metrics = row["metrics"]
        assert ("network_time" in metrics) == (row["algorithm"] == "IQL")
        assert 0 <= metrics.get("network_time", 0) <= metrics["runtime"]


def test_views_that_pogema_toolbox_lacks_are_drawn_too(tmp_path, caplog):
    rows = [
        {"metrics": {"CSR": 1.0, "SoC": 8 + seed}, "env_grid_search": {"seed": seed}, "algorithm": name}
        for name in ("A", "B")
        for seed in range(3)
    ]
    views = {"Boxes": {"type": "box", "y": "SoC"}, "Seeds": {"type": "seeds"}}
    run_views(rows, {"results_views": views}, eval_dir=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["Boxes.pdf"]
    assert (tmp_path / "Boxes.pdf").read_bytes().startswith(b"%PDF")


def test_views_accept_what_results_may_contain(tmp_path):
    rows = [
        {"metrics": {"SoC": value, "gap": float("nan")}, "env_grid_search": {"seed": seed}, "algorithm": "A/B"}
        for seed, value in enumerate([np.int64(3), np.float32(2.5), 4, 5.0])
    ]
    process_plot_view(rows, PlotView(x="seed", y="SoC"), tmp_path / "plot.svg")
    assert "A/B" in (tmp_path / "plot.svg").read_text()


def test_plots_show_algorithms_of_any_name(tmp_path):
    names = ["A/B", "A_B", "a_b", "about", "x.episodes"]
    rows = [
        {"metrics": {"SoC": 3 + seed + place}, "env_grid_search": {"seed": seed}, "algorithm": name}
        for place, name in enumerate(names)
        for seed in range(2)
    ]
    process_plot_view(rows, PlotView(x="seed", y="SoC"), tmp_path / "plot.svg")
    text = (tmp_path / "plot.svg").read_text()
    assert all(f">{name}<" in text for name in names)


def test_messages_go_to_any_sink(tmp_path):
    lines = []
    handler = logging.StreamHandler(io.StringIO())
    for sink in (lines.append, handler, tmp_path / "log.txt", str(tmp_path / "log.txt")):
        ToolboxRegistry.setup_logger("SUCCESS", sink)
        ToolboxRegistry.success("done")
        ToolboxRegistry.debug("hidden")
    assert len(lines) == 1 and lines[0].endswith("| done\n")
    assert handler.stream.getvalue().endswith("| done\n")
    assert (tmp_path / "log.txt").read_text().count("done") == 2
    assert "hidden" not in (tmp_path / "log.txt").read_text()


POLICIES = """
from pogema import GridConfig
from pogema_toolbox.algorithm_config import AlgoBase


class Right:
    def reset_states(self):
        pass

    def act(self, observations):
        return [len(GridConfig().MOVES) - 1] * len(observations)
"""
MAIN = """
import json
import pogema_rs
pogema_rs.install_as_pogema(toolbox=True)
from pogema_toolbox.create_env import Environment, create_env_base
from pogema_toolbox.evaluator import evaluation
from pogema_toolbox.registry import ToolboxRegistry
from policies import Right

if __name__ == "__main__":
    ToolboxRegistry.setup_logger("ERROR")
    ToolboxRegistry.register_env("Environment", create_env_base, Environment)
    ToolboxRegistry.register_algorithm("Right", Right)
    environment = {"name": "Environment", "num_agents": 3, "seed": {"grid_search": [1, 2, 3]}, "with_animation": True}
    names = ("sequential", "balanced_multiprocessing", "balanced_dask", "dask")
    algorithms = {name: {"name": "Right", "num_process": 2, "parallel_backend": name} for name in names}
    print(json.dumps(evaluation({"environment": environment, "algorithms": algorithms})))
"""


def test_line_in_a_script_redirects_imports_in_all_its_processes(tmp_path):
    (tmp_path / "policies.py").write_text(POLICIES)
    (tmp_path / "main.py").write_text(MAIN)
    # Dask spawns its workers, which read the script again.
    command = [sys.executable, "-B", "main.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)
    assert len(rows) == 12 and set(rows[0]["metrics"]) == {"ISR", "CSR", "ep_length"}
    assert all(row["metrics"] == rows[number % 3]["metrics"] for number, row in enumerate(rows))
    drawn = sorted(str(path.relative_to(tmp_path)) for path in (tmp_path / "renders").rglob("*.svg"))
    assert drawn[:3] == [f"renders/balanced_dask/pogema-seed{seed}.svg" for seed in (1, 2, 3)] and len(drawn) == 12


def test_own_results_can_be_loaded(tmp_path, monkeypatch):
    ToolboxRegistry.register_algorithm("Policy", Still)
    played = evaluation(SUITE, tmp_path)
    results, suite = load_from_folder(tmp_path)
    assert metrics(results) == metrics(played) and suite["algorithms"] == SUITE["algorithms"]
    (tmp_path / "suite.yaml").unlink()
    with pytest.raises(FileNotFoundError, match="expected the suite of the results"):
        load_from_folder(Path(tmp_path))
    assert json.loads((tmp_path / "Policy.json").read_text()) == results
    (tmp_path / f"{tmp_path.name}.yaml").write_text("{}")
    monkeypatch.chdir(tmp_path)
    assert load_from_folder(Path(".")) == (results, {})
