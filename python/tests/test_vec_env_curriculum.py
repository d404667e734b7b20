"""Tests a `VecEnv` whose configs change at the next episode, by comparison with single engines."""

import numpy as np
import pytest
from pogema_rs import GridConfig, errors
from pogema_rs.vec_env import AutoresetMode, VecEnv
from vec_helpers import CONFIG, Plain, actions_of, check_step, reset_ended, shared_seed

MODES = list(AutoresetMode)
NUM_ENVS = 4
STAGES = [
    {**CONFIG, "num_agents": 2, "size": 5, "density": 0.0},
    {**CONFIG, "num_agents": 4, "size": 8, "density": 0.2},
    {**CONFIG, "num_agents": 6, "size": 10, "density": 0.3},
]
ROOM = {"num_agents": 6, "map_size": 10}


def vec_env(mode=AutoresetMode.SAME_STEP, **fields):
    return VecEnv(STAGES[0], NUM_ENVS, masks=True, autoreset_mode=mode, **{**ROOM, **fields})


def stage_of(env, metrics, num_ended):
    """Chooses the next config by environment, metrics and number of ended episodes; None keeps the config."""
    level = (env + num_ended + round(10 * metrics["CSR"] + 7 * metrics["ISR"])) % 4
    return None if level == 3 else STAGES[level]


class Curriculum:
    def __init__(self):
        self.calls = []

    def __call__(self, env, metrics):
        num_ended = sum(one == env for one, _ in self.calls)
        self.calls.append((env, metrics))
        return stage_of(env, metrics, num_ended)


class Learner(Plain):
    """A single engine whose next config comes from `stage_of`."""

    def __init__(self, env, seed):
        self.num_ended, self.next_config = 0, STAGES[0]
        super().__init__(STAGES[0], env, shared_seed(seed), room=ROOM["num_agents"])

    def begin(self):
        self.config = self.next_config
        super().begin()

    def follow(self, metrics):
        config = stage_of(self.env, metrics, self.num_ended)
        self.next_config = self.next_config if config is None else config
        self.num_ended += 1

    def begin_after(self, metrics):
        self.follow(metrics)
        self.begin()

    def step(self, mode, actions):
        shown = super().step(mode, actions)
        if "metrics" in shown and mode != AutoresetMode.SAME_STEP:
            self.follow(shown["metrics"])
        return shown


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("num_threads", [1, 2, 8])
@pytest.mark.parametrize("dtype", ["float32", "uint8"])
def test_a_curriculum_equals_single_engines_in_every_mode(mode, num_threads, dtype):
    curriculum = Curriculum()
    env = vec_env(mode, curriculum=curriculum, num_threads=num_threads, dtype=dtype)
    env.reset(seed=5)
    plain = [Learner(index, 5) for index in range(NUM_ENVS)]
    rng, num_ended, numbers = np.random.default_rng(0), 0, set()
    for step in range(80):
        actions = actions_of(rng, env)
        num_ended += check_step(env.step(actions), plain, mode, actions, env.episode_seeds)
        numbers.update(one.num_agents for one in plain)
        if mode == AutoresetMode.DISABLED and step % 3 == 0:
            reset_ended(env, plain)
    assert num_ended == len(curriculum.calls) > 5 * NUM_ENVS and numbers == {2, 4, 6}
    # A reset begins the next episodes, with the configs that the curriculum chose last.
    env.reset()
    for one in plain:
        one.begin()
    np.testing.assert_array_equal(env.action_masks(), [one.masks() for one in plain])


@pytest.mark.parametrize("rewards", ["shared", lambda rewards, *others: rewards + np.float32(1)])
def test_statistics_count_the_agents_of_the_ended_episode(rewards):
    env = vec_env(curriculum=Curriculum(), statistics=True, rewards=rewards)
    _, infos = env.reset(seed=1)
    mask, rng, total, num_ended = infos["agent_mask"], np.random.default_rng(0), np.zeros(NUM_ENVS), 0
    for _ in range(60):
        _, rewards, terminated, truncated, infos = env.step(actions_of(rng, env))
        assert not rewards[~mask].any() and terminated[~mask].all() and truncated[~mask].all()
        total += rewards.sum(axis=1) / mask.sum(axis=1)
        if "episode" in infos:
            np.testing.assert_array_equal(infos["final_info"]["agent_mask"][infos["_episode"]], mask[infos["_episode"]])
            np.testing.assert_allclose(infos["episode"]["r"], np.where(infos["_episode"], total, 0), rtol=1e-6)
            total[infos["_episode"]] = 0
            num_ended += infos["_episode"].sum()
        mask = infos["agent_mask"]
    assert num_ended > 10


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("num_threads", [1, 2, 8])
def test_set_configs_takes_effect_at_the_next_episodes(mode, num_threads):
    env = vec_env(mode, num_threads=num_threads)
    env.reset(seed=2)
    plain = [Plain(STAGES[0], index, shared_seed(2), room=6) for index in range(NUM_ENVS)]
    rng, level, num_ended = np.random.default_rng(4), 0, 0
    for step in range(70):
        actions = actions_of(rng, env)
        num_ended += check_step(env.step(actions), plain, mode, actions, env.episode_seeds)
        if step % 7 == 3:
            level += 1
            chosen = [(level + index) % NUM_ENVS for index in range(1 + level % NUM_ENVS)]
            configs = [GridConfig(**STAGES[(level + env) % 3], seed=99) for env in chosen]
            env.set_configs(configs, envs=chosen)
            for index in chosen:
                plain[index].config = STAGES[(level + index) % 3]
        if mode == AutoresetMode.DISABLED and step % 5 == 0:
            reset_ended(env, plain)
    assert num_ended > 5 * NUM_ENVS


def test_set_configs_takes_one_config_for_all_and_works_before_the_first_reset():
    env = vec_env()
    env.set_configs(STAGES[2])
    _, infos = env.reset(seed=0)
    assert infos["agent_mask"].sum(axis=1).tolist() == [6] * NUM_ENVS
    env.set_configs([STAGES[0], STAGES[1]], envs=np.array([3, 1]))
    env.set_configs([], envs=[])
    _, infos = env.reset(seed=0)
    assert infos["agent_mask"].sum(axis=1).tolist() == [6, 4, 6, 2]
    other = VecEnv([STAGES[2], STAGES[1], STAGES[2], STAGES[0]], masks=True, **ROOM)
    observations, _ = other.reset(seed=0)
    np.testing.assert_array_equal(env.reset(seed=0)[0], observations)


def test_a_map_text_with_starts_and_goals_can_be_set():
    env = vec_env()
    text = "\n".join(["......", ".##...", "......"])
    agents = {"agents_xy": [[0, 0], [2, 5]], "targets_xy": [[2, 5], [0, 0]]}
    config = {name: value for name, value in CONFIG.items() if name not in ("size", "density", "num_agents")}
    env.set_configs({**config, "map": text, **agents})
    env.reset(seed=0)
    state = env.state()
    assert state["positions"][2].tolist() == [[0, 0], [2, 5], [0, 0], [0, 0], [0, 0], [0, 0]]
    assert state["obstacles"][0, :3, :6].sum() == 2 and state["obstacles"][0, 3:].all()
    assert state["active"].sum(axis=1).tolist() == [2] * NUM_ENVS


BIG = {**CONFIG, "num_agents": 7, "size": 8}
WRONG = [
    (BIG, None, ValueError, r"`num_agents` is `7`, expected at most 6, the number of agents for which the arrays have"),
    (
        {**STAGES[0], "size": 11},
        None,
        ValueError,
        r"`map_size` is `11 x 11`, expected at most 10 x 10, the size for which",
    ),
    ([*STAGES, BIG], None, ValueError, "`num_agents` is `7`, expected at most 6"),
    (STAGES, None, ValueError, "configs holds 3 configs, expected 4, one per environment"),
    (STAGES, [0, 1], ValueError, "configs holds 3 configs, expected 2, one per environment"),
    ({**STAGES[0], "obs_radius": 3}, None, ValueError, "`obs_radius` is `3`, expected 2, which cannot change"),
    ({**STAGES[0], "max_episode_steps": 3}, [1], ValueError, "`max_episode_steps` is `3`, expected 9, which cannot"),
    ({**STAGES[0], "on_target": "restart"}, None, ValueError, '`on_target` is `"restart"`, expected "finish", which'),
    ({**STAGES[0], "persistent": True}, None, ValueError, "expected false"),
    ({**STAGES[0], "map_name": "no such map"}, None, KeyError, "no such map"),
    (STAGES[0], [4], ValueError, r"envs\[0\] is 4, expected 0 to 3, an index of an environment"),
    (STAGES[0], [0, -1], ValueError, r"envs\[1\] is -1, expected 0 to 3"),
    (STAGES[0], [0, 0], ValueError, r"envs is \[0, 0\], expected each environment once"),
    (STAGES[0], [True], TypeError, r"envs\[0\] is True, expected a whole number"),
    (STAGES[0], 2, TypeError, "envs is 2, expected a list of indices"),
    (7, None, TypeError, "configs holds a value of type int, expected a GridConfig or a dict"),
]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("configs", "envs", "error", "text"), WRONG)
def test_configs_that_do_not_fit_change_nothing(mode, configs, envs, error, text):
    env, other = vec_env(mode), vec_env(mode)
    for one in (env, other):
        one.reset(seed=8)
    for step in range(30):
        if step % 4 == 1:
            with pytest.raises(error, match=text) as raised:
                env.set_configs(configs, envs)
            assert "\n" not in str(raised.value)
        actions = np.full((NUM_ENVS, 6), step % 5)
        for got, expected in zip(env.step(actions)[:4], other.step(actions)[:4]):
            np.testing.assert_array_equal(got, expected)
        assert (env.episode_seeds == other.episode_seeds).all()


def full():
    """Returns a config that fits the arrays, but whose map has too few free cells for its agents."""
    return {**CONFIG, "num_agents": 6, "size": 3, "density": 0.9}


def test_a_config_without_an_instance_is_reported_and_can_be_replaced():
    env = vec_env(AutoresetMode.NEXT_STEP)
    env.reset(seed=0)
    for _ in range(9):
        *_, infos = env.step(np.zeros((NUM_ENVS, 6), int))
    assert infos["_metrics"].all()
    # The next episodes are already prepared, so `set_configs` raises the error and changes nothing.
    with pytest.raises(errors.InstanceError, match="environment 0, episode 1"):
        env.set_configs(full())
    assert env.step(np.zeros((NUM_ENVS, 6), int))[4]["agent_mask"].sum() == 2 * NUM_ENVS
    # In the middle of an episode, `set_configs` succeeds, and the next reset raises the error.
    env.set_configs(full())
    with pytest.raises(errors.InstanceError, match="environment 0, episode 2"):
        env.reset()
    env.set_configs(STAGES[1])
    _, infos = env.reset()
    assert infos["agent_mask"].sum() == 4 * NUM_ENVS


@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
@pytest.mark.parametrize("wrong", ["raises", "misfit", "interrupt"])
def test_a_curriculum_that_fails_leaves_the_configs_unchanged(mode, wrong):
    failures = {"raises": ZeroDivisionError, "misfit": ValueError, "interrupt": KeyboardInterrupt}
    calls = []

    def curriculum(env, metrics):
        calls.append(env)
        if len(calls) == 2 and wrong == "interrupt":
            raise KeyboardInterrupt
        if len(calls) == 2:
            return BIG if wrong == "misfit" else 1 / 0
        # The config of the first call does not take effect either.
        return STAGES[1] if len(calls) == 1 else None

    env, other = vec_env(mode, curriculum=curriculum), vec_env(mode)
    for one in (env, other):
        one.reset(seed=8)
    num_failures = 0
    for step in range(25):
        actions = np.full((NUM_ENVS, 6), step % 5)
        expected = other.step(actions)
        try:
            got = env.step(actions)
        except failures[wrong]:
            num_failures += 1
            continue
        for one, two in zip(got[:4], expected[:4]):
            np.testing.assert_array_equal(one, two)
        assert (env.episode_seeds == other.episode_seeds).all()
    assert num_failures == 1 and len(calls) >= 2


def test_a_curriculum_without_a_next_instance_needs_a_reset():
    env = vec_env(curriculum=lambda env, metrics: full() if env == 1 else None)
    env.reset(seed=0)
    actions = np.zeros((NUM_ENVS, 6), int)
    for _ in range(8):
        env.step(actions)
    for _ in range(3):
        with pytest.raises(errors.InstanceError, match="environment 1, episode 1"):
            env.step(actions)
    env.set_configs(STAGES[2])
    with pytest.raises(errors.InstanceError):
        env.step(actions)
    _, infos = env.reset()
    assert infos["agent_mask"].sum() == 6 * NUM_ENVS
    env.step(actions)


def test_wrong_curricula_are_errors():
    with pytest.raises(TypeError, match="curriculum has type dict, expected a function"):
        vec_env(curriculum=STAGES[0])
    env = vec_env(curriculum=lambda env, metrics: 3)
    env.reset(seed=0)
    for _ in range(8):
        env.step(np.zeros((NUM_ENVS, 6), int))
    with pytest.raises(TypeError, match="configs holds a value of type int"):
        env.step(np.zeros((NUM_ENVS, 6), int))


def test_a_closed_environment_rejects_configs():
    env = vec_env()
    env.close()
    with pytest.raises(RuntimeError, match="closed"):
        env.set_configs(STAGES[1])
