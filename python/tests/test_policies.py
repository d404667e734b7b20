"""Tests policies that play in Rust: compares them with a plain network in NumPy and with native evaluations."""

import json
import pickle
import shutil
import threading
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from network_model import PlainNetwork, drawn_network
from pogema_rs import GridConfig, VecEnv, pogema_v0
from pogema_rs.errors import NotResetError, StateError
from pogema_rs.policies import LEARNED, Encoder, Policy, load, save
from pogema_rs.toolbox.evaluator import evaluation
from pogema_rs.toolbox.registry import ToolboxRegistry

WEIGHTS = Path(__file__).resolve().parent.parent.parent / "suites" / "policies" / "descent.safetensors"
CONFIG = {
    "num_agents": 6, "size": 10, "density": 0.2, "obs_radius": 3, "max_episode_steps": 12, "on_target": "restart",
    "collision_system": "soft",
}  # fmt: skip
ENCODER = Encoder(2, ["obstacles", "seen_obstacles", "cost_to_go"], ["goal_direction", "position"])


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    """A recurrent network with scalars: its file and its plain model."""
    layers, tensors = drawn_network(1, 3, 2, 4)
    path = tmp_path_factory.mktemp("network") / "drawn.safetensors"
    save(path, ENCODER, layers, tensors, sampling="greedy")
    return path, PlainNetwork(layers, tensors)


def test_logits_equal_those_of_numpy(network):
    path, plain = network
    policy, rng = load(path), np.random.default_rng(0)
    windows = rng.uniform(-1, 1, (37, 3, 5, 5)).astype(np.float32)
    scalars = rng.uniform(-1, 1, (37, 4)).astype(np.float32)
    np.testing.assert_allclose(policy.logits(windows, scalars), plain.logits(windows, scalars), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("mode", ["same_step", "next_step", "disabled"])
@pytest.mark.parametrize("on_target", ["restart", "finish"])
def test_actions_in_a_batch_follow_the_windows_and_the_recurrent_state(network, mode, on_target):
    path, plain = network
    policy = load(path)
    configs = [{**CONFIG, "on_target": on_target, "num_agents": count} for count in (6, 2, 6)]
    # The observations of the environment are the inputs of the policy.
    env = VecEnv(configs, autoreset_mode=mode, encoder=policy.encoder, num_threads=2)
    observations, infos = env.reset(seed=1)
    states = np.zeros((3, 6, 4))
    num_compared = num_ends = 0
    is_over = np.zeros(3, bool)
    for _ in range(50):
        actions = policy.act(env)
        assert actions.shape == (3, 6) and actions.dtype == np.int64
        np.testing.assert_array_equal(policy.act(env), actions)
        for index in range(3):
            if is_over[index]:
                assert not actions[index].any()
                continue
            logits = plain.logits(observations["windows"][index], observations["scalars"][index], states[index])
            ordered = np.sort(logits, axis=1)
            # If the two largest logits are equal up to rounding, the policy may choose either action.
            is_clear = infos["is_active"][index] & (ordered[:, -1] - ordered[:, -2] > 1e-3)
            np.testing.assert_array_equal(actions[index][is_clear], logits.argmax(axis=1)[is_clear])
            assert not actions[index][~infos["is_active"][index]].any()
            num_compared += is_clear.sum()
        observations, _, terminated, truncated, infos = env.step(actions)
        ended = infos.get("_metrics", np.zeros(3, bool))
        num_ends += ended.sum()
        if mode == "next_step":
            states[is_over] = 0
            is_over = ended.copy()
        elif mode == "same_step":
            states[ended] = 0
        else:
            is_over |= ended
            if is_over.all():
                observations, infos = env.reset(options={"reset_mask": is_over})
                states[is_over], is_over = 0, np.zeros(3, bool)
    assert num_compared > 300 and num_ends >= 9


@pytest.mark.parametrize("settings", [{}, {"sampling": "greedy", "mask_actions": True}, {"seed": 5}])
def test_a_batch_plays_the_episodes_of_a_native_evaluation(settings, tmp_path):
    seeds = [3, 4, 5, 6, 7]
    environment = {
        **CONFIG, "obs_radius": 5, "name": "Environment", "max_episode_steps": 40, "seed": {"grid_search": seeds},
    }  # fmt: skip
    algorithm = {"name": "network", "weights": str(WEIGHTS), **settings}
    rows = evaluation({"environment": environment, "algorithms": {"Mine": algorithm}}, tmp_path / "out")
    policy = load(WEIGHTS, **settings)
    env = VecEnv({**CONFIG, "obs_radius": 5, "max_episode_steps": 40}, 5, num_threads=2)
    env.reset(seed=seeds)
    infos = {}
    while "metrics" not in infos:
        *_, infos = env.step(policy.act(env))
    by_seed = {row["env_grid_search"]["seed"]: row["metrics"]["avg_throughput"] for row in rows}
    assert [by_seed[seed] for seed in seeds] == infos["metrics"]["avg_throughput"].tolist()
    assert len(set(by_seed.values())) > 1


@pytest.mark.parametrize(
    ("settings", "channels"),
    [
        ({"name": "mats-lp", "expansions": 9}, ["all_agents", "cost_tracer"]),
        ({"name": "follower", "sampling": "follower"}, ["follower_path", "agents"]),
    ],
)
def test_follower_and_mats_lp_play_a_batch_as_in_a_native_evaluation(settings, channels, tmp_path):
    layers, tensors = drawn_network(3, 2, 2, 0, has_gru=False)
    path = tmp_path / "drawn.safetensors"
    save(path, Encoder(2, channels), layers, tensors)
    seeds = [3, 4]
    config = {**CONFIG, "obs_radius": 5, "max_episode_steps": 12}
    environment = {**config, "name": "Environment", "seed": {"grid_search": seeds}}
    algorithms = {"Mine": {**settings, "weights": str(path)}}
    rows = evaluation({"environment": environment, "algorithms": algorithms}, tmp_path / "out")
    policy, env, infos = load(path, **settings), VecEnv(config, 2, num_threads=2), {}
    env.reset(seed=seeds)
    cells = []
    while "metrics" not in infos:
        *_, infos = env.step(policy.act(env))
        cells.append(env.state()["positions"].tolist())
    assert [row["metrics"]["avg_throughput"] for row in rows] == infos["metrics"]["avg_throughput"].tolist()
    assert cells[0] != cells[5]
    # The policy also begins the next episodes.
    for _ in range(3):
        env.step(policy.act(env))
    if settings["name"] == "mats-lp":
        check_mats_lp(policy, env)
        for mask_actions in [True, False]:
            with pytest.raises(ValueError, match="`mats-lp` never moves into obstacles"):
                load(path, **settings, mask_actions=mask_actions)


def check_mats_lp(policy, env):
    assert policy.encoder is None and policy.sampling is None
    env.step(env.sample_actions())
    with pytest.raises(StateError, match=r"^found the state of step \d+, expected step \d+ of the same episode$"):
        policy.act(env)
    env.reset(seed=1)
    policy.act(env)
    policy.reset_states()
    observations, _ = pogema_v0(GridConfig(**CONFIG, seed=0, observation_type="MAPF")).reset()
    with pytest.raises(ValueError, match="`mats-lp` needs future goals, .* expected a VecEnv"):
        policy.act(observations)
    with pytest.raises(ValueError, match="'mats-lp' has no logits of single agents"):
        policy.logits(np.zeros((1, 2, 5, 5)))


@pytest.mark.parametrize("on_target", ["restart", "finish", "nothing"])
@pytest.mark.parametrize("name", ["network", "lswitcher"])
def test_observations_of_one_environment_give_the_actions_of_a_batch(name, on_target, network):
    own = {} if name == "lswitcher" else {"path": network[0], "sampling": "softmax"}
    settings = {"name": name, "seed": 3, **own}
    config = {**CONFIG, "on_target": on_target, "seed": 9, "max_episode_steps": 30}
    single = pogema_v0(GridConfig(**config, observation_type="MAPF"))
    env = VecEnv(config, 1)
    of_batch, of_one = load(**settings), load(**settings)
    for _ in range(2):
        env.reset(seed=[9])
        observations, _ = single.reset()
        of_one.reset_states()
        for _ in range(25):
            actions = of_batch.act(env)[0]
            chosen = of_one.act(observations, None, None, None, None)
            assert chosen == actions.tolist()
            env.step(actions[None])
            observations, _, terminated, _, _ = single.step(chosen)
            if all(terminated):  # the batch has begun the next episode
                break
    assert of_one.act(observations, skip_agents=[True] * 6) == [0] * 6
    with pytest.raises(ValueError, match="skip_agents holds 1 flag, expected 6, one for each agent"):
        of_one.act(observations, skip_agents=[True])
    observations, _ = single.reset()
    of_one.reset_states()
    first = of_one.act(observations)
    of_one.reset_states()
    with pytest.raises(ValueError, match="skip_agents"):
        of_one.act(observations, skip_agents=[True])
    assert of_one.act(observations) == first


def test_infos_distinguish_vanished_from_finished_agents():
    places = {"width": 8, "height": 12, "density": 0.3, "num_agents": 12, "obs_radius": 7}
    config = {**places, "on_target": "nothing", "collision_system": "soft", "max_episode_steps": 16, "seed": 758}
    single, env = pogema_v0(GridConfig(**config, observation_type="MAPF")), VecEnv(config, 1)
    of_batch, with_infos, without = (load(name="iql") for _ in range(3))
    env.reset(seed=[758])
    observations, infos = single.reset()
    has_vanished = False
    for _ in range(16):
        actions = of_batch.act(env)[0].tolist()
        assert with_infos.act(observations, info=infos) == actions
        has_vanished |= without.act(observations, info=[{}] * 12) != actions
        env.step(np.array([actions]))
        observations, _, _, _, infos = single.step(actions)
    assert has_vanished
    with pytest.raises(ValueError, match="info holds 1 element, expected 12, one for each agent"):
        with_infos.act(observations, info=[{}])


def test_threads_and_other_environments_of_the_batch_do_not_change_the_actions():
    def played(configs, num_threads):
        env, policy = VecEnv(configs, num_threads=num_threads), load(WEIGHTS, seed=2)
        env.reset(seed=list(range(len(configs))))
        trajectory = []
        for _ in range(30):
            trajectory.append(policy.act(env).copy())
            env.step(trajectory[-1])
        return np.array(trajectory)

    whole = played([CONFIG] * 7, 1)
    np.testing.assert_array_equal(played([CONFIG] * 7, 2), whole)
    np.testing.assert_array_equal(played([CONFIG] * 2, 1), whole[:, :2])


def test_a_policy_plays_one_environment_at_a_time():
    policy, env, other = load(WEIGHTS), VecEnv(CONFIG, 2), VecEnv(CONFIG, 2)
    with pytest.raises(NotResetError):
        policy.act(env)
    env.reset(seed=0)
    other.reset(seed=0)
    first = policy.act(env)
    with pytest.raises(RuntimeError, match="plays another environment"):
        policy.act(other)
    policy.reset_states()
    np.testing.assert_array_equal(policy.act(other), first)
    with pytest.raises(RuntimeError, match="plays another environment"):
        policy.act(pogema_v0(GridConfig(**CONFIG, seed=0, observation_type="MAPF")).reset()[0])
    policy.reset_states()
    first, *others = (
        pogema_v0(GridConfig(**{**CONFIG, **fields}, observation_type="MAPF")).reset()[0]
        for fields in ({"seed": 0}, {"seed": 1}, {"seed": 0, "size": 20}, {"seed": 0, "num_agents": 2})
    )
    actions = policy.act(first)
    for observations in others:
        with pytest.raises(RuntimeError, match="plays another environment"):
            policy.act(observations)
    for wrong, error, text in (
        ({"obstacles": 3}, TypeError, "observations have the wrong type"),
        ({"global_xy": (0.5, 1)}, ValueError, "global_xy holds a value that is not a whole number"),
    ):
        with pytest.raises(error, match=text):
            policy.act([{**seen, **wrong} for seen in first])
    policy.reset_states()
    assert policy.act(first) == actions
    env.close()
    policy.reset_states()
    with pytest.raises(RuntimeError, match="closed"):
        policy.act(env)


def test_a_call_while_another_thread_uses_the_policy_is_rejected():
    policy, env = load(WEIGHTS), VecEnv({**CONFIG, "size": 32, "num_agents": 200}, 64)
    env.reset(seed=0)
    said = set()

    def interfere():
        while thread.is_alive():
            try:
                policy.reset_states()
            except StateError as error:
                said.add(str(error))

    thread = threading.Thread(target=lambda: [policy.act(env) for _ in range(20)])
    thread.start()
    interfere()
    assert said == {"another thread is using this policy, expected one thread at a time"}


def test_pickles_hold_the_settings():
    policy = load(WEIGHTS, sampling="greedy", seed=4)
    copy = pickle.loads(pickle.dumps(policy))
    assert isinstance(copy, Policy) and copy.sampling == "greedy" and copy.encoder == policy.encoder
    assert copy.encoder == Encoder(1, ["cost_to_go"]) and repr(copy) == repr(policy) and copy.name == "network"


def test_pickles_hold_the_seed():
    env = VecEnv(CONFIG, 4)
    env.reset(seed=0)
    policy, other = (load(WEIGHTS, sampling="softmax", seed=seed) for seed in (4, 5))
    actions = pickle.loads(pickle.dumps(policy)).act(env)
    np.testing.assert_array_equal(actions, policy.act(env))
    assert (actions != other.act(env)).any()


def test_a_registered_policy_plays_suites(tmp_path):
    ToolboxRegistry.register_algorithm("Learned", partial(load, WEIGHTS))
    environment = {
        **CONFIG, "name": "Environment", "observation_type": "MAPF", "seed": {"grid_search": [0, 1, 2]},
    }  # fmt: skip
    algorithms = {
        "Registered": {"name": "Learned", "parallel_backend": "sequential"},
        "Native": {"name": "network", "weights": str(WEIGHTS)},
    }
    rows = evaluation({"environment": environment, "algorithms": algorithms}, tmp_path / "out")
    throughput = {}
    for row in rows:
        throughput.setdefault(row["algorithm"], []).append(row["metrics"]["avg_throughput"])
    assert throughput["Registered"] == throughput["Native"] and max(throughput["Native"]) > 0


def test_weights_are_relative_to_the_suite(tmp_path, monkeypatch):
    for suffix in (".safetensors", ".json"):
        shutil.copy(WEIGHTS.with_suffix(suffix), tmp_path)
    suite = tmp_path / "suite.yaml"
    environment = {**CONFIG, "name": "Environment", "seed": 1}
    suite.write_text(
        json.dumps({"environment": environment, "algorithms": {"A": {"name": "network", "weights": WEIGHTS.name}}})
    )
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert len(evaluation(suite, tmp_path / "out")) == 1


def write(tmp_path, weights=b"", config="{}"):
    path = tmp_path / "wrong.safetensors"
    path.write_bytes(weights)
    path.with_suffix(".json").write_text(config)
    return path


def test_errors_name_the_wrong_file(tmp_path):
    good, config = WEIGHTS.read_bytes(), WEIGHTS.with_suffix(".json").read_text()
    with pytest.raises(FileNotFoundError, match="missing.safetensors: "):
        load(tmp_path / "missing.safetensors")
    (tmp_path / "alone.safetensors").write_bytes(good)
    with pytest.raises(FileNotFoundError, match="alone.json: "):
        load(tmp_path / "alone.safetensors")
    with pytest.raises(OSError, match=str(tmp_path)):
        load(tmp_path)
    wrong = [
        (good[:-7], config, "wrong.safetensors: not a safetensors file"),
        (b"PK\x03\x04" * 9, config, "wrong.safetensors: not a safetensors file"),
        (good, "{", "wrong.json: "),
        (good, config.replace('"version": 1', '"version": 2'), "wrong.json: `version` is `2`, expected 1"),
        (
            good,
            config.replace('"descent"', '"other"'),
            "wrong.safetensors: does not fit wrong.json: tensor `other.weight` is missing",
        ),
        (good, config.replace('"radius": 1', '"radius": 2'), r"wrong.safetensors: .*network expects \[1, 3, 3\]"),
        (good, config.replace("cost_to_go", "costs"), "wrong.json: unknown variant"),
    ]
    for weights, text, message in wrong:
        with pytest.raises(ValueError, match=message) as caught:
            load(write(tmp_path, weights, text))
        assert not isinstance(caught.value, OSError) and "\n" not in str(caught.value)


def test_wrong_arguments_are_rejected():
    for arguments, error, message in [
        (
            {"name": "lacam"},
            ValueError,
            "name is 'lacam', expected one of 'aswitcher', 'epom', 'follower', 'follower-large', 'follower-small', "
            "'ippo', 'iql', 'lswitcher', 'mappo', 'mats-lp', 'network', 'qmix', 'qplex', 'vdn'",
        ),
        ({"sampling": "best"}, ValueError, "`best`"),
        ({"seed": -1}, ValueError, "seed is -1"),
        ({"seed": 1.5}, TypeError, "seed is 1.5"),
        ({"faithful": True}, ValueError, "`faithful` is given"),
        ({"num_threads": -1}, ValueError, "num_threads is -1, expected 1 to"),
        ({"expansions": -1}, ValueError, "expansions is -1, expected at least 1"),
        ({"semantics": "3.0"}, ValueError, "3.0"),
    ]:
        with pytest.raises(error, match=message):
            load(WEIGHTS, **arguments)
    policy = load(WEIGHTS)
    for observations in [pogema_v0(GridConfig()).reset()[0], [], 3, "text", [{"obstacles": 1}]]:
        with pytest.raises(TypeError, match="expected a VecEnv, or the observations of one environment"):
            policy.act(observations)
    with pytest.raises(ValueError, match=r"windows have shape \(2, 1, 5, 5\), expected \(2, 1, 3, 3\)"):
        policy.logits(np.zeros((2, 1, 5, 5)))


@pytest.mark.parametrize("name", sorted({*LEARNED} - {"mats-lp", "network"}))
def test_policies_with_weights_of_the_package_are_loaded_by_name(name):
    policy = load(name=name)
    assert name in LEARNED and repr(policy) == f"Policy({name!r})"
    copies = [policy, pickle.loads(pickle.dumps(policy))]
    env = VecEnv(CONFIG, 2)
    env.reset(seed=0)
    first, second = (one.act(env) for one in copies)
    np.testing.assert_array_equal(first, second)
    assert policy.encoder is not None and (first != 0).any()


def test_policies_without_weights_need_a_file():
    for name in ["mats-lp", "network"]:
        with pytest.raises(ValueError, match=f"`{name}` needs the weights of a network"):
            load(name=name)


def save_judge(path, values):
    """Writes a network of LSwitcher that returns the same values for every window."""
    tensors = {"values.weight": np.zeros((len(values), 9)), "values.bias": np.array(values)}
    save(path, Encoder(1, ["obstacles"]), ["flatten"], tensors, actions="values", name="lswitcher")


def test_lswitcher_plays_the_policy_that_its_network_prefers(tmp_path):
    path = tmp_path / "judge.safetensors"
    save_judge(path, [1.0, 0.0])
    policy, epom = load(path, name="lswitcher"), load(name="epom")
    np.testing.assert_array_equal(policy.logits(np.zeros((3, 1, 3, 3))), [[1, 0]] * 3)
    env = VecEnv(CONFIG, 2)
    env.reset(seed=0)
    for _ in range(8):
        actions = policy.act(env)
        np.testing.assert_array_equal(actions, epom.act(env))
        env.step(actions)
    env.close()


def test_networks_are_checked_for_the_policy_that_will_play_them(tmp_path):
    path = tmp_path / "judge.safetensors"
    save_judge(path, [1.0, 0.0])
    content = path.read_bytes()
    message = "the network has 5 outputs, expected 2: the values of EPOM and of RePlan"
    with pytest.raises(ValueError, match=message):
        save_judge(path, [0.0] * 5)
    with pytest.raises(ValueError, match="the network has 2 logits, expected 5"):
        load(path)
    with pytest.raises(ValueError, match=f"learned.safetensors: {message}"):
        load(WEIGHTS.with_name("learned.safetensors"), name="lswitcher")
    tensors = {"policy.weight": np.zeros((5, 9)), "policy.bias": np.zeros(5)}
    with pytest.raises(ValueError, match="`name` is `lacam`, expected"):
        save(path, Encoder(1, ["obstacles"]), ["flatten"], tensors, name="lacam")
    assert path.read_bytes() == content


def test_errors_about_infinite_logits_name_the_agent(tmp_path):
    tensors = {"policy.weight": np.full((5, 9), 3e38, np.float32), "policy.bias": np.zeros(5, np.float32)}
    save(tmp_path / "huge.safetensors", Encoder(1, ["obstacles"]), ["flatten"], tensors)
    env = VecEnv(CONFIG, 2)
    env.reset(seed=0)
    with pytest.raises(StateError, match="environment 0: the logits or the value of agent . in step 0 are not finite"):
        load(tmp_path / "huge.safetensors").act(env)
