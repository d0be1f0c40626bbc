"""Coaching analysis of an evening's throws, as pure functions from tracks to tables.

- `calls`: called shots in a coach's notation (`read_call`)
- `throw_sheet`: each throw's numbers with its athlete and call (`throw_table`)
- `hand_or_ice`: causes of misses; `causes` has its results
- `athletes`: bias and spread of an athlete's throws, over sessions (`athlete_errors`)
- `stones`: stones that run and curl alike (`match_stones`)
- `seen_throws`, `released`: the actual throw; `intended`: the intended one, and habits
- `throw_parts`: the contribution of each cause to a miss
- `draw_weight`, `measured_ice`: draws down the centre line, compared; curl and weight as draws show
  them; `scores`: points of drills
- `runs`, `ices`: throws simulated on ices; the ice before each of them, corrected by all of them
- `coaching_figures`: pictures of the results
- `tuning`: chosen constants
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
        "coaching_figures": ("draw_stones",),
        "lane_draws": ("LANES",),
        "misses.causes": ("CAUSES", "HandError"),
        "misses.intended": ("intend",),
        "misses.released": ("read_release",),
        "runs": ("Place", "rests"),
        "throw_sheet": ("sheet_rows", "spin_sign"),
    },
)
