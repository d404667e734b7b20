"""Small training runs, which take seconds, and comparisons of networks in PyTorch with policies in Rust."""

import subprocess
import sys

import numpy as np
import torch
from pogema_rs import VecEnv
from pogema_rs.baselines import load_config
from pogema_rs.baselines._acting import Actor
from pogema_rs.baselines._collector import parts
from pogema_rs.baselines._episodes import Episodes
from pogema_rs.baselines._lswitcher import NUM_VALUES
from pogema_rs.baselines._networks import AgentNetwork
from pogema_rs.vec_env import NUM_ACTIONS
from safetensors.numpy import load_file

Q_METHODS = ("iql", "vdn", "qmix", "qplex")
PPO_METHODS = ("ippo", "mappo", "follower", "follower-small", "follower-large", "epom")
#: The methods that learn the values of given policies.
VALUE_METHODS = ("lswitcher",)
#: The methods whose network has an output for the value.
WITH_VALUE = ("ippo", "follower", "follower-small", "follower-large", "epom")

_SMALL = (
    "environment.maps=[plain]",
    "environment.size=5",
    "environment.density=0.1",
    "environment.num_agents=2",
    "environment.max_episode_steps=12",
    "schedule.lanes=4",
    "schedule.validate_every=2",
    "schedule.validation_episodes=4",
    "schedule.validation_steps=12",
    "schedule.checkpoint_every=2",
    "network.hidden=16",
    "imitation.iterations=0",
)


def changes(method):
    """Returns the changes to the hyperparameters that make a training run small, in the form of `--set`."""
    learner = ("learner.batch=4", "learner.replay=12", "learner.updates=1") if method in Q_METHODS else ()
    recurrent = () if method in ("follower", "follower-small", "lswitcher") else ("network.recurrent=16",)
    # The network of this method has no dense layer.
    hidden = ("network.hidden=0",) if method == "follower-small" else ()
    return (*_SMALL, *learner, *recurrent, *hidden)


def small_config(method, *others):
    """Returns the hyperparameters of a small training run."""
    return load_config(method, None, [*changes(method), *others])


def read_network(method, config, path):
    """Returns exported weights as a network in PyTorch."""
    num_outputs = NUM_VALUES if method in VALUE_METHODS else NUM_ACTIONS
    network = AgentNetwork(config.encoder, config.network, method in WITH_VALUE, num_outputs)
    network.load_state_dict({name: torch.from_numpy(one) for name, one in load_file(path).items()})
    return network


def command(method, folder, *arguments):
    """Returns the command of a small training run."""
    settings = [part for change in changes(method) for part in ("--set", change)]
    program = [sys.executable, "-B", "-m", "pogema_rs.baselines", "train", method]
    return [*program, "--out", str(folder), *settings, *arguments]


def run(method, folder, *arguments):
    """Runs the command of a small training run and returns its result."""
    return subprocess.run(command(method, folder, *arguments), capture_output=True, text=True, check=False)


def outputs_of(network, windows, scalars):
    """Returns the outputs of a network in PyTorch at the beginning of an episode. Shape: `(rows, outputs)`."""
    rows = len(windows)
    with torch.no_grad():
        features, _ = network.features(torch.from_numpy(windows).view(1, rows, -1), torch.from_numpy(scalars)[None])
        return network.policy(features[0]).numpy()


def compare_outputs(policy, network, config, *, lanes, steps):
    """Checks that a policy in Rust and a network without memory in PyTorch return almost the same numbers."""
    configs, seeds = Episodes(config.environment, 9, steps).of_validation(lanes)
    env = VecEnv(configs, encoder=config.encoder, autoreset_mode="Disabled")
    seen, _ = env.reset(seed=seeds)
    for _ in range(steps):
        windows, scalars = parts(seen)
        rows = windows.shape[0] * windows.shape[1]
        flat, beside = windows.reshape(rows, *config.encoder.shape), scalars.reshape(rows, -1)
        np.testing.assert_allclose(policy.logits(flat, beside), outputs_of(network, flat, beside), atol=1e-4)
        seen, *_ = env.step(policy.act(env))
    env.close()


def compare_play(policy, network, config, *, lanes, steps, masks=True):
    """Checks that a policy in Rust and a network in PyTorch choose the same actions; returns how many are not `stay`.

    On average, half of the agents act at random in each step, so that even a network that always stays sees many
    states.
    """
    actor = Actor(network, torch.Generator(), 0.0, masks)
    configs, seeds = Episodes(config.environment, 9, steps).of_validation(lanes)
    env = VecEnv(configs, encoder=config.encoder, masks=True, autoreset_mode="Disabled")
    seen, infos = env.reset(seed=seeds)
    moves, rng = 0, np.random.default_rng(0)
    for _ in range(steps):
        windows, scalars = parts(seen)
        actions = actor(windows, scalars, infos["action_masks"])
        np.testing.assert_array_equal(policy.act(env), actions)
        moves += int((actions != 0).sum())
        random = rng.integers(5, size=actions.shape)
        seen, _, _, _, infos = env.step(np.where(rng.random(actions.shape) < 0.5, random, actions))
    env.close()
    return moves
