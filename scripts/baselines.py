"""Columns of the benchmark by the protocol of docs/benchmark.md, which shows the table.

    python scripts/baselines.py constants                    # the best constant action of each task
    python scripts/baselines.py rows random constant planner rulebased
    python scripts/baselines.py train ppo --workers 2        # five seeds of every supported task
    python scripts/baselines.py table                        # of all rows

Results are in runs/baselines. Completed trainings are not repeated: an interrupted run continues
with the next one. A training writes its configuration, curve, weights and the metric of every
episode; a row is written to `ALGORITHM.json`, which `curling benchmark` checks.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.benchmark import TASKS, BenchmarkTask, contestant, played
from agents.benchmark.contestants import can_do
from agents.benchmark.ices import DISTRIBUTION
from agents.benchmark.rows import aggregate, read_row, scores_of, write_row
from curling_env.infrastructure.executor import executor

FOLDER = Path("runs/baselines")
EPISODES = 100
"""Number of episodes of every task and run."""
SEEDS = 5
"""Seeds of the trainings of every task."""
NUM_ENVS = 64
ENDS = [name for name, task in TASKS.items() if task.headline and task.metric == "points"]
THROWS = [name for name, task in TASKS.items() if task.headline and task.metric != "points"]
KNOWS = {"draw-mean": "mean", "draw-blind": "nothing"}


@dataclass(frozen=True)
class Algorithm:
    """One column.

    Parameters
    ----------
    name : of the class in stable-baselines3 or sb3-contrib; "BC" for behaviour cloning
    tasks : that it can do
    steps : of a training, on single throws and on ends
    settings : of the algorithm; others are its own defaults
    actions : of ends
    """

    name: str
    tasks: list[str]
    steps: tuple[int, int]
    settings: dict[str, Any]
    actions: str = "throws"


ON_POLICY: dict[str, Any] = {
    "n_steps": 16,
    "batch_size": 512,
    "n_epochs": 8,
    "learning_rate": 1e-3,
    "gamma": 1.0,
}
OFF_POLICY: dict[str, Any] = {"learning_rate": 1e-3, "batch_size": 512, "gradient_steps": 16}
ALGORITHMS = {
    "ppo": Algorithm("PPO", THROWS + ENDS, (400_000, 400_000), ON_POLICY),
    "sac": Algorithm("SAC", THROWS, (80_000, 0), OFF_POLICY),
    "maskable-ppo": Algorithm("MaskablePPO", ENDS, (0, 400_000), ON_POLICY, "shots"),
    "dqn": Algorithm("DQN", ENDS, (0, 200_000), OFF_POLICY, "shots"),
    "bc": Algorithm("BC", THROWS + ENDS, (10_000, 10_000), ON_POLICY),
}


# --- what is trained in ---------------------------------------------------------------------------


def training_options(task: BenchmarkTask, actions: str = "throws") -> dict[str, Any]:
    """Return the options of a task's environment, with other ices of the same distribution."""
    options = dict(task.options)
    if "ices" in options:
        options["ices"] = {**asdict(DISTRIBUTION), "knows": KNOWS.get(task.name, "map")}
    return options if actions == "throws" else {**options, "actions": actions}


def environments(task: BenchmarkTask, count: int, actions: str = "throws") -> Any:
    return gymnasium.make_vec(
        task.environment,
        num_envs=count,
        autoreset_mode="SameStep",
        **training_options(task, actions),
    )


# --- one action for all -------------------------------------------------------------------------


def mean_of(task: BenchmarkTask, envs: Any, actions: Any, seed: int) -> Any:
    """Return the metric of an episode of each environment that repeats one action.

    Parameters
    ----------
    actions : (n, 3)
    """
    envs.reset(seed=seed)
    total, over, info = np.zeros(len(actions)), False, dict[str, Any]()
    while not over:
        _, rewards, ended, _, info = envs.step(actions.astype(np.float32))
        total, over = total + rewards, ended.any()  # all end together
    if task.metric == "points":
        return total
    value = np.asarray(info["final_info"][task.metric], dtype=float)
    return -value if task.metric == "distance_m" else value


def best_constant(task: BenchmarkTask, *, many: int = 2048, rounds: int = 6) -> Any:
    """Find the best constant action by random search and the cross-entropy method, (3,)."""
    n, rng = 256, np.random.default_rng(0)
    envs, tried = environments(task, n), rng.uniform(-1, 1, (many, 3))
    scores = np.concatenate(
        [mean_of(task, envs, tried[k : k + n], 1000 + k) for k in range(0, many, n)]
    )
    kept = tried[np.argsort(scores)[::-1][:n]]
    scores = np.mean([mean_of(task, envs, kept, 50_000 + 1000 * j) for j in range(4)], axis=0)
    best = kept[np.argsort(scores)[::-1][:8]]
    for k in range(rounds):
        tried = np.clip(rng.normal(best.mean(0), best.std(0) + 0.02, (32, 3)), -1, 1)
        tried[0] = best.mean(0)
        each = np.repeat(tried, n // len(tried), axis=0)
        found = [mean_of(task, envs, each, 100_000 + 10_000 * k + 1000 * j) for j in range(4)]
        order = np.argsort(np.mean(found, axis=0).reshape(len(tried), -1).mean(axis=1))
        best = tried[order[::-1][:8]]
    return best.mean(axis=0)


def constants() -> None:
    """Print the best constant action of each kind of task, in ends against `rulebased`."""
    for name in [*THROWS, "end-rulebased"]:
        print(name, np.round(best_constant(TASKS[name]), 3).tolist(), flush=True)


# --- trainings ----------------------------------------------------------------------------------


def train(job: tuple[str, str, int, float]) -> str:
    """Train and measure one model, unless that was done; return the folder of the run."""
    name, task_name, seed, share = job
    folder, task = FOLDER / name / task_name / str(seed), TASKS[task_name]
    if (folder / "values.json").exists():
        return str(folder)
    folder.mkdir(parents=True, exist_ok=True)
    algorithm = ALGORITHMS[name]
    steps = int(share * algorithm.steps[task.metric == "points"])
    configuration = {
        "algorithm": asdict(algorithm),
        "steps": steps,
        "seed": seed,
        "options": training_options(task, algorithm.actions),
    }
    (folder / "config.json").write_text(json.dumps(configuration, indent=1, default=str))
    model, curve = _model(algorithm, task, seed), Curve(folder / "curve.csv")
    if algorithm.name == "BC":
        clone(model, task, seed, steps)
    else:
        model.learn(steps, callback=curve)
    model.save(folder / "model.zip")
    values, _ = played(task, contestant(model), episodes=EPISODES)
    (folder / "values.json").write_text(json.dumps(values.tolist()))
    return str(folder)


def _model(algorithm: Algorithm, task: BenchmarkTask, seed: int) -> Any:
    """Return a model before its training; observations are normalised by those at resets."""
    import stable_baselines3
    import torch

    from agents.learning.normalisation import ObservationNormaliser
    from curling_env.envs.stable_baselines import CurlingVecEnv

    torch.set_num_threads(1)
    envs = environments(task, NUM_ENVS, algorithm.actions)
    seen = np.concatenate([envs.reset(seed=10_000 * (seed + 1) + 100 * k)[0] for k in range(32)])
    places: Any = {"features_extractor_class": ObservationNormaliser}
    places["features_extractor_kwargs"] = {"mean": seen.mean(0), "deviation": seen.std(0)}
    kind, policy = "PPO" if algorithm.name == "BC" else algorithm.name, "MlpPolicy"
    if kind == "PPO":
        places["log_std_init"] = -1.0
    if kind == "MaskablePPO":
        import sb3_contrib as package  # pyright: ignore[reportMissingImports]
    else:
        package = stable_baselines3
    return getattr(package, kind)(
        policy,
        CurlingVecEnv(envs, seed=100_000 * (seed + 1)),
        seed=seed,
        device="cpu",
        policy_kwargs=places,
        **algorithm.settings,
    )


def Curve(path: Path) -> Any:
    """Callback that writes the mean reward of the last hundred episodes, step by step."""
    from stable_baselines3.common.callbacks import BaseCallback

    class Written(BaseCallback):
        def _on_step(self) -> bool:
            return True

        def _on_rollout_end(self) -> None:
            ended: Any = self.model.ep_info_buffer
            if ended and (self.n_calls % 64 == 0 or self.n_calls < 64):
                with path.open("a", newline="") as file:
                    csv.writer(file).writerow(
                        [self.num_timesteps, float(np.mean([one["r"] for one in ended]))]
                    )

    return Written()


def clone(model: Any, task: BenchmarkTask, seed: int, steps: int) -> None:
    """Learn the planner's throws, or the calls of `learned`, by behaviour cloning."""
    import torch

    observations, actions = demonstrations(task, seed, steps)
    policy, batch = model.policy, 256
    optimiser = torch.optim.Adam(policy.parameters(), lr=1e-3)
    seen, done = torch.as_tensor(observations), torch.as_tensor(actions)
    torch.manual_seed(seed)
    for _ in range(40 * len(seen) // batch):
        some = torch.randint(len(seen), (batch,))
        _, likelihood, _ = policy.evaluate_actions(seen[some], done[some])
        optimiser.zero_grad()
        (-likelihood.mean()).backward()
        optimiser.step()


def demonstrations(task: BenchmarkTask, seed: int, steps: int) -> tuple[Any, Any]:
    """Return observations and actions of the planner, or in ends of `learned`."""
    env: Any = gymnasium.make(task.environment, **training_options(task)).unwrapped
    who = contestant("learned" if task.metric == "points" else "planner")
    seen, done, episode = list[Any](), list[Any](), 0
    while len(done) < steps:
        observation, _ = env.reset(seed=500_000 + 10_000 * seed + episode)
        episode, over = episode + 1, False
        while not over:
            seen.append(observation)
            done.append(who(env, observation))
            observation, _, over, _, _ = env.step(done[-1])
    return np.array(seen, dtype=np.float32), np.array(done, dtype=np.float32)


def train_all(names: list[str], tasks: list[str] | None, share: float, workers: str) -> None:
    """Train the missing models, seed by seed, and write the rows."""
    jobs = [
        (name, task, seed, share)
        for seed in range(SEEDS)
        for name in names
        for task in ALGORITHMS[name].tasks
        if tasks is None or task in tasks
    ]
    with executor(workers) as crew:
        for place in crew.map(train, jobs):
            print(place, flush=True)
    for name in names:
        found: dict[str, list[Any]] = {}
        for task in ALGORITHMS[name].tasks:
            runs = sorted((FOLDER / name / task).glob("*/values.json"))
            if runs:
                found[task] = [np.array(json.loads(run.read_text())) for run in runs]
        write_row(FOLDER / f"{name}.json", name, found, method=str(ALGORITHMS[name]))


# --- rows and the table -------------------------------------------------------------------------


def rows(names: list[str]) -> None:
    """Measure policies without training, on all tasks that they support."""
    for name in names:
        path = FOLDER / f"{name.replace(':', '-')}.json"
        if path.exists():
            continue
        found: dict[str, list[Any]] = {}
        for task in TASKS.values():
            if can_do(name, task):
                found[task.name] = [played(task, contestant(name), episodes=EPISODES)[0]]
                print(name, task.name, found[task.name][0].mean(), flush=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_row(path, name, found)


def table() -> None:
    """Print the tasks by the rows, as Markdown."""
    found = {path.stem: read_row(path) for path in sorted(FOLDER.glob("*.json"))}
    print(f"| row | normalised | {' | '.join(f'`{name}`' for name in TASKS)} |")
    print("|---" * (len(TASKS) + 2) + "|")
    for name, row in found.items():
        scores = {score.task: score.in_words() for score in scores_of(row)}
        mean, low, high = aggregate(row)
        cells = [f"`{name}`", f"{mean:.2f} ({low:.2f} to {high:.2f})"]
        print("| " + " | ".join([*cells, *(scores.get(task, "") for task in TASKS)]) + " |")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("what", choices=["constants", "rows", "train", "table"])
    parser.add_argument("names", nargs="*", help="players and policies, or algorithms")
    parser.add_argument("--task", action="append", help="trains for these only")
    parser.add_argument("--share", type=float, default=1.0, help="of the steps, for a trial")
    parser.add_argument("--workers", default="1", help="processes, or 'ray'")
    given = parser.parse_args()
    chosen: dict[str, Callable[[], None]] = {
        "constants": constants,
        "rows": lambda: rows(given.names),
        "train": lambda: train_all(given.names, given.task, given.share, given.workers),
        "table": table,
    }
    chosen[given.what]()


if __name__ == "__main__":
    main()
