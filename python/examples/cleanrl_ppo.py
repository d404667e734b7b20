"""PPO in the style of CleanRL: one file, no classes around the loop, all details in order of execution.

    pip install torch
    python cleanrl_ppo.py --total-steps 2000000
    python cleanrl_ppo.py --tensorboard runs       # pip install tensorboard
    python cleanrl_ppo.py --wandb offline          # pip install wandb

All agents share one network. `VecEnv` takes the place of `SyncVectorEnv`; every agent of every environment is one
row of the batch. Agents that finished do not contribute to the loss.
"""

import argparse
import random
import time

import numpy as np
import torch
from pogema_rs import GridConfig, VecEnv
from torch import nn, optim
from torch.distributions import Categorical

CONFIG = GridConfig(size=8, density=0.3, num_agents=4, obs_radius=5, max_episode_steps=64)


def parse_args() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--total-steps", type=int, default=2_000_000, help="agent steps in total [default: 2000000]")
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--num-steps", type=int, default=32, help="steps per environment and rollout [default: 32]")
    parser.add_argument("--num-minibatches", type=int, default=4)
    parser.add_argument("--update-epochs", type=int, default=3)
    parser.add_argument("--learning-rate", type=float, default=1e-3)
    parser.add_argument("--gamma", type=float, default=0.95)
    parser.add_argument("--gae-lambda", type=float, default=0.9)
    parser.add_argument("--clip-coef", type=float, default=0.2)
    parser.add_argument("--ent-coef", type=float, default=0.01)
    parser.add_argument("--vf-coef", type=float, default=0.5)
    parser.add_argument("--step-cost", type=float, default=0.02)
    parser.add_argument("--tensorboard", metavar="FOLDER", help="write TensorBoard logs to this folder")
    parser.add_argument("--wandb", choices=["online", "offline", "disabled"], help="log to Weights & Biases")
    return parser.parse_args()


def layer_init(layer: nn.Linear, std: float = 2**0.5) -> nn.Linear:
    nn.init.orthogonal_(layer.weight, std)
    nn.init.constant_(layer.bias, 0.0)
    return layer


class Agent(nn.Module):
    def __init__(self, num_values: int) -> None:
        super().__init__()
        self.body = nn.Sequential(
            nn.Flatten(), layer_init(nn.Linear(num_values, 256)), nn.ReLU(), layer_init(nn.Linear(256, 128)), nn.ReLU()
        )
        self.actor, self.critic = layer_init(nn.Linear(128, 5), 0.01), layer_init(nn.Linear(128, 1), 1.0)

    def forward(self, obs: torch.Tensor, masks: torch.Tensor) -> tuple[Categorical, torch.Tensor]:
        features = self.body(obs)
        logits = self.actor(features).masked_fill(masks == 0, -1e9)
        return Categorical(logits=logits, validate_args=False), self.critic(features).squeeze(-1)


def main() -> None:
    args = parse_args()
    random.seed(args.seed)
    np.random.seed(args.seed)
    torch.manual_seed(args.seed)
    if args.wandb:
        import wandb

        wandb.init(project="pogema", config=vars(args), mode=args.wandb)
    if args.tensorboard:
        from torch.utils.tensorboard import SummaryWriter

        writer = SummaryWriter(args.tensorboard)

    envs = VecEnv(CONFIG, args.num_envs, semantics="2.0", masks=True, statistics=True)
    num_rows = args.num_envs * envs.num_agents
    seen, infos = envs.reset(seed=args.seed)
    obs_shape = seen.shape[2:]
    agent = Agent(int(np.prod(obs_shape)))
    optimizer = optim.Adam(agent.parameters(), lr=args.learning_rate, eps=1e-5)

    # The rollout: one row for each agent of each environment.
    size = (args.num_steps, num_rows)
    obs, masks = torch.zeros((*size, *obs_shape)), torch.zeros((*size, 5), dtype=torch.int8)
    actions, active = torch.zeros(size, dtype=torch.int64), torch.zeros(size, dtype=torch.bool)
    logprobs, rewards, dones, values = (torch.zeros(size) for _ in range(4))

    num_updates, global_step, began = max(1, args.total_steps // (args.num_steps * num_rows)), 0, time.perf_counter()
    for update in range(num_updates):
        optimizer.param_groups[0]["lr"] = args.learning_rate * (1 - update / num_updates)
        shares, returns_of_episodes = [], []
        for step in range(args.num_steps):
            global_step += num_rows
            obs[step] = torch.from_numpy(seen).flatten(0, 1)
            masks[step] = torch.from_numpy(infos["action_masks"]).flatten(0, 1)
            active[step] = torch.from_numpy(infos["is_active"]).flatten()
            with torch.no_grad():
                policy, values[step] = agent(obs[step], masks[step])
                actions[step] = policy.sample()
                logprobs[step] = policy.log_prob(actions[step])
            seen, reward, terminated, truncated, infos = envs.step(actions[step].view(args.num_envs, -1).numpy())
            rewards[step] = torch.from_numpy(reward).flatten() - args.step_cost
            dones[step] = torch.from_numpy(terminated | truncated).flatten()
            if "_final_obs" in infos:
                # The value of the final observation replaces the rewards that the time limit cut off.
                ended = np.flatnonzero(infos["_final_obs"])
                final = torch.from_numpy(np.stack(infos["final_obs"][ended])).flatten(0, 1)
                final_masks = torch.from_numpy(infos["final_info"]["action_masks"][ended]).flatten(0, 1)
                with torch.no_grad():
                    final_values = agent(final, final_masks)[1].view(len(ended), -1)
                cut = torch.from_numpy((truncated & ~terminated)[ended])
                rewards[step].view(args.num_envs, -1)[torch.from_numpy(ended)] += args.gamma * final_values * cut
                shares.extend(infos["metrics"]["ISR"][ended])
                returns_of_episodes.extend(infos["episode"]["r"][ended])

        # Advantages by GAE.
        with torch.no_grad():
            next_obs = torch.from_numpy(seen).flatten(0, 1)
            next_value = agent(next_obs, torch.from_numpy(infos["action_masks"]).flatten(0, 1))[1]
        advantages, last = torch.zeros_like(rewards), torch.zeros(num_rows)
        for step in reversed(range(args.num_steps)):
            continues = 1.0 - dones[step]
            delta = rewards[step] + args.gamma * next_value * continues - values[step]
            last = delta + args.gamma * args.gae_lambda * continues * last
            advantages[step], next_value = last, values[step]
        returns = advantages + values

        # Minibatches of the rows whose agents were active.
        rows = active.flatten().nonzero().squeeze(-1)
        b_obs, b_masks, b_actions = obs.flatten(0, 1), masks.flatten(0, 1), actions.flatten()
        b_logprobs, b_advantages, b_returns = logprobs.flatten(), advantages.flatten(), returns.flatten()
        spread, mean = torch.std_mean(b_advantages[rows])
        b_advantages = (b_advantages - mean) / (spread + 1e-8)
        for _ in range(args.update_epochs):
            for part in torch.chunk(rows[torch.randperm(len(rows))], args.num_minibatches):
                policy, new_values = agent(b_obs[part], b_masks[part])
                ratio = (policy.log_prob(b_actions[part]) - b_logprobs[part]).exp()
                clipped = ratio.clamp(1 - args.clip_coef, 1 + args.clip_coef)
                pg_loss = -torch.min(ratio * b_advantages[part], clipped * b_advantages[part]).mean()
                v_loss = (new_values - b_returns[part]).pow(2).mean()
                loss = pg_loss + args.vf_coef * v_loss - args.ent_coef * policy.entropy().mean()
                optimizer.zero_grad()
                torch.autograd.backward(loss)
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()

        charts = {"losses/policy": pg_loss.item(), "losses/value": v_loss.item()}
        charts["charts/SPS"] = global_step / (time.perf_counter() - began)
        if shares:
            charts["charts/ISR"] = float(np.mean(shares))
            charts["charts/episodic_return"] = float(np.mean(returns_of_episodes))
        if args.wandb:
            wandb.log(charts, step=global_step)
        if args.tensorboard:
            for name, value in charts.items():
                writer.add_scalar(name, value, global_step)
        if update % 20 == 0 or update == num_updates - 1:
            isr, speed = charts.get("charts/ISR", float("nan")), charts["charts/SPS"]
            print(f"step {global_step:>9,}  ISR {isr:.3f}  {speed:,.0f}/s")

    envs.close()
    if args.tensorboard:
        writer.close()
    if args.wandb:
        wandb.finish()


if __name__ == "__main__":
    main()
