"""Rows of the benchmark by one protocol, which docs/benchmark.md describes.

    python scripts/baselines.py constants                    # the best constant action of each task
    python scripts/baselines.py run random planner ppo --workers 2
    python scripts/baselines.py table                        # of all rows up to now
    python scripts/baselines.py release      # rows, curves, configurations and weights to docs

Results are kept in runs/baselines, and an interrupted run continues. A training writes its
configuration, its curve, its weights and the scores of its episodes; a row is `NAME.json`, which
`curling benchmark` checks.
"""

from __future__ import annotations

import argparse
import csv
import json
import platform
import re
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import ZIP_DEFLATED, ZipFile

import gymnasium
import numpy as np
from scipy.stats import trim_mean

from agents.benchmark import TASKS, BenchmarkTask, contestant, played
from agents.benchmark.contestants import can_do
from agents.benchmark.datasets import expert_of, practice_env, practice_options, tier_episodes
from agents.benchmark.rows import aggregate, read_row, scores_of, shortcomings, write_row
from agents.benchmark.scores import TRIMMED
from curling_env.envs.game.shots import SHOTS
from curling_env.infrastructure.executor import executor
from curling_env.infrastructure.files.storage import write_json
from curling_env.infrastructure.files.writing import atomic_path

FOLDER = Path("runs/baselines")
EPISODES = 100
"""Number of episodes of each task and run."""
SEEDS = 5
"""Number of trainings of each task."""
END = "end-rulebased"
"""Opponent in training. Players are measured against all three, clones of lower tiers only here."""
ENDS = [name for name, task in TASKS.items() if task.headline and task.metric == "points"]
THROWS = [name for name, task in TASKS.items() if task.headline and task.metric != "points"]
DELIVERIES = {"learned": 10_000, "planner": 300}
"""Number of recorded deliveries of a tier, by its expert."""
CHUNKS = 10
"""Number of files in which they are recorded."""
POINTS = 60
"""Number of points of a curve."""
CLONING_STEPS = 2000
"""Minimum number of steps of behaviour cloning."""
STONES = re.compile(r"^target|stone \d")
"""Names of the observed numbers that show a stone or the target."""
NEVER = -1000.0
"""Logit of a shot that is never called."""


@dataclass(frozen=True, kw_only=True)
class Algorithm:
    """Row of the benchmark.

    Parameters
    ----------
    name : class in stable-baselines3, sb3-contrib or `learn.masked_dqn`; "BC" for behaviour cloning
    tasks : tasks to train in
    steps : number of training steps, on single throws and on ends
    num_envs : number of environments in parallel, on single throws and on ends
    settings : settings of the algorithm; the others keep their defaults
    actions : kind of actions in ends
    tier : tier of the recorded deliveries, for behaviour cloning
    best : share of the recorded episodes to clone, those of the highest return
    blind : hide stones and targets, and allow no shot that names a stone
    """

    name: str
    tasks: list[str]
    steps: tuple[int, int] = (0, 0)
    num_envs: tuple[int, int] = (64, 64)
    settings: dict[str, Any] = field(default_factory=dict[str, Any])
    actions: str = "throws"
    tier: str = ""
    best: float = 1.0
    blind: bool = False


ON_POLICY: dict[str, Any] = {
    "n_steps": 16,
    "batch_size": 512,
    "n_epochs": 10,
    "learning_rate": "lin_1e-3",
    "gamma": 1.0,
    "stats_window_size": 1000,
}
OFF_POLICY: dict[str, Any] = {
    "learning_rate": 1e-3,
    "batch_size": 512,
    "gradient_steps": 8,
    "buffer_size": 100_000,
    "stats_window_size": 1000,
}
EXPLORATION = {
    "gamma": 1.0,
    "train_freq": 1,
    "n_steps": 8,
    "exploration_fraction": 0.3,
    "target_update_interval": 1000,
}
COPIED = ["draw", "takeout", END]
ALGORITHMS = {
    "ppo": Algorithm(
        name="PPO",
        tasks=[*THROWS, END],
        steps=(250_000, 200_000),
        num_envs=(256, 64),
        settings=ON_POLICY,
    ),
    "ppo-blind": Algorithm(
        name="PPO",
        tasks=["takeout", "hit-and-stay", "freeze"],
        steps=(50_000, 0),
        num_envs=(256, 64),
        settings=ON_POLICY,
        blind=True,
    ),
    "sac": Algorithm(name="SAC", tasks=[*THROWS, END], steps=(30_000, 60_000), settings=OFF_POLICY),
    "maskable-ppo": Algorithm(
        name="MaskablePPO", tasks=[END], steps=(0, 100_000), settings=ON_POLICY, actions="shots"
    ),
    "maskable-ppo-blind": Algorithm(
        name="MaskablePPO",
        tasks=[END],
        steps=(0, 50_000),
        settings=ON_POLICY,
        actions="shots",
        blind=True,
    ),
    "dqn": Algorithm(
        name="MaskedDQN",
        tasks=[END],
        steps=(0, 60_000),
        settings=OFF_POLICY | EXPLORATION,
        actions="shots",
    ),
    "bc": Algorithm(name="BC", tasks=[*THROWS, END], tier="expert"),
    "bc-medium": Algorithm(name="BC", tasks=COPIED, tier="medium"),
    "bc-random": Algorithm(name="BC", tasks=COPIED, tier="random"),
    "bc-best-medium": Algorithm(name="BC", tasks=COPIED, tier="medium", best=0.1),
    "bc-best-random": Algorithm(name="BC", tasks=COPIED, tier="random", best=0.1),
}


def environments(task: BenchmarkTask, count: int, actions: str = "throws") -> Any:
    """Return environments of a task, vectorised, with other ices of the same distribution."""
    options: Any = practice_options(task) | ({} if actions == "throws" else {"actions": actions})
    return gymnasium.make_vec(
        task.environment, num_envs=count, autoreset_mode="SameStep", **options
    )


# --- one action for all -------------------------------------------------------------------------


def mean_of(task: BenchmarkTask, envs: Any, actions: Any, seed: int) -> Any:
    """Return the metric of an episode of each environment, in which the action is constant.

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
    """Return the best constant action by random search and the cross-entropy method, (3,)."""
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


# --- jobs ---------------------------------------------------------------------------------------


class Job(NamedTuple):
    """Job of one process.

    Parameters
    ----------
    kind : "record" (deliveries of a tier), "train" (and measure) or "measure"
    name : name of the algorithm, the policy or the tier
    task : name of the task
    number : seed of the training, or number of the chunk
    share : share of the steps
    """

    kind: str
    name: str
    task: str
    number: int = 0
    share: float = 1.0

    @property
    def folder(self) -> Path:
        """Folder of the results; recorded deliveries are shared by all seeds."""
        if self.kind == "record":
            return FOLDER / "recorded" / f"{self.task}-{self.name}"
        return FOLDER / self.name.replace(":", "-") / self.task / str(self.number)


def run_job(job: Job) -> str:
    """Do a job, unless its result exists, and return a line for the log."""
    work = {"record": recorded, "train": train, "measure": measure}[job.kind]
    job.folder.mkdir(parents=True, exist_ok=True)
    return f"{' '.join(map(str, job))}: {work(job)}"


def measure(job: Job) -> str:
    """Measure a policy that needs no training."""
    return _measured(job, job.name, [job.task])


def _measured(job: Job, name: str, tasks: list[str]) -> str:
    path = job.folder / "values.json"
    if not path.exists():
        who = contestant(name)
        values = {task: played(TASKS[task], who, episodes=EPISODES)[0] for task in tasks}
        write_json(path, {task: np.round(each, 4).tolist() for task, each in values.items()})
    found = json.loads(path.read_text())
    return ", ".join(f"{task} {np.mean(each):.3f}" for task, each in found.items())


def recorded(job: Job) -> Any:
    """Record a chunk of the deliveries of a tier, each with the return of its episode; return the
    file.
    """
    path = job.folder / f"{job.number}.npz"
    if not path.exists():
        env, first = practice_env(job.task), 20_000_000 + 100_000 * job.number
        many = max(1, int(job.share * DELIVERIES[expert_of(job.task)]) // CHUNKS)
        episodes = list(tier_episodes(env, job.task, job.name, deliveries=many, first_seed=first))
        arrays: dict[str, Any] = {
            "observations": np.concatenate([one["observations"][:-1] for one in episodes]),
            "actions": np.concatenate([one["actions"] for one in episodes]),
            "returns": np.concatenate(
                [np.full(len(one["rewards"]), np.sum(one["rewards"])) for one in episodes]
            ),
        }
        singles: dict[str, Any] = {name: v.astype(np.float32) for name, v in arrays.items()}
        with atomic_path(path) as draft, draft.open("wb") as file:
            np.savez_compressed(file, **singles)
    return path


def train(job: Job) -> str:
    """Train a model, save it, and measure the saved one."""
    algorithm, task, path = ALGORITHMS[job.name], TASKS[job.task], job.folder / "model.zip"
    if not path.exists():
        steps = int(job.share * algorithm.steps[task.metric == "points"])
        model, curve = _model(algorithm, task, job.number), job.folder / "curve.csv"
        if algorithm.name == "BC":
            steps = clone(model, job)
        else:
            curve.unlink(missing_ok=True)
            model.learn(steps, callback=Curve(curve, steps // POINTS))
        configuration = {
            "algorithm": asdict(algorithm),
            "steps": steps,
            "seed": job.number,
            "options": dict(practice_options(task)),
            "versions": _versions(),
        }
        write_json(job.folder / "config.json", configuration)
        save_weights(model, path)
    ends = task.metric == "points" and algorithm.tier in ("", "expert")
    return _measured(job, str(path), ENDS if ends else [task.name])


def _versions() -> dict[str, str]:
    import numba
    import scipy
    import stable_baselines3
    import torch

    packages = (gymnasium, numba, np, scipy, stable_baselines3, torch)
    return {
        "python": platform.python_version(),
        **{package.__name__: str(package.__version__) for package in packages},
    }


def _model(algorithm: Algorithm, task: BenchmarkTask, seed: int) -> Any:
    """Return an untrained model; its observations are normalised by `observations_of`."""
    import stable_baselines3
    import torch

    from agents.learning.configuration import schedule_of
    from agents.learning.normalisation import ObservationNormaliser
    from curling_env.envs.stable_baselines import CurlingVecEnv

    torch.set_num_threads(1)
    envs = environments(task, algorithm.num_envs[task.metric == "points"], algorithm.actions)
    seen = observations_of(task, seed)
    policy: dict[str, Any] = {"features_extractor_class": ObservationNormaliser}
    one: Any = gymnasium.make(task.environment, **practice_options(task)).unwrapped
    names: list[str] = one.observation.names
    shown = np.array([not (algorithm.blind and STONES.search(name)) for name in names])
    policy["features_extractor_kwargs"] = {"mean": seen.mean(0), "deviation": shown * seen.std(0)}
    policy["net_arch"] = [64, 64]
    kind: Any = "PPO" if algorithm.name == "BC" else algorithm.name
    if kind == "PPO":
        policy["log_std_init"] = -1.0
    if kind == "MaskablePPO":
        import sb3_contrib as package  # pyright: ignore[reportMissingImports]
    elif kind == "MaskedDQN":
        from learn import masked_dqn as package
    else:
        package = stable_baselines3
    model = getattr(package, kind)(
        "MlpPolicy",
        CurlingVecEnv(envs, seed=100_000 * (seed + 1), info_keywords=("action_mask",)),
        seed=seed,
        device="cpu",
        policy_kwargs=policy,
        **{name: schedule_of(value) for name, value in algorithm.settings.items()},
    )
    if algorithm.blind and algorithm.actions == "shots":
        at_stones = [shot.stone >= 0 for shot in SHOTS]
        with torch.no_grad():
            model.policy.action_net.bias[at_stones] = NEVER
    return model


def observations_of(task: BenchmarkTask, seed: int) -> Any:
    """Return observations of a task, which define the normalisation of learners, (n, size).

    Those of resets, and in ends those after random shots as well: stones lie there only later.
    """
    ends, rng = task.metric == "points", np.random.default_rng(seed)
    envs = environments(task, 64, "shots") if ends else environments(task, 256)
    seen: list[Any] = []
    for k in range(4 if ends else 16):
        now, info = envs.reset(seed=10_000 * (seed + 1) + 300 * k)
        seen.append(now)
        for _ in range(7 * ends):
            masks = info["action_mask"]
            now, *_, info = envs.step((masks * rng.random(masks.shape)).argmax(axis=1))
            seen.append(now)
    return np.concatenate(seen)


def save_weights(model: Any, path: Path) -> None:
    """Save a model without its optimisers, with weights in half precision."""
    import torch

    state = ["_last_obs", "_last_original_obs", "ep_info_buffer", "ep_success_buffer"]
    whole, half = BytesIO(), BytesIO()
    model.save(whole, exclude=state)
    torch.save({name: one.half() for name, one in model.policy.state_dict().items()}, half)
    with (
        atomic_path(path) as draft,
        ZipFile(whole) as given,
        ZipFile(draft, "w", ZIP_DEFLATED) as kept,
    ):
        for name in given.namelist():
            if name == "policy.pth" or not name.endswith(".pth"):
                kept.writestr(name, half.getvalue() if name == "policy.pth" else given.read(name))


def Curve(path: Path, every: int) -> Any:
    """Return a callback that regularly writes the mean reward of the last thousand episodes."""
    from stable_baselines3.common.callbacks import BaseCallback

    class Written(BaseCallback):
        def _on_step(self) -> bool:
            ended: Any = self.model.ep_info_buffer
            if ended and self.num_timesteps // every > self._points:
                self._points = self.num_timesteps // every
                with path.open("a", newline="") as file:
                    mean = float(np.mean([one["r"] for one in ended]))
                    csv.writer(file).writerow([self.num_timesteps, round(mean, 4)])
            return True

        _points = 0

    return Written()


def clone(model: Any, job: Job) -> int:
    """Clone recorded deliveries by maximum likelihood, and return their number."""
    import torch

    algorithm = ALGORITHMS[job.name]
    chunks = [Job("record", algorithm.tier, job.task, k, job.share) for k in range(CHUNKS)]
    files = [np.load(recorded(chunk)) for chunk in chunks]
    given = {
        name: np.concatenate([file[name] for file in files])
        for name in ("observations", "actions", "returns")
    }
    some = given["returns"] >= np.quantile(given["returns"], 1 - algorithm.best)
    policy, batch = model.policy, 256
    optimiser = torch.optim.Adam(policy.parameters(), lr=1e-3)
    seen, done = (torch.as_tensor(given[name][some]) for name in ("observations", "actions"))
    for _ in range(max(40 * len(seen) // batch, CLONING_STEPS)):
        rows = torch.randint(len(seen), (batch,))
        _, likelihood, _ = policy.evaluate_actions(seen[rows], done[rows])
        optimiser.zero_grad()
        (-likelihood.mean()).backward()
        optimiser.step()
    return len(seen)


def jobs_of(names: list[str], tasks: list[str] | None, share: float) -> list[Job]:
    """Return the jobs in order: recordings, measures, then trainings by seed."""
    chosen = {name: ALGORITHMS[name] for name in names if name in ALGORITHMS}
    jobs = [
        Job("record", algorithm.tier, task, chunk, share)
        for chunk in range(CHUNKS)
        for algorithm in chosen.values()
        for task in algorithm.tasks
        if algorithm.tier
    ]
    jobs += [
        Job("measure", name, task.name)
        for name in names
        if name not in ALGORITHMS
        for task in TASKS.values()
        if can_do(name, task)
    ]
    jobs += [
        Job("train", name, task, seed, share)
        for seed in range(SEEDS)
        for name, algorithm in chosen.items()
        for task in algorithm.tasks
    ]
    return [one for one in dict.fromkeys(jobs) if tasks is None or one.task in tasks]


def run(names: list[str], tasks: list[str] | None, share: float, workers: str) -> None:
    """Do the jobs without a result, and write the rows."""
    with executor(workers) as crew:
        for words in crew.map(run_job, jobs_of(names, tasks, share)):
            print(words, flush=True)
    for name in names:
        write_rows(name)


def write_rows(name: str) -> None:
    """Write the row of a policy or algorithm; other tasks stay as in the released row."""
    stem, found = name.replace(":", "-"), dict[str, list[Any]]()
    released = Path(RELEASED) / f"{stem}.json"
    kept = read_row(released).scores if released.exists() else []
    for path in sorted((FOLDER / stem).glob("*/*/values.json")):
        for task, values in json.loads(path.read_text()).items():
            found.setdefault(task, []).append(np.array(values))
    found = {score.task: [np.array(run) for run in score.runs] for score in kept} | found
    method = str(ALGORITHMS.get(name, ""))
    ordered = {task: found[task] for task in TASKS if task in found}
    write_row(FOLDER / f"{stem}.json", name, ordered, method=method, link=RELEASED * bool(method))


# --- tables and what is released ------------------------------------------------------------------

RELEASED = "docs/baselines"
KEPT_POINTS = 20
"""Points of each released curve."""
TRAINED = ("ppo", "sac", "maskable-ppo", "dqn")


def table() -> None:
    """Print the released rows and those in runs as Markdown tables."""
    released = Path(RELEASED).glob("[!c]*.json"), Path(RELEASED).glob("constant.json")
    files = {path.stem: path for some in (*released, FOLDER.glob("*.json")) for path in some}
    found = {name: read_row(path) for name, path in sorted(files.items())}
    for tasks in (THROWS, [*ENDS, "end-draw", "end-doubles"]):
        print(f"\n| | {' | '.join(f'`{name}`' for name in tasks)} |\n{'|---' * (len(tasks) + 1)}|")
        for name, row in found.items():
            scores = {score.task: score.in_words() for score in scores_of(row)}
            if any(task in scores for task in tasks):
                print(f"| `{name}` | {' | '.join(scores.get(task, '') for task in tasks)} |")
    print("\n| | normalised | tasks |\n|---|---|---|")
    for name, row in found.items():
        mean, low, high = aggregate(row)
        counted = sum(TASKS[score.task].headline for score in row.scores)
        print(f"| `{name}` | {mean:.2f} ({low:.2f} to {high:.2f}) | {counted} |")


def release() -> None:
    """Copy complete rows with the curves, configurations and weights of their trainings. Other rows
    stay unchanged.
    """
    folder = Path(RELEASED)
    (folder / "weights").mkdir(parents=True, exist_ok=True)
    configurations: dict[str, Any] = json.loads((folder / "configurations.json").read_text())
    complete = [path for path in sorted(FOLDER.glob("*.json")) if not shortcomings(read_row(path))]
    found = _released_curves(folder)
    for row in complete:
        shutil.copy(row, folder / row.name)
        for path in sorted(FOLDER.glob(f"{row.stem}/*/0/config.json")):
            task = path.parts[-3]
            configurations.setdefault(row.stem, {})[task] = json.loads(path.read_text())
            weights = folder / "weights" / f"{row.stem}-{task}.zip"
            if ALGORITHMS[row.stem].tier in ("", "expert"):
                shutil.copy(path.with_name("model.zip"), weights)
        for path in sorted(FOLDER.glob(f"{row.stem}/*/*/curve.csv")):
            points = np.loadtxt(path, delimiter=",", ndmin=2)
            few = points[:: -max(len(points) // KEPT_POINTS, 1)][::-1]
            found[row.stem, path.parts[-3], path.parts[-2]] = few
    write_json(folder / "configurations.json", configurations)
    with (folder / "curves.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["algorithm", "task", "seed", "steps", "reward"])
        for key, points in sorted(found.items()):
            writer.writerows((*key, int(step), reward) for step, reward in points.tolist())
    draw_curves(found, folder / "curves.png")


Curves = dict[tuple[str, str, str], Any]
"""Rewards in training by algorithm, task and seed: rows of deliveries and mean reward."""


def _released_curves(folder: Path) -> Curves:
    found: dict[tuple[str, str, str], list[tuple[float, float]]] = {}
    with (folder / "curves.csv").open(newline="") as file:
        for algorithm, task, seed, steps, reward in list(csv.reader(file))[1:]:
            found.setdefault((algorithm, task, seed), []).append((float(steps), float(reward)))
    return {key: np.array(points) for key, points in found.items()}


def draw_curves(found: Curves, path: Path) -> None:
    """Draw the rewards in training: the interquartile mean of the seeds, and their range."""
    from matplotlib.figure import Figure

    tasks = [task for task in TASKS if any(task == key[1] for key in found)]
    figure = Figure(figsize=(11, 5.2), layout="constrained")
    for axes, task in zip(figure.subplots(2, 4).flat, tasks, strict=False):
        for colour, name in enumerate(TRAINED):
            runs = [points for key, points in sorted(found.items()) if key[:2] == (name, task)]
            if runs:
                many = min(map(len, runs))
                steps, rewards = (np.array([one[-many:, k] for one in runs]) for k in (0, 1))
                drawn = {"color": f"C{colour}"}
                axes.fill_between(
                    steps[0], rewards.min(0), rewards.max(0), alpha=0.2, lw=0, **drawn
                )
                axes.plot(steps[0], trim_mean(rewards, TRIMMED), label=name, **drawn)
        for level, style in zip(TASKS[task].reference_returns, (":", "--"), strict=True):
            axes.axhline(level, color="0.5", lw=0.8, ls=style)
        axes.set_title(task, fontsize=10)
        axes.set_xscale("log")
        axes.legend(fontsize=7)
    figure.supxlabel("deliveries", fontsize=9)
    figure.supylabel("mean reward of an episode in training", fontsize=9)
    figure.savefig(path, dpi=80)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("what", choices=["constants", "run", "table", "release"])
    parser.add_argument("names", nargs="*", help="policies and algorithms")
    parser.add_argument("--task", action="append", help="task; repeatable; default: all")
    parser.add_argument("--share", type=float, default=1.0, help="of the steps, for a trial")
    parser.add_argument("--workers", default="1", help="processes, or 'ray'")
    given = parser.parse_args()
    chosen: dict[str, Callable[[], None]] = {
        "constants": constants,
        "run": lambda: run(given.names, given.task, given.share, given.workers),
        "table": table,
        "release": release,
    }
    chosen[given.what]()


if __name__ == "__main__":
    main()
