"""Tests the films of a `VecEnv` against single engines that record the same episodes."""

import os
import signal
import subprocess
import sys
import textwrap
import warnings
from pathlib import Path

import numpy as np
import pytest
from pogema_rs import Film, _engine
from pogema_rs.vec_env import AutoresetMode, VecEnv
from vec_helpers import CONFIG, shared_seed

MODES = list(AutoresetMode)
STAGES = [{**CONFIG, "num_agents": 3}, {**CONFIG, "num_agents": 5, "size": 9}]
NUM_ENVS = 3


def recorded(config, seed, actions):
    """Returns a single engine that has recorded an episode."""
    engine = _engine.Engine({**config, "seed": seed})
    engine.film(True)
    engine.reset()
    for step in actions:
        engine.step(step[: config["num_agents"]].tolist())
    return engine


class Watch:
    """Plays a `VecEnv`, and keeps the config, the seed and the actions of each episode of one environment."""

    def __init__(self, env, index):
        self.env, self.index, self.rng = env, index, np.random.default_rng(1)
        self.config, self.episodes = STAGES[0], []

    def reset(self, **kwargs):
        self.env.reset(**kwargs)
        self.begin()

    def begin(self):
        self.is_over = False
        self.episodes.append((self.config, int(self.env.episode_seeds[self.index]), []))

    def play(self, num_steps):
        mode = self.env.autoreset_mode
        for _ in range(num_steps):
            actions = self.rng.integers(5, size=(NUM_ENVS, 5))
            if not self.is_over:
                self.episodes[-1][2].append(actions[self.index])
            *_, infos = self.env.step(actions)
            if self.is_over and mode == AutoresetMode.NEXT_STEP:
                self.begin()
            elif "_metrics" in infos and infos["_metrics"][self.index]:
                self.is_over = True
                if mode == AutoresetMode.SAME_STEP:
                    self.begin()
            if self.is_over and mode == AutoresetMode.DISABLED:
                self.reset(options={"reset_mask": np.arange(NUM_ENVS) == self.index})


def text_of(path):
    return Path(path).read_text(encoding="utf-8")


def check_films(watch, folder, every, format="svg"):
    """Compares the films to the recordings of the single engines."""
    expected = [number for number in range(0, len(watch.episodes), every) if watch.episodes[number][2]]
    paths = [folder / f"pogema-episode-{number}.{format}" for number in expected]
    assert watch.env.films == [str(path) for path in paths]
    assert {path.name for path in folder.iterdir()} == {path.name for path in paths}
    for number, path in zip(expected, paths):
        engine = recorded(*watch.episodes[number])
        drawn = engine.draw_svg() if format == "svg" else engine.draw_html(path.stem)
        assert text_of(path) == drawn
    return len(expected)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("format", ["svg", "html"])
@pytest.mark.parametrize("every", [1, 3])
def test_films_show_exactly_the_episodes(tmp_path, mode, format, every):
    folder = tmp_path / "made" / "films"
    film = Film(folder, every=every, env=1, format=format)
    env = VecEnv(STAGES[0], NUM_ENVS, autoreset_mode=mode, film=film, num_agents=5)
    watch = Watch(env, 1)
    watch.reset(seed=4)
    watch.play(50)
    env.close()
    assert check_films(watch, folder, every, format) >= 2


@pytest.mark.parametrize("mode", MODES)
def test_films_follow_resets_seeds_and_new_configs(tmp_path, mode):
    def curriculum(env, metrics):
        if env != 2:
            return None
        watch.config = STAGES[len(watch.episodes) % 2]
        return watch.config

    film = Film(tmp_path, env=2)
    env = VecEnv(STAGES[0], NUM_ENVS, autoreset_mode=mode, film=film, num_agents=5, map_size=9, curriculum=curriculum)
    watch = Watch(env, 2)
    watch.reset(seed=4)
    watch.play(30)
    env.reset(seed=6, options={"reset_mask": np.array([True, True, False])})
    watch.play(5)
    watch.reset(seed=[7, 8, 9])
    watch.play(4)
    watch.reset()
    watch.reset()
    watch.play(12)
    env.set_configs(STAGES[1])
    watch.config = STAGES[1]
    watch.reset(seed=[1, 2, 3], options={"reset_mask": np.array([False, False, True])})
    watch.play(21)
    env.close()
    assert check_films(watch, tmp_path, 1) > 8
    assert {config["num_agents"] for config, *_ in watch.episodes} == {3, 5}


def test_2_0_semantics_are_filmed(tmp_path):
    config = {**CONFIG, "num_agents": 5, "on_target": "nothing"}
    env = VecEnv(config, 1, film=Film(tmp_path), semantics="2.0")
    env.reset(seed=3)
    actions = np.random.default_rng(0).integers(5, size=(9, 1, 5))
    for step in actions:
        env.step(step)
    env.close()
    engine = _engine.Engine({**config, "seed": shared_seed(3)(0, 0)}, None, True)
    engine.film(True)
    engine.reset()
    for step in actions:
        engine.step(step[0].tolist())
    assert text_of(env.films[0]) == engine.draw_svg()


@pytest.mark.parametrize("mode", MODES)
def test_filming_changes_no_result(tmp_path, mode):
    filmed, plain = (VecEnv(CONFIG, NUM_ENVS, autoreset_mode=mode, film=film) for film in (Film(tmp_path), None))
    for env in (filmed, plain):
        env.reset(seed=0)
    for _ in range(30):
        actions = plain.sample_actions()
        for one, other in zip(filmed.step(actions)[:4], plain.step(actions)[:4]):
            np.testing.assert_array_equal(one, other)
    assert plain.films == []


def test_more_films_than_the_queue_holds_are_all_drawn(tmp_path):
    env = VecEnv({**CONFIG, "max_episode_steps": 1}, 2, film=Film(tmp_path, name_prefix="run 1"))
    env.reset(seed=0)
    for _ in range(60):
        env.step(env.sample_actions())
    env.close()
    assert len(env.films) == 60 == len(list(tmp_path.iterdir()))
    assert Path(env.films[59]).name == "run 1-episode-59.svg"


WRONG = [
    ("films", TypeError, "film has type str, expected a Film"),
    (Film("x", every=0), ValueError, "every is 0, expected at least 1"),
    (Film("x", every=1.5), TypeError, "every is 1.5, expected a whole number"),
    (Film("x", env=3), ValueError, "env is 3, expected 0 to 2, the index of the filmed environment"),
    (Film("x", env=-1), ValueError, "env is -1, expected 0 to 2"),
    (Film("x", env="0"), TypeError, "env is '0', expected a whole number"),
    (Film("x", format="avi"), ValueError, "format is 'avi', expected one of 'svg', 'html', 'mp4'"),
    (Film("x", name_prefix="a/b"), ValueError, "name_prefix is 'a/b', expected the beginning of a file name"),
    (Film("x", name_prefix=3), ValueError, "name_prefix is 3, expected the beginning of a file name"),
    (Film(3), TypeError, "str, bytes or os.PathLike"),
]


@pytest.mark.parametrize(("film", "error", "text"), WRONG)
def test_wrong_films_are_errors(tmp_path, monkeypatch, film, error, text):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=text):
        VecEnv(CONFIG, NUM_ENVS, film=film)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path):
    file = tmp_path / "file"
    file.write_text("text")
    for folder in (file, file / "below"):
        with pytest.raises(OSError, match="file"):
            VecEnv(CONFIG, film=Film(folder))
    assert file.read_text() == "text"


def stay(env, num_steps=9):
    for _ in range(num_steps):
        env.step(np.zeros((env.num_envs, env.num_agents), int))


def test_a_folder_that_disappears_is_a_warning_and_training_continues(tmp_path):
    folder = tmp_path / "films"
    env = VecEnv(CONFIG, 1, film=Film(folder))
    env.reset(seed=0)
    folder.rmdir()
    # The thread that draws may fail before or after a step.
    with pytest.warns(RuntimeWarning) as caught:
        stay(env, 12)
        env.close()
    messages = [str(warning.message) for warning in caught]
    assert len(messages) == 2
    for episode, message in enumerate(messages):
        assert f"the film of episode {episode} is missing: " in message
        assert f"pogema-episode-{episode}.svg" in message and "No such file" in message
    assert env.films == [] and env.closed
    env = VecEnv(CONFIG, 1, film=Film(folder))
    env.reset(seed=0)
    env.step(env.sample_actions())
    folder.rmdir()
    with pytest.warns(RuntimeWarning, match="episode 0 is missing") as caught:
        env.close()
    assert caught[0].filename == __file__


def test_a_warning_raised_as_an_error_changes_no_state(tmp_path):
    folder = tmp_path / "films"
    env, other = VecEnv(CONFIG, 1, film=Film(folder, every=2)), VecEnv(CONFIG, 1)
    for one in (env, other):
        one.reset(seed=0)
    folder.rmdir()
    num_errors, actions = 0, np.zeros((1, 5), int)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(9):
            env.step(actions)
            other.step(actions)
        # The thread takes some time to fail.
        while not num_errors:
            seeds, before = env.episode_seeds.tolist(), env.state()
            try:
                env.step(actions)
                other.step(actions)
            except RuntimeWarning as warning:
                num_errors += 1
                assert "the film of episode 0 is missing" in str(warning)
                assert env.episode_seeds.tolist() == seeds
                assert all((part == before[name]).all() for name, part in env.state().items())
    for one, two in zip(env.step(actions)[:4], other.step(actions)[:4]):
        np.testing.assert_array_equal(one, two)


def run(code, path, **environment):
    """Runs code in another process."""
    command = [sys.executable, "-W", "always", "-c", textwrap.dedent(code), str(path)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, env={**os.environ, **environment})


PLAY = """
import sys
import numpy as np
from pogema_rs import Film, VecEnv

config = {"num_agents": 5, "size": 7, "max_episode_steps": 9, "seed": 0}

def play(env):
    env.reset(seed=0)
    for _ in range(20):
        env.step(np.zeros((1, 5), int))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit on file sizes")
def test_a_full_disk_is_a_warning_and_leaves_no_file(tmp_path):
    done = run(
        PLAY
        + """
import resource
env = VecEnv(config, film=Film(sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
play(env)
env.close()
print(env.films)
""",
        tmp_path,
    )
    assert done.returncode == 0 and done.stdout == "[]\n", done.stderr
    for number in range(3):
        assert f"the film of episode {number} is missing: " in done.stderr
    assert "pogema-episode-0.svg" in done.stderr and "File too large" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_program_that_ends_without_close_completes_its_films(tmp_path):
    done = run(PLAY + "env = VecEnv(config, film=Film(sys.argv[1]))\nplay(env)\n", tmp_path)
    assert done.returncode == 0 and done.stderr == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"pogema-episode-{number}.svg" for number in range(3)]


# Counts the bytes of the frames. The last argument is the output file.
FFMPEG = """#!{python}
import sys
if "-version" not in sys.argv:
    num_bytes = len(sys.stdin.buffer.read())
    if {fails}:
        sys.exit("No space left on device")
    open(sys.argv[-1], "w").write(" ".join(sys.argv[1:-1]) + f"\\n{{num_bytes}}")
"""


def stand_in(tmp_path, fails):
    """Makes a folder with a program `ffmpeg`."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "ffmpeg"
    program.write_text(FFMPEG.format(python=sys.executable, fails=fails))
    program.chmod(0o755)
    return str(folder)


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in for ffmpeg is a script")
@pytest.mark.parametrize("fails", [False, True])
def test_videos_are_written_by_ffmpeg(tmp_path, monkeypatch, fails):
    monkeypatch.setenv("PATH", stand_in(tmp_path, fails))
    folder = tmp_path / "films"
    env = VecEnv(CONFIG, 1, film=Film(folder, every=5, format="mp4"))
    env.reset(seed=0)
    stay(env)
    if fails:
        with pytest.warns(RuntimeWarning, match="the film of episode 0 is missing: .*No space left on device"):
            env.close()
        assert list(folder.iterdir()) == []
        return
    env.close()
    assert [path.name for path in folder.iterdir()] == ["pogema-episode-0.mp4"]
    arguments, num_bytes = text_of(env.films[0]).split("\n")
    size = arguments.split("-video_size ")[1].split()[0]
    width, height = map(int, size.split("x"))
    assert max(width, height) == 720 and int(num_bytes) % (4 * width * height) == 0 < int(num_bytes)


INTERRUPTED = """
import os, signal, sys, time
from pathlib import Path
from pogema_rs import Film
from pogema_rs.vec_env import VecEnv

env = VecEnv({"num_agents": 2, "size": 5, "max_episode_steps": 4}, 1, film=Film("films", every=50, format="mp4"))
env.reset(seed=0)
for _ in range(4):
    env.step(env.action_space.sample() * 0)
try:
    while not Path("started").exists():
        time.sleep(0.02)
    os.killpg(0, signal.SIGINT)
    time.sleep(60)
except KeyboardInterrupt:
    env.close()
print([path.name for path in Path("films").iterdir()])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in for ffmpeg is a script")
def test_ctrl_c_in_a_terminal_loses_no_video(tmp_path):
    program = Path(stand_in(tmp_path, False)) / "ffmpeg"
    wait = 'if "-version" not in sys.argv:\n    open("started", "w"); import time; time.sleep(0.5)\n'
    program.write_text(program.read_text().replace('if "-version" not in sys.argv:\n', wait, 1))
    path = os.pathsep.join([str(program.parent), os.environ["PATH"]])
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED],
        cwd=tmp_path, env={**os.environ, "PATH": path}, start_new_session=True, capture_output=True, text=True,
        timeout=60,
        # A shell's background job would ignore SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "['pogema-episode-0.mp4']\n"), done.stderr


def test_videos_without_ffmpeg_are_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="ffmpeg") as raised:
        VecEnv(CONFIG, film=Film(tmp_path / "films", format="mp4"))
    assert "\n" not in str(raised.value)
