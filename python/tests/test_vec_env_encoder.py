"""Tests `VecEnv(encoder=...)` against a plain model of encoders on single engines."""

import numpy as np
import pytest
from encoder_model import PlainEncoder
from pogema_rs import Film, VecEnv
from pogema_rs.policies import Encoder
from pogema_rs.vec_env import AutoresetMode
from vec_helpers import CONFIG, Plain, actions_of, of_env, own_seeds

CHANNELS = [
    "obstacles", "agents", "all_agents", "goal", "cost_to_go", "cost_tracer", "path", "seen_agents", "seen_obstacles",
]  # fmt: skip
SCALARS = ["position", "goal_position", "goal_offset", "goal_direction"]
EVERYTHING = Encoder(3, CHANNELS, SCALARS, sight=2)


class Model(Plain):
    """A single engine with a plain encoder."""

    def __init__(self, encoder, *arguments, **settings):
        self.settings = encoder
        super().__init__(*arguments, **settings)

    def begin(self):
        super().begin()
        self.encoder = PlainEncoder(self.settings, self.engine.obstacles(), self.config["obs_radius"], self.exact)
        self.is_followed = False

    def step(self, mode, actions):
        was_over = self.last is not None
        self.is_followed = was_over and mode == AutoresetMode.DISABLED
        return super().step(mode, actions)

    def observe(self):
        if not self.is_followed:
            self.encoder.follow(self.engine.cells(0), self.engine.goals(0), self.engine.active)
            self.is_followed = True
        shown = {"windows": self.padded(self.encoder.windows()), "scalars": self.padded(self.encoder.scalars())}
        return shown if self.settings.scalars else shown["windows"]


def check(got, expected, text):
    if isinstance(expected, dict):
        assert set(got) == set(expected)
        for name, part in expected.items():
            check(got[name], part, f"{text}, {name}")
        return
    assert got.dtype == np.float32 and got.shape == expected.shape
    where = np.argwhere(got != expected)
    assert not len(where), (
        f"{text}: {len(where)} differ, the first at {where[0]}: {got[tuple(where[0])]}, {expected[tuple(where[0])]}"
    )


def play(envs, models, mode, num_steps):
    """Plays random steps in a `VecEnv` and its models; returns the number of ended episodes."""
    rng, num_ends = np.random.default_rng(0), 0
    for step in range(num_steps):
        actions = actions_of(rng, envs)
        observations, *_, infos = envs.step(actions)
        assert envs.observation_space.contains(observations)
        for env, model in enumerate(models):
            shown = model.step(mode, actions[env])
            check(of_env(observations, env), shown["obs"], f"step {step}, environment {env}")
            if "final_obs" in shown:
                check(infos["final_obs"][env], shown["final_obs"], f"end in step {step}, environment {env}")
            num_ends += "metrics" in shown
    return num_ends


@pytest.mark.parametrize("mode", ["same_step", "next_step"])
@pytest.mark.parametrize("on_target", ["finish", "restart", "nothing"])
@pytest.mark.parametrize(("exact", "outside", "collisions"), [(False, True, "soft"), (True, False, "priority")])
def test_all_channels_equal_a_plain_model(mode, on_target, exact, outside, collisions):
    shared = {**CONFIG, "on_target": on_target, "empty_outside": outside, "collision_system": collisions}
    # Maps of different sizes, and different numbers of agents, so that some rows are padding.
    configs = [shared, {**shared, "size": 12, "num_agents": 3}, {**shared, "density": 0.45, "num_agents": 2}, shared]
    semantics = "2.0" if exact else "1.4.0"
    envs = VecEnv(configs, num_threads=2, autoreset_mode=mode, semantics=semantics, encoder=EVERYTHING)
    seeds = [3, 4, 5, 6]
    observations, _ = envs.reset(seed=seeds)
    models = [Model(EVERYTHING, config, env, own_seeds(seeds), exact, 5) for env, config in enumerate(configs)]
    for env, model in enumerate(models):
        check(of_env(observations, env), model.observe(), f"reset, environment {env}")
    assert play(envs, models, envs.autoreset_mode, 60) >= 20


def test_without_autoreset_an_ended_environment_keeps_its_last_windows_until_its_reset():
    configs = [{**CONFIG, "on_target": "restart", "max_episode_steps": 5}] * 2
    envs = VecEnv(configs, autoreset_mode="disabled", encoder=EVERYTHING)
    seeds = [8, 9]
    envs.reset(seed=seeds)
    models = [Model(EVERYTHING, config, env, own_seeds(seeds)) for env, config in enumerate(configs)]
    for model in models:
        model.observe()
    assert play(envs, models, AutoresetMode.DISABLED, 9) == 2
    observations, _ = envs.reset(options={"reset_mask": np.array([True, False])})
    models[0].begin()
    for env, model in enumerate(models):
        check(of_env(observations, env), model.observe(), f"environment {env}")


def test_windows_follow_new_configs_and_a_curriculum():
    plain = {**CONFIG, "on_target": "restart", "max_episode_steps": 6}
    larger = {**plain, "size": 11, "num_agents": 3}
    windows = Encoder(2, ["all_agents", "cost_to_go", "seen_obstacles"])

    class Grown(Model):
        def begin_after(self, metrics):
            self.config = larger
            self.begin()

    for settings in ({"curriculum": lambda env, metrics: larger}, {}):
        envs = VecEnv(plain, 2, num_agents=5, map_size=11, encoder=windows, **settings)
        seeds = [1, 2]
        envs.reset(seed=seeds)
        if not settings:
            envs.set_configs(larger)
        models = [Grown(windows, plain, env, own_seeds(seeds), room=5) for env in range(2)]
        for model in models:
            model.observe()
        assert play(envs, models, AutoresetMode.SAME_STEP, 20) == 6


@pytest.mark.parametrize("scalars", [(), ("goal_offset",)])
def test_windows_are_written_to_the_callers_buffers(scalars):
    encoder = Encoder(2, ["obstacles", "goal"], scalars)
    envs, other = (VecEnv(CONFIG, 3, encoder=encoder, double_buffer=True) for _ in range(2))
    first, _ = envs.reset(seed=0)
    other.reset(seed=0)
    kept = {name: part.copy() for name, part in first.items()} if scalars else first.copy()
    out = {name: np.full_like(part, 7) for name, part in first.items()} if scalars else np.full_like(first, 7)
    actions = np.arange(15).reshape(3, 5) % 5
    assert envs.step(actions, out=out)[0] is out
    check(out, other.step(actions)[0], "out")
    check(first, kept, "the first buffer")
    assert envs.step(actions)[0] is not first and envs.step(actions)[0] is first


def test_bytes_do_not_depend_on_threads():
    encoder = Encoder(3, [*CHANNELS, "follower_path"], SCALARS)
    config = {**CONFIG, "size": 16, "num_agents": 12, "on_target": "restart", "max_episode_steps": 20}
    envs = [VecEnv(config, 9, num_threads=num_threads, encoder=encoder) for num_threads in (1, 2)]
    rng = np.random.default_rng(0)
    for one in envs:
        one.reset(seed=3)
    for _ in range(50):
        actions = rng.integers(5, size=(9, 12))
        first, second = (one.step(actions)[0] for one in envs)
        check(first, second, "two threads")
    assert (first["windows"][:, :, -1] == 1).any() and (first["windows"][:, :, -1] == -1).any()


def test_films_and_statistics_work_beside_an_encoder(tmp_path):
    envs = VecEnv(
        CONFIG, 2, encoder={"radius": 1, "channels": ["goal"]}, film=Film(tmp_path), statistics=True, masks=True
    )
    envs.reset(seed=0)
    infos = {}
    while "episode" not in infos:
        *_, infos = envs.step(envs.sample_actions())
    assert infos["final_obs"][int(infos["_final_obs"].argmax())].shape == (5, 1, 3, 3)
    envs.close()
    assert envs.films


def test_spaces_match_the_observations():
    encoder = Encoder(4, ["obstacles", "cost_tracer"], ["position"], sight=9, follower="python")
    envs = VecEnv([CONFIG, {**CONFIG, "num_agents": 2}], encoder=encoder.to_dict())
    assert envs.encoder == encoder and Encoder.from_dict(encoder.to_dict()) == encoder
    assert envs.single_observation_space["windows"].shape == (5, 2, 9, 9)
    assert envs.observation_space["scalars"].shape == (2, 5, 2)
    assert envs.observation_space.contains(envs.reset(seed=1)[0])
    assert VecEnv(CONFIG, 2, encoder=Encoder(1, ["goal"])).observation_space.shape == (2, 5, 1, 3, 3)


@pytest.mark.parametrize(
    ("settings", "error", "text"),
    [
        ({"dtype": "bits"}, ValueError, "dtype is 'bits', expected 'float32' with an encoder"),
        ({"dtype": "uint8"}, ValueError, "dtype is 'uint8', expected 'float32' with an encoder"),
        ({"observation_type": "MAPF"}, ValueError, "observation_type is 'MAPF', expected 'default' with an encoder"),
        ({"encoder": 3}, TypeError, "encoder has type int, expected an Encoder or a dict"),
        ({"encoder": {"radius": 1}}, ValueError, "encoder has no field 'channels'"),
        ({"encoder": {"radius": 1, "channels": []}}, ValueError, "encoder has no channels"),
        ({"encoder": {"radius": 0, "channels": ["goal"]}}, ValueError, "radius is 0, expected 1 to 128"),
        ({"encoder": {"radius": 1.5, "channels": ["goal"]}}, TypeError, "radius is 1.5, expected a whole number"),
        ({"encoder": {"radius": 1, "channels": "goal"}}, TypeError, "channels is 'goal', expected a list of names"),
        (
            {"encoder": {"radius": 1, "channels": ["goals"]}},
            ValueError,
            r"channels\[0\] is 'goals', expected one of 'obst",
        ),
        (
            {"encoder": {"radius": 1, "channels": ["goal"] * 65}},
            ValueError,
            "channels is a list of 65, expected at most 64",
        ),
        ({"encoder": {"radius": 1, "channels": ["goal"], "scalars": ["x"]}}, ValueError, r"scalars\[0\] is 'x'"),
        ({"encoder": {"radius": 1, "channels": ["goal"], "sight": 200}}, ValueError, "sight is 200, expected 1 to 128"),
        (
            {"encoder": {"radius": 1, "channels": ["goal"], "follower": "c"}},
            ValueError,
            "follower is 'c', expected one of",
        ),
        (
            {"encoder": {"radius": 1, "channels": ["goal"], "size": 1}},
            ValueError,
            "encoder has the unknown field 'size'",
        ),
    ],
)
def test_wrong_encoders_are_rejected(settings, error, text):
    settings = {"encoder": Encoder(1, ["goal"]), **settings}
    config = {
        **CONFIG,
        **({"observation_type": settings.pop("observation_type")} if "observation_type" in settings else {}),
    }
    with pytest.raises(error, match=text):
        VecEnv(config, 2, **settings)


def test_wrong_buffers_are_rejected_before_the_step():
    envs = VecEnv(CONFIG, 2, encoder=Encoder(1, ["goal"], ["position"]))
    observations, _ = envs.reset(seed=0)
    for out, error, text in [
        (np.zeros(3), TypeError, "expected a dict of arrays with the keys"),
        (
            {**observations, "windows": observations["windows"].astype(np.float64)},
            TypeError,
            "has type float64, expected float32",
        ),
        ({**observations, "scalars": np.zeros((2, 5, 3), np.float32)}, ValueError, r"out\['scalars'\] has shape"),
    ]:
        with pytest.raises(error, match=text):
            envs.step(np.zeros((2, 5), int), out=out)
    for _ in range(8):
        assert not envs.step(np.zeros((2, 5), int))[3].any()
    assert envs.step(np.zeros((2, 5), int))[3].all()
