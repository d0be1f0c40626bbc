"""Planning: from a target to a throw, by search over simulated throws."""

from agents.planning.planner import Choice, Plan, plan

__all__ = ["Choice", "Plan", "plan"]
