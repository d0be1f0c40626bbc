"""Planning: from a target or a task to a throw, by search over simulated throws."""

from agents.planning.planner import Choice, Plan, plan, plan_task

__all__ = ["Choice", "Plan", "plan", "plan_task"]
