"""Tests of single environments."""

import copy
import pickle
import warnings

import gymnasium
import numpy as np
import pogema_rs
import pytest
from pogema_rs import AnimationConfig, AnimationMonitor, BatchAStarAgent, GridConfig, pogema_v0
from pogema_rs.errors import InstanceError
from pogema_rs.grid import Grid
from pogema_rs.grid_registry import RegisteredGrid
from pydantic import ValidationError


def play(env, act, most=1000):
    observations, infos = env.reset()
    for _ in range(most):
        observations, rewards, terminated, truncated, infos = env.step(act(observations))
        if all(terminated) or all(truncated):
            return infos[0]["metrics"]
    raise AssertionError("the episode does not end")


def test_quickstart_of_pogema_plays_an_episode():
    env = pogema_v0(
        grid_config=GridConfig(num_agents=2, size=8, density=0.4, seed=1, max_episode_steps=128, obs_radius=3)
    )
    metrics = play(env, lambda _: env.sample_actions())
    assert list(metrics) == ["ISR", "CSR", "ep_length"]
    assert env.observation_space.shape == (3, 7, 7)
    assert env.action_space.n == 5


def test_letters_on_a_map_are_starts_and_goals():
    grid = """
    .....#.....
    .....#.....
    ...........
    .....#.....
    a....#....A
    """
    env = pogema_v0(grid_config=GridConfig(map=grid, observation_type="POMAPF", on_target="nothing"))
    env.reset()
    assert env.get_agents_xy(ignore_borders=True) == [[4, 0]]
    assert env.get_targets_xy(ignore_borders=True) == [[4, 10]]
    team = BatchAStarAgent()
    assert play(env, team.act)["CSR"] == 1.0


@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_astar_agents_play_every_mode(on_target):
    config = GridConfig(num_agents=4, seed=5, density=0.1, on_target=on_target, observation_type="POMAPF")
    metrics = play(pogema_v0(config), BatchAStarAgent().act)
    assert metrics["avg_throughput" if on_target == "restart" else "ISR"] > 0.3


def test_reward_and_observation_wrappers_stack():
    class Reward(gymnasium.Wrapper):
        def step(self, action):
            observations, rewards, *rest = self.env.step(action)
            return (observations, [reward - 0.1 for reward in rewards], *rest)

    class Flat(gymnasium.Wrapper):
        def reset(self, **kwargs):
            observations, infos = self.env.reset(**kwargs)
            return [seen.flatten() for seen in observations], infos

        def step(self, action):
            observations, *rest = self.env.step(action)
            return ([seen.flatten() for seen in observations], *rest)

    env = Flat(Reward(Reward(pogema_v0(GridConfig(num_agents=3, seed=1)))))
    observations, _ = env.reset()
    assert observations[0].shape == (363,)
    assert env.step([0, 0, 0])[1] == [-0.2, -0.2, -0.2]
    assert env.unwrapped.get_num_agents() == 3


def test_wrapper_forwards_unknown_attributes():
    env = pogema_rs.Wrapper(pogema_rs.Wrapper(pogema_v0(GridConfig(num_agents=3, seed=1))))
    env.reset()
    assert env.get_num_agents() == 3
    assert env.grid_config.seed == 1
    assert not hasattr(env, "nothing_of_this_name")


def test_config_may_change_between_resets():
    config = GridConfig(seed=1, num_agents=2)
    env = pogema_v0(config)
    first, _ = env.reset()
    config.seed = 2
    env.reset()
    second = env.get_agents_xy()
    assert second == _starts(GridConfig(seed=2, num_agents=2))
    env.unwrapped.grid_config = GridConfig(seed=1, num_agents=3, size=16)
    assert len(env.reset()[0]) == 3
    assert env.get_agents_xy() == _starts(GridConfig(seed=1, num_agents=3, size=16))


def test_failed_reset_keeps_the_seed():
    config = GridConfig(seed=1, num_agents=8)
    env = pogema_v0(config)
    env.reset()
    expected = env.get_agents_xy()
    for seed in (2, 10**30):
        config.seed = seed
        engine = env.unwrapped._engine
        env.unwrapped._engine = _FailingEngine(engine)
        with pytest.raises((MemoryError, ValueError)):
            env.reset()
        env.unwrapped._engine = engine
        config.seed = 1
        env.reset()
        assert env.get_agents_xy() == expected


def test_failed_reset_to_a_seed_keeps_the_seed():
    config = GridConfig(seed=None, num_agents=6, size=4, density=0.6)
    env = pogema_v0(config, semantics="2.0")
    for seed, error in ((0, InstanceError), (2**80, ValueError), (-1, gymnasium.error.Error)):
        before = env.unwrapped._sampler._rnd
        with pytest.raises(error):
            env.reset(seed=seed)
        assert env.grid_config.seed is None and env.unwrapped._sampler._rnd is before


class _FailingEngine:
    """An engine whose resets fail as if memory had run out."""

    def __init__(self, engine):
        self._engine = engine

    def __getattr__(self, name):
        return getattr(self._engine, name)

    def reset(self, *_):
        raise MemoryError


@pytest.mark.parametrize(
    ("fields", "change"),
    [
        ({"map": [[0, 0, 0], [0, 0, 0]]}, lambda config: config.map[0].__setitem__(slice(1, 3), [1, 1])),
        ({"agents_xy": [[0, 0]], "targets_xy": [[2, 2]]}, lambda config: config.agents_xy[0].__setitem__(0, 4)),
        (
            {"agents_xy": [[0, 0]], "targets_xy": [[[1, 1], [2, 2]]], "on_target": "restart"},
            lambda config: config.targets_xy[0].__setitem__(0, [5, 5]),
        ),
        (
            {"possible_agents_xy": [[0, 0]], "possible_targets_xy": [[1, 1]]},
            lambda config: config.possible_agents_xy[0].__setitem__(1, 3),
        ),
    ],
)
def test_a_change_inside_a_field_takes_effect_at_the_next_reset(fields, change):
    config = GridConfig(size=8, density=0, seed=1, **fields)
    env = pogema_v0(config)

    def seen():
        env.reset()
        return env.get_obstacles().tolist(), env.get_agents_xy(), env.get_targets_xy()

    before = seen()
    assert seen() == before
    change(config)
    after = seen()
    assert after != before
    assert seen() == after


def test_a_map_that_is_registered_anew_is_played(monkeypatch):
    monkeypatch.setattr(pogema_rs.grid_registry, "GRID_STR_REGISTRY", {})
    RegisteredGrid("anew", "...\n...")
    env = pogema_v0(GridConfig(map_name="anew", seed=1))
    env.reset()
    assert not env.get_obstacles(ignore_borders=True).any()
    del pogema_rs.grid_registry.GRID_STR_REGISTRY["anew"]
    RegisteredGrid("anew", ".#.\n...")
    env.reset()
    assert env.get_obstacles(ignore_borders=True).tolist() == [[0, 1, 0], [0, 0, 0]]


def _starts(config):
    env = pogema_v0(config)
    env.reset()
    return env.get_agents_xy()


def test_a_seed_given_to_reset_counts_only_in_2_0():
    config = {"num_agents": 2, "seed": 7}
    released, developed = pogema_v0(config), pogema_v0(config, semantics="2.0")
    for env in (released, developed):
        env.reset(seed=1)
    assert released.get_agents_xy() == _starts(GridConfig(**config))
    assert developed.get_agents_xy() == _starts(GridConfig(num_agents=2, seed=1))
    assert developed.grid_config.seed == 1
    with pytest.raises(ValueError, match="expected|valid"):
        pogema_v0(config, semantics="3.0")


def test_metrics_leak_only_in_1_4_0():
    # In the first episode, which is not finished, one of two agents reaches its goal; in the next one both do.
    def isr(semantics):
        env = pogema_v0({"map": "aA.\nb.B"}, semantics=semantics)
        env.reset()
        env.step([4, 0])
        return play(env, lambda _: [4, 4])["ISR"]

    assert isr("1.4.0") == 1.5
    assert isr("2.0") == 1.0


def test_animations_are_saved(tmp_path):
    env = AnimationMonitor(
        pogema_v0(GridConfig(num_agents=3, seed=2, map_name=None)),
        AnimationConfig(directory=str(tmp_path / "renders"), save_every_idx_episode=1),
    )
    play(env, lambda _: env.sample_actions())
    assert [path.name for path in (tmp_path / "renders").iterdir()] == ["pogema-ep00001-seed2.svg"]
    for config in (
        AnimationConfig(egocentric_idx=1),
        AnimationConfig(static=True, frame_idx=3),
        AnimationConfig(static_frame_idx=0, show_agents=False, show_grid_lines=False),
    ):
        env.save_animation(tmp_path / "one.svg", config)
        drawn = (tmp_path / "one.svg").read_text()
        assert drawn.startswith("<svg") and "<text" not in drawn
    env.save_animation(tmp_path / "one.svg", AnimationConfig(show_numbers=True))
    # One number in each of the three agents, and one in each of their goals.
    assert (tmp_path / "one.svg").read_text().count("<text") == 6
    inner = env.unwrapped
    assert "data:image/svg+xml;base64" in inner.render_animation()._repr_html_()
    inner.save_replay(tmp_path / "replay.html")
    assert "<html" in (tmp_path / "replay.html").read_text()
    with pytest.raises(ValueError, match="agent"):
        inner.render_animation(AnimationConfig(egocentric_idx=3))


def test_unrecorded_episode_cannot_be_drawn(tmp_path):
    env = pogema_v0(GridConfig())
    env.reset()
    with pytest.raises(ValueError, match="not recorded"):
        env.save_animation(tmp_path / "one.svg")
    assert not (tmp_path / "one.svg").exists()


def test_unknown_field_is_ignored_with_one_warning():
    with pytest.warns(UserWarning, match="`num_agents`") as caught:
        config = GridConfig(num_agent=3)
    assert len(caught) == 1
    assert config.num_agents == 1


@pytest.mark.parametrize(
    ("fields", "error"),
    [
        ({"size": 1}, ValidationError),
        ({"width": 3}, ValidationError),
        ({"density": float("nan")}, ValidationError),
        ({"collision_system": "hard"}, ValidationError),
        ({"num_agents": 0}, ValidationError),
        ({"seed": -1}, ValidationError),
        ({"targets_xy": []}, ValidationError),
        ({"map": "..\n."}, ValidationError),
        ({"map": "aA?"}, KeyError),
        ({"map": "aA@"}, KeyError),
        ({"map": "aA", "agents_xy": [[0, 0]], "targets_xy": [[0, 1]]}, KeyError),
        ({"agents_xy": [[9, 9]], "targets_xy": [[0, 0]]}, IndexError),
        ({"map": ""}, ZeroDivisionError),
    ],
)
def test_wrong_config_raises_the_class_of_pogema(fields, error):
    with pytest.raises(error) as caught:
        GridConfig(**fields)
    assert isinstance(caught.value, ValueError)
    assert "expected" in str(caught.value) or "no cells" in str(caught.value)


def test_update_config_is_atomic():
    config = GridConfig(size=8, seed=1)
    config.update_config(width=4, height=5)
    assert (config.width, config.height, config.size) == (4, 5, 5)
    config.update_config(size=6)
    assert (config.width, config.height) == (6, 6)
    before = config.dict()
    with pytest.raises(ValueError):
        config.update_config(seed=9, density=2)
    assert config.dict() == before


def test_configs_can_be_extended_copied_and_pickled():
    class Extended(GridConfig):
        with_animation: bool = False

    config = Extended(size=5, with_animation=True, seed=3)
    assert config.with_animation
    assert config.width == 5
    for same in (copy.deepcopy(config), config.copy()):
        assert same == config
    plain = GridConfig(size=5, agents_xy=[[0, 0]], targets_xy=[[1, 1]])
    assert pickle.loads(pickle.dumps(plain)) == plain
    assert GridConfig(**plain.dict()) == plain


def test_too_many_agents_raise_the_exceptions_of_both_release_lines():
    env = pogema_v0(GridConfig(size=3, density=0.0, num_agents=9))
    for error in (OverflowError, ValueError):
        with pytest.raises(error, match="room"):
            env.reset()


def test_lists_of_the_caller_are_unchanged():
    actions, pool = [4, 3, 1], [[0, 0], [0, 1], [2, 2], [1, 1]]
    kept = copy.deepcopy(pool)
    env = pogema_v0(
        GridConfig(
            size=3,
            density=0,
            num_agents=3,
            possible_agents_xy=pool,
            possible_targets_xy=pool,
            collision_system="soft",
            seed=1,
        )
    )
    env.reset()
    env.step(actions)
    env.reset()
    assert (actions, pool) == ([4, 3, 1], kept)


def test_warnings_about_the_instance_reach_the_user():
    config = GridConfig(map=[[1, 0], [0, 0]], agents_xy=[[0, 0]], targets_xy=[[1, 1]])
    with pytest.warns(UserWarning, match="obstacle"):
        pogema_v0(config).reset()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pogema_v0(GridConfig(seed=1)).reset()


def _num_without_room(config, num_retries):
    """Makes 200 grids, and returns the number of grids for which every attempt failed."""
    num_failed = 0
    for _ in range(200):
        try:
            Grid(config, num_retries=num_retries)
        except OverflowError:
            num_failed += 1
    return num_failed


@pytest.mark.filterwarnings("ignore:the agents were placed only at attempt")
def test_grid_tries_as_often_as_num_retries_says():
    # One in seven random maps has room for all agents.
    config = GridConfig(size=4, density=0.5, num_agents=5)
    never, default, always = (_num_without_room(config, number) for number in (0, 10, 10_000))
    assert never > 100 > default > always == 0
    assert _num_without_room(config, -1) > 100
    with pytest.warns(UserWarning, match="placed only at attempt"):
        _num_without_room(config, 5)
    with pytest.raises(TypeError):
        Grid(config, num_retries="10")
    # With a seed, all attempts are equal.
    assert _num_without_room(GridConfig(size=4, density=0.9, num_agents=5, seed=1), 10_000) == 200


def test_grid_is_read_only():
    env = pogema_v0(GridConfig(seed=1))
    env.reset()
    with pytest.raises(ValueError, match="read-only"):
        env.grid.obstacles[0, 0] = 1
    with pytest.raises(ValueError, match="by hand"):
        env.grid.hide_agent(0)
    assert isinstance(env.grid.positions, np.ndarray)


def test_sequences_assigned_to_the_config_give_all_goals_of_the_next_episode() -> None:
    """In POGEMA, an environment that was made without sequences draws the later goals."""
    env = pogema_v0(GridConfig(map="....", num_agents=1, on_target="restart", seed=1))
    env.reset()
    env.grid_config.agents_xy, env.grid_config.targets_xy = [[0, 0]], [[[0, 1], [0, 3], [0, 0]]]
    env.reset()
    goals = [env.get_targets_xy(ignore_borders=True)[0]]
    for action in (4, 4, 4, 3):
        env.step([action])
        goals.append(env.get_targets_xy(ignore_borders=True)[0])
    assert goals == [[0, 1], [0, 3], [0, 3], [0, 0], [0, 0]]
