"""Ten fixed tasks with fixed seeds, for comparable results.

- `tasks`: the aim, the ices and the metric of each task
- `contestants`: the contestants: players, the planner, trained models, functions
- `scores`: the measurement, with an interval
- `rows`: a row as one JSON file, which is checked
- `ices`: the hundred ices, as a file with a checked digest
- `datasets`: offline datasets of the tasks, in tiers
"""

from agents.benchmark.scores import Difference, Score, difference_of, measure, played, score_of
from agents.benchmark.tasks import TASKS, BenchmarkTask, make
from curling_env.infrastructure.lazy_names import lazy_names

__all__ = [
    "TASKS",
    "BenchmarkTask",
    "Difference",
    "Score",
    "difference_of",
    "make",
    "measure",
    "played",
    "score_of",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "contestants": ("contestant",),
    },
)
