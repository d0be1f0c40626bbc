"""Conditions of games that have a name: who plays, what they call for, and one change at a time."""

from __future__ import annotations

from dataclasses import replace

from agents.playing.ends.play import Conditions
from agents.playing.search import CallingStyle
from curling_env.game.team_judgement import TeamJudgement
from curling_env.throw import SKILLS, Skill

BY_THE_ODDS = Conditions()
"""`search` with the hands of `champion` and nothing else: what is compared with championships."""


CHAMPIONSHIP = replace(
    BY_THE_ODDS,
    skill="championship",
    judgement=TeamJudgement(weight=0.005, curl=0.04, sweep=0.3),
    calls=CallingStyle(
        blank_cost=0.005,
        single_cost=0.008,
        opening_guards=2,
        source="fitted to the published ends",
    ),
)
"""Hands, judgement and calls under which ends are scored as in championships: all were fitted."""


def _champion(speed: float = 1.0, line: float = 1.0, **others: float) -> Skill:
    """The hand of `champion` with so many times its errors."""
    hand = SKILLS["champion"]
    return replace(
        hand,
        name="champion, changed",
        sigma_speed=speed * hand.sigma_speed,
        sigma_angle=line * hand.sigma_angle,
        **others,
    )


FORMER_FIT = "championship, the former fit"
"""As championships, before single points had a cost and curl was read worse."""
_FORMER = replace(
    CHAMPIONSHIP,
    judgement=TeamJudgement(weight=0.005, curl=0.02, sweep=0.3),
    calls=CallingStyle(blank_cost=0.005, opening_guards=2, source="fitted to the published ends"),
)
_EVOLUTION = BY_THE_ODDS.evolution
_GUARDS = replace(BY_THE_ODDS, calls=CallingStyle(opening_guards=1))
FACTORS: dict[str, Conditions] = {
    "search:600": replace(BY_THE_ODDS, budget=600),
    "hands: exact": replace(BY_THE_ODDS, skill="none"),
    "hands: elite": replace(BY_THE_ODDS, skill="elite"),
    "hands: club": replace(BY_THE_ODDS, skill="club"),
    "calls: ends open with guards": _GUARDS,
    "calls: a blank costs 5 %": replace(BY_THE_ODDS, calls=CallingStyle(blank_cost=0.05)),
    "weight: errors twice as large": replace(BY_THE_ODDS, skill=_champion(2.0)),
    "line: errors 1.5 times as large": replace(BY_THE_ODDS, skill=_champion(1.0, 1.5)),
    "tails: 3 degrees of freedom": replace(BY_THE_ODDS, skill=_champion(tails=3.0)),
    "sweepers: 0.5 m wrong": replace(BY_THE_ODDS, judgement=TeamJudgement(sweep=0.5)),
    "ice: friction read 1.5 % wrong": replace(BY_THE_ODDS, judgement=TeamJudgement(weight=0.015)),
    "ice: curl read 10 % wrong": replace(BY_THE_ODDS, judgement=TeamJudgement(curl=0.1)),
    "no sweeping": replace(BY_THE_ODDS, sweeping=False),
    "weight and line: correlation 0.7": replace(BY_THE_ODDS, skill=_champion(correlation=0.7)),
    "hits: errors 1.5 times as large": replace(BY_THE_ODDS, hit_factor=1.5),
    "one turn: errors 1.5 times as large": replace(BY_THE_ODDS, turn_factor=1.5),
    "stones: 2 % apart": replace(BY_THE_ODDS, evolution=replace(_EVOLUTION, stone_spread=0.02)),
    "the former fit by the four-rock rule": replace(_FORMER, free_guard_until=4, no_tick=False),
    "guards, weight 2": replace(_GUARDS, skill=_champion(2.0)),
    "guards, weight 2.3, line 0.8": replace(_GUARDS, skill=_champion(2.3, 0.8)),
    "two guards, weight 2.3, line 0.8": replace(
        _GUARDS, skill=_champion(2.3, 0.8), calls=CallingStyle(opening_guards=2)
    ),
    "guards, weight 2.3, line 0.9, tails 4": replace(_GUARDS, skill=_champion(2.3, 0.9, tails=4.0)),
    FORMER_FIT: _FORMER,
    "the former fit with a blank that costs 2 %": replace(
        _FORMER, calls=CallingStyle(blank_cost=0.02, opening_guards=2)
    ),
    "the former fit, bolder calls for two": replace(
        _FORMER, calls=replace(_FORMER.calls, blank_cost=0.008, single_cost=0.015)
    ),
    "guards, weight 1.5, judgement": replace(
        _GUARDS,
        skill=_champion(1.5),
        judgement=TeamJudgement(weight=0.01, curl=0.05, sweep=0.5),
    ),
}
"""One change at a time against `BY_THE_ODDS`, and steps of the fit from there."""
