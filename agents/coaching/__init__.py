"""Coaching: what a coach asks of an evening's throws, as pure functions from tracks to tables.

- `calls`: what was called, as a coach types it (`read_call`)
- `throw_sheet`: each throw's numbers with who threw it and what was called (`throw_table`)
- `hand_or_ice`: why throws missed; `causes` holds what it tells
- `released`, `intended`, `habits`: the throw that was made, and the one that was meant
- `runs`, `session_ice`: throws run on ices, and the ice before each of them
- `tuning`: the constants that were chosen
"""

from agents.coaching.calls import Call, read_call
from agents.coaching.causes import Part, Pattern, SessionCauses, ThrowCauses
from agents.coaching.hand_or_ice import hand_or_ice
from agents.coaching.throw_sheet import ThrowSheet, throw_table

__all__ = [
    "Call",
    "Part",
    "Pattern",
    "SessionCauses",
    "ThrowCauses",
    "ThrowSheet",
    "hand_or_ice",
    "read_call",
    "throw_table",
]
