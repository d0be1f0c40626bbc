"""Game on ice: the rules joined with the physics, changing ice, and the players.

- `simulator`: one throw after another: execution error, sweeping, physics, ruling, wear
- `state`: the complete, immutable state of a game, from which a search can branch; the random
  numbers of every throw
- `ice_evolution`: changes of the ice during a game: wear along the paths, frost, unequal stones
- `team_judgement`: a team's reading of the ice, and its default sweeping
- `players`: views and decisions of players, and their lookup by name
- `opponents`: the built-in players
"""

from __future__ import annotations

from curling_env.game.ice_evolution import NO_EVOLUTION, TYPICAL_EVOLUTION, IceEvolution
from curling_env.game.players import Call, Player, PlayerView, player_named
from curling_env.game.simulator import GameSimulator, PlayedShot
from curling_env.game.state import GameState
from curling_env.infrastructure.lazy_names import lazy_names

__all__ = [
    "NO_EVOLUTION",
    "TYPICAL_EVOLUTION",
    "Call",
    "GameSimulator",
    "GameState",
    "IceEvolution",
    "PlayedShot",
    "Player",
    "PlayerView",
    "player_named",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "ice_evolution": ("ice_for_game",),
        "opponents": ("DrawPlayer", "RuleBasedPlayer"),
        "players": ("PLAYER_GROUP", "player_names"),
        "rules": (
            "End",
            "Fault",
            "Game",
            "Lines",
            "RULE_SETS",
            "RestingStone",
            "Result",
            "RuleSet",
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
        ),
        "rules.game": ("stones_left",),
        "rules.scoring": ("hammer_after", "points_of"),
        "simulator": ("direction_of",),
        "state": ("ThrowRng",),
        "skill_file": ("load_skill", "save_skill"),
        "team_judgement": ("PERFECT_JUDGEMENT", "TeamJudgement", "sweep_for"),
    },
)
