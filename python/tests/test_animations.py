"""Tests animations, their settings and their files, and the history and the elapsed steps of environments."""

from __future__ import annotations

import threading
import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from pogema_rs import AnimationConfig, AnimationMonitor, GridConfig, pogema_v0
from pogema_rs._files import write_text
from pogema_rs.errors import NotResetError, StateError
from pogema_rs.wrappers.multi_time_limit import MultiTimeLimit
from pogema_rs.wrappers.persistence import PersistentWrapper

SMALL: dict[str, Any] = {"size": 5, "num_agents": 3, "density": 0.2, "seed": 2, "max_episode_steps": 4}


def recorded(semantics: str = "1.4.0", **fields: Any) -> Any:
    """Returns an environment after an episode that it recorded."""
    env = pogema_v0(GridConfig(**{**SMALL, **fields}), semantics=semantics)
    env.enable_animation()
    env.reset()
    for _ in range(4):
        env.step(env.sample_actions())
    return env


def test_text_of_an_animation_is_its_svg() -> None:
    animation = recorded().render_animation()
    assert str(animation) == animation.render()
    assert ElementTree.fromstring(str(animation)).tag.endswith("svg")


def test_saving_makes_folders(tmp_path: Path) -> None:
    env = recorded()
    ways = {"a.svg": env.save_animation, "b.html": env.save_replay, "c.svg": env.render_animation().save}
    for name, save in ways.items():
        for folder in (tmp_path / name / "new" / "folder", tmp_path):
            save(folder / f"saved-{name}")
            assert (folder / f"saved-{name}").read_text(encoding="utf-8").strip().endswith(">")
    assert sorted(path.name for path in tmp_path.iterdir() if path.is_file()) == [f"saved-{name}" for name in ways]
    with pytest.raises(OSError, match="a.svg"):
        env.save_animation(tmp_path / "saved-a.svg" / "below a file")


def test_a_failed_write_of_a_drawing_leaves_the_earlier_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    animation, path = recorded().render_animation(), tmp_path / "a.svg"
    (tmp_path / "link.svg").symlink_to(path)
    animation.save(tmp_path / "link.svg")
    before = path.read_text(encoding="utf-8")
    assert before == animation.render()

    def fail(_file: int) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OSError, match="the disk is full"):
        recorded(seed=3).save_animation(path)
    assert path.read_text(encoding="utf-8") == before
    recorded().save_animation("/dev/null")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"egocentric_idx": -1}, "egocentric_idx is -1, expected at least 0"),
        ({"static_frame_idx": -1}, "static_frame_idx is -1, expected at least 0"),
        ({"static": True, "frame_idx": -1}, "^frame_idx is -1, expected at least 0"),
    ],
)
def test_negative_indices_of_agents_and_frames_are_rejected(options: dict[str, Any], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        recorded().render_animation(AnimationConfig(**options))


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"egocentric_idx": -1}, ValueError),
        ({"egocentric_idx": 9}, StateError),
        ({"egocentric_idx": 2**70}, StateError),
        ({"static_frame_idx": -1}, ValueError),
        ({"static_frame_idx": 9}, StateError),
    ],
)
def test_changed_settings_of_a_monitor_have_the_errors_of_the_engine(
    tmp_path: Path, options: dict[str, int], error: type[Exception]
) -> None:
    monitor = AnimationMonitor(recorded(), AnimationConfig(save_every_idx_episode=None))
    texts = []
    for color in (monitor.svg_settings.obstacle_color, "#123456"):
        monitor.svg_settings.obstacle_color = color
        with pytest.raises(error) as raised:
            monitor.save_animation(tmp_path / "a.svg", AnimationConfig(**options))
        texts.append(str(raised.value))
    assert texts[0] == texts[1]
    fresh = AnimationMonitor(pogema_v0(GridConfig(**SMALL)))
    fresh.svg_settings.obstacle_color = "#123456"
    with pytest.raises(NotResetError):
        fresh.save_animation(tmp_path / "a.svg")


def test_environment_tells_whether_it_records() -> None:
    env = pogema_v0(GridConfig(**SMALL))
    assert env.animation_is_active is False
    env.enable_animation()
    assert env.animation_is_active is True
    monitor = AnimationMonitor(pogema_v0(GridConfig(**SMALL)))
    assert monitor.animation_is_active is True


@pytest.mark.parametrize("persistent", [False, True])
def test_elapsed_steps_of_the_2_0_line_need_no_persistence(persistent: bool) -> None:
    env = pogema_v0(GridConfig(**SMALL, persistent=persistent), semantics="2.0")
    env.set_elapsed_steps(3)
    env.reset()
    assert env.step([0] * 3)[3] == [False] * 3
    env.set_elapsed_steps(3)
    assert env.step([0] * 3)[3] == [True] * 3
    with pytest.raises(ValueError, match="elapsed_steps is -1, expected at least 0"):
        env.set_elapsed_steps(-1)
    limited = MultiTimeLimit(env, 5)
    limited.reset()
    limited.set_elapsed_steps(4)
    assert limited.step([0] * 3)[3] == [True] * 3
    with pytest.raises(ValueError, match="only with persistent=True"):
        pogema_v0(GridConfig(**SMALL)).set_elapsed_steps(1)


@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_persistent_wrapper_records_the_history_of_any_environment(on_target: str) -> None:
    env = PersistentWrapper(pogema_v0(GridConfig(**SMALL, on_target=on_target), semantics="2.0"))

    def shown() -> list[Any]:
        cells, goals = env.unwrapped.get_agents_xy(), env.unwrapped.get_targets_xy()
        return [(tuple(cell), tuple(goal)) for cell, goal in zip(cells, goals)]

    env.reset()
    expected = [shown()]
    for actions in ([1, 2, 3], [4, 1, 2], [3, 4, 1], [2, 3, 4]):
        env.step(actions)
        expected.append(shown())
    history = [[(state.get_xy(), state.get_target_xy()) for state in states] for states in env.get_full_history()]
    assert history == [list(states) for states in zip(*expected)]
    assert expected[0] != expected[-1]


@pytest.mark.parametrize(("semantics", "number"), [("1.4.0", 0), ("2.0", 1)])
def test_monitor_is_deprecated_in_the_2_0_line(semantics: str, number: int) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        AnimationMonitor(pogema_v0(GridConfig(**SMALL), semantics=semantics))
    assert [one.category for one in caught] == [DeprecationWarning] * number
    assert all(one.filename == __file__ and "`enable_animation`" in str(one.message) for one in caught)


@pytest.mark.parametrize(
    "options", [{}, {"egocentric_idx": 1}, {"static": True, "frame_idx": 2}, {"static_frame_idx": 1}]
)
@pytest.mark.parametrize("on_target", ["finish", "restart"])
def test_settings_of_a_monitor_take_effect(tmp_path: Path, options: dict[str, Any], on_target: str) -> None:
    monitor = AnimationMonitor(
        pogema_v0(GridConfig(**SMALL, on_target=on_target)), AnimationConfig(save_every_idx_episode=None)
    )
    assert monitor.history is None
    monitor.reset()
    for _ in range(4):
        monitor.step(monitor.sample_actions())
    monitor.svg_settings.obstacle_color = "#123456"
    monitor.save_animation(tmp_path / "new" / "own.svg", AnimationConfig(**options))
    text = (tmp_path / "new" / "own.svg").read_text(encoding="utf-8")
    assert 'fill="#123456"' in text and ElementTree.fromstring(text.encode()) is not None
    assert ("<animate" in text) == (not any("static" in name for name in options))


def test_undone_steps_are_not_drawn(tmp_path: Path) -> None:
    fields: dict[str, Any] = {"num_agents": 2, "seed": 1, "persistent": True, "size": 6, "density": 0.1}
    drawings = []
    for undone in ([], [[2, 3]]):
        env = pogema_v0(GridConfig(**fields, max_episode_steps=4))
        monitor = AnimationMonitor(env, AnimationConfig(directory=str(tmp_path)))
        monitor.reset()
        monitor.step([1, 2])
        for actions in undone:
            monitor.step(actions)
            assert monitor.step_back()
        for actions in ([4, 4], [3, 3], [1, 1]):
            *_, truncated, _ = monitor.step(actions)
        assert all(truncated)
        drawings.append(env.render_animation().render())
    assert drawings[0] == drawings[1]


def test_two_writers_of_one_file_do_not_mix_their_texts(tmp_path: Path) -> None:
    path, errors = tmp_path / "render.svg", list[Exception]()
    texts = [letter * 100_000 for letter in "ab"]

    def write(text: str) -> None:
        try:
            for _ in range(50):
                write_text(path, text)
                assert path.read_text() in texts
        except (AssertionError, OSError) as error:
            errors.append(error)

    threads = [threading.Thread(target=write, args=(text,)) for text in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert [path] == list(tmp_path.iterdir())


def test_a_monitor_saves_nothing_before_the_first_reset(tmp_path):
    env = AnimationMonitor(pogema_v0(GridConfig(num_agents=2)))
    for error in (AttributeError, NotResetError):
        with pytest.raises(error, match="the environment has not been reset yet"):
            env.save_animation(tmp_path / "film.svg")
    assert not list(tmp_path.iterdir())
