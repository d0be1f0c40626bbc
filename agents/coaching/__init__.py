"""Coaching: what a coach asks of an evening's throws, as pure functions from tracks to tables.

- `calls`: what was called, as a coach types it (`read_call`)
- `throw_sheet`: each throw's numbers with who threw it and what was called (`throw_table`)
- `hand_or_ice`: why throws missed; `causes` holds what it tells
- `athletes`: bias and spread of an athlete's throws, over sessions (`athlete_errors`)
- `stones`: which stones run and curl alike (`match_stones`)
- `seen_throws`, `released`: the throw that was made; `intended`, `habits`: the one that was meant
- `throw_parts`: what each cause adds to a miss
- `runs`, `session_ice`, `shared_ice`: throws run on ices, the ice before each of them, and what all
  of them show of it
- `tuning`: the constants that were chosen
"""

from agents.coaching.athletes import AthleteErrors, ErrorSummary, athlete_errors
from agents.coaching.calls import Call, read_call
from agents.coaching.misses.causes import Part, Pattern, SessionCauses, ThrowCauses
from agents.coaching.misses.hand_or_ice import hand_or_ice
from agents.coaching.stones import StoneFactor, StoneMatch, StonePair, match_stones
from agents.coaching.throw_sheet import ThrowSheet, throw_table
from curling_env.infrastructure.lazy_names import lazy_names

__all__ = [
    "AthleteErrors",
    "Call",
    "ErrorSummary",
    "Part",
    "Pattern",
    "SessionCauses",
    "StoneFactor",
    "StoneMatch",
    "StonePair",
    "ThrowCauses",
    "ThrowSheet",
    "athlete_errors",
    "hand_or_ice",
    "match_stones",
    "read_call",
    "throw_table",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "calls": ("PLACES",),
        "figures.stones_figure": ("draw_stones",),
        "lane_draws": ("LANES",),
        "misses.causes": ("CAUSES", "HandError"),
        "misses.intended": ("intend",),
        "misses.released": ("read_release",),
        "runs": ("Place", "rests"),
        "throw_sheet": ("sheet_rows", "spin_sign"),
    },
)
