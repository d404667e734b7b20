"""Independent PPO in the style of JaxMARL: dictionaries by agent name, and one compiled update in JAX.

    pip install jax
    python jaxmarl_ippo.py --updates 200

`ByAgent` gives a `VecEnv` the dictionaries of JaxMARL: `reset` and `step` return one array `(envs, ...)` for each
agent, and `step` also returns `dones["__all__"]`. Instead of JaxMARL's state, both return which agents are active: the
`VecEnv` keeps its own state, takes no key and is stepped outside of `jit`. All agents share one network. Besides
pogema-rs, only JAX is needed: this file contains the optimizer, Adam.
"""

import argparse
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from pogema_rs import GridConfig, VecEnv

CONFIG = GridConfig(size=8, density=0.3, num_agents=4, obs_radius=3, max_episode_steps=64)
NUM_ENVS, NUM_STEPS, NUM_EPOCHS, NUM_MINIBATCHES = 64, 32, 3, 4
GAMMA, LAMBDA, CLIP, ENTROPY, LEARNING_RATE, STEP_COST = 0.95, 0.9, 0.2, 0.01, 1e-3, 0.02

ByName = dict[str, np.ndarray]
Params = list[tuple[jax.Array, jax.Array]]


class ByAgent:
    """A `VecEnv` whose values are dictionaries by agent name."""

    def __init__(self, config: GridConfig, num_envs: int) -> None:
        self.envs = VecEnv(config, num_envs, semantics="2.0")
        self.agents = [f"agent_{agent}" for agent in range(self.envs.num_agents)]
        self.num_agents = len(self.agents)

    def reset(self, seed: int) -> tuple[ByName, ByName]:
        """Begins the first episodes of a seed; returns observations and which agents are active."""
        observations, infos = self.envs.reset(seed=seed)
        return self._split(observations), self._split(infos["is_active"])

    def step(self, actions: ByName) -> tuple[ByName, ByName, ByName, ByName, dict[str, Any]]:
        """Plays one step; returns observations, active agents, rewards, dones and infos."""
        joint = np.stack([actions[name] for name in self.agents], axis=1)
        observations, rewards, terminated, truncated, infos = self.envs.step(joint)
        dones = self._split(terminated | truncated)
        dones["__all__"] = np.asarray(terminated.all(axis=1) | truncated.all(axis=1))
        return self._split(observations), self._split(infos["is_active"]), self._split(rewards), dones, infos

    def _split(self, values: np.ndarray) -> ByName:
        return {name: values[:, agent].copy() for agent, name in enumerate(self.agents)}


def batchify(values: ByName, agents: list[str]) -> np.ndarray:
    """Returns the arrays of all agents as one, `(agents * envs, ...)`."""
    return np.concatenate([values[name] for name in agents])


def unbatchify(values: np.ndarray, agents: list[str]) -> ByName:
    """Returns one array `(envs, ...)` for each agent."""
    return dict(zip(agents, np.split(values, len(agents))))


class Transition(NamedTuple):
    """One step of all agents of all environments (rows); with a leading axis of steps, a rollout."""

    obs: jax.Array
    active: jax.Array
    action: jax.Array
    log_prob: jax.Array
    value: jax.Array
    reward: jax.Array
    done: jax.Array


class Train(NamedTuple):
    """Parameters, and the state of Adam."""

    params: Params
    first: Params
    second: Params
    num_updates: jax.Array


def init(key: jax.Array, sizes: list[int]) -> Train:
    keys = jax.random.split(key, len(sizes) - 1)
    scales = [2**0.5] * (len(sizes) - 2) + [0.01]
    make = jax.nn.initializers.orthogonal
    params = [
        (make(scale)(one, (rows, columns), jnp.float32), jnp.zeros(columns))
        for one, scale, rows, columns in zip(keys, scales, sizes, sizes[1:])
    ]
    zeros = jax.tree.map(jnp.zeros_like, params)
    return Train(params, zeros, zeros, jnp.zeros((), jnp.int32))


def forward(params: Params, obs: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Returns the log-probabilities of the 5 actions, and the value."""
    hidden = obs.reshape(obs.shape[0], -1)
    for weights, bias in params[:-1]:
        hidden = jax.nn.relu(hidden @ weights + bias)
    weights, bias = params[-1]
    out = hidden @ weights + bias
    return jax.nn.log_softmax(out[:, :5]), out[:, 5]


@jax.jit
def act(params: Params, key: jax.Array, obs: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    log_probs, value = forward(params, obs)
    action = jax.random.categorical(key, log_probs)
    return action, jnp.take_along_axis(log_probs, action[:, None], 1)[:, 0], value


def gae(rollout: Transition, last_value: jax.Array) -> jax.Array:
    """Returns the advantages of a rollout."""

    def back(carry: tuple[jax.Array, jax.Array], step: Transition) -> tuple[tuple[jax.Array, jax.Array], jax.Array]:
        after, next_value = carry
        error = step.reward + GAMMA * next_value * (1 - step.done) - step.value
        after = error + GAMMA * LAMBDA * (1 - step.done) * after
        return (after, step.value), after

    return jax.lax.scan(back, (jnp.zeros_like(last_value), last_value), rollout, reverse=True)[1]


def loss(params: Params, batch: Transition, advantage: jax.Array, target: jax.Array) -> jax.Array:
    log_probs, value = forward(params, batch.obs)
    log_prob = jnp.take_along_axis(log_probs, batch.action[:, None], 1)[:, 0]
    ratio = jnp.exp(log_prob - batch.log_prob)
    policy = -jnp.minimum(ratio * advantage, jnp.clip(ratio, 1 - CLIP, 1 + CLIP) * advantage)
    entropy = -(jnp.exp(log_probs) * log_probs).sum(axis=1)
    # Rows of finished agents do not count.
    each = policy + 0.5 * jnp.square(value - target) - ENTROPY * entropy
    return (each * batch.active).sum() / jnp.maximum(batch.active.sum(), 1)


def adam(train: Train, gradient: Params) -> Train:
    count = train.num_updates + 1
    first = jax.tree.map(lambda mean, now: 0.9 * mean + 0.1 * now, train.first, gradient)
    second = jax.tree.map(lambda mean, now: 0.999 * mean + 0.001 * now**2, train.second, gradient)
    rate = LEARNING_RATE * jnp.sqrt(1 - 0.999**count) / (1 - 0.9**count)
    params = jax.tree.map(lambda old, m, v: old - rate * m / (jnp.sqrt(v) + 1e-5), train.params, first, second)
    return Train(params, first, second, count)


@jax.jit
def update(train: Train, rollout: Transition, last_obs: jax.Array, key: jax.Array) -> tuple[Train, jax.Array]:
    """Trains on a rollout: epochs of minibatches, all in one compiled program."""
    advantages = gae(rollout, forward(train.params, last_obs)[1])
    targets = advantages + rollout.value
    advantages = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    flat = jax.tree.map(lambda part: part.reshape(-1, *part.shape[2:]), (rollout, advantages, targets))

    def epoch(train: Train, key: jax.Array) -> tuple[Train, jax.Array]:
        order = jax.random.permutation(key, flat[1].shape[0])
        batches = jax.tree.map(lambda part: part[order].reshape(NUM_MINIBATCHES, -1, *part.shape[1:]), flat)

        def minibatch(train: Train, batch: tuple[Transition, jax.Array, jax.Array]) -> tuple[Train, jax.Array]:
            value, gradient = jax.value_and_grad(loss)(train.params, *batch)
            return adam(train, gradient), value

        return jax.lax.scan(minibatch, train, batches)

    train, losses = jax.lax.scan(epoch, train, jax.random.split(key, NUM_EPOCHS))
    return train, losses.mean()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--updates", type=int, default=200, help="number of rollouts, each with an update [default: 200]"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of episodes, network and actions [default: 0]")
    arguments = parser.parse_args()
    env = ByAgent(CONFIG, NUM_ENVS)
    key = jax.random.key(arguments.seed)
    by_name, is_active = env.reset(arguments.seed)
    obs, active = batchify(by_name, env.agents), batchify(is_active, env.agents)
    train = init(key, [int(np.prod(obs.shape[1:])), 256, 128, 6])
    shares: list[float] = []
    for number in range(arguments.updates):
        steps = []
        for _ in range(NUM_STEPS):
            key, one = jax.random.split(key)
            action, log_prob, value = act(train.params, one, jnp.asarray(obs))
            before = obs, active
            by_name, is_active, rewards, dones, infos = env.step(unbatchify(np.asarray(action), env.agents))
            obs, active = batchify(by_name, env.agents), batchify(is_active, env.agents)
            reward, done = batchify(rewards, env.agents) - STEP_COST, batchify(dones, env.agents)
            parts = (*before, action, log_prob, value, reward, done.astype(np.float32))
            steps.append(Transition(*map(jnp.asarray, parts)))
            if "_metrics" in infos:
                shares = [*shares, *infos["metrics"]["ISR"][infos["_metrics"]].tolist()][-500:]
        key, one = jax.random.split(key)
        rollout = jax.tree.map(lambda *parts: jnp.stack(parts), *steps)
        train, value = update(train, rollout, jnp.asarray(obs), one)
        if number % 20 == 0 or number == arguments.updates - 1:
            print(f"update {number + 1:4}  loss {float(value):7.4f}  ISR {float(np.mean(shares or [np.nan])):.3f}")


if __name__ == "__main__":
    main()
