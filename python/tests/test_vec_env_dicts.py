"""Tests the observation types `POMAPF` and `MAPF` of `VecEnv`, and its global states, against single environments."""

import numpy as np
import pytest
from pogema_rs import GridConfig, errors, pogema_v0
from pogema_rs.vec_env import AutoresetMode, VecEnv
from vec_helpers import CONFIG, of_env

# Maps of two sizes, so that one of them is padded.
SHAPES = [{"size": 7}, {"map": "\n".join(["....", ".#..", "....", "....", "...#"])}, {"size": 7}]
SEEDS = [5, 6, 7]
PAIRS = ("xy", "target_xy", "global_xy", "global_target_xy")


def configs_of(**fields):
    plain = {name: value for name, value in CONFIG.items() if name != "size"}
    return [{**plain, **shape, **fields} for shape in SHAPES]


class Single:
    """A single environment whose next episode begins when `begin` is called."""

    def __init__(self, config, seed, semantics):
        self.env = pogema_v0(GridConfig(**config, seed=seed), semantics=semantics)
        self.observations, _ = self.env.reset()

    def step(self, actions):
        """Plays a step, and returns whether the episode has ended."""
        self.observations, _, terminated, truncated, _ = self.env.step(actions.tolist())
        return all(terminated) or all(truncated)

    def begin(self, seed):
        self.env.grid_config.seed = int(seed)
        self.observations, _ = self.env.reset()


def check_observations(got, single, kind):
    """Compares the arrays of one environment of a `VecEnv` to the dictionaries of a single environment."""
    names = {"obstacles", "agents", "xy", "target_xy"} | ({"global_obstacles", *PAIRS} if kind == "MAPF" else set())
    assert set(got) == names == set(single[0])
    for name in names - {"global_obstacles"}:
        np.testing.assert_array_equal(got[name], [seen[name] for seen in single], err_msg=name)
    if kind == "MAPF":
        whole = single[0]["global_obstacles"]
        rows, columns = whole.shape
        np.testing.assert_array_equal(got["global_obstacles"][:rows, :columns], whole)
        assert got["global_obstacles"][rows:].all() and got["global_obstacles"][:, columns:].all()


def check_state(got, env):
    rows, columns = env.get_obstacles(ignore_borders=True).shape
    np.testing.assert_array_equal(got["obstacles"][:rows, :columns], env.get_obstacles(ignore_borders=True))
    assert got["obstacles"][rows:].all() and got["obstacles"][:, columns:].all()
    np.testing.assert_array_equal(got["positions"], env.get_agents_xy(ignore_borders=True))
    np.testing.assert_array_equal(got["goals"], env.get_targets_xy(ignore_borders=True))
    np.testing.assert_array_equal(got["active"], [env.grid.is_active[agent] for agent in range(5)])


@pytest.mark.parametrize("kind", ["POMAPF", "MAPF"])
@pytest.mark.parametrize("on_target", ["finish", "nothing", "restart"])
@pytest.mark.parametrize(("dtype", "empty_outside"), [("float32", True), ("uint8", False)])
def test_dictionaries_and_states_equal_single_environments(kind, on_target, dtype, empty_outside):
    configs = configs_of(observation_type=kind, on_target=on_target, empty_outside=empty_outside)
    envs = VecEnv(configs, dtype=dtype, semantics="2.0", num_threads=2)
    observations, _ = envs.reset(seed=SEEDS)
    singles = [Single(config, seed, "2.0") for config, seed in zip(configs, SEEDS)]
    rng, num_ends = np.random.default_rng(0), 0
    for _ in range(30):
        state = envs.state()
        assert envs.observation_space.contains(observations) and envs.state_space.contains(state)
        assert observations["obstacles"].dtype == observations["agents"].dtype == dtype
        for index, single in enumerate(singles):
            check_observations(of_env(observations, index), single.observations, kind)
            check_state(of_env(state, index), single.env)
        actions = rng.integers(5, size=(3, 5))
        observations, *_, infos = envs.step(actions)
        for index, single in enumerate(singles):
            has_ended = single.step(actions[index])
            assert has_ended == bool("_final_state" in infos and infos["_final_state"][index])
            if has_ended:
                check_observations(infos["final_obs"][index], single.observations, kind)
                check_state(infos["final_state"][index], single.env)
                single.begin(envs.episode_seeds[index])
                num_ends += 1
            elif "final_state" in infos:
                assert infos["final_state"][index] is None and infos["final_obs"][index] is None
    assert num_ends >= 9


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED])
def test_other_modes_show_the_end_in_the_state(mode):
    config = configs_of()[1]
    envs, single = VecEnv(config, 1, autoreset_mode=mode), Single(config, 3, "1.4.0")
    envs.reset(seed=[3])
    for step in range(9):
        actions = np.full((1, 5), step % 5)
        *_, infos = envs.step(actions)
        single.step(actions[0])
    assert "metrics" in infos and "final_state" not in infos
    check_state(of_env(envs.state(), 0), single.env)


def test_states_are_new_arrays_of_one_size():
    envs = VecEnv(configs_of())
    with pytest.raises(errors.NotResetError):
        envs.state()
    envs.reset(seed=1)
    first, second = envs.state(), envs.state()
    assert first["obstacles"].shape == (3, 7, 7) and first["obstacles"].dtype == np.uint8
    assert first["positions"].shape == first["goals"].shape == (3, 5, 2) and first["positions"].dtype == np.int64
    assert first["active"].shape == (3, 5) and first["active"].dtype == np.bool_
    for name, part in first.items():
        assert not np.shares_memory(part, second[name])
        np.testing.assert_array_equal(part, second[name])
        assert envs.single_state_space[name].contains(part[0])


def test_dictionaries_are_written_to_the_callers_buffers():
    config = configs_of(observation_type="MAPF")
    envs, other = VecEnv(config, double_buffer=True), VecEnv(config)
    first, _ = envs.reset(seed=0)
    other.reset(seed=0)
    out = {name: np.full_like(part, 7) for name, part in first.items()}
    kept = {name: part.copy() for name, part in first.items()}
    actions = np.arange(15).reshape(3, 5) % 5
    assert envs.step(actions, out=out)[0] is out
    expected = other.step(actions)[0]
    for name, part in expected.items():
        np.testing.assert_array_equal(out[name], part)
        np.testing.assert_array_equal(first[name], kept[name])
    assert other.step(actions)[0] is expected and envs.step(actions)[0] is not first
    wrong = [
        (np.zeros(3), TypeError, "out has type ndarray, expected a dict of arrays with the keys"),
        ({"xy": out["xy"]}, TypeError, r"out has the keys \['xy'\], expected a dict of arrays"),
        ({**out, "xy": out["xy"].astype(np.int32)}, TypeError, r"out\['xy'\] has type int32, expected int64"),
        ({**out, "agents": out["agents"][:1]}, ValueError, r"out\['agents'\] has shape"),
        ({**out, "xy": out["target_xy"]}, RuntimeError, "cannot be written"),
    ]
    for buffers, error, text in wrong:
        with pytest.raises(error, match=text):
            envs.step(actions, out=buffers)
    unchanged = other.state()
    for name, part in envs.state().items():
        np.testing.assert_array_equal(part, unchanged[name])
