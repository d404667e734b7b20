"""Trains the policy of train_ppo.py in JAX: one compiled function runs environments, network and PPO of an iteration.

    pip install 'pogema-rs[jax]' optax matplotlib
    python train_ppo_jax.py --plot learning.svg --save policy.safetensors

The task and the hyperparameters are those of train_ppo.py. The episodes come from a pool of instances, drawn with
replacement. `--save` writes weights that play in Rust: `pogema run --policy network --weights policy.safetensors`.
"""

import argparse
import time
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax  # type: ignore[import-untyped, unused-ignore]
from pogema_rs.jax import InstancePool, Params, State, action_masks, auto_reset, observe, observe_rows, reset, step
from pogema_rs.jax import unpack_rows

CONFIG: dict[str, Any] = {"size": 8, "density": 0.3, "num_agents": 4, "obs_radius": 5, "on_target": "finish"}
NUM_AGENTS, NUM_VALUES = 4, 3 * 11 * 11
# The evaluation seeds of train_ppo.py. The pool for training does not hold their episodes.
EVALUATION_SEEDS = range(10_000, 10_512)


@dataclass(frozen=True)
class Settings:
    """The hyperparameters; the defaults are those of train_ppo.py."""

    num_envs: int = 256
    num_steps: int = 32
    num_epochs: int = 3
    batch_size: int = 4096
    learning_rate: float = 1e-3
    discount: float = 0.95
    gae: float = 0.9
    clip: float = 0.2
    entropy: float = 0.01
    value: float = 0.5
    step_cost: float = 0.02
    hidden: int = 384


Weights = dict[str, jax.Array]


def new_weights(key: jax.Array, hidden: int) -> Weights:
    """Returns the weights of a network: two dense layers, then the logits and the value."""
    sizes = {"first": (NUM_VALUES, hidden), "second": (hidden, hidden // 2), "actions": (hidden // 2, 5)}
    sizes["value"] = (hidden // 2, 1)
    weights: Weights = {}
    for name, (width, height) in sizes.items():
        key, drawn = jax.random.split(key)
        scale = 0.01 if name == "actions" else 1.0
        weights[f"{name}.weight"] = scale * jax.random.normal(drawn, (height, width)) / np.sqrt(width)
        weights[f"{name}.bias"] = jnp.zeros(height)
    return weights


def forward(weights: Weights, windows: jax.Array, masks: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Returns the log-probabilities of the actions, and the values, of agents in a batch of any shape."""

    def dense(name: str, values: jax.Array) -> jax.Array:
        return values @ weights[f"{name}.weight"].T + weights[f"{name}.bias"]

    values = jax.nn.relu(dense("first", windows.reshape(*windows.shape[:-3], NUM_VALUES)))
    values = jax.nn.relu(dense("second", values))
    logits = jnp.where(masks, dense("actions", values), -1e9)
    return jax.nn.log_softmax(logits), dense("value", values)[..., 0]


class Steps(NamedTuple):
    """A rollout of all agents. Shape: `(steps, envs, agents, ...)`; windows are rows of bits."""

    rows: jax.Array
    masks: jax.Array
    is_active: jax.Array
    actions: jax.Array
    log_probs: jax.Array
    values: jax.Array
    rewards: jax.Array
    is_over: jax.Array


class Trained(NamedTuple):
    """The state of a training run."""

    weights: Weights
    optimizer: Any
    states: State
    key: jax.Array


over_envs = partial(jax.vmap, in_axes=(None, 0))


def look(params: Params, weights: Weights, states: State) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Returns the masks, log-probabilities and values of all agents."""
    masks = over_envs(action_masks)(params, states) != 0
    return masks, *forward(weights, over_envs(observe)(params, states), masks)


def play(settings: Settings, params: Params, weights: Weights, states: State, key: jax.Array) -> tuple[State, Steps]:
    """Plays some steps in all environments."""

    def advance(states: State, key: jax.Array) -> tuple[State, Steps]:
        draws, resets = jax.random.split(key)
        masks, log_probs, values = look(params, weights, states)
        actions = jax.random.categorical(draws, log_probs)
        chosen = jnp.take_along_axis(log_probs, actions[..., None], -1)[..., 0]
        keys = jax.random.split(resets, settings.num_envs)
        after, out, last = jax.vmap(auto_reset, (None, 0, 0, 0))(params, keys, states, actions)
        # After a time limit, the value of the last observation stands in for the rewards that would follow.
        _, _, last_values = look(params, weights, last)
        cut = out.truncated & ~out.terminated
        rewards = out.rewards - settings.step_cost + settings.discount * jnp.where(cut, last_values, 0)
        rows, is_over = over_envs(observe_rows)(params, states), out.terminated | out.truncated
        return after, Steps(rows, masks, states.active, actions, chosen, values, rewards, is_over)

    return jax.lax.scan(advance, states, jax.random.split(key, settings.num_steps))


def advantages(settings: Settings, steps: Steps, next_values: jax.Array) -> jax.Array:
    """Returns the advantage of each action, by GAE."""

    def back(carry: tuple[jax.Array, jax.Array], now: Steps) -> tuple[tuple[jax.Array, jax.Array], jax.Array]:
        last, next_values = carry
        continues = ~now.is_over
        error = now.rewards + settings.discount * continues * next_values - now.values
        last = error + settings.discount * settings.gae * continues * last
        return (last, now.values), last

    start = (jnp.zeros_like(next_values), next_values)
    _, found = jax.lax.scan(back, start, steps, reverse=True)
    return found


def loss_of(settings: Settings, weights: Weights, steps: Steps, gains: jax.Array, returns: jax.Array) -> jax.Array:
    """Returns the loss of PPO for a minibatch; finished agents do not count."""
    log_probs, values = forward(weights, unpack_rows(steps.rows, CONFIG["obs_radius"], jnp.float32), steps.masks)
    chosen = jnp.take_along_axis(log_probs, steps.actions[..., None], -1)[..., 0]
    ratio = jnp.exp(chosen - steps.log_probs)
    clipped = jnp.clip(ratio, 1 - settings.clip, 1 + settings.clip)
    loss = -jnp.minimum(ratio * gains, clipped * gains)
    loss += settings.value * (values - returns) ** 2
    loss += settings.entropy * (jnp.exp(log_probs) * log_probs).sum(-1)
    return (loss * steps.is_active).sum() / steps.is_active.sum().clip(1)


# Adam with clipped gradients, without the learning rate, which falls during the training.
OPTIMIZER = optax.chain(optax.clip_by_global_norm(0.5), optax.scale_by_adam(eps=1e-5))


@partial(jax.jit, static_argnums=0)
def iterate(settings: Settings, params: Params, trained: Trained, progress: jax.Array) -> Trained:
    """Plays one rollout and learns from it; `progress` is the completed share of the training."""
    key, plays, shuffles = jax.random.split(trained.key, 3)
    states, steps = play(settings, params, trained.weights, trained.states, plays)
    _, _, next_values = look(params, trained.weights, states)
    gains = advantages(settings, steps, next_values)
    returns, active = gains + steps.values, steps.is_active
    mean = gains.mean(where=active)
    gains = (gains - mean) / (gains.std(where=active) + 1e-8)
    flat = jax.tree.map(lambda one: one.reshape(-1, *one.shape[3:]), (steps, gains, returns))
    rate = settings.learning_rate * jnp.maximum(1 - progress, 0.05)

    def learn(carry: tuple[Weights, Any], batch: jax.Array) -> tuple[tuple[Weights, Any], None]:
        weights, state = carry
        part = jax.tree.map(lambda one: one[batch], flat)
        gradients = jax.grad(loss_of, argnums=1)(settings, weights, *part)
        updates, state = OPTIMIZER.update(gradients, state, weights)
        return (jax.tree.map(lambda one, update: one - rate * update, weights, updates), state), None

    def epoch(carry: tuple[Weights, Any], key: jax.Array) -> tuple[tuple[Weights, Any], None]:
        order = jax.random.permutation(key, flat[2].shape[0])
        return jax.lax.scan(learn, carry, order.reshape(-1, settings.batch_size))

    start = (trained.weights, trained.optimizer)
    (weights, state), _ = jax.lax.scan(epoch, start, jax.random.split(shuffles, settings.num_epochs))
    return Trained(weights, state, states, key)


@jax.jit
def evaluate(params: Params, weights: Weights, key: jax.Array) -> jax.Array:
    """Returns the mean ISR over one episode of each instance; actions are drawn, as in training."""
    num = params.pool.starts.shape[0]
    states = over_envs(reset)(params, jnp.arange(num))

    def advance(states: State, key: jax.Array) -> tuple[State, None]:
        _, log_probs, _ = look(params, weights, states)
        return jax.vmap(step, (None, 0, 0))(params, states, jax.random.categorical(key, log_probs))[0], None

    # 64 steps are the default `max_episode_steps`. If an episode ends earlier, its remaining steps are played, too; its
    # agents stay inactive.
    states, _ = jax.lax.scan(advance, states, jax.random.split(key, 64))
    return 1 - states.active.mean()


def save(weights: Weights, path: str) -> None:
    """Writes the weights for play in Rust."""
    from pogema_rs.policies import Encoder
    from pogema_rs.policies import save as write

    layers = ["flatten", {"dense": "first"}, "relu", {"dense": "second"}, "relu"]
    encoder = Encoder(CONFIG["obs_radius"], ["obstacles", "agents", "goal"])
    tensors = {name: np.asarray(one) for name, one in weights.items()}
    write(path, encoder, layers, tensors, actions="actions", value="value", mask_actions=True)


def plot(curve: list[tuple[float, float]], path: str) -> None:
    """Draws the learning curve."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 3.6))
    axes = figure.add_subplot()
    axes.plot(*zip(*curve), color="#c1433c")
    axes.set(xlabel="minutes", ylabel="ISR on unseen seeds", ylim=(0, 1))
    axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--minutes", type=float, default=5.0, help="training time in minutes, without compilation [default: 5]"
    )
    parser.add_argument("--iterations", type=int, metavar="N", help="play N iterations, not --minutes; reproducible")
    parser.add_argument("--seed", type=int, default=0, help="seed of the run [default: 0]")
    parser.add_argument(
        "--instances", type=int, default=20_000, help="number of instances in the pool [default: 20000]"
    )
    parser.add_argument(
        "--envs",
        type=int,
        default=Settings.num_envs,
        metavar="N",
        help="number of environments [default: 256]; for a GPU, e.g. 4096",
    )
    parser.add_argument(
        "--batch-size",
        type=int,
        default=Settings.batch_size,
        metavar="N",
        help="agent steps of a minibatch [default: 4096]",
    )
    parser.add_argument("--plot", metavar="FILE", help="draw the learning curve, e.g. learning.svg")
    parser.add_argument("--save", metavar="FILE", help="write the weights, e.g. policy.safetensors")
    parser.add_argument(
        "--evaluate-every", type=float, default=1.0, metavar="MINUTES", help="minutes between evaluations [default: 1]"
    )
    arguments = parser.parse_args()

    if not arguments.minutes > 0:
        parser.error(f"--minutes is {arguments.minutes}, expected a number above 0")
    if arguments.iterations is not None and arguments.iterations < 1:
        parser.error(f"--iterations is {arguments.iterations}, expected at least 1")
    settings = Settings(num_envs=arguments.envs, batch_size=arguments.batch_size)
    num_rows = settings.num_envs * settings.num_steps * NUM_AGENTS
    if min(settings.num_envs, settings.batch_size) < 1 or num_rows % settings.batch_size:
        sizes = f"--envs is {settings.num_envs} and --batch-size is {settings.batch_size}"
        parser.error(f"{sizes}, expected positive numbers, and a batch size that divides the {num_rows} agent steps")
    make_pool = partial(InstancePool, CONFIG, semantics="2.0")
    params = make_pool(arguments.instances, arguments.seed).params
    evaluation = make_pool(len(EVALUATION_SEEDS), list(EVALUATION_SEEDS)).params
    key, drawn, evaluation_key = jax.random.split(jax.random.key(arguments.seed), 3)
    weights = new_weights(drawn, settings.hidden)
    states = over_envs(reset)(params, jnp.arange(settings.num_envs))
    trained = Trained(weights, OPTIMIZER.init(weights), states, key)

    began = time.perf_counter()
    compiled = iterate.lower(settings, params, trained, jnp.float32(0)).compile()
    print(f"compiled in {time.perf_counter() - began:.1f} s")
    curve, seconds, iteration = [(0.0, float(evaluate(evaluation, trained.weights, evaluation_key)))], 0.0, 0
    progress = 0.0
    while progress < 1:
        resumed = time.perf_counter()
        trained = compiled(params, trained, jnp.float32(progress))
        trained.weights["value.bias"].block_until_ready()
        iteration += 1
        seconds += time.perf_counter() - resumed
        limit = arguments.iterations
        progress = seconds / (60 * arguments.minutes) if limit is None else iteration / limit
        if seconds / 60 >= curve[-1][0] + arguments.evaluate_every or progress >= 1:
            curve.append((seconds / 60, float(evaluate(evaluation, trained.weights, evaluation_key))))
            num_steps = iteration * settings.num_envs * settings.num_steps * NUM_AGENTS
            speed = num_steps / seconds
            print(f"{curve[-1][0]:6.1f} min  {num_steps:>12,} agent steps  {speed:8,.0f}/s  ISR {curve[-1][1]:.3f}")
    print(f"ISR on {len(EVALUATION_SEEDS)} unseen seeds: {curve[-1][1]:.3f}")
    if arguments.plot:
        plot(curve, arguments.plot)
    if arguments.save:
        save(trained.weights, arguments.save)


if __name__ == "__main__":
    main()
