"""PPO in one file, in the style of CleanRL: learn to draw anywhere in the house, as a club player.

    python scripts/ppo.py                                       # five minutes of one core
    python scripts/ppo.py --env CurlingEnd-v0 --options '{"potential": "value-network"}'
    python scripts/ppo.py --options '{"task": "takeout", "target": "random"}'

The file contains networks, rollouts in the vector environment, advantages and updates. Each line of
the printed table is the mean of the episodes since the previous line.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import gymnasium
import matplotlib.pyplot as plt
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

import curling_env  # noqa: F401  (registers the environments)


@dataclass
class Settings:
    """Options of the command line."""

    env: str = "CurlingSheet-v0"
    options: str = '{"target": "random", "skill": "club"}'
    steps: int = 1_500_000
    num_envs: int = 256
    rollout: int = 8  # steps of each environment between updates
    epochs: int = 8
    minibatch: int = 512
    learning_rate: float = 1e-3  # falls to zero
    gamma: float = 1.0
    gae_lambda: float = 0.95
    clip: float = 0.2
    entropy: float = 0.0
    value: float = 0.5
    max_norm: float = 0.5
    units: int = 64
    deviation: float = 0.3  # of the first actions, whose range is 2
    seed: int = 0
    output: str = "runs/ppo"


class Agent(nn.Module):
    """Policy and value networks, each of two layers; observations are normalised online."""

    def __init__(self, seen: int, acts: int, settings: Settings) -> None:
        super().__init__()

        def network(last: int, gain: float) -> nn.Sequential:
            sizes = (seen, settings.units, settings.units, last)
            layers: list[nn.Module] = []
            for k in range(3):
                layer = nn.Linear(sizes[k], sizes[k + 1])
                nn.init.orthogonal_(layer.weight, gain if k == 2 else 2**0.5)
                nn.init.zeros_(layer.bias)
                layers += [layer] if k == 2 else [layer, nn.Tanh()]
            return nn.Sequential(*layers)

        self.policy, self.critic = network(acts, 0.01), network(1, 1.0)
        self.log_deviation = nn.Parameter(torch.full((acts,), float(np.log(settings.deviation))))
        self.register_buffer("mean", torch.zeros(seen))
        self.register_buffer("square", torch.ones(seen))
        self.register_buffer("count", torch.tensor(1e-4))
        self.mean: torch.Tensor
        self.square: torch.Tensor
        self.count: torch.Tensor

    def notice(self, observations: torch.Tensor) -> None:
        """Update the running mean and variance of observations."""
        n = observations.shape[0]
        share = n / (self.count + n)
        change = observations.mean(0) - self.mean
        variance = observations.var(0, unbiased=False)
        self.square += share * (variance + change**2 * (1 - share) - self.square)
        self.mean += share * change
        self.count += n

    def forward(self, observations: torch.Tensor) -> tuple[Normal, torch.Tensor]:
        """Return the distribution of the action, and the value."""
        x = ((observations - self.mean) / torch.sqrt(self.square + 1e-6)).clamp(-5, 5)
        return Normal(self.policy(x), self.log_deviation.exp()), self.critic(x)[..., 0]

    def predict(self, observation: Any) -> np.ndarray:
        """Return the best action for one or many observations."""
        with torch.no_grad():
            action, _ = self(torch.as_tensor(np.asarray(observation), dtype=torch.float32))
        return action.mean.clamp(-1, 1).numpy()


def advantages(
    rewards: torch.Tensor, values: torch.Tensor, over: torch.Tensor, settings: Settings
) -> torch.Tensor:
    """Generalised advantages (Schulman et al. 2016), (steps, n); `values` has one row more."""
    found, following = torch.zeros_like(rewards), torch.zeros(rewards.shape[1])
    for t in reversed(range(len(rewards))):
        goes_on = 1.0 - over[t]
        error = rewards[t] + settings.gamma * goes_on * values[t + 1] - values[t]
        following = error + settings.gamma * settings.gae_lambda * goes_on * following
        found[t] = following
    return found


def train(settings: Settings) -> Agent:
    """Learn, print the table, and leave its curve and `agent.pt` in the output folder."""
    torch.manual_seed(settings.seed)
    torch.set_num_threads(1)
    envs = gymnasium.make_vec(
        settings.env,
        num_envs=settings.num_envs,
        autoreset_mode="SameStep",
        **json.loads(settings.options),
    )
    seen, acts = envs.single_observation_space.shape, envs.single_action_space.shape
    assert seen is not None, "an observation must be a vector"
    assert acts is not None, "an action must be a vector"
    agent = Agent(seen[0], acts[0], settings)
    optimiser = torch.optim.Adam(agent.parameters(), lr=settings.learning_rate, eps=1e-5)
    n, length = settings.num_envs, settings.rollout
    updates = max(settings.steps // (n * length), 1)
    observation, _ = envs.reset(seed=settings.seed)
    returns, episode = np.zeros(n), {"return": [], "success": [], "miss": []}
    output = Path(settings.output)
    output.mkdir(parents=True, exist_ok=True)
    began, rows = time.perf_counter(), []
    for update in range(updates):
        optimiser.param_groups[0]["lr"] = settings.learning_rate * (1 - update / updates)
        observations = torch.zeros(length + 1, n, seen[0])
        actions, chances = torch.zeros(length, n, acts[0]), torch.zeros(length, n)
        rewards, over = torch.zeros(length, n), torch.zeros(length, n)
        for t in range(length):
            observations[t] = torch.from_numpy(observation)
            agent.notice(observations[t])
            with torch.no_grad():
                choice, _ = agent(observations[t])
                actions[t] = choice.sample()
                chances[t] = choice.log_prob(actions[t]).sum(-1)
            observation, reward, ended, _, info = envs.step(actions[t].numpy())
            rewards[t], over[t] = torch.from_numpy(reward), torch.from_numpy(ended)
            returns += reward
            episode["return"] += returns[ended].tolist()
            returns[ended] = 0.0
            final = info.get("final_info", {})
            for name, key in (("success", "success"), ("miss", "distance_m")):
                episode[name] += final[key][ended].tolist() if key in final else []
        observations[length] = torch.from_numpy(observation)
        with torch.no_grad():
            _, values = agent(observations)
        advantage = advantages(rewards, values, over, settings).flatten()
        target = advantage + values[:-1].flatten()
        flat = [x.flatten(0, 1) for x in (observations[:-1], actions, chances)]
        for _ in range(settings.epochs):
            for rows_of in torch.randperm(len(advantage)).split(settings.minibatch):
                o, a, before = (x[rows_of] for x in flat)
                choice, value = agent(o)
                ratio = (choice.log_prob(a).sum(-1) - before).exp()
                good = advantage[rows_of]
                good = (good - good.mean()) / (good.std() + 1e-8)
                clipped = ratio.clamp(1 - settings.clip, 1 + settings.clip)
                loss = -torch.minimum(ratio * good, clipped * good).mean()
                loss = loss + settings.value * 0.5 * ((value - target[rows_of]) ** 2).mean()
                loss = loss - settings.entropy * choice.entropy().sum(-1).mean()
                optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), settings.max_norm)
                optimiser.step()
        if (update + 1) % max(updates // 30, 1) == 0 or update + 1 == updates:
            means = {name: float(np.mean(v)) if v else np.nan for name, v in episode.items()}
            row = {"steps": (update + 1) * n * length, **means}
            row["seconds"] = time.perf_counter() - began
            rows.append(row)
            print("  ".join(f"{name} {value:9.3f}" for name, value in row.items()), flush=True)
            episode = {name: [] for name in episode}
    with (output / "curve.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    draw(rows, output / "curve.png")
    torch.save(agent.state_dict(), output / "agent.pt")
    envs.close()
    return agent


def draw(rows: list[dict[str, float]], path: Path) -> None:
    """Draw the learning curve: the miss of throws, or the return without a target."""
    name, label = ("miss", "mean miss [m]") if rows[0]["miss"] > 0 else ("return", "mean return")
    figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
    axes.plot([row["steps"] / 1000 for row in rows], [row[name] for row in rows], color="#b3342d")
    axes.set(xlabel="throws [thousands]", ylabel=label, ylim=(0, None) if name == "miss" else None)
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def evaluate(
    predict: Callable[[Any], Any], settings: Settings, episodes: int = 1000
) -> tuple[float, float]:
    """Return the mean return and the mean miss [m] in unseen episodes."""
    envs = gymnasium.make_vec(
        settings.env, num_envs=episodes, autoreset_mode="NextStep", **json.loads(settings.options)
    )
    observation, _ = envs.reset(seed=settings.seed + 10**6)
    returns, misses = np.zeros(episodes), np.full(episodes, np.nan)
    over = np.zeros(episodes, dtype=bool)
    while not over.all():
        observation, reward, ended, _, info = envs.step(predict(observation))
        returns += reward * ~over
        last = ended & ~over
        misses[last] = info.get("distance_m", misses)[last]
        over |= ended
    return float(returns.mean()), float(misses.mean())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for field in fields(Settings):
        kind = type(field.default)
        parser.add_argument(
            f"--{field.name.replace('_', '-')}",
            type=kind,
            default=field.default,
            metavar=kind.__name__,
        )
    settings = Settings(**vars(parser.parse_args()))
    agent = train(settings)
    mean, miss = evaluate(agent.predict, settings)
    print(f"best actions, 1,000 new episodes: mean return {mean:.3f}, mean miss {miss:.3f} m")


if __name__ == "__main__":
    main()
