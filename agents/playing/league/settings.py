"""Settings of a league, as in a configuration file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from agents.playing.league.tuning import NETWORK_WIDTHS, REPEATED_SHOTS, SIMULATED_SHOTS
from agents.playing.search.networks import NETWORKS
from curling_env.errors import InputError
from curling_env.game.rules import rule_set
from curling_env.throw import delivery_named, skill_named


@dataclass(frozen=True, kw_only=True)
class LeagueSettings:
    """Settings of opponents, number of ends, and learning.

    Parameters
    ----------
    generations : number of ends that each generation plays
    past : share of the ends against earlier generations
    tried : number of shots simulated before each delivery
    layers : units of the hidden layers: two for a stone, two for the position
    epochs : passes through the played ends
    learning_rate : highest learning rate of the schedule
    ice : file or preset to play on
    skill : skill of all players
    rules, delivery : names of the rules, and of the start of throws
    various : let players of many skills play, and most ends begin with random throws, so that the
        network also values positions that other players leave
    begin : network of the package to begin with, see `networks.NETWORKS`; None for a heuristic
    seed : seed of all randomness

    Raises
    ------
    InputError : an invalid setting
    """

    generations: tuple[int, ...] = (512, 768, 1536)
    past: float = 0.5
    tried: int = SIMULATED_SHOTS
    layers: tuple[int, int, int, int] = NETWORK_WIDTHS
    epochs: int = 8
    learning_rate: float = 3e-3
    ice: str = "standard"
    skill: str = "elite"
    rules: str = "world_curling_2024"
    delivery: str = "hog-line"
    various: bool = False
    begin: str | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in (("generations", 1), ("layers", 1)):
            value = getattr(self, name)
            listed = isinstance(value, tuple | list) and 0 < len(value) <= 100
            if not listed or not all(_is_whole(n, least, _MOST[name]) for n in value):
                raise InputError(
                    f"{name} must list whole numbers from {least} to {_MOST[name]}, got "
                    f"{str(value)[:60]}"
                )
        if len(self.layers) != 4:
            raise InputError(f"layers must be four, got {len(self.layers)}")
        for name in ("past", "learning_rate"):
            value = getattr(self, name)
            if not isinstance(value, int | float) or not 0 <= value <= 1:
                raise InputError(f"{name} must be between 0 and 1, got {str(value)[:40]}")
        good = _is_whole(self.tried, REPEATED_SHOTS, 10**6) and _is_whole(self.epochs, 1, 10**4)
        if not (good and 0 < self.learning_rate < 1 and _is_whole(self.seed, 0, 2**32 - 1)):
            raise InputError(
                f"tried must be a whole number of at least {REPEATED_SHOTS}, epochs of at least "
                "1, seed of at least 0, and learning_rate between 0 and 1"
            )
        if not isinstance(self.various, bool):
            raise InputError(f"various must be true or false, got {str(self.various)[:40]}")
        known = [None, *(network.name for network in NETWORKS)]
        if self.begin not in known:
            raise InputError(f"begin must be one of {', '.join(map(str, known[1:]))}")
        for name in ("ice", "skill", "rules", "delivery"):
            if not isinstance(getattr(self, name), str):
                raise InputError(f"{name} must be a name, got {str(getattr(self, name))[:40]}")
        skill_named(self.skill)
        rule_set(self.rules)
        delivery_named(self.delivery)


_MOST = {"generations": 10**7, "layers": 8192}


def _is_whole(value: Any, least: int, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most


def league_settings(document: dict[str, Any], **others: Any) -> LeagueSettings:
    """Read settings from the mapping in a configuration file.

    Parameters
    ----------
    document : content of the file
    others : settings that replace those of the file

    Raises
    ------
    InputError : an unknown key, or an invalid value
    """
    if not isinstance(document, dict) or not all(isinstance(key, str) for key in document):
        raise InputError("expected settings by name")
    given = {**document, **others}
    given.pop("algorithm", None)
    known = [f.name for f in fields(LeagueSettings)]
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise InputError(
            f"unknown key {unknown[0]!r} in a league; expected one of {', '.join(known)}"
        )
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in given.items()
    }
    return LeagueSettings(**values)
