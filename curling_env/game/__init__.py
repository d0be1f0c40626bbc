"""A game on ice: the rules joined with the physics, the ice that changes, and those who play.

- `living_ice`: wear along the paths, frost, stones that differ; `luck`: of a game's every throw
- `state`: all that a game is at one moment, frozen, so that a search may branch from it
- `rink`: plays throws: execution error, sweeping, physics, ruling, wear
- `players`: what a player sees, decides, and how players are found by name
"""

from __future__ import annotations

from curling_env.game.living_ice import STILL, USUAL, LivingIce
from curling_env.game.players import Call, Player, View, player_named
from curling_env.game.rink import Rink, Shot
from curling_env.game.state import GameState

__all__ = [
    "STILL",
    "USUAL",
    "Call",
    "GameState",
    "LivingIce",
    "Player",
    "Rink",
    "Shot",
    "View",
    "player_named",
]
