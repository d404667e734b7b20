"""Tests of the warm start: the advice of planners, its loss, and the change from imitation to PPO."""

import numpy as np
import pytest
import torch
from pogema_rs import GridConfig, pogema_v0
from pogema_rs.baselines import Budget, load_config, train
from pogema_rs.baselines._acting import Actor
from pogema_rs.baselines._collector import Collector
from pogema_rs.baselines._episodes import Episodes
from pogema_rs.baselines._ppo import PPOLearner
from pogema_rs.baselines._teacher import Teacher, cells_ahead
from pogema_rs.planners import PlannerAgents
from small import PPO_METHODS, small_config
from test_training import check_equal

CROWD = ("environment.maps=[mazes, random]", "environment.num_agents=6", "environment.max_episode_steps=48")


def play(config, planner, nodes, act, rule):
    """Plays the episodes of the first iteration with a teacher; returns them, the teacher, the configs and seeds."""
    episodes = Episodes(config.environment, 0, 48)
    configs, seeds = episodes.of_iteration(0, 4)
    collector = Collector(config, episodes.map_size, 4, 1)
    teacher = Teacher(planner, nodes, rule, collector.shape)
    record, _ = collector.play(configs, seeds, act(teacher), teacher)
    collector.close()
    return record, teacher, configs, seeds


def mapf(obstacles, cells, goals):
    """Returns the parts of observations of type `MAPF` that a planner reads."""
    names = ("global_obstacles", "global_xy", "global_target_xy")
    return [dict(zip(names, (obstacles, cell, goal))) for cell, goal in zip(cells, goals)]


@pytest.mark.parametrize(("rule", "planner"), [("restart", "pibt"), ("restart", "rhcr"), ("nothing", "lacam")])
def test_agents_that_take_the_advice_play_the_planners_own_episode(rule, planner):
    config = small_config("follower", *CROWD, f"environment.on_target=[{rule}]")

    def follow(teacher):
        steps = iter(range(48))
        return lambda *_: teacher.advice[next(steps)].astype(np.int64)

    record, teacher, configs, seeds = play(config, planner, 200, follow, rule)
    moves = 0
    for lane, (fields, seed) in enumerate(zip(configs, seeds)):
        env = pogema_v0(GridConfig(**fields, seed=seed))
        agents = PlannerAgents(planner, nodes=200, max_steps=48, lifelong=rule == "restart")
        env.reset()
        grid = env.unwrapped.grid
        for step in range(int(record.played[:, lane].sum())):
            places = grid.get_agents_xy(ignore_borders=True), grid.get_targets_xy(ignore_borders=True)
            actions = agents.act(mapf(grid.get_obstacles(ignore_borders=True), *places))
            assert actions == teacher.advice[step, lane].tolist(), (lane, step)
            env.step(actions)
            moves += np.count_nonzero(actions)
    assert moves > 100


def test_advice_is_given_for_the_states_that_the_agents_reach():
    config = small_config("follower", *CROWD, "environment.on_target=[restart]")
    rng = np.random.default_rng(0)

    def wander(_):
        return lambda windows, *_: rng.integers(5, size=windows.shape[:2])

    record, teacher, configs, _ = play(config, "pibt", 200, wander, "restart")
    for lane, fields in enumerate(configs):
        rows = fields["map"].split()
        obstacles = np.array([[cell == "#" for cell in row] for row in rows])
        agents = PlannerAgents("pibt", nodes=200, lifelong=True)
        for step in range(48):
            places = record.places[step, lane].astype(int)
            assert agents.act(mapf(obstacles, places[:, :2], places[:, 2:])) == teacher.advice[step, lane].tolist(), (
                lane,
                step,
            )
    assert (teacher.advice != record.actions).mean() > 0.2


def test_cells_ahead_are_those_of_the_path():
    windows = np.zeros((1, 3, 5, 5), dtype=bool)
    for row, col in ((2, 2), (1, 2), (0, 2), (0, 3), (0, 4)):
        windows[0, 0, row, col] = True
    windows[0, 1, 2, 2:4] = True
    for steps, first, second in ((0, (0, 0), (0, 0)), (1, (-1, 0), (0, 1)), (3, (-2, 1), (0, 1)), (9, (-2, 2), (0, 1))):
        np.testing.assert_array_equal(cells_ahead(windows, steps), [[first, second, (0, 0)]])


def test_advice_leads_along_the_path():
    changes = ("environment.on_target=[restart]", "imitation.ahead=1", "imitation.iterations=1")
    config = small_config("follower", *CROWD, *changes, "environment.num_agents=1")
    record, teacher, *_ = play(config, "pibt", 200, lambda teacher: lambda *_: teacher.advice[0] * 0, "restart")
    windows = record.windows[:-1].reshape(48, 4, 1, *config.encoder.shape)[:, :, :, 0]
    steps = np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]])[teacher.advice]
    step, lane, agent = np.indices(teacher.advice.shape)
    assert (windows[step, lane, agent, 5 + steps[..., 0], 5 + steps[..., 1]] > 0).all()
    assert (teacher.advice != 0).all()


def test_imitation_learns_what_is_advised():
    config = small_config("follower", "learner.epochs=8", "learner.minibatches=4", "learner.learning_rate=0.01")
    episodes = Episodes(config.environment, 0, 12)
    generator = torch.Generator().manual_seed(0)
    learner = PPOLearner(config, episodes.map_size, generator)
    collector = Collector(config, episodes.map_size, 4, 1)
    record, _ = collector.play(*episodes.of_iteration(0, 4), learner.actor())
    # The action depends on what the agent sees: 4 if the cell to the right is free, else 1.
    advice = np.where(record.masks[:-1, ..., 4], 4, 1)
    losses = [learner.imitate(record, advice)["imitation"] for _ in range(8)]
    assert losses[0] > 0.3 and losses[-1] < 0.1
    actor = Actor(learner.network, generator, 0.0, masks=False)
    windows = record.windows[0].reshape(4, 2, *config.encoder.shape) / (2.0 * config.encoder.radius)
    actions = actor(windows.astype(np.float32), record.scalars[0], record.masks[0])
    np.testing.assert_array_equal(actions, advice[0])
    collector.close()


@pytest.mark.parametrize("method", PPO_METHODS)
def test_a_run_resumes_before_and_after_the_change_to_ppo(method, tmp_path):
    config = small_config(method, "imitation.iterations=4")
    train(config, tmp_path / "whole", Budget(iterations=8), seed=3)
    for iterations in (2, 6, 8):
        train(config, tmp_path / "part", Budget(iterations=iterations), seed=3, resume=iterations > 2)
    check_equal(tmp_path / "whole", tmp_path / "part")
    names = (tmp_path / "whole" / "curve.csv").read_text().splitlines()[0].split(",")
    assert {"imitation", "critic", "objective", "entropy"} < set(names)


@pytest.mark.parametrize(
    ("method", "changes", "expected"),
    [
        (
            "follower",
            ["imitation.planner=lacam"],
            "follower.yaml: imitation: `planner` is `lacam`, expected one of `rhcr`",
        ),
        (
            "ippo",
            ["imitation.ahead=1"],
            "ippo.yaml: imitation.ahead is 1, expected 0 without the channel 'follower_path'",
        ),
        ("follower", ["imitation.nodes=0"], "follower.yaml: imitation.nodes is 0, expected at least 1"),
        ("follower", ["imitation.iterations=-1"], "follower.yaml: imitation.iterations is -1, expected at least 0"),
        (
            "follower",
            ["environment.on_target=[restart, nothing]", "imitation.planner=pibt", "imitation.ahead=1"],
            "follower.yaml: imitation.ahead is 1, expected 0 unless environment.on_target is 'restart'",
        ),
        (
            "follower",
            ["environment.on_target=[finish]"],
            "follower.yaml: environment.on_target is ('finish',), expected",
        ),
        ("qmix", [], "qmix.yaml: imitation.iterations is 9, expected 0, because qmix learns no policy by PPO"),
    ],
)
def test_invalid_settings_of_the_imitation_are_rejected(method, changes, expected):
    with pytest.raises(ValueError) as error:
        load_config(method, None, ["imitation.iterations=9", *changes])
    name, _, rest = expected.partition(": ")
    how = f"{len(changes) + 1} changes by --set" if changes else "--set imitation.iterations=9"
    assert str(error.value).startswith(f"{name} with {how}: {rest}")
