"""Trains one policy for all agents with PPO, on 8 x 8 maps with 4 agents, and evaluates it.

    pip install torch matplotlib
    python train_ppo.py --plot learning.svg --save policy.pt --replay episode.html

PPO as in "Proximal Policy Optimization Algorithms" (Schulman et al., 2017): clipped ratios, advantages by GAE, one
network that all agents of all environments share. Finished agents do not contribute to the loss. If the time limit ends
an episode, the value of its final observation stands in for the rewards after it. The policy is evaluated on unseen
seeds, next to a random policy and POGEMA's A* agents.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
import torch
from pogema_rs import BatchAStarAgent, GridConfig, VecEnv, pogema_v0
from pogema_rs.envs import Pogema
from torch import nn
from torch.distributions import Categorical

CONFIG: dict[str, Any] = {"size": 8, "density": 0.3, "num_agents": 4, "obs_radius": 5, "on_target": "finish"}
# Training derives its 63-bit seeds from a `SeedSequence`, which practically never yields one of these.
EVALUATION_SEEDS = range(10_000, 10_512)


@dataclass
class Params:
    """The hyperparameters of PPO; the defaults are those of the run in the documentation."""

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
    #: Whether the network computes in bfloat16, for processors with instructions for it.
    bf16: bool = False


class Policy(nn.Module):
    """Maps an agent's window to a distribution over its actions and the value of its state."""

    def __init__(self, num_values: int, hidden: int, bf16: bool = False) -> None:
        super().__init__()
        self.bf16 = bf16
        self.body = nn.Sequential(
            nn.Flatten(),
            nn.Linear(num_values, hidden),
            nn.ReLU(),
            nn.Linear(hidden, hidden // 2),
            nn.ReLU(),
        )
        self.actions = nn.Linear(hidden // 2, 5)
        self.value = nn.Linear(hidden // 2, 1)
        nn.init.orthogonal_(self.actions.weight, 0.01)

    def forward(self, seen: torch.Tensor, masks: torch.Tensor) -> tuple[Categorical, torch.Tensor]:
        with torch.autocast("cpu", torch.bfloat16, enabled=self.bf16):
            features = self.body(seen)
            logits, values = self.actions(features).float(), self.value(features).float()
        logits = logits.masked_fill(masks == 0, -1e9)
        return Categorical(logits=logits, validate_args=False), values.squeeze(-1)


@dataclass
class Rollout:
    """The observations, actions and rewards of all agents: tensors of shape (steps, agents, ...)."""

    seen: torch.Tensor
    masks: torch.Tensor
    is_active: torch.Tensor
    actions: torch.Tensor
    log_probs: torch.Tensor
    values: torch.Tensor
    rewards: torch.Tensor
    is_over: torch.Tensor

    @classmethod
    def empty(cls, params: Params, num_agents: int, seen_shape: tuple[int, ...]) -> "Rollout":
        shape = (params.num_steps, num_agents)
        flags = [torch.zeros(shape, dtype=torch.bool) for _ in range(2)]
        numbers = [torch.zeros(shape) for _ in range(3)]
        masks = torch.zeros((*shape, 5), dtype=torch.int8)
        actions = torch.zeros(shape, dtype=torch.int64)
        seen = torch.zeros((*shape, *seen_shape), dtype=torch.float32)
        log_probs, values, rewards = numbers
        return cls(seen, masks, flags[0], actions, log_probs, values, rewards, flags[1])


class Trainer:
    """A policy, its environments and its rollout."""

    def __init__(self, params: Params, seed: int) -> None:
        torch.manual_seed(seed)
        self.params = params
        self.env = self.make_env()
        observations, infos = self.env.reset(seed=seed)
        self.seen, self.infos = self._flat(observations), infos
        self.num_agents = self.seen.shape[0]
        self.policy = Policy(self.seen[0].numel(), params.hidden, params.bf16)
        self.optimizer = torch.optim.Adam(self.policy.parameters(), params.learning_rate, eps=1e-5)
        self.rollout = Rollout.empty(params, self.num_agents, tuple(self.seen.shape[1:]))
        self.seconds_in_env = 0.0

    def make_env(self) -> VecEnv:
        """Makes the environments of the training."""
        return VecEnv(GridConfig(**CONFIG), self.params.num_envs, semantics="2.0", masks=True)

    def _flat(self, observations: np.ndarray) -> torch.Tensor:
        """Returns a view of the environments' memory, one row per agent."""
        return torch.from_numpy(observations).flatten(0, 1)

    @torch.no_grad()
    def play(self) -> None:
        """Fills the rollout."""
        rollout, params = self.rollout, self.params
        for step in range(params.num_steps):
            rollout.seen[step] = self.seen
            rollout.masks[step] = torch.from_numpy(self.infos["action_masks"]).flatten(0, 1)
            rollout.is_active[step] = torch.from_numpy(self.infos["is_active"]).flatten()
            distribution, rollout.values[step] = self.policy(rollout.seen[step], rollout.masks[step])
            actions = distribution.sample()
            rollout.actions[step], rollout.log_probs[step] = actions, distribution.log_prob(actions)
            began = time.perf_counter()
            observations, rewards, terminated, truncated, self.infos = self.env.step(
                actions.view(params.num_envs, -1).numpy()
            )
            self.seconds_in_env += time.perf_counter() - began
            self.seen = self._flat(observations)
            rollout.rewards[step] = torch.from_numpy(rewards).flatten() - params.step_cost
            self._bootstrap(rollout.rewards[step].view(params.num_envs, -1), truncated & ~terminated)
            rollout.is_over[step] = torch.from_numpy(terminated | truncated).flatten()

    def _bootstrap(self, rewards: torch.Tensor, truncated: np.ndarray) -> None:
        """Adds the discounted value of the final observation to the last reward of each truncated agent."""
        envs = np.flatnonzero(truncated.any(axis=1))
        if len(envs) == 0:
            return
        seen = torch.from_numpy(np.stack(self.infos["final_obs"][envs])).flatten(0, 1)
        masks = torch.from_numpy(self.infos["final_info"]["action_masks"][envs]).flatten(0, 1)
        _, values = self.policy(seen, masks)
        cut = torch.from_numpy(truncated[envs])
        rewards[torch.from_numpy(envs)] += self.params.discount * values.view(cut.shape) * cut

    @torch.no_grad()
    def advantages(self) -> torch.Tensor:
        """Returns the advantage of each action, by GAE."""
        rollout, params = self.rollout, self.params
        masks = torch.from_numpy(self.infos["action_masks"]).flatten(0, 1)
        _, next_value = self.policy(self.seen, masks)
        advantages, last = torch.zeros_like(rollout.values), torch.zeros(self.num_agents)
        for step in reversed(range(params.num_steps)):
            continues = (~rollout.is_over[step]).float()
            error = rollout.rewards[step] + params.discount * continues * next_value - rollout.values[step]
            last = error + params.discount * params.gae * continues * last
            advantages[step], next_value = last, rollout.values[step]
        return advantages

    def learn(self, progress: float) -> None:
        """Updates the policy on the rollout; `progress` is the elapsed share of the training time."""
        params, rollout = self.params, self.rollout
        for group in self.optimizer.param_groups:
            group["lr"] = params.learning_rate * max(1 - progress, 0.05)
        advantages = self.advantages()
        active = rollout.is_active.flatten().nonzero().squeeze(-1)
        flat = {name: getattr(rollout, name).flatten(0, 1) for name in ("seen", "masks", "actions", "log_probs")}
        returns, advantages = (advantages + rollout.values).flatten(), advantages.flatten()
        # Normalized over the whole rollout, because its last minibatch may hold a single sample, which has no spread.
        spread, mean = torch.std_mean(advantages[active])
        advantages = (advantages - mean) / (spread + 1e-8)
        for _ in range(params.num_epochs):
            order = active[torch.randperm(len(active))]
            for part in torch.split(order, params.batch_size):
                distribution, values = self.policy(flat["seen"][part], flat["masks"][part])
                gain = advantages[part]
                ratio = (distribution.log_prob(flat["actions"][part]) - flat["log_probs"][part]).exp()
                clipped = ratio.clamp(1 - params.clip, 1 + params.clip)
                loss = -torch.min(ratio * gain, clipped * gain).mean()
                loss = loss + params.value * (values - returns[part]).pow(2).mean()
                loss = loss - params.entropy * distribution.entropy().mean()
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.policy.parameters(), 0.5)
                self.optimizer.step()


@torch.no_grad()
def evaluate(policy: Policy, seeds: range) -> float:
    """Returns the mean ISR of a policy on one episode per seed; it samples its actions, as in training."""
    env = VecEnv(GridConfig(**CONFIG), len(seeds), semantics="2.0", masks=True, autoreset_mode="Disabled")
    observations, infos = env.reset(seed=list(seeds))
    shares = np.full(len(seeds), np.nan)
    while np.isnan(shares).any():
        seen = torch.from_numpy(observations).flatten(0, 1)
        distribution, _ = policy(seen, torch.from_numpy(infos["action_masks"]).flatten(0, 1))
        observations, _, _, _, infos = env.step(distribution.sample().view(len(seeds), -1).numpy())
        if "metrics" in infos:
            ended = infos["_metrics"] & np.isnan(shares)
            shares[ended] = infos["metrics"]["ISR"][ended]
    return float(shares.mean())


Act = Callable[[list[dict[str, Any]]], Union[Sequence[int], np.ndarray]]


def evaluate_agents(make_team: Callable[[Pogema[dict[str, Any]]], Act], seeds: range) -> float:
    """Returns the mean ISR of a team that acts on the observation lists of POGEMA's interface."""
    shares = []
    for seed in seeds:
        config = GridConfig(**CONFIG, seed=seed, observation_type="POMAPF")
        env: Pogema[dict[str, Any]] = pogema_v0(config, semantics="2.0")
        act = make_team(env)
        observations, _ = env.reset()
        infos: list[dict[str, Any]] = [{}]
        while "metrics" not in infos[0]:
            observations, _, _, _, infos = env.step(act(observations))
        shares.append(infos[0]["metrics"]["ISR"])
    return float(np.mean(shares))


@torch.no_grad()
def replay(policy: Policy, seed: int, path: str) -> None:
    """Plays one episode with a policy and writes a page that replays it in a browser."""
    env = pogema_v0(GridConfig(**CONFIG, seed=seed), semantics="2.0")
    env.enable_animation()
    observations, infos = env.reset()
    while "metrics" not in infos[0]:
        windows = torch.from_numpy(np.stack(observations))
        radius = CONFIG["obs_radius"]
        # An action is allowed if the cell that it leads to is free in the obstacle window, channel 0.
        cells = [(radius + down, radius + right) for down, right in env.grid_config.MOVES]
        masks = torch.stack([windows[:, 0, row, col] == 0 for row, col in cells], dim=1)
        distribution, _ = policy(windows, masks)
        observations, _, _, _, infos = env.step(distribution.sample().tolist())
    env.save_replay(path, title=f"Seed {seed}: ISR {infos[0]['metrics']['ISR']:.2f}")


def plot(curve: list[tuple[float, float]], peers: dict[str, float], path: str) -> None:
    """Draws the learning curve."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 3.6))
    axes.plot(*zip(*curve), color="#c1433c", label="PPO")
    for (name, share), style in zip(peers.items(), ("--", ":")):
        axes.axhline(share, linestyle=style, color="#2e6f9e", label=name)
    axes.set(xlabel="minutes", ylabel="ISR on unseen seeds", ylim=(0, 1))
    axes.legend(loc="lower right", frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=5.0, help="training time in minutes [default: 5]")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--plot", metavar="FILE", help="draw the learning curve, e.g. learning.svg")
    parser.add_argument("--save", metavar="FILE", help="write the weights, e.g. policy.pt")
    parser.add_argument(
        "--replay", metavar="FILE", help="write a page that replays an unseen episode, e.g. episode.html"
    )
    parser.add_argument(
        "--evaluate-every", type=float, default=1.0, metavar="MINUTES", help="minutes between evaluations [default: 1]"
    )
    parser.add_argument(
        "--bf16", action="store_true", help="compute the network in bfloat16, which is faster with AVX512_BF16"
    )
    arguments = parser.parse_args()
    if not arguments.minutes > 0:
        parser.error(f"--minutes is {arguments.minutes}, expected a number above 0")

    peers = {
        "random": evaluate_agents(lambda env: lambda _: env.sample_actions(), EVALUATION_SEEDS),
        "A*": evaluate_agents(lambda _: BatchAStarAgent().act, EVALUATION_SEEDS),
    }
    trainer = Trainer(Params(bf16=arguments.bf16), arguments.seed)
    began, seconds, num_steps = time.perf_counter(), 0.0, 0
    curve = [(0.0, evaluate(trainer.policy, EVALUATION_SEEDS))]
    while seconds < 60 * arguments.minutes:
        resumed = time.perf_counter()
        trainer.play()
        trainer.learn(seconds / (60 * arguments.minutes))
        num_steps += trainer.rollout.actions.numel()
        seconds += time.perf_counter() - resumed
        if seconds / 60 >= curve[-1][0] + arguments.evaluate_every or seconds >= 60 * arguments.minutes:
            curve.append((seconds / 60, evaluate(trainer.policy, EVALUATION_SEEDS)))
            speed = num_steps / seconds
            print(f"{curve[-1][0]:6.1f} min  {num_steps:>12,} agent steps  {speed:8,.0f}/s  ISR {curve[-1][1]:.3f}")
    print(f"ISR on {len(EVALUATION_SEEDS)} unseen seeds: PPO {curve[-1][1]:.3f}", end="")
    print("".join(f", {name} {share:.3f}" for name, share in peers.items()))
    print(f"{100 * trainer.seconds_in_env / seconds:.1f} % of {seconds / 60:.1f} minutes were spent in the environment")
    print(f"{(time.perf_counter() - began) / 60:.1f} minutes in total")
    if arguments.plot:
        plot(curve, peers, arguments.plot)
    if arguments.save:
        torch.save(trainer.policy.state_dict(), arguments.save)
    if arguments.replay:
        replay(trainer.policy, EVALUATION_SEEDS[0], arguments.replay)


if __name__ == "__main__":
    main()
