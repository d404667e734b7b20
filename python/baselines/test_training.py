"""Tests of whole training runs: repeated, killed and resumed ones, their files, and the networks that they export."""

import csv
import dataclasses
import errno
import json
import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import torch
from filelock import FileLock
from matplotlib import figure
from pogema_rs import policies
from pogema_rs.baselines import METHODS, Budget, _checkpoint, _networks, _run, train
from pogema_rs.baselines.__main__ import main
from pogema_rs.baselines._config import completed, first_difference
from pogema_rs.baselines._curve import Curve
from pogema_rs.baselines._networks import AgentNetwork
from safetensors.numpy import load_file
from small import (
    PPO_METHODS,
    Q_METHODS,
    VALUE_METHODS,
    command,
    outputs_of,
    read_network,
    run,
    small_config,
)


def weights(folder):
    """Returns the exported and the last weights of a run."""
    method = json.loads((folder / "run.json").read_text())["method"]
    saved = _checkpoint.load(folder / "checkpoint.pt", method)
    last = {name: values.numpy() for name, values in saved["learner"]["modules"][0].items()}
    return {**load_file(folder / "weights.safetensors"), **{f"last.{name}": one for name, one in last.items()}}


def check_equal(first, second):
    """Checks that two runs ended with bit-identical weights."""
    ours, theirs = weights(first), weights(second)
    assert ours.keys() == theirs.keys() and len(ours) > 6
    for name in ours:
        assert ours[name].tobytes() == theirs[name].tobytes(), name


def test_the_methods_are_covered():
    assert set(METHODS) == {*Q_METHODS, *PPO_METHODS, *VALUE_METHODS}


@pytest.mark.parametrize("method", METHODS)
def test_a_seed_repeats_and_a_resumed_run_equals_an_uninterrupted_one(method, tmp_path):
    config = small_config(method)
    train(config, tmp_path / "whole", Budget(iterations=8), seed=3)
    train(config, tmp_path / "part", Budget(iterations=4), seed=3)
    halfway = weights(tmp_path / "part")
    train(config, tmp_path / "part", Budget(iterations=8), seed=3, resume=True)
    check_equal(tmp_path / "whole", tmp_path / "part")
    assert any(not np.array_equal(halfway[name], one) for name, one in weights(tmp_path / "part").items())
    train(config, tmp_path / "other", Budget(iterations=4), seed=4)
    assert any(not np.array_equal(halfway[name], one) for name, one in weights(tmp_path / "other").items())


@pytest.mark.parametrize("method", ("iql", "ippo"))
def test_the_learning_rate_halves_and_a_resumed_run_continues_with_it(method, tmp_path):
    config = small_config(method, "learner.half_life=2")
    train(config, tmp_path / "whole", Budget(iterations=4), seed=3)
    train(config, tmp_path / "part", Budget(iterations=2), seed=3)
    train(config, tmp_path / "part", Budget(iterations=4), seed=3, resume=True)
    check_equal(tmp_path / "whole", tmp_path / "part")
    learner = _checkpoint.load(tmp_path / "part" / "checkpoint.pt", method)["learner"]
    rate = learner["modules"][-1]["param_groups"][0]["lr"]
    assert rate == pytest.approx(config.learner.learning_rate / 4)


def test_logits_are_values_divided_by_the_temperature(tmp_path):
    for name, temperature in (("greedy", 0.0), ("softmax", 0.5)):
        config = small_config("iql", f"learner.temperature={temperature}")
        train(config, tmp_path / name, Budget(iterations=2), seed=3)
        assert policies.load(tmp_path / name / "weights.safetensors").sampling == name
    greedy, softmax = (weights(tmp_path / name) for name in ("greedy", "softmax"))
    for name in ("policy.weight", "policy.bias"):
        np.testing.assert_array_equal(softmax[f"last.{name}"], greedy[f"last.{name}"])
        assert np.abs(softmax[name] - 2 * softmax[f"last.{name}"]).max() == 0


@pytest.mark.parametrize("method, changes", [("iql", ["learner.temperature=0"]), ("ippo", [])])
def test_the_average_of_the_networks_is_exported(method, changes, tmp_path):
    config = small_config(method, "learner.averaging=0.75", "learner.learning_rate=0.01", *changes)
    path = tmp_path / "checkpoint.pt"
    found = []
    for iterations in (1, 2):
        train(config, tmp_path, Budget(iterations=iterations), seed=3, resume=iterations > 1)
        modules = _checkpoint.load(path, method)["learner"]["modules"]
        # The network, and the last module before the optimizer: the average.
        found.append([modules[place]["policy.weight"].numpy() for place in (0, -2)])
        if iterations == 1:
            np.testing.assert_array_equal(weights(tmp_path)["policy.weight"], found[0][1])
    (_, before), (network, average) = found
    assert np.abs(network - before).max() > 1e-4
    np.testing.assert_allclose(average, 0.75 * before + 0.25 * network, atol=1e-6)


def test_a_training_run_leaves_the_settings_of_pytorch_as_they_were(tmp_path):
    def settings():
        return (
            torch.get_num_threads(),
            torch.are_deterministic_algorithms_enabled(),
            torch.utils.deterministic.fill_uninitialized_memory,
            torch.get_rng_state().tolist(),
        )

    torch.manual_seed(5)
    before = settings()
    train(small_config("iql"), tmp_path / "done", Budget(iterations=1), threads=before[0] + 1)
    assert settings() == before
    with pytest.raises(ValueError):
        train(small_config("iql", "environment.num_agents=90"), tmp_path / "failed", Budget(iterations=1))
    assert settings() == before
    for wrong, error in (({"seed": 2**64}, ValueError), ({"seed": None}, TypeError), ({"threads": 0}, ValueError)):
        with pytest.raises(error, match=next(iter(wrong))):
            train(small_config("iql"), tmp_path / "failed", Budget(iterations=1), **wrong)
        assert settings() == before
    assert not (tmp_path / "failed").exists()


@pytest.mark.parametrize("method", ("iql", "ippo"))
def test_a_training_run_that_fails_before_its_first_iteration_ends_leaves_no_files(method, tmp_path):
    too_many = small_config(method, "environment.num_agents=90")
    folder = tmp_path / "run"
    with pytest.raises(ValueError):
        train(too_many, folder, Budget(iterations=1))
    assert not folder.exists()
    folder.mkdir()
    for name in ("notes.txt", "replay/mine.txt", "tensorboard/mine.txt"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("mine")
    before = sorted(folder.rglob("*"))
    with pytest.raises(ValueError):
        train(too_many, folder, Budget(iterations=1), tensorboard=True)
    assert sorted(folder.rglob("*")) == before
    train(small_config(method), folder, Budget(iterations=1))
    assert (folder / "weights.safetensors").exists()
    # A run whose checkpoint was deleted keeps its description and curve.
    (folder / "checkpoint.pt").unlink()
    kept = {name: (folder / name).read_bytes() for name in ("run.json", "curve.csv", "curve.svg")}
    with pytest.raises(ValueError):
        train(too_many, folder, Budget(iterations=1))
    assert {name: (folder / name).read_bytes() for name in kept} == kept


def stop_in(monkeypatch, number):
    """Interrupts the next training run in iteration `number`, counted from 1."""
    train_once = _run._Run._train_once

    def stopping(run):
        if run.iteration + 1 == number:
            monkeypatch.setattr(_run._Run, "_train_once", train_once)
            raise KeyboardInterrupt
        return train_once(run)

    monkeypatch.setattr(_run._Run, "_train_once", stopping)


def test_a_resumed_run_keeps_its_budget(tmp_path, monkeypatch):
    config = small_config("ippo")
    train(config, tmp_path / "whole", Budget(iterations=6), seed=3)
    stop_in(monkeypatch, 6)
    with pytest.raises(KeyboardInterrupt):
        train(config, tmp_path / "part", Budget(iterations=6), seed=3)
    train(config, str(tmp_path / "part"), seed=3, resume=True)
    check_equal(tmp_path / "whole", tmp_path / "part")
    with pytest.raises(ValueError, match="budget is None"):
        train(config, tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_resumed_run_whose_budget_is_used_up_is_validated(tmp_path, monkeypatch):
    config = small_config("iql", "schedule.validate_every=100")
    stop_in(monkeypatch, 4)
    with pytest.raises(KeyboardInterrupt):
        train(config, tmp_path / "part", Budget(iterations=6))
    assert not (tmp_path / "part" / "curve.csv").exists()
    monkeypatch.setattr(sys, "argv", ["own.py", "--iterations", "9"])
    last = train(config, tmp_path / "part", Budget(iterations=1), resume=True)
    assert last["iteration"] == 2
    found = weights(tmp_path / "part")
    np.testing.assert_array_equal(found["core.0.weight_hh_l0"], found["last.core.0.weight_hh_l0"])
    described = json.loads((tmp_path / "part" / "run.json").read_text())
    assert described["command"] is None and described["best"] is not None


@pytest.mark.parametrize("method", ["ippo", "iql"])
def test_a_network_that_is_not_finite_ends_a_training_run(method, tmp_path):
    config = small_config(method)
    # A config file with such a large rate is rejected.
    config = dataclasses.replace(config, learner=dataclasses.replace(config.learner, learning_rate=1e30))
    with pytest.raises(ValueError, match=": the network is no longer finite, expected a smaller learner.learning_rate"):
        train(config, tmp_path, Budget(iterations=9))


def test_curves_hold_whole_numbers_and_negative_scores(tmp_path):
    curve = Curve("reward")
    curve.rows = [{"minutes": minutes, "agent_steps": 12345678, "reward": -0.1 - minutes} for minutes in (1.0, 2.0)]
    curve.write(tmp_path, "title", drawn=True)
    assert (tmp_path / "curve.csv").read_text().splitlines()[1] == "1,12345678,-1.1"
    figures = []
    original = figure.Figure.savefig

    def savefig(self, *arguments, **options):
        figures.append(self)
        return original(self, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figure.Figure, "savefig", savefig)
        curve.write(tmp_path, "title", drawn=True)
    bottom, top = figures[0].axes[0].get_ylim()
    assert bottom < -2.1 and top > -1.1


def test_a_failed_start_without_tensorboard_leaves_no_files(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "tensorboard", None)
    with pytest.raises(ImportError, match="--tensorboard needs"):
        train(small_config("iql"), tmp_path / "run", Budget(iterations=1), tensorboard=True)
    assert not (tmp_path / "run").exists()
    train(small_config("iql"), tmp_path / "run", Budget(iterations=1))
    files = sorted(path.name for path in (tmp_path / "run").iterdir())
    with pytest.raises(ImportError, match="--tensorboard needs"):
        train(small_config("iql"), tmp_path / "run", Budget(iterations=2), tensorboard=True, resume=True)
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == files


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ({}, "minutes and iterations are None, expected at least one limit"),
        ({"minutes": 0}, "minutes is 0, expected a finite number above 0"),
        ({"iterations": 0}, "iterations is 0, expected a finite number above 0"),
        ({"minutes": float("inf")}, "minutes is inf, expected a finite number above 0"),
    ],
)
def test_a_budget_needs_a_limit_above_zero(limits, text):
    with pytest.raises(ValueError, match=text):
        Budget(**limits)


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="needs os.posix_fallocate")
def test_a_replay_that_does_not_fit_the_disk_is_an_error(tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", fail)
    with pytest.raises(OSError, match="No space left on device"):
        train(small_config("iql"), tmp_path / "run", Budget(iterations=1))
    assert not (tmp_path / "run").exists()


def test_ppo_keeps_finite_weights_with_a_single_sample(tmp_path):
    single = ("environment.num_agents=1", "environment.max_episode_steps=1", "schedule.lanes=1")
    config = small_config("ippo", *single)
    last = train(config, tmp_path, Budget(iterations=2))
    assert all(np.isfinite(values).all() for values in weights(tmp_path).values())
    assert np.isfinite(last["critic"])


def test_losses_of_ppo_are_means_of_the_updates(tmp_path):
    # A single lane makes a single minibatch, so both configs make one update.
    config = small_config("ippo", "schedule.lanes=1", "learner.minibatches=8", "learner.epochs=1")
    whole = small_config("ippo", "schedule.lanes=1", "learner.minibatches=1", "learner.epochs=1")
    few, one = (train(each, tmp_path / name, Budget(iterations=1)) for name, each in (("few", config), ("one", whole)))
    assert few["critic"] == one["critic"] > 0


def test_windows_pass_convolutions_in_parts(monkeypatch):
    config = small_config("follower", "network.filters=4", "network.blocks=1")
    torch.manual_seed(0)
    network = AgentNetwork(config.encoder, config.network, has_value=True)
    windows = torch.rand(3, 5, *config.encoder.shape)
    found = []
    for num_rows in (4096, 4, 1):
        monkeypatch.setattr(_networks, "ROWS_AT_ONCE", num_rows)
        features, _ = network.features(windows, torch.zeros(3, 5, 0))
        network.zero_grad()
        features.square().sum().backward()
        found.append([features.detach(), *(parameter.grad.clone() for parameter in network.body.parameters())])
    plain = network.body(windows.flatten(0, 1)).view(3, 5, -1)
    torch.testing.assert_close(found[0][0], plain)
    for others in zip(*found):
        for other in others[1:]:
            torch.testing.assert_close(other, others[0])


def test_networks_with_all_layers_return_the_same_logits_in_rust(tmp_path):
    changes = ["network.filters=4", "network.blocks=1", "encoder.scalars=[goal_offset]", "learner.batch=2"]
    config = small_config("iql", *changes)
    train(config, tmp_path, Budget(iterations=1))
    policy = policies.load(tmp_path / "weights.safetensors")
    assert policy.encoder == config.encoder
    network = read_network("iql", config, tmp_path / "weights.safetensors")
    rng = np.random.default_rng(0)
    windows = rng.integers(-1, 2, (64, *config.encoder.shape)).astype(np.float32)
    scalars = rng.uniform(-1, 1, (64, 2)).astype(np.float32)
    np.testing.assert_allclose(policy.logits(windows, scalars), outputs_of(network, windows, scalars), atol=1e-5)


def test_lifelong_and_one_shot_episodes_share_a_training_run(tmp_path):
    config = small_config("qmix", "environment.on_target=[restart, nothing]")
    train(config, tmp_path / "whole", Budget(iterations=4), seed=3)
    rows = list(csv.DictReader((tmp_path / "whole" / "curve.csv").open(newline="")))
    assert len(rows) == 2 and {"reward", "ISR", "avg_throughput"} < set(rows[0])
    assert json.loads((tmp_path / "whole" / "run.json").read_text())["score"] == "reward"
    # The run stops between the two rules.
    train(config, tmp_path / "part", Budget(iterations=3), seed=3)
    train(config, tmp_path / "part", Budget(iterations=4), seed=3, resume=True)
    whole, part = weights(tmp_path / "whole"), weights(tmp_path / "part")
    last = [name for name in whole if name.startswith("last.")]
    assert last and all(whole[name].tobytes() == part[name].tobytes() for name in last)


@pytest.mark.parametrize("method", METHODS)
def test_two_numbers_of_agents_share_a_training_run(method, tmp_path):
    config = small_config(method, "environment.num_agents=[2, 3]")
    train(config, tmp_path / "whole", Budget(iterations=4), seed=3)
    rows = list(csv.DictReader((tmp_path / "whole" / "curve.csv").open(newline="")))
    assert len(rows) == 2 and all(np.isfinite(float(value)) for row in rows for value in row.values())
    values = json.loads((tmp_path / "whole" / "run.json").read_text())
    assert values["config"]["environment"]["num_agents"] == [2, 3]
    train(config, tmp_path / "part", Budget(iterations=2), seed=3)
    train(config, tmp_path / "part", Budget(iterations=4), seed=3, resume=True)
    check_equal(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize("method", ["qmix", "ippo"])
def test_a_killed_run_resumes_to_the_same_weights(method, tmp_path):
    assert run(method, tmp_path / "whole", "--iterations", "120").returncode == 0
    killed = tmp_path / "killed"
    checkpoint, kills = killed / "checkpoint.pt", 0
    for number in range(3):
        process = subprocess.Popen(
            command(method, killed, "--iterations", "120", *(["--resume"] if number else [])),
            stdout=subprocess.DEVNULL,
        )
        before = checkpoint.stat().st_mtime_ns if number else None
        while process.poll() is None:
            if checkpoint.exists() and checkpoint.stat().st_mtime_ns != before:
                # The kill happens between two checkpoints, or while a checkpoint is written.
                time.sleep(0.05 * (number + 1))
                break
            time.sleep(0.01)
        kills += process.poll() is None
        process.kill()
        process.wait()
        reached = _checkpoint.load(checkpoint, method)["progress"][0]
        assert reached < 120, "the training ended before the kill"
    assert kills == 3
    assert run(method, killed, "--iterations", "120", "--resume").returncode == 0
    check_equal(tmp_path / "whole", killed)


@pytest.mark.skipif(os.name != "posix", reason="Windows has no SIGINT for another process")
def test_an_interrupted_run_says_how_to_continue(tmp_path):
    process = subprocess.Popen(
        command("iql", tmp_path, "--minutes", "5"),
        stderr=subprocess.PIPE,
        text=True,
        # A shell's background job would ignore SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    path = tmp_path / "checkpoint.pt"
    # A run that ends in its first iteration removes its checkpoint, so this loop waits for a later checkpoint.
    while not path.exists() or _checkpoint.load(path, "iql")["progress"][0] == 0:
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (130, "stopped; --resume continues from the last checkpoint\n")
    reached = _checkpoint.load(path, "iql")["progress"][0]
    assert run("iql", tmp_path, "--iterations", str(reached + 2), "--resume").returncode == 0


def test_a_run_writes_its_files(tmp_path):
    done = run("vdn", tmp_path, "--iterations", "4", "--seed", "5", "--tensorboard")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 3 and "min left" in lines[0] and lines[-1] == f"wrote {tmp_path / 'weights.safetensors'}"
    rows = list(csv.DictReader((tmp_path / "curve.csv").read_text().splitlines()))
    assert [row["iteration"] for row in rows] == ["2", "4"]
    assert all(0 <= float(row["ISR"]) <= 1 for row in rows)
    assert ElementTree.parse(tmp_path / "curve.svg").getroot().tag.endswith("svg")
    values = json.loads((tmp_path / "run.json").read_text())
    assert (values["method"], values["seed"], values["iterations"]) == ("vdn", 5, 4)
    assert values["budget"] == {"minutes": None, "iterations": 4} and values["minutes"] > 0
    assert values["config"]["environment"]["size"] == 5 and values["versions"]["torch"] == torch.__version__
    assert list((tmp_path / "tensorboard").iterdir())


def test_wrong_runs_fail_with_one_clear_line_and_change_nothing(tmp_path):
    folder = tmp_path / "run"
    assert run("iql", folder, "--iterations", "2").returncode == 0
    content = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    config = "learner.discount is 0.95, not 0.5"
    broken, missing = tmp_path / "broken", tmp_path / "missing"
    broken.mkdir()
    (broken / "checkpoint.pt").write_bytes(content[folder / "checkpoint.pt"][:-100])
    for method, where, arguments, expected in (
        ("iql", folder, [], "the folder holds a run; continue it with --resume or name another folder"),
        ("vdn", folder, ["--resume"], "the checkpoint belongs to iql, expected vdn"),
        ("iql", folder, ["--resume", "--seed", "1"], "the run has seed 0, not 1"),
        ("iql", folder, ["--resume", "--set", "learner.discount=0.5"], f"the run has another config: {config}"),
        ("iql", broken, ["--resume"], "the file is not a checkpoint of a training run"),
        ("iql", missing, ["--resume"], "no checkpoint to resume from; train without --resume"),
    ):
        done = run(method, where, "--iterations", "4", *arguments)
        assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
        assert expected in done.stderr and done.stderr.startswith(f"train {method}: {where}")
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == content
    assert not missing.exists()


def test_a_damaged_checkpoint_is_never_read_as_another_one(tmp_path):
    path = tmp_path / "checkpoint.pt"
    _checkpoint.save(path, {"method": "iql", "numbers": torch.arange(64)})
    content = path.read_bytes()
    for place in range(0, len(content), 3):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0x3A]) + content[place + 1 :])
        with pytest.raises(
            ValueError, match="checkpoint.pt: the file is not a checkpoint of a training run, or is damaged"
        ):
            _checkpoint.load(path, "iql")


@pytest.mark.parametrize(
    "arguments, expected",
    [
        (["--set", "environment.size=2024-99-99"], "config iql: --set 'environment.size=2024-99-99': month must be"),
        (["--set", "environment.size=0x_"], "config iql: --set 'environment.size=0x_': invalid literal"),
        (["--set", "learner.discount=["], "config iql: --set 'learner.discount=[': "),
        (["--config", "binary.yaml"], "config iql: binary.yaml: "),
    ],
)
def test_unreadable_values_fail_with_one_line(tmp_path, monkeypatch, capsys, arguments, expected):
    monkeypatch.chdir(tmp_path)
    Path("binary.yaml").write_bytes(b"method: \xff")
    assert main(["config", "iql", *arguments]) == 1
    errors = capsys.readouterr().err
    assert errors.startswith(expected) and errors.count("\n") == 1


def test_a_failed_write_keeps_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "checkpoint.pt"
    _checkpoint.save(path, {"method": "iql", "number": 1})

    def full(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        _checkpoint.save(path, {"method": "iql", "number": 2})
    assert _checkpoint.load(path, "iql")["number"] == 1
    assert [one.name for one in tmp_path.iterdir()] == ["checkpoint.pt"]


def test_a_folder_holds_one_training_run_at_a_time(tmp_path):
    folder = tmp_path / "run"
    train(small_config("iql"), folder, Budget(iterations=2))
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    other = FileLock(folder / ".lock")
    with other:
        for resume in (True, False):
            with pytest.raises(FileExistsError, match=f"{folder}: another training run uses the folder"):
                train(small_config("iql"), folder, Budget(iterations=4), resume=resume)
    (folder / ".lock").unlink(missing_ok=True)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    train(small_config("iql"), folder, Budget(iterations=4), resume=True)
    assert not (folder / ".lock").exists()
    # A training run that begins while another one uses the folder leaves no files.
    fresh = tmp_path / "fresh"
    fresh.mkdir()
    with FileLock(fresh / ".lock"), pytest.raises(FileExistsError, match="another training run uses the folder"):
        train(small_config("iql"), fresh, Budget(iterations=1))
    assert [path.name for path in fresh.iterdir()] in ([], [".lock"])


def test_a_saved_config_without_a_newer_field_equals_one_with_its_default():
    config = small_config("iql")
    saved = config.to_dict()
    del saved["environment"]["occupancy"]
    assert first_difference(saved, config.to_dict()) is not None
    assert first_difference(completed(saved, config), config.to_dict()) is None
    changed = small_config("iql", "environment.occupancy=exact")
    assert "environment.occupancy" in first_difference(completed(saved, changed), changed.to_dict())
