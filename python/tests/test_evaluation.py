"""Tests of suites with policies in Python, on all backends."""

import json
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

SCRIPT = Path(__file__).parent / "toolbox" / "play_suite.py"
BACKENDS = ["sequential", "multiprocessing", "balanced_multiprocessing", "dask", "balanced_dask"]


def suite(backend="sequential", seconds=0.0, num_seeds=5, **algorithms):
    """Returns a suite of A* agents on named maps."""
    return {
        "environment": {
            "name": "Environment",
            "on_target": "nothing",
            "collision_system": "soft",
            "observation_type": "POMAPF",
            "max_episode_steps": 32,
            "obs_radius": 3,
            "seed": {"grid_search": list(range(num_seeds))},
            "num_agents": {"grid_search": [4, 8]},
            "map_name": {"grid_search": ["hall", "validation-mazes-seed-00[0-3]"]},
        },
        "algorithms": {
            "A star": {"name": "Slow", "seconds": seconds, "parallel_backend": backend, "num_process": 2},
            **algorithms,
        },
    }


def command(folder, begin="new", *address):
    return [sys.executable, "-B", str(SCRIPT), str(folder / "suite.yaml"), str(folder / "out"), begin, *address]


def write(folder, content):
    folder.mkdir(exist_ok=True)
    (folder / "suite.yaml").write_text(yaml.safe_dump(content, sort_keys=False))


def play(folder, content, begin="new", *address):
    """Plays a suite with the script, and returns its output and exit status."""
    write(folder, content)
    done = subprocess.run(command(folder, begin, *address), capture_output=True, text=True, timeout=300)
    return done.stdout + done.stderr, done.returncode


def results(folder, key="A star"):
    return (folder / "out" / f"{key}.json").read_bytes()


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """The results of the same suite with the built-in A*."""
    folder = tmp_path_factory.mktemp("built-in")
    content = suite()
    content["algorithms"]["A star"] = {"name": "astar"}
    output, status = play(folder, content)
    assert status == 0, output
    return results(folder)


@pytest.mark.parametrize("backend", BACKENDS)
def test_every_backend_gets_the_results_of_the_built_in_policy(backend, played, tmp_path):
    output, status = play(tmp_path, suite(backend))
    assert status == 0, output
    assert output.splitlines()[-1] == "20" or output.startswith("20\n"), output
    assert results(tmp_path) == played
    rows = json.loads(played)
    assert [row["env_grid_search"]["num_agents"] for row in rows[:4]] == [4, 4, 8, 8]
    assert {"ISR", "CSR", "ep_length", "SoC", "makespan", "avg_agents_density", "a_collisions", "o_collisions"} == set(
        rows[0]["metrics"]
    )


def test_dead_process_is_replaced_and_no_episode_is_lost(played, tmp_path):
    content = suite("balanced_multiprocessing")
    content["algorithms"]["A star"].update(name="Mortal", mark=str(tmp_path / "died"))
    output, status = play(tmp_path, content)
    assert status == 0, output
    assert "a process died" in output and (tmp_path / "died").exists()
    assert results(tmp_path) == played


@pytest.mark.parametrize("observations", ["default", "POMAPF", "MAPF"])
@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_staying_policy_has_the_metrics_of_the_built_in_one(on_target, observations, tmp_path):
    content = suite(Still={"name": "Crowded", "parallel_backend": "sequential"}, Stay={"name": "stay"})
    del content["algorithms"]["A star"]
    content["environment"].update(on_target=on_target, observation_type=observations, num_agents=6)
    output, status = play(tmp_path, content)
    assert status == 0, output
    still, stay = (json.loads(results(tmp_path, key)) for key in ("Still", "Stay"))
    assert [row["metrics"] for row in still] == [row["metrics"] for row in stay]
    assert len(still) == 10


@contextmanager
def cluster(folder):
    """Starts a scheduler with two workers, and yields its address and the workers."""
    where = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    to_file = ["--scheduler-file", str(where)]
    children = [subprocess.Popen([*dask, "scheduler", "--port", "0", "--no-dashboard", *to_file])]
    try:
        while not where.exists():
            assert children[0].poll() is None, "the scheduler ended"
            time.sleep(0.05)
        for _ in range(2):
            one = ["worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", *to_file]
            children.append(subprocess.Popen([*dask, *one]))
        yield json.loads(where.read_text())["address"], children[1:]
    finally:
        for child in children:
            child.kill()
            child.wait()


def test_dead_dask_worker_loses_no_episode(played, tmp_path):
    write(tmp_path, suite("balanced_dask", seconds=0.01))
    with cluster(tmp_path) as (address, workers):
        child = subprocess.Popen(command(tmp_path, "new", address))
        lines = tmp_path / "out" / "A star.jsonl"
        while not lines.exists() or lines.read_bytes().count(b"\n") < 4:
            assert child.poll() is None, "the run ended before a worker could be killed"
            time.sleep(0.01)
        workers[0].kill()
        assert child.wait(timeout=120) == 0
    assert results(tmp_path) == played


def test_command_line_plays_built_in_algorithms_on_a_scheduler(tmp_path):
    on_dask = {"name": "LaCAM", "nodes": 200, "parallel_backend": "balanced_dask"}
    content = suite(num_seeds=2, **{"On Dask": on_dask, "Here": {"name": "LaCAM", "nodes": 200}})
    content["algorithms"]["A star"]["parallel_backend"] = "balanced_dask"
    content["algorithms"]["IQL"] = {"name": "iql", "parallel_backend": "dask"}
    write(tmp_path, content)
    (tmp_path / "policies.py").write_text(f"import runpy\nrunpy.run_path({str(SCRIPT)!r})['register']()\n")
    run = [sys.executable, "-B", "-m", "pogema_rs.toolbox", "suite.yaml", "--out", "out", "--register", "policies.py"]
    with cluster(tmp_path) as (address, _):
        done = subprocess.run([*run, "--dask", address], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
    rows = {key: json.loads(results(tmp_path, key)) for key in ("On Dask", "Here")}
    assert [row["metrics"] for row in rows["On Dask"]] == [row["metrics"] for row in rows["Here"]]
    assert len(rows["Here"]) == len(json.loads(results(tmp_path))) == 8
    episodes = json.loads((tmp_path / "out" / "IQL.episodes.json").read_text())
    assert all(0 < episode["network_seconds"] <= episode["seconds"] for episode in episodes)
    again = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert again.returncode == 1
    assert again.stderr.startswith("error: out: has results already"), again.stderr


def test_results_say_how_each_episode_was_played(played, tmp_path):
    content = suite("multiprocessing")
    # A built-in algorithm begins the run.
    content["algorithms"] = {"Stay": {"name": "stay"}, **content["algorithms"]}
    assert play(tmp_path, content)[1] == 0
    about = json.loads((tmp_path / "out" / "about.json").read_text())
    episodes = json.loads((tmp_path / "out" / "A star.episodes.json").read_text())
    rows = json.loads(results(tmp_path))
    assert len(about["runs"]) == 1 and len(episodes) == len(rows)
    versions = about["runs"][0]["versions"]
    assert versions["Python"].startswith("3.") and {"pogema-rs", "POGEMA", "numpy"} <= set(versions)
    for number, (episode, row) in enumerate(zip(episodes, rows)):
        assert (episode["episode"], episode["run"]) == (number, 0) and episode["seconds"] > 0
        assert "machine" not in episode
        varied = row["env_grid_search"]
        assert episode["seed"] == episode["config"]["seed"] == varied["seed"]
        # The config holds the map that the seed chose, not the pattern.
        assert episode["config"]["map_name"].startswith(varied["map_name"].split("[")[0])
        assert "[" not in episode["config"]["map_name"]


@pytest.mark.parametrize("backend", ["sequential", "multiprocessing", "dask"])
def test_failures_are_reported_and_other_episodes_are_played(backend, tmp_path):
    crowded = {"name": "Crowded", "parallel_backend": backend, "num_process": 2}
    output, status = play(tmp_path, suite(backend, num_seeds=2, Crowded=crowded, Still={"name": "stay"}))
    assert status == 1
    assert "EvaluationError: 4 episodes could not be played" in output
    assert "Crowded: episode 2: ValueError: 8 are" in output
    failed = [json.loads(line) for line in (tmp_path / "out" / "Crowded.failed.jsonl").read_text().splitlines()]
    assert sorted(row["index"] for row in failed) == [2, 3, 6, 7]
    for row in failed:
        assert row["config"]["seed"] == row["env_grid_search"]["seed"]
        assert row["config"]["num_agents"] == 8
        assert "in act" in row["traceback"] and "too many" in row["traceback"]
    assert len(json.loads(results(tmp_path, "Still"))) == 8
    # The other results are kept, so that a resumed run plays only the missing episodes.
    assert (tmp_path / "out" / "Crowded.jsonl").read_bytes().count(b"\n") == 4


def test_wrong_suites_and_folders_are_reported(tmp_path):
    def output(change, begin="new"):
        content = suite(num_seeds=1)
        change(content)
        return play(tmp_path, content, begin)[0]

    def environment(**fields):
        return lambda content: content["environment"].update(fields)

    unmatched = output(environment(map_name="nowhere"))
    assert unmatched.startswith("ValueError: ")
    assert "config: `map_name` is `nowhere`, expected a pattern that matches a known map" in unmatched
    assert "unknown key `sise` in environment; did you mean `size`?" in output(environment(sise=8))
    missing = output(lambda content: content["algorithms"].update(S={"name": "Crowd"}))
    assert missing.startswith("ValueError: ") and "`Crowd` is neither registered nor built in" in missing
    assert "did you mean `Crowded`?" in missing and not (tmp_path / "out").exists()
    assert output(lambda content: None, "anew").startswith("4\n")
    again = output(lambda content: None)
    assert again.startswith("OSError: ") and "has results already: begin='resume' (`--resume`) continues them" in again
    assert "results for environments that differ" in output(environment(max_episode_steps=16), "resume")
