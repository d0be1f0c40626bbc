"""Coaching: what a coach asks of an evening's throws, as pure functions from tracks to tables.

- `calls`: what was called, as a coach types it (`read_call`)
- `throw_sheet`: each throw's numbers with who threw it and what was called (`throw_table`)
"""

from agents.coaching.calls import Call, read_call
from agents.coaching.throw_sheet import ThrowSheet, throw_table

__all__ = ["Call", "ThrowSheet", "read_call", "throw_table"]
