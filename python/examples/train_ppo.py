"""Trains one policy for all agents by PPO, on 8 x 8 maps with 4 agents, and says how good it became.

    pip install torch matplotlib
    python train_ppo.py --plot learning.svg

PPO as in "Proximal Policy Optimization Algorithms" (Schulman et al., 2017): clipped ratios, advantages by GAE, one
network for every agent of every environment. An agent that has left takes no part in the loss. The policy is judged on
seeds that it has never played, beside a random policy and POGEMA's A* agents.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np
import torch
from pogema_rs import BatchAStarAgent, GridConfig, VecEnv, pogema_v0
from torch import nn
from torch.distributions import Categorical

CONFIG = {"size": 8, "density": 0.3, "num_agents": 4, "obs_radius": 5, "on_target": "finish"}
# Seeds are drawn for training; those of the judgement are not among them.
JUDGED_SEEDS = range(10_000, 10_512)


@dataclass
class Params:
    """What PPO may be told; the values are those of the run in the documentation."""

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


class Policy(nn.Module):
    """From an agent's window to the odds of its actions and the value of its state."""

    def __init__(self, num_values: int, hidden: int) -> None:
        super().__init__()
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
        features = self.body(seen)
        logits = self.actions(features).masked_fill(masks == 0, -1e9)
        return Categorical(logits=logits, validate_args=False), self.value(features).squeeze(-1)


@dataclass
class Rollout:
    """What all agents saw and did: tensors of the shape (steps, agents, ...)."""

    seen: torch.Tensor
    masks: torch.Tensor
    is_active: torch.Tensor
    actions: torch.Tensor
    odds: torch.Tensor
    values: torch.Tensor
    rewards: torch.Tensor
    is_over: torch.Tensor

    @classmethod
    def empty(cls, params: Params, num_agents: int, seen_shape: tuple[int, ...]) -> "Rollout":
        shape = (params.num_steps, num_agents)
        flags, numbers = (lambda: torch.zeros(shape, dtype=torch.bool)), (lambda: torch.zeros(shape))
        masks = torch.zeros((*shape, 5), dtype=torch.int8)
        actions = torch.zeros(shape, dtype=torch.int64)
        seen = torch.zeros((*shape, *seen_shape), dtype=torch.float32)
        return cls(seen, masks, flags(), actions, numbers(), numbers(), numbers(), flags())


class Trainer:
    """A policy, the environments that it plays and what it has learnt from."""

    def __init__(self, params: Params, seed: int) -> None:
        torch.manual_seed(seed)
        self.params = params
        self.env = VecEnv(GridConfig(**CONFIG), params.num_envs, semantics="2.0", masks=True)
        observations, infos = self.env.reset(seed=seed)
        self.seen, self.infos = self._flat(observations), infos
        self.num_agents = self.seen.shape[0]
        self.policy = Policy(self.seen[0].numel(), params.hidden)
        self.optimizer = torch.optim.Adam(self.policy.parameters(), params.learning_rate, eps=1e-5)
        self.rollout = Rollout.empty(params, self.num_agents, tuple(self.seen.shape[1:]))
        self.seconds_in_env = 0.0

    def _flat(self, observations: np.ndarray) -> torch.Tensor:
        """The environments' own memory, one row per agent."""
        return torch.from_numpy(observations).flatten(0, 1)

    @torch.no_grad()
    def play(self) -> None:
        """Fills the rollout."""
        rollout, params = self.rollout, self.params
        for step in range(params.num_steps):
            rollout.seen[step] = self.seen
            rollout.masks[step] = torch.from_numpy(self.infos["action_masks"]).flatten(0, 1)
            rollout.is_active[step] = torch.from_numpy(self.infos["is_active"]).flatten()
            odds, rollout.values[step] = self.policy(rollout.seen[step], rollout.masks[step])
            actions = odds.sample()
            rollout.actions[step], rollout.odds[step] = actions, odds.log_prob(actions)
            began = time.perf_counter()
            observations, rewards, terminated, truncated, self.infos = self.env.step(
                actions.view(params.num_envs, -1).numpy()
            )
            self.seconds_in_env += time.perf_counter() - began
            self.seen = self._flat(observations)
            rollout.rewards[step] = torch.from_numpy(rewards).flatten() - params.step_cost
            rollout.is_over[step] = torch.from_numpy(terminated | truncated).flatten()

    @torch.no_grad()
    def advantages(self) -> torch.Tensor:
        """How much better each action was than expected, by GAE."""
        rollout, params = self.rollout, self.params
        masks = torch.from_numpy(self.infos["action_masks"]).flatten(0, 1)
        _, next_value = self.policy(self.seen, masks)
        advantages, last = torch.zeros_like(rollout.values), torch.zeros(self.num_agents)
        for step in reversed(range(params.num_steps)):
            goes_on = (~rollout.is_over[step]).float()
            error = rollout.rewards[step] + params.discount * goes_on * next_value - rollout.values[step]
            last = error + params.discount * params.gae * goes_on * last
            advantages[step], next_value = last, rollout.values[step]
        return advantages

    def learn(self, progress: float) -> None:
        """Improves the policy on the rollout; `progress` is the share of the time that is over."""
        params, rollout = self.params, self.rollout
        for group in self.optimizer.param_groups:
            group["lr"] = params.learning_rate * max(1 - progress, 0.05)
        advantages = self.advantages()
        taking_part = rollout.is_active.flatten().nonzero().squeeze(-1)
        flat = {name: getattr(rollout, name).flatten(0, 1) for name in ("seen", "masks", "actions", "odds")}
        returns, advantages = (advantages + rollout.values).flatten(), advantages.flatten()
        # Over the whole rollout: the last part of it may be a single step, which has no spread.
        spread, mean = torch.std_mean(advantages[taking_part])
        advantages = (advantages - mean) / (spread + 1e-8)
        for _ in range(params.num_epochs):
            order = taking_part[torch.randperm(len(taking_part))]
            for part in order.split(params.batch_size):
                odds, values = self.policy(flat["seen"][part], flat["masks"][part])
                gain = advantages[part]
                ratio = (odds.log_prob(flat["actions"][part]) - flat["odds"][part]).exp()
                clipped = ratio.clamp(1 - params.clip, 1 + params.clip)
                loss = -torch.min(ratio * gain, clipped * gain).mean()
                loss = loss + params.value * (values - returns[part]).pow(2).mean()
                loss = loss - params.entropy * odds.entropy().mean()
                self.optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self.policy.parameters(), 0.5)
                self.optimizer.step()


@torch.no_grad()
def judge(policy: Policy, seeds: range) -> float:
    """Mean ISR of a policy on the first episodes of some seeds; it draws its actions, as in training."""
    env = VecEnv(GridConfig(**CONFIG), len(seeds), semantics="2.0", masks=True, autoreset_mode="Disabled")
    observations, infos = env.reset(seed=list(seeds))
    shares = np.full(len(seeds), np.nan)
    while np.isnan(shares).any():
        seen = torch.from_numpy(observations).flatten(0, 1)
        odds, _ = policy(seen, torch.from_numpy(infos["action_masks"]).flatten(0, 1))
        observations, _, _, _, infos = env.step(odds.sample().view(len(seeds), -1).numpy())
        if "metrics" in infos:
            ended = infos["_metrics"] & np.isnan(shares)
            shares[ended] = infos["metrics"]["ISR"][ended]
    return float(shares.mean())


def judge_agents(make_team, seeds: range) -> float:
    """Mean ISR of a team that acts on POGEMA's own lists."""
    shares = []
    for seed in seeds:
        env = pogema_v0(GridConfig(**CONFIG, seed=seed, observation_type="POMAPF"), semantics="2.0")
        act = make_team(env)
        observations, _ = env.reset()
        infos = [{}]
        while "metrics" not in infos[0]:
            observations, _, _, _, infos = env.step(act(observations))
        shares.append(infos[0]["metrics"]["ISR"])
    return float(np.mean(shares))


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
    parser.add_argument("--minutes", type=float, default=5.0, help="how long to train")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--plot", metavar="FILE", help="draw the learning curve, e.g. learning.svg")
    parser.add_argument("--judge-every", type=float, default=1.0, metavar="MINUTES")
    arguments = parser.parse_args()

    peers = {
        "random": judge_agents(lambda env: lambda _: env.sample_actions(), JUDGED_SEEDS),
        "A*": judge_agents(lambda _: BatchAStarAgent().act, JUDGED_SEEDS),
    }
    trainer = Trainer(Params(), arguments.seed)
    began, seconds, num_steps = time.perf_counter(), 0.0, 0
    curve = [(0.0, judge(trainer.policy, JUDGED_SEEDS))]
    while seconds < 60 * arguments.minutes:
        resumed = time.perf_counter()
        trainer.play()
        trainer.learn(seconds / (60 * arguments.minutes))
        num_steps += trainer.rollout.actions.numel()
        seconds += time.perf_counter() - resumed
        if seconds / 60 >= curve[-1][0] + arguments.judge_every or seconds >= 60 * arguments.minutes:
            curve.append((seconds / 60, judge(trainer.policy, JUDGED_SEEDS)))
            speed = num_steps / seconds
            print(f"{curve[-1][0]:6.1f} min  {num_steps:>12,} agent steps  {speed:8,.0f}/s  ISR {curve[-1][1]:.3f}")
    print(f"ISR on {len(JUDGED_SEEDS)} unseen seeds: PPO {curve[-1][1]:.3f}", end="")
    print("".join(f", {name} {share:.3f}" for name, share in peers.items()))
    print(f"{100 * trainer.seconds_in_env / seconds:.1f} % of {seconds / 60:.1f} minutes were spent in the environment")
    print(f"{(time.perf_counter() - began) / 60:.1f} minutes in all")
    if arguments.plot:
        plot(curve, peers, arguments.plot)


if __name__ == "__main__":
    main()
