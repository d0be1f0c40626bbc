"""Planning: from a target or a task to a throw, by search over simulated throws.

- `planner`: `plan_throw`, for a stone that should rest at a target or for a task
- `objective`: the objective of a throw, and the judgement of its outcome
- `target_search`: throws that come to rest at a target
- `reward_map`: promising throws for a task, by a grid and the cross-entropy method
- `monte_carlo`: a throw repeated with execution errors, on ices sampled within the standard errors
- `rollouts`: many throws in the batch engine
- `description`, `plan_figure`: a plan in a curler's words and as a picture
- `tuning`: tuned constants
"""

from agents.planning.planner import Plan, PlannedThrow, plan_throw
from curling_env.infrastructure.lazy_names import lazy_names

__all__ = ["Plan", "PlannedThrow", "plan_throw"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "description": ("describe", "handles"),
        "monte_carlo": ("run_trials",),
        "objective": ("RestAtTarget",),
        "plan_figure": ("draw_plan",),
        "rollouts": ("roll_out",),
        "stones_file": ("read_stones",),
        "target_search": ("find_throws",),
    },
)
