"""Tests `VecEnv` with different numbers of agents, against single engines and environments without padding."""

import numpy as np
import pogema_rs
import pytest
from pogema_rs import errors
from pogema_rs.vec_env import AutoresetMode, VecEnv
from vec_helpers import CONFIG, Plain, actions_of, check_step, own_seeds, reset_ended

MODES = list(AutoresetMode)
NUMBERS = [5, 1, 3, 8, 2]
SIZES = [7, 4, 12, 9, 7]
SEEDS = [5, 2**63 - 2, 0, 5, 9]


def configs_of(**fields):
    pairs = zip(NUMBERS, SIZES)
    return [{**CONFIG, "num_agents": number, "size": size, **fields} for number, size in pairs]


def unpacked(dtype):
    return (lambda words: pogema_rs.unpack(words, 2)) if dtype == "bits" else np.asarray


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("dtype", ["float32", "uint8", "bits"])
@pytest.mark.parametrize("num_threads", [1, 2, 8])
@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
def test_padded_environments_equal_single_engines(mode, dtype, num_threads, on_target):
    made = {"autoreset_mode": mode, "dtype": dtype, "num_threads": num_threads, "masks": True}
    configs = configs_of(on_target=on_target)
    env = VecEnv(configs, num_agents=10 if num_threads == 2 else None, **made)
    room = 10 if num_threads == 2 else 8
    assert env.num_agents == room and env.single_action_space.shape == (room,)
    observations, infos = env.reset(seed=SEEDS)
    plain = [Plain(config, index, own_seeds(SEEDS), room=room) for index, config in enumerate(configs)]
    unpack = unpacked(dtype)
    np.testing.assert_array_equal(unpack(observations), [one.observe() for one in plain])
    assert infos["agent_mask"].sum(axis=1).tolist() == NUMBERS
    rng, num_ended = np.random.default_rng(0), 0
    for step in range(40):
        actions = actions_of(rng, env)
        num_ended += check_step(env.step(actions), plain, mode, actions, env.episode_seeds, unpack)
        if mode == AutoresetMode.DISABLED and step % 4 == 0:
            reset_ended(env, plain)
    assert num_ended > 2 * env.num_envs
    np.testing.assert_array_equal(env.action_masks(), [one.masks() for one in plain])


def parts_of(value):
    """Returns the arrays of a value, by name."""
    return value if isinstance(value, dict) else {"": value}


def check_rows(got, alone, number, name):
    """Compares the rows of agents to those of an environment without padding; all other values must be 0."""
    np.testing.assert_array_equal(got[:number], alone, err_msg=name)
    assert not got[number:].any(), name


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", ["default", "POMAPF", "MAPF"])
@pytest.mark.parametrize("rewards", ["own", "shared", "function"])
def test_padded_environments_equal_environments_alone(mode, kind, rewards):
    """Compares each environment of the batch to a `VecEnv` with only that environment."""
    change = rewards if rewards != "function" else lambda rewards, *others: rewards + np.float32(0.5)
    made = {"autoreset_mode": mode, "rewards": change, "statistics": True, "semantics": "2.0"}
    configs = configs_of(observation_type=kind, on_target="restart")
    env = VecEnv(configs, num_agents=9, map_size=(14, 13), **made)
    alone = [VecEnv([config], **made) for config in configs]
    observations, _ = env.reset(seed=SEEDS)
    for one, seed in zip(alone, SEEDS):
        one.reset(seed=[seed])
    rng, returns = np.random.default_rng(3), 0.0
    for _ in range(24):
        actions = actions_of(rng, env)
        observations, got, terminated, truncated, infos = env.step(actions)
        assert env.observation_space.contains(observations) and env.state_space.contains(env.state())
        for index, (one, number) in enumerate(zip(alone, NUMBERS)):
            seen, own, *ends, own_infos = one.step(actions[index : index + 1, :number])
            check_arrays(observations, seen, index, number)
            check_arrays(env.state(), one.state(), index, number)
            check_rows(got[index], own[0], number, "rewards")
            for padded, end in zip((terminated, truncated), ends):
                np.testing.assert_array_equal(padded[index, :number], end[0])
                assert padded[index, number:].all()
            has_ended = "_metrics" in own_infos
            assert has_ended == bool("_metrics" in infos and infos["_metrics"][index])
            if has_ended:
                check_end(infos, own_infos, index, number)
                returns += infos["episode"]["r"][index]
        over = np.array([all(ends) or all(cuts) for ends, cuts in zip(terminated, truncated)])
        if mode == AutoresetMode.DISABLED and over.any():
            env.reset(options={"reset_mask": over.copy()})
            for one in np.array(alone, object)[over]:
                one.reset()
    assert returns > 1


def check_arrays(got, alone, index, number):
    for name, part in parts_of(got).items():
        own = parts_of(alone)[name][0]
        if name in ("obstacles", "global_obstacles") and own.ndim == 2:
            rows, columns = own.shape
            np.testing.assert_array_equal(part[index, :rows, :columns], own)
            assert part[index, rows:].all() and part[index, :, columns:].all()
        else:
            check_rows(part[index], own, number, name)


def check_end(infos, own_infos, index, number):
    for name in ("r", "l"):
        assert infos["episode"][name][index] == pytest.approx(own_infos["episode"][name][0])
    for name, values in own_infos["metrics"].items():
        if not name.startswith("_"):
            assert infos["metrics"][name][index] == values[0]
    if "final_obs" in infos:
        final, own = infos["final_obs"][index], own_infos["final_obs"][0]

        def spread(arrays):
            return {name: part[None] for name, part in parts_of(arrays).items()}

        check_arrays(spread(final), spread(own), 0, number)
        check_arrays(spread(infos["final_state"][index]), spread(own_infos["final_state"][0]), 0, number)
        assert infos["final_info"]["agent_mask"][index].tolist() == [True] * number + [False] * (9 - number)


def test_padding_does_not_change_results_of_equal_environments():
    plain, roomy = VecEnv(CONFIG, 3), VecEnv(CONFIG, 3, num_agents=64, map_size=30)
    plain.reset(seed=1)
    observations, infos = roomy.reset(seed=1)
    assert observations.shape == (3, 64, 3, 5, 5) and roomy.state()["obstacles"].shape == (3, 30, 30)
    rng = np.random.default_rng(0)
    for _ in range(25):
        actions = rng.integers(5, size=(3, 64))
        got, other = plain.step(actions[:, :5]), roomy.step(actions)
        for one, padded in zip(got[:4], other[:4]):
            np.testing.assert_array_equal(padded[:, :5], one)
    assert (roomy.episode_seeds == plain.episode_seeds).all()


def test_a_wrong_action_of_padding_is_an_error_that_changes_nothing():
    env = VecEnv(configs_of())
    env.reset(seed=0)
    before = env.state()
    actions = np.ones((5, 8), int)
    actions[1, 7] = 5
    with pytest.raises(errors.ActionError, match="environment 1, agent 7"):
        env.step(actions)
    for name, part in env.state().items():
        np.testing.assert_array_equal(part, before[name])


WRONG = [
    ({"num_agents": 7}, ValueError, r"`num_agents` is `8`, expected at most 7, the number of agents for which"),
    ({"map_size": 11}, ValueError, r"`map_size` is `12 x 12`, expected at most 11 x 11, the size for which"),
    ({"map_size": (12, 11)}, ValueError, r"`map_size` is `12 x 12`, expected at most 12 x 11"),
    ({"num_agents": 0}, ValueError, "num_agents is 0, expected at least 1"),
    ({"num_agents": "9"}, TypeError, "num_agents is '9', expected a whole number"),
    ({"map_size": "12"}, TypeError, r"map_size is '12', expected a whole number or a pair \(rows, columns\)"),
    ({"map_size": (12, 12, 12)}, TypeError, r"map_size is \(12, 12, 12\), expected a whole number or a pair"),
    ({"map_size": (12, 1.5)}, TypeError, "map_size is 1.5, expected a whole number"),
    ({"map_size": -3}, ValueError, "map_size is -3, expected at least 1"),
    ({"num_agents": 10**15}, MemoryError, "memory"),
    ({"map_size": 10**30}, MemoryError, "memory"),
]


@pytest.mark.parametrize(("fields", "error", "text"), WRONG)
def test_wrong_room_is_an_error(fields, error, text):
    with pytest.raises(error, match=text) as raised:
        VecEnv(configs_of(), **fields)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("field", [{"obs_radius": 3}, {"max_episode_steps": 10}, {"on_target": "restart"}])
def test_rules_must_agree(field):
    with pytest.raises(ValueError, match="because environment 1 must share it with environment 0"):
        VecEnv([CONFIG, {**CONFIG, "num_agents": 2, **field}])
