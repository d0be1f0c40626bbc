"""Rules of curling: pure functions over small immutable states, without physics or ice.

Everything is in the delivery frame: origin at the playing tee, +y along the direction of play. So a
rule reads the same in every end. The near hog line, where stones are thrown from, plays no part.

- `lines`: contact of a stone with house, hog line, side and back lines, the free guard zone
- `teams`: the two teams, and their stones on the sheet
- `rulesets`: the named, dated sets of rules; in mixed doubles, the stones placed before an end
- `delivery`: the ruling on a delivered stone; stones protected early in an end
- `scoring`: measuring, counting, and the next hammer
- `game`: an end and a game, from the first stone to the last
"""

from __future__ import annotations

from curling_env.game.rules.delivery import Fault, Result, Ruling, rule_on
from curling_env.game.rules.game import (
    End,
    Game,
    begin_end,
    concede,
    deliver,
    may_concede,
    new_game,
)
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import RULE_SETS, RuleSet, rule_set
from curling_env.game.rules.scoring import count, score_of, shot_order
from curling_env.game.rules.teams import RestingStone, Team

__all__ = [
    "RULE_SETS",
    "End",
    "Fault",
    "Game",
    "Lines",
    "RestingStone",
    "Result",
    "RuleSet",
    "Ruling",
    "Team",
    "begin_end",
    "concede",
    "count",
    "deliver",
    "may_concede",
    "new_game",
    "rule_on",
    "rule_set",
    "score_of",
    "shot_order",
]
