"""Row of the benchmark as one JSON file: the policy, and the metric of every episode."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from scipy.stats import trim_mean

from agents.benchmark.scores import TRIMMED, Score, interval_of, resampled_runs, score_of
from agents.benchmark.tasks import TASKS, VERSION, BenchmarkTask, task_of
from curling_env.errors import InputError, placed
from curling_env.infrastructure.files.reading import read_json
from curling_env.infrastructure.files.schema import Document, FileFormat, Short, Text, checked
from curling_env.infrastructure.files.storage import write_json
from curling_env.typing import Floats

ROW_FORMAT = FileFormat(name="curling-benchmark/1", what="a row of the benchmark")
LEAST_EPISODES = 100
"""Minimum number of episodes of each run in a published row; the same for all tasks and runs."""
LEAST_RUNS = 5
"""Minimum number of trainings with different seeds in a published row of a learner."""
Values = Annotated[list[float], msgspec.Meta(min_length=2, max_length=10**6)]


class TaskDocument(Document, kw_only=True):
    """Results in one task.

    Parameters
    ----------
    task : its name
    runs : for each training, or the only one, what counted in each episode
    """

    task: Short
    runs: Annotated[list[Values], msgspec.Meta(min_length=1, max_length=1000)]


class RowDocument(Document, kw_only=True):
    """A row.

    Parameters
    ----------
    format : see `ROW_FORMAT`
    version : version of the benchmark
    policy : name of the method
    learnt : whether it was trained
    method : how it was made, in a few words: algorithm, steps, ices, hands
    link : where its configuration, curves and weights are
    scores : tasks in any order
    """

    format: Short
    version: int
    policy: Short
    learnt: bool = False
    method: Text = ""
    link: Text = ""
    scores: Annotated[list[TaskDocument], msgspec.Meta(min_length=1, max_length=100)]


def read_row(path: str | Path) -> RowDocument:
    """Read a row.

    Raises
    ------
    InputError : no such file, another version of the benchmark, an unknown task, or values that
        no episode of the task can have
    """
    with placed(source=path):
        row = checked(ROW_FORMAT.accept(read_json(path)), RowDocument)
        if row.version != VERSION:
            raise InputError(
                f"holds scores of version {row.version} of the benchmark; this is {VERSION}"
            )
        for number, score in enumerate(row.scores):
            _check(score, f"scores[{number}]")
        names = [score.task for score in row.scores]
        if len(set(names)) < len(names):
            raise InputError("lists a task twice; expected one score per task")
    return row


def write_row(
    path: str | Path,
    policy: str,
    scores: Mapping[str, Sequence[Floats]],
    *,
    method: str = "",
    link: str = "",
) -> None:
    """Write a row from the results of `played`, run by run, for each task."""
    each = [{"task": name, "runs": [one.tolist() for one in runs]} for name, runs in scores.items()]
    head: dict[str, Any] = {"format": ROW_FORMAT.name, "version": VERSION, "policy": policy}
    learnt = any(len(runs) > 1 for runs in scores.values())
    write_json(path, {**head, "learnt": learnt, "method": method, "link": link, "scores": each})


def scores_of(row: RowDocument) -> list[Score]:
    """Return the scores of a row, in the order of the tasks."""
    runs = {score.task: np.array(score.runs) for score in row.scores}
    return [score_of(TASKS[name], runs[name]) for name in TASKS if name in runs]


def shortcomings(row: RowDocument) -> list[str]:
    """List the reasons why a row cannot be published, in words."""
    found: list[str] = []
    headline = {name for name, task in TASKS.items() if task.headline}
    counts = {len(run) for score in row.scores for run in score.runs}
    if not headline & {score.task for score in row.scores}:
        found.append("no task that counts")
    if len(counts) > 1 or min(counts) < LEAST_EPISODES:
        found.append(f"every run needs the same number of episodes, at least {LEAST_EPISODES}")
    if row.learnt and min(len(score.runs) for score in row.scores) < LEAST_RUNS:
        found.append(f"a learner needs {LEAST_RUNS} trainings for every task")
    if row.learnt and not row.link:
        found.append("a learner needs a link to its configuration, curves and weights")
    return found


def normalised(task: BenchmarkTask, values: Floats) -> Floats:
    """Normalise values: random actions score 0 and the task's reference 1."""
    low, high = task.references
    return (values - low) / (high - low)


def aggregate(row: RowDocument) -> tuple[float, float, float]:
    """Return the interquartile mean over tasks and runs of the normalised scores, and its 95 %
    interval.

    The interval is a stratified bootstrap: runs are resampled within each task, and episodes within
    each run (Agarwal et al. 2021).
    """
    values = [
        normalised(TASKS[score.task], np.array(score.runs))
        for score in row.scores
        if TASKS[score.task].headline
    ]
    if not values:
        raise InputError("no task of this row counts")
    means = np.concatenate([each.mean(axis=1) for each in values])
    drawn = np.concatenate([resampled_runs(each) for each in values], axis=1)
    return float(trim_mean(means, TRIMMED)), *interval_of(drawn)


def _check(score: TaskDocument, where: str) -> None:
    task = task_of(score.task)
    runs = score.runs
    if len({len(run) for run in runs}) > 1:
        raise InputError("runs have different numbers of episodes", where=f"{where}.runs")
    values = np.array(runs)
    good = {
        "success": np.isin(values, (0.0, 1.0)),
        "distance_m": (values >= 0) & (values < 60),
        "points": (np.abs(values) <= 8) & (values == np.rint(values)),
    }[task.metric]
    for run, episode in np.argwhere(~good)[:1].tolist():
        raise InputError(
            f"{values[run, episode]:g} is no {task.metric} of an episode",
            where=f"{where}.runs[{run}][{episode}]",
        )
