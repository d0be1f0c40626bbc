"""Agents: planning a throw, learning to throw, and playing games.

`plan_throw` finds the throw for a target or a task, `train` trains a policy, and `evaluate`
compares a trained policy with the planner. Dependencies are imported at first use, so that
importing this package does not import PyTorch.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from agents.learning.evaluation import evaluate
    from agents.learning.policy import TrainedPolicy
    from agents.learning.training import train
    from agents.planning.planned_throw import Plan
    from agents.planning.planner import plan_throw

__all__ = ["Plan", "TrainedPolicy", "evaluate", "plan_throw", "train"]

_MODULES = {
    "Plan": "planning.planned_throw",
    "TrainedPolicy": "learning.policy",
    "evaluate": "learning.evaluation",
    "plan_throw": "planning.planner",
    "train": "learning.training",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
