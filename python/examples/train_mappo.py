"""Trains with MAPPO: each agent acts on its own window, and a centralised critic sees the global state.

    pip install torch
    python train_mappo.py --minutes 5

MAPPO as in "The Surprising Effectiveness of PPO in Cooperative Multi-Agent Games" (Yu et al., 2022): one actor for all
agents, and one critic that receives the state of the environment together with the agent whose value it estimates. The
state comes from `VecEnv.state()`; at the end of an episode, `final_state` holds the last one. The reward is shared by
all agents.
"""

import argparse
import time

import numpy as np
import torch
from pogema_rs import GridConfig, VecEnv
from torch import nn
from torch.distributions import Categorical, Distribution

CONFIG = GridConfig(
    size=8, density=0.2, num_agents=4, obs_radius=3, on_target="nothing", collision_system="soft", max_episode_steps=64
)
NUM_ENVS, NUM_STEPS, NUM_EPOCHS, BATCH_SIZE = 64, 32, 4, 2048
DISCOUNT, GAE, CLIP, ENTROPY, LEARNING_RATE = 0.97, 0.95, 0.2, 0.01, 7e-4

State = dict[str, np.ndarray]


def planes(state: State) -> torch.Tensor:
    """Returns the global state as the critic sees it for each agent, `(envs * agents, 5, rows, columns)`, float32.

    The planes are obstacles, all agents, all goals, this agent and its goal. Finished agents are not drawn.
    """
    obstacles, positions, goals, active = (state[name] for name in ("obstacles", "positions", "goals", "active"))
    num_envs, num_agents = active.shape
    drawn = np.zeros((num_envs, num_agents, 5, *obstacles.shape[1:]), dtype=np.float32)
    drawn[:, :, 0] = obstacles[:, None]
    envs, agents = np.nonzero(active)
    for plane, cells in ((1, positions), (2, goals)):
        rows, columns = cells[envs, agents].T
        drawn[envs, :, plane, rows, columns] = 1
        drawn[envs, agents, plane + 2, rows, columns] = 1
    return torch.from_numpy(drawn).flatten(0, 1)


def stacked(states: np.ndarray) -> State:
    """Returns the states of some environments, one dictionary each, as one dictionary."""
    return {name: np.stack([state[name] for state in states]) for name in states[0]}


def network(num_values: int, num_outputs: int, scale: float) -> nn.Sequential:
    last = nn.Linear(128, num_outputs)
    nn.init.orthogonal_(last.weight, scale)
    return nn.Sequential(nn.Flatten(), nn.Linear(num_values, 256), nn.ReLU(), nn.Linear(256, 128), nn.ReLU(), last)


class Trainer:
    """An actor, a critic and their environments."""

    def __init__(self, seed: int) -> None:
        torch.manual_seed(seed)
        self.envs = VecEnv(CONFIG, NUM_ENVS, semantics="2.0", masks=True, rewards="shared")
        self.num_rows = NUM_ENVS * self.envs.num_agents
        self.seen, self.infos = self.envs.reset(seed=seed)
        rows, columns = self.envs.state()["obstacles"].shape[1:]
        self.actor = network(int(np.prod(self.seen.shape[2:])), 5, 0.01)
        self.critic = network(5 * rows * columns, 1, 1.0)
        parameters = [*self.actor.parameters(), *self.critic.parameters()]
        self.optimizer = torch.optim.Adam(parameters, LEARNING_RATE, eps=1e-5)

    def policy(self, seen: torch.Tensor, masks: torch.Tensor) -> Distribution:
        logits = self.actor(seen).masked_fill(masks == 0, -1e9)
        return Categorical(logits=logits, validate_args=False)

    def value(self, state: torch.Tensor) -> torch.Tensor:
        values: torch.Tensor = self.critic(state).squeeze(-1)
        return values

    @torch.no_grad()
    def play(self) -> tuple[dict[str, torch.Tensor], list[float]]:
        """Plays a rollout; returns tensors of shape (steps, envs * agents, ...), and the ISR of each ended episode."""
        steps: list[dict[str, torch.Tensor]] = []
        shares: list[float] = []
        for _ in range(NUM_STEPS):
            masks = torch.from_numpy(self.infos["action_masks"]).flatten(0, 1)
            seen, state = torch.from_numpy(self.seen).flatten(0, 1).clone(), planes(self.envs.state())
            policy = self.policy(seen, masks)
            actions = policy.sample()
            self.seen, rewards, terminated, truncated, self.infos = self.envs.step(actions.view(NUM_ENVS, -1).numpy())
            if "_final_state" in self.infos:
                ended = np.flatnonzero(self.infos["_final_state"])
                shares.extend(self.infos["metrics"]["ISR"][ended].tolist())
                self.bootstrap(rewards, truncated & ~terminated, ended)
            step = {
                "seen": seen,
                "masks": masks,
                "state": state,
                "actions": actions,
                "log_probs": policy.log_prob(actions),
            }
            step["values"] = self.value(state)
            step["rewards"] = torch.from_numpy(rewards).flatten()
            step["continues"] = torch.from_numpy(~(terminated | truncated)).flatten().float()
            steps.append(step)
        return {name: torch.stack([step[name] for step in steps]) for name in steps[0]}, shares

    def bootstrap(self, rewards: np.ndarray, cut: np.ndarray, ended: np.ndarray) -> None:
        """Adds the discounted value of the final state to the last rewards of episodes that the time limit ended."""
        values = self.value(planes(stacked(self.infos["final_state"][ended]))).view(len(ended), -1)
        rewards[ended] += DISCOUNT * values.numpy() * cut[ended]

    @torch.no_grad()
    def advantages(self, rollout: dict[str, torch.Tensor]) -> torch.Tensor:
        """Returns the advantage of each action, by GAE."""
        next_value, last = self.value(planes(self.envs.state())), torch.zeros(self.num_rows)
        advantages = torch.zeros_like(rollout["values"])
        for step in reversed(range(NUM_STEPS)):
            continues = rollout["continues"][step]
            error = rollout["rewards"][step] + DISCOUNT * continues * next_value - rollout["values"][step]
            last = error + DISCOUNT * GAE * continues * last
            advantages[step], next_value = last, rollout["values"][step]
        return advantages

    def learn(self, rollout: dict[str, torch.Tensor]) -> None:
        """Updates actor and critic on a rollout."""
        advantages = self.advantages(rollout).flatten()
        flat = {name: part.flatten(0, 1) for name, part in rollout.items()}
        returns = advantages + flat["values"]
        spread, mean = torch.std_mean(advantages)
        advantages = (advantages - mean) / (spread + 1e-8)
        for _ in range(NUM_EPOCHS):
            for part in torch.split(torch.randperm(len(returns)), BATCH_SIZE):
                policy = self.policy(flat["seen"][part], flat["masks"][part])
                ratio = (policy.log_prob(flat["actions"][part]) - flat["log_probs"][part]).exp()
                gain = advantages[part]
                loss = -torch.min(ratio * gain, ratio.clamp(1 - CLIP, 1 + CLIP) * gain).mean()
                loss = loss + 0.5 * (self.value(flat["state"][part]) - returns[part]).pow(2).mean()
                loss = loss - ENTROPY * policy.entropy().mean()
                self.optimizer.zero_grad()
                torch.autograd.backward(loss)
                nn.utils.clip_grad_norm_([*self.actor.parameters(), *self.critic.parameters()], 0.5)
                self.optimizer.step()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=5.0, help="training time in minutes [default: 5]")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    trainer, began, updates = Trainer(arguments.seed), time.perf_counter(), 0
    recent: list[float] = []
    minutes = 0.0
    while updates == 0 or minutes < arguments.minutes:
        rollout, shares = trainer.play()
        trainer.learn(rollout)
        recent, updates = [*recent, *shares][-500:], updates + 1
        minutes = (time.perf_counter() - began) / 60
        if updates % 25 == 0 or minutes >= arguments.minutes:
            share = float(np.mean(recent)) if recent else float("nan")
            print(f"{minutes:5.1f} min  {updates * NUM_STEPS * trainer.num_rows:>10,} agent steps  ISR {share:.3f}")


if __name__ == "__main__":
    main()
