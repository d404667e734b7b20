"""One training run from a seed to weights: its loop, its budget and its files."""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import json
import math
import os
import platform
import re
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Union

import torch
from filelock import FileLock, Timeout

from pogema_rs import __version__, _engine, policies
from pogema_rs._checks import check_whole
from pogema_rs._files import replaced
from pogema_rs.baselines import _checkpoint
from pogema_rs.baselines._collector import Collector
from pogema_rs.baselines._config import QLearningConfig, TrainingConfig, ValueConfig, completed, first_difference
from pogema_rs.baselines._curve import Curve, open_tensorboard, score_of
from pogema_rs.baselines._episodes import Episodes
from pogema_rs.baselines._lswitcher import ValueLearner
from pogema_rs.baselines._ppo import PPOLearner
from pogema_rs.baselines._progress import Progress
from pogema_rs.baselines._q_learning import QLearner
from pogema_rs.baselines._teacher import Teacher
from pogema_rs.baselines._workers import Workers

#: Learns from episodes.
Learner = Union[QLearner, PPOLearner, ValueLearner]


@dataclass(frozen=True)
class Budget:
    """The limits of a training run, in minutes and in iterations. The run ends at the first limit that it reaches."""

    minutes: Optional[float] = None
    iterations: Optional[int] = None

    def __post_init__(self) -> None:
        """Checks the limits.

        Errors: ValueError without a limit, or for one that is not positive and finite.
        """
        if self.minutes is None and self.iterations is None:
            raise ValueError("minutes and iterations are None, expected at least one limit")
        for name, value in (("minutes", self.minutes), ("iterations", self.iterations)):
            if value is not None and not 0 < value < math.inf:
                raise ValueError(f"{name} is {value}, expected a finite number above 0")

    def share(self, seconds: float, iteration: int) -> float:
        """Returns the used share of the budget; values of at least 1 end the training run."""
        shares = [0.0]
        if self.minutes is not None:
            shares.append(seconds / (60 * self.minutes))
        if self.iterations is not None:
            shares.append(iteration / self.iterations)
        return max(shares)


def train(
    config: TrainingConfig,
    folder: Union[str, os.PathLike[str]],
    budget: Optional[Budget] = None,
    *,
    seed: int = 0,
    threads: int = 1,
    resume: bool = False,
    tensorboard: bool = False,
    draw: bool = True,
    command: Optional[Sequence[str]] = None,
) -> dict[str, float]:
    """Trains a method, writes the files of the run to a folder, and returns the last row of the learning curve.

    If only the iterations are limited, the same config, seed and number of threads give the same weights on the same
    machine, even if the run is killed and resumed. The budget limits the whole run. A resumed run keeps its budget if
    `budget` is None. `command` is the command that `run.json` shows.

    Errors: ValueError or TypeError for a wrong `seed` or `threads`, for a new run without a budget, or if the network
    is no longer finite; MemoryError if there is too little memory; FileExistsError if the folder holds a run and
    `resume` is False, or another run uses it; FileNotFoundError if there is no checkpoint to resume; ValueError if
    the checkpoint is damaged or belongs to another method, config or seed; ImportError if Matplotlib or TensorBoard is
    needed but missing; OSError if a file cannot be written.
    """
    seed = check_whole("seed", seed, 0, 2**63 - 1)
    threads = check_whole("threads", threads, 1, _engine.MAX_THREADS)
    if budget is None and not resume:
        raise ValueError("budget is None, expected a Budget; only a resumed run may omit it")
    with _memory_errors(), _settings(seed), _locked(Path(folder), resume), Workers(threads) as workers:
        run = _Run(config, Path(folder), seed, workers, resume, budget)
        run.draw, run.command = draw, None if command is None else list(command)
        try:
            run.open(tensorboard)
            return run.play()
        except BaseException:
            if run.is_new and run.iteration == 0:
                run.remove()
            raise
        finally:
            run.close()


@contextmanager
def _memory_errors() -> Iterator[None]:
    """Turns PyTorch's out-of-memory error into a MemoryError.

    Errors: MemoryError.
    """
    try:
        yield
    except RuntimeError as error:
        # On the CPU, PyTorch has no class for this error.
        if not re.search("can't allocate memory|bad_alloc", str(error)):
            raise
        bytes_wanted = re.search(r"allocate (\d+) bytes", str(error))
        wanted = f"{int(bytes_wanted[1]):,} bytes" if bytes_wanted else "an array"
        raise MemoryError(f"PyTorch has no memory for {wanted}") from None


@contextmanager
def _settings(seed: int) -> Iterator[None]:
    """Sets PyTorch up for a training run, and restores the caller's settings afterwards."""
    before = (torch.get_num_threads(), torch.are_deterministic_algorithms_enabled())
    warns, fills = (
        torch.is_deterministic_algorithms_warn_only_enabled(),
        torch.utils.deterministic.fill_uninitialized_memory,
    )
    with torch.random.fork_rng(devices=[]):
        try:
            torch.set_num_threads(1)  # see `Workers`
            torch.use_deterministic_algorithms(True)
            # No result reads memory that was never written.
            torch.utils.deterministic.fill_uninitialized_memory = False
            torch.manual_seed(seed)
            yield
        finally:
            torch.set_num_threads(before[0])
            torch.use_deterministic_algorithms(before[1], warn_only=warns)
            torch.utils.deterministic.fill_uninitialized_memory = fills


@contextmanager
def _locked(folder: Path, resume: bool) -> Iterator[None]:
    """Keeps other runs out of a folder; makes it for a new run, and deletes it again if an error leaves it empty.

    Errors: FileExistsError if another training run uses the folder.
    """
    made = not folder.exists()
    if made and resume:
        yield  # the error about the missing checkpoint is clearer
        return
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / ".lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise FileExistsError(f"{folder}: another training run uses the folder") from None
    try:
        yield
    except BaseException:
        _unlock(lock, folder)
        with contextlib.suppress(OSError):
            if made:
                folder.rmdir()
        raise
    _unlock(lock, folder)


def _unlock(lock: FileLock, folder: Path) -> None:
    lock.release()
    # Windows deletes no file that another training run has just opened.
    with contextlib.suppress(OSError):
        (folder / ".lock").unlink(missing_ok=True)


class _Run:
    """A training run in progress."""

    writer: Any = None
    draw = True
    command: Optional[list[str]] = None

    def __init__(
        self, config: TrainingConfig, folder: Path, seed: int, workers: Workers, resume: bool, budget: Optional[Budget]
    ) -> None:
        self.config, self.folder, self.seed, self.threads = config, folder, seed, workers.threads
        self.path = folder / "checkpoint.pt"
        # Read the commit now, because the checkout may change during the run.
        self.commit = _commit()
        if not resume and self.path.exists():
            raise FileExistsError(f"{folder}: the folder holds a run; continue it with --resume or name another folder")
        saved = _checkpoint.load(self.path, config.method) if resume else None
        self.is_new = saved is None
        description = folder / "run.json"
        self._earlier = description.read_bytes() if description.exists() else None
        self._files = set(self._below())
        self.generator = torch.Generator().manual_seed(seed)
        self.episodes = Episodes(config.environment, seed, config.schedule.validation_steps)
        self.learner: Learner = _learner_of(config)(config, self.episodes.map_size, self.generator, workers)
        self.curve = Curve(score_of(config.environment.on_target))
        self.iteration, self.seconds, self.agent_steps = 0, 0.0, 0
        self.best_weights = self._weights()
        if saved is not None:
            self._restore(saved)
            budget = Budget(*saved["budget"]) if budget is None else budget
        assert budget is not None
        self.budget = budget
        self.lanes: dict[tuple[str, int], Collector] = {}
        self.validators: dict[tuple[str, int], Collector] = {}

    def open(self, tensorboard: bool) -> None:
        """Opens the files, and makes the environments."""
        config, threads = self.config, self.threads
        if tensorboard:
            self.writer = open_tensorboard(self.folder)
        self.learner.open(self.folder)
        size, schedule = self.episodes.map_size, config.schedule
        # Each kind needs its own collector: an environment cannot change `on_target` or its number of agents.
        kinds = config.environment.kinds
        self.lanes = {kind: Collector(config, size, schedule.lanes, threads) for kind in kinds}
        environment = dataclasses.replace(config.environment, max_episode_steps=schedule.validation_steps)
        validated = dataclasses.replace(config, environment=environment)
        episodes = schedule.validation_episodes
        self.validators = {kind: Collector(validated, size, episodes, threads) for kind in kinds}

    def play(self) -> dict[str, float]:
        """Trains until the budget is used up."""
        budget = self.budget
        progress = Progress(self.config.method, budget.share(self.seconds, self.iteration))
        schedule = self.config.schedule
        if self.iteration == 0:
            self._describe()
            self._save()
        while budget.share(self.seconds, self.iteration) < 1:
            began = time.perf_counter()
            try:
                parts = self._train_once()
            except RuntimeError as error:
                # PyTorch draws no actions from outputs that are not finite.
                if "probability tensor" not in str(error):
                    raise
                raise self._divergence() from None
            self.seconds += time.perf_counter() - began
            share = budget.share(self.seconds, self.iteration)
            if self.iteration % schedule.validate_every == 0 or share >= 1:
                self._validate(parts)
                progress.tell(share, self.seconds, self.agent_steps, self.curve)
            if self.iteration % schedule.checkpoint_every == 0 or share >= 1:
                self._save()
        # A run that resumes with a smaller budget may already have used it up, without a validation.
        if not self.curve.rows or self.curve.rows[-1]["iteration"] < self.iteration:
            self._validate({})
            self._save()
        self._export()
        self._describe()
        return self.curve.rows[-1]

    def remove(self) -> None:
        """Deletes the files of a run that ended during its first iteration, so that its folder can be used again.

        All other files stay, as do the description and the curve of an earlier run whose checkpoint was deleted.
        """
        self.path.unlink(missing_ok=True)
        description = self.folder / "run.json"
        if self._earlier is None:
            description.unlink(missing_ok=True)
        elif description.read_bytes() != self._earlier:
            description.write_bytes(self._earlier)
        made = [path for path in self._below() if path not in self._files]
        # Windows deletes no open file.
        with contextlib.suppress(OSError):
            for path in sorted(made, reverse=True):
                path.rmdir() if path.is_dir() else path.unlink()
        with contextlib.suppress(OSError):
            (self.folder / ".lock").unlink()
        if not any(self.folder.iterdir()):
            self.folder.rmdir()

    def _below(self) -> Iterator[Path]:
        """Yields the folders of the run and the files in them that a run makes."""
        for pattern in ("replay", "replay/*.bin", "tensorboard", "tensorboard/events.*"):
            yield from self.folder.glob(pattern)

    def close(self) -> None:
        """Frees the environments, and closes the files for TensorBoard."""
        for collector in (*self.lanes.values(), *self.validators.values()):
            collector.close()
        if self.writer is not None:
            self.writer.close()

    def _train_once(self) -> dict[str, float]:
        """Plays the episodes of one iteration, and learns from them."""
        configs, seeds = self.episodes.of_iteration(self.iteration, self.config.schedule.lanes)
        lanes = self.lanes[configs[0]["on_target"], configs[0]["num_agents"]]
        imitation = self.config.imitation
        if self.iteration < imitation.iterations:
            assert isinstance(self.learner, PPOLearner)
            teacher = Teacher(imitation.planner, imitation.nodes, configs[0]["on_target"], lanes.shape)
            record, _ = lanes.play(configs, seeds, self.learner.actor(), teacher)
            parts = self.learner.imitate(record, teacher.advice)
        else:
            record, _ = lanes.play(configs, seeds, self.learner.actor())
            parts = self.learner.learn(record)
        if not all(bool(values.isfinite().all()) for values in self.learner.trained().parameters()):
            raise self._divergence()
        self.iteration += 1
        self.agent_steps += int(record.active[:-1][record.played].sum())
        return parts

    def _divergence(self) -> ValueError:
        rate = f"expected a smaller learner.learning_rate than {self.config.learner.learning_rate}"
        return ValueError(f"iteration {self.iteration + 1}: the network is no longer finite, {rate}")

    def _validate(self, parts: dict[str, float]) -> None:
        """Plays the validation episodes, and keeps the weights if they are the best so far."""
        found_in: dict[str, list[float]] = {}
        for kind, validator in self.validators.items():
            configs, seeds = self.episodes.of_validation(self.config.schedule.validation_episodes, kind)
            generator = torch.Generator().manual_seed(self.seed)
            _, found = validator.play(configs, seeds, self.learner.validation_actor(generator))
            for name, value in found.items():
                found_in.setdefault(name, []).append(value)
        # Some metrics exist only for some values of `on_target`.
        metrics = {name: sum(values) / len(values) for name, values in found_in.items()}
        if metrics[self.curve.score] > self.curve.best:
            self.best_weights = self._weights()
        row = {"iteration": self.iteration, "agent_steps": self.agent_steps, "minutes": self.seconds / 60}
        self.curve.rows.append({**row, **metrics, **parts})
        if self.writer is not None:
            for name, value in {**metrics, **parts}.items():
                self.writer.add_scalar(name, value, self.agent_steps)

    def _weights(self) -> dict[str, torch.Tensor]:
        return {name: values.clone() for name, values in self.learner.trained().state_dict().items()}

    def _save(self) -> None:
        """Writes a checkpoint, and the files that show the progress."""
        self.learner.save()
        _checkpoint.save(
            self.path,
            {
                "method": self.config.method,
                "config": json.dumps(self.config.to_dict()),
                "seed": self.seed,
                "budget": [self.budget.minutes, self.budget.iterations],
                "progress": [self.iteration, self.seconds, self.agent_steps],
                "generators": [self.generator.get_state(), torch.get_rng_state()],
                "learner": self.learner.state(),
                "curve": self.curve.rows,
                "best_weights": self.best_weights,
            },
        )
        self.curve.write(self.folder, f"{self.config.method}, seed {self.seed}", self.draw)

    def _restore(self, saved: dict[str, Any]) -> None:
        difference = first_difference(completed(json.loads(saved["config"]), self.config), self.config.to_dict())
        if difference is not None:
            raise ValueError(f"{self.path}: the run has another config: {difference}")
        if saved["seed"] != self.seed:
            raise ValueError(f"{self.path}: the run has seed {saved['seed']}, not {self.seed}")
        self.iteration, self.seconds, self.agent_steps = saved["progress"]
        self.generator.set_state(saved["generators"][0])
        torch.set_rng_state(saved["generators"][1])
        self.learner.restore(saved["learner"])
        self.curve.rows, self.best_weights = saved["curve"], saved["best_weights"]

    def _export(self) -> None:
        """Writes the best weights in the format that the crate `pogema-policies` reads."""
        learner = self.learner
        network = copy.deepcopy(learner.trained())
        network.load_state_dict(self.best_weights)
        path = self.folder / "weights.safetensors"
        rules: dict[str, Any] = {
            "sampling": learner.sampling,
            "mask_actions": learner.masks,
            "name": learner.policy_name,
        }
        policies.export(network, self.config.encoder, path, **rules)

    def _describe(self) -> None:
        """Writes the settings and the results of the run to `run.json`."""
        values = {
            "method": self.config.method,
            "seed": self.seed,
            "budget": {"minutes": self.budget.minutes, "iterations": self.budget.iterations},
            "threads": self.threads,
            "minutes": round(self.seconds / 60, 3),
            "iterations": self.iteration,
            "agent_steps": self.agent_steps,
            "score": self.curve.score,
            "best": self.curve.best if self.curve.rows else None,
            "versions": {"pogema_rs": __version__, "torch": torch.__version__, "python": platform.python_version()},
            "commit": self.commit,
            "machine": f"{platform.machine()}, {platform.system()}, {torch.backends.cpu.get_cpu_capability()}",
            "command": self.command,
            "config": self.config.to_dict(),
        }
        with replaced(self.folder / "run.json") as file:
            file.write((json.dumps(values, indent=2) + "\n").encode())


def _learner_of(config: TrainingConfig) -> type[Learner]:
    if isinstance(config.learner, ValueConfig):
        return ValueLearner
    return QLearner if isinstance(config.learner, QLearningConfig) else PPOLearner


def _commit() -> Optional[str]:
    """Returns the commit of the checkout that contains this package; None for an installed package or without git."""
    git = shutil.which("git")
    source = Path(__file__).resolve()
    if git is None or "site-packages" in source.parts:
        return None
    done = subprocess.run([git, "rev-parse", "HEAD"], cwd=source.parent, capture_output=True, text=True, check=False)
    return done.stdout.strip() or None
