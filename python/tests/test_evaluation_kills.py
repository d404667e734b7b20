"""Tests that a killed evaluation leaves no process and no lock, and that resuming it gives the same bytes."""

import json
import os
import random
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import pytest
from test_evaluation import BACKENDS, command, play, results, suite, write

SIGNALS = [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL]
#: Number of kills of one suite, and the longest time in seconds before each kill. Dask takes seconds to start.
NUM_KILLS = 5
LONGEST = {"dask": 4.0, "balanced_dask": 4.0}


def session(leader):
    """Returns the living processes of a session."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, sid = stat.read_text().rpartition(") ")[2].split()[:4]
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(sid) == leader and state not in "ZX":
            found.append(int(stat.parent.name))
    return found


def wait_for(condition, seconds=20):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "timed out"
        time.sleep(0.005)


def start(folder, begin, log=subprocess.DEVNULL):
    """Starts a run as the leader of a session. SIGHUP has its default effect, even if this test ignores it."""
    return subprocess.Popen(
        command(folder, begin),
        stdout=log,
        stderr=log,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
    )


def kill_at_random(folder, dice, longest):
    """Plays a suite; at a random moment, kills at most one worker, then the parent.

    Returns whether a signal ended the parent.
    """
    begin = "resume" if (folder / "out" / "about.json").exists() else "new"
    log = (folder / "log").open("a")
    child = start(folder, begin, log)
    until = time.monotonic() + dice.uniform(0, longest)
    while child.poll() is None and time.monotonic() < until:
        time.sleep(0.005)
    # The processes of the run are those of its session.
    workers = [process for process in session(child.pid) if process != child.pid]
    if child.poll() is not None:
        assert child.returncode in (0, 1), (folder / "log").read_text()
    elif workers and dice.random() < 0.3:
        with suppress(ProcessLookupError):
            os.kill(dice.choice(workers), dice.choice(SIGNALS))
    child.send_signal(dice.choice(SIGNALS))
    child.wait()
    wait_for(lambda: not session(child.pid))
    return child.returncode < 0


@pytest.mark.parametrize(
    "backend",
    [pytest.param(name, marks=[] if name == "multiprocessing" else pytest.mark.slow) for name in BACKENDS],
)
def test_killed_run_leaves_no_process_and_resumes_to_the_same_bytes(backend, tmp_path):
    content, whole = suite(backend, seconds=0.02), suite()
    whole["algorithms"]["A star"] = {"name": "astar"}
    assert play(tmp_path / "whole", whole)[1] == 0
    folder, dice = tmp_path / "killed", random.Random(backend)
    write(folder, content)
    num_killed = sum(kill_at_random(folder, dice, LONGEST.get(backend, 2.0)) for _ in range(NUM_KILLS))
    assert num_killed >= 2
    assert "another run is writing" not in (folder / "log").read_text()
    output, status = play(folder, content, "resume")
    assert status == 0, output
    assert results(folder) == results(tmp_path / "whole")


@pytest.mark.parametrize("backend", ["balanced_multiprocessing", "balanced_dask"])
@pytest.mark.parametrize("number", SIGNALS)
def test_workers_end_with_their_parent_in_the_middle_of_an_episode(backend, number, tmp_path):
    # One step of a policy takes longer than the test.
    write(tmp_path, suite(backend, seconds=600.0))
    child = start(tmp_path, "new")
    started = tmp_path / "out" / "about.json"
    wait_for(lambda: started.exists() and len(session(child.pid)) > 2, 60)
    child.send_signal(number)
    child.wait()
    wait_for(lambda: not session(child.pid))
    output, status = play(tmp_path, suite(backend), "anew")
    assert status == 0, output


def test_no_forked_process_inherits_the_lock(tmp_path):
    # A policy that starts a process of its own, which outlives the run.
    content = suite("sequential", num_seeds=1)
    content["algorithms"]["A star"].update(name="Forking", pid=str(tmp_path / "pid"))
    output, status = play(tmp_path, content)
    assert status == 0, output
    orphan = json.loads((tmp_path / "pid").read_text())
    try:
        os.kill(orphan, 0)
        output, status = play(tmp_path, content, "anew")
        assert status == 0, output
    finally:
        os.kill(orphan, signal.SIGKILL)
