"""Tests of what a training run records: windows, rewards, ends and the replay."""

import numpy as np
import pytest
from encoder_model import distances
from pogema_rs import VecEnv
from pogema_rs.baselines import _record, load_config
from pogema_rs.baselines._collector import Collector
from pogema_rs.baselines._episodes import Episodes
from pogema_rs.baselines._replay import Replay
from small import small_config

CHANNELS = "[obstacles, agents, all_agents, goal, cost_to_go, path, follower_path, seen_agents, seen_obstacles]"


def played(config, iteration=0):
    """Plays random actions; returns the record, observations and masks, the metrics, and configs and seeds."""
    episodes = Episodes(config.environment, 1, config.schedule.validation_steps)
    configs, seeds = episodes.of_iteration(iteration, config.schedule.lanes)
    collector = Collector(config, episodes.map_size, config.schedule.lanes, 1)
    rng, seen = np.random.default_rng(iteration), []

    def act(windows, scalars, masks):
        seen.append((windows.copy(), scalars.copy(), masks.copy()))
        return rng.integers(5, size=masks.shape[:2])

    record, metrics = collector.play(configs, seeds, act)
    collector.close()
    return record, seen, metrics, (configs, seeds)


@pytest.mark.parametrize("radius", [1, 3, 5, 7])
def test_bytes_hold_windows_exactly(radius):
    changes = [f"encoder.channels={CHANNELS}", f"encoder.radius={radius}", "encoder.scalars=[goal_offset]"]
    record, seen, _, _ = played(small_config("iql", "environment.size=12", "environment.density=0.3", *changes))
    assert len(np.unique(record.windows)) > 3
    for step, (windows, scalars, masks) in enumerate(seen):
        restored = record.windows[step].astype(np.float32) / np.float32(2 * radius)
        np.testing.assert_array_equal(restored.reshape(windows.shape), windows)
        np.testing.assert_array_equal(record.scalars[step], scalars)
        np.testing.assert_array_equal(record.masks[step], masks != 0)


@pytest.mark.parametrize("on_target", ["nothing", "restart", "finish"])
def test_rewards_and_ends_are_those_of_the_environment(on_target):
    changes = [f"environment.on_target=[{on_target}]", "environment.max_episode_steps=40", "schedule.lanes=16"]
    rewards = ["rewards.goal=1.0", "rewards.progress=0.25", "rewards.approach=0", "rewards.step=-0.125"]
    config = small_config("iql", *changes, *rewards, "learner.replay=16")
    record, seen, metrics, (configs, seeds) = played(config)
    env = VecEnv(configs, autoreset_mode="Disabled", encoder=config.encoder, masks=True)
    windows, _ = env.reset(seed=seeds)
    windows, state, is_over = windows.copy(), env.state(), np.zeros(16, dtype=bool)
    rewarded, costs = 0, config.encoder.channels.index("cost_to_go")
    for step in range(len(record.actions)):
        np.testing.assert_array_equal(record.played[step], ~is_over)
        active = state["active"] & ~is_over[:, None]
        after, own, terminated, truncated, _ = env.step(record.actions[step].astype(np.int64))
        now = env.state()
        for lane, agent in np.argwhere(active):
            down, right = now["positions"][lane, agent] - state["positions"][lane, agent]
            nearer = windows[lane, agent, costs, 5 + down, 5 + right] * 10
            on_goal = (now["positions"][lane, agent] == now["goals"][lane, agent]).all()
            goal = on_goal if on_target == "nothing" else own[lane, agent]
            assert record.rewards[step, lane, agent] == pytest.approx(goal + 0.25 * nearer - 0.125, abs=1e-6)
            rewarded += bool(goal)
        assert (record.rewards[step][~active] == 0).all()
        np.testing.assert_array_equal(record.terminated[step][~is_over], terminated[~is_over])
        is_over |= terminated.all(axis=1) | truncated.all(axis=1)
        windows, state = after.copy(), now
    assert rewarded > 5 and is_over.all()
    assert all(np.isfinite(value) for value in metrics.values())


@pytest.mark.parametrize("on_target", ["nothing", "restart"])
@pytest.mark.parametrize("channels", ["[obstacles, agents]", "[cost_to_go, agents]"])
def test_approach_counts_each_nearest_cell_once(on_target, channels):
    changes = [
        f"environment.on_target=[{on_target}]",
        "environment.max_episode_steps=40",
        f"encoder.channels={channels}",
    ]
    rewards = ["rewards.goal=0", "rewards.progress=0", "rewards.approach=1"]
    config = small_config("iql", *changes, *rewards)
    record, seen, _, _ = played(config)
    assert seen[0][0].shape[2] == 2 and record.windows.shape[-1] == 2 * 11 * 11
    approaches = returns = 0
    places = record.places.astype(int)
    for lane, agent in np.ndindex(record.actions.shape[1:]):
        best = None
        for step in range(len(record.actions)):
            *_, row, col = places[step, lane, agent]
            if step == 0 or (places[step - 1, lane, agent, 2:] != (row, col)).any():
                best = None
            costs = distances(record.maps[lane], (row, col))
            before, after = (costs[tuple(places[at, lane, agent, :2])] for at in (step, step + 1))
            best = before if best is None else best
            expected = float(after < best and record.played[step, lane])
            assert record.rewards[step, lane, agent] == expected, (lane, agent, step)
            approaches += expected
            returns += after < before and not expected
            best = min(best, after)
    assert approaches > 5 and returns > 10


def test_the_rules_of_goals_take_turns():
    config = small_config("iql", "environment.on_target=[restart, nothing]")
    episodes = Episodes(config.environment, 1, 12)
    drawn = [episodes.of_iteration(iteration, 3)[0] for iteration in range(4)]
    rules = [{one["on_target"] for one in configs} for configs in drawn]
    assert rules == [{"restart"}, {"nothing"}, {"restart"}, {"nothing"}]
    lifelong, one_shot = (episodes.of_validation(3, (rule, 2)) for rule in ("restart", "nothing"))
    assert lifelong[1] == one_shot[1] and lifelong[0][0]["on_target"] == "restart"


def test_numbers_of_agents_alternate_and_small_ones_are_padded():
    config = small_config("iql", "environment.on_target=[restart, nothing]", "environment.num_agents=[2, 4]")
    episodes = Episodes(config.environment, 1, 12)
    drawn = [episodes.of_iteration(iteration, 3)[0][0] for iteration in range(5)]
    kinds = [(one["on_target"], one["num_agents"]) for one in drawn]
    assert kinds == [("restart", 2), ("nothing", 2), ("restart", 4), ("nothing", 4), ("restart", 2)]
    small, large = (played(config, iteration) for iteration in (0, 2))
    assert small[1][0][0].shape[1] == 2 and large[1][0][0].shape[1] == 4
    for record, _, metrics, _ in (small, large):
        assert record.actions.shape[2] == 4 and np.isfinite(metrics["reward"])
    record = small[0]
    assert record.active[:, :, :2].all() and not record.active[:, :, 2:].any()
    assert record.terminated[:, :, 2:].all() and not record.terminated[:, :, :2].any()
    assert not record.rewards[:, :, 2:].any() and not record.masks[:, :, 2:].any()


def test_rewards_of_follower_are_moves_along_the_path():
    config = small_config("follower", "rewards.path=1.0", "schedule.lanes=16")
    radius = config.encoder.radius
    record, seen, _, _ = played(config)
    assert set(np.unique(record.rewards)) == {0.0, 1.0}
    for step, (windows, _, _) in enumerate(seen):
        moves = record.places[step + 1, ..., :2].astype(int) - record.places[step, ..., :2]
        for lane, agent in np.ndindex(moves.shape[:2]):
            down, right = moves[lane, agent]
            is_on_path = windows[lane, agent, 0, radius + down, radius + right] == 1 and (down, right) != (0, 0)
            assert record.rewards[step, lane, agent] == is_on_path


def test_team_rewards_are_the_mean():
    own, team = (played(small_config("iql", f"rewards.team={flag}"))[0] for flag in ("false", "true"))
    np.testing.assert_allclose(team.rewards, np.broadcast_to(own.rewards.mean(-1, keepdims=True), own.rewards.shape))
    assert (own.rewards[..., 0] != own.rewards[..., 1]).any()


def test_replay_returns_the_newest_episodes_and_keeps_those_of_a_checkpoint(tmp_path):
    config = small_config("qmix")
    size = Episodes(config.environment, 1, 12).map_size
    records = [played(config, number)[0] for number in range(8)]
    replay = Replay(tmp_path, config, size, (12, 8), 0)
    for record in records[:6]:
        replay.add(record)
    assert (len(replay), replay.count) == (12, 24)

    def newest(replay):
        return _record.by_lane(replay.sample(np.arange(12)))

    expected = _record.by_lane(records[5])
    for name, array in newest(replay).items():
        np.testing.assert_array_equal(array[:4], expected[name][::-1])
    at_checkpoint = newest(replay)
    replay.flush()
    for record in records[6:]:  # 8 episodes fill the spare room
        replay.add(record)
    resumed = Replay(tmp_path, config, size, (12, 8), 24)
    for name, array in newest(resumed).items():
        np.testing.assert_array_equal(array, at_checkpoint[name])


def test_replay_rejects_missing_and_cut_files(tmp_path):
    config = small_config("qmix")
    sizes = (12, 8)
    size = Episodes(config.environment, 1, 12).map_size
    Replay(tmp_path, config, size, sizes, 0)
    windows = tmp_path / "windows.bin"
    windows.write_bytes(windows.read_bytes()[:-1])
    with pytest.raises(FileNotFoundError, match="windows.bin: part of the replay buffer is missing"):
        Replay(tmp_path, config, size, sizes, 4)
    windows.unlink()
    with pytest.raises(FileNotFoundError, match="windows.bin"):
        Replay(tmp_path, config, size, sizes, 4)


def test_the_configs_of_the_package_play_an_episode():
    for method in ("qmix", "follower"):
        config = load_config(method, None, ["schedule.lanes=2", "environment.max_episode_steps=8"])
        record, _, metrics, _ = played(config)
        assert record.shape == (8, 2, *config.environment.num_agents) and metrics


@pytest.mark.parametrize(("occupancy", "semantics"), [("as_released", "1.4.0"), ("exact", "2.0")])
def test_windows_follow_the_rule_of_occupancy(occupancy, semantics):
    changes = ["environment.num_agents=[8]", "environment.collision_system=soft", f"environment.occupancy={occupancy}"]
    config = small_config("ippo", *changes)
    record, seen, _, (configs, seeds) = played(config)
    others = {"1.4.0": "2.0", "2.0": "1.4.0"}[semantics]
    envs = [
        VecEnv(configs, autoreset_mode="Disabled", encoder=config.encoder, semantics=line)
        for line in (semantics, others)
    ]
    same, other = (env.reset(seed=seeds)[0] for env in envs)
    num_different = 0
    for step, (windows, _, _) in enumerate(seen):
        np.testing.assert_array_equal(windows, same)
        num_different += int((windows != other).sum())
        same, other = (env.step(record.actions[step].astype(np.int64))[0] for env in envs)
    assert num_different > 0
