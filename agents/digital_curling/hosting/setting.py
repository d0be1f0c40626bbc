"""What a hosted game is played with."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from agents.digital_curling.conversation import PlayerMessage
from agents.digital_curling.conversion import rules_of, skill_of
from agents.digital_curling.messages import TEAMS, SettingMessage
from curling_env.errors import InputError
from curling_env.game import NO_EVOLUTION, GameSimulator, IceEvolution
from curling_env.game.rules import RuleSet
from curling_env.ice import Ice
from curling_env.throw import FROM_HACK, MAX_SPEED, SKILLS, Skill, skill_named

THROWERS = 4
"""Players of a team."""
Order = tuple[int, ...]
"""Who of a team's players is lead, second, third and fourth."""


@dataclass(frozen=True, kw_only=True)
class HostSetting:
    """What a game is played with.

    Parameters
    ----------
    ice : the ice when the game begins
    ice_name : its name or file, for the record
    rule_name : name of the rules
    arrangement : of the placed stones, in mixed doubles
    ends : scheduled ends
    five_rock : whether guards are protected for five stones, else for four
    thinking_time, extra_time : clock of each team for the game, and for each extra end [s]
    throwers : execution errors of the four players of team 0 and of team 1; in mixed doubles, the
        first two play
    max_speed : the fastest throw that a player may mean [m/s]
    announced : name of the physics that clients are told
    send_trajectory : whether clients are told the paths of each shot
    ice_evolution : how the ice changes during the game
    sweeping : whether stones that are light are swept, as the host's sweepers judge
    seed : seed of everything random

    Raises
    ------
    InputError : rules, clocks, throwers or speeds with which no game can be played
    """

    ice: Ice
    ice_name: str = "fcv1"
    rule_name: str = "digital_curling"
    arrangement: int = 0
    ends: int = 8
    five_rock: bool = True
    thinking_time: float = 600.0
    extra_time: float = 60.0
    throwers: tuple[tuple[Skill, ...], tuple[Skill, ...]] = (
        (SKILLS["digital-curling"],) * THROWERS,
        (SKILLS["digital-curling"],) * THROWERS,
    )
    max_speed: float = 4.0
    announced: str = "fcv1"
    send_trajectory: bool = False
    ice_evolution: IceEvolution = NO_EVOLUTION
    sweeping: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        if not (0 < self.thinking_time < 1e6 and 0 < self.extra_time < 1e6):
            raise InputError("a clock has more than 0 s and less than 1,000,000 s")
        if any(len(team) != THROWERS for team in self.throwers):
            raise InputError(f"a team has {THROWERS} throwers")
        rules = self.rules
        if not (rules.placed_stones or rules.stones == 2 * THROWERS):
            raise InputError(f"games with {rules.name} are not hosted")
        if not 0 < self.max_speed <= MAX_SPEED:
            raise InputError(f"a greatest speed lies above 0 and up to {MAX_SPEED} m/s")

    @property
    def rules(self) -> RuleSet:
        """The rules of the game."""
        told = SettingMessage(max_end=self.ends, five_rock_rule=self.five_rock)
        return rules_of(told, name=self.rule_name, arrangement=self.arrangement)

    @property
    def is_doubles(self) -> bool:
        """Whether mixed doubles are played."""
        return self.rules.placed_stones

    @property
    def players(self) -> dict[str, list[dict[str, Any]]]:
        """The players of both teams in Digital Curling's form."""
        return {
            name: [
                {
                    "type": "normal_dist",
                    "max_speed": self.max_speed,
                    "stddev_speed": skill.sigma_speed,
                    "stddev_angle": skill.sigma_angle,
                    # Clients of the competition's library look for these; a seed is not told.
                    "seed": None,
                    "randomize_hand": False,
                }
                for skill in team
            ]
            for name, team in zip(TEAMS, self.throwers, strict=True)
        }

    @property
    def told(self) -> dict[str, Any]:
        """The `game` of `is_ready`."""
        per_team = dict.fromkeys(TEAMS, self.thinking_time)
        return {
            "rule": "normal",
            "setting": {
                "max_end": self.ends,
                "sheet_width": self.ice.sheet.width,
                "five_rock_rule": self.five_rock,
                "thinking_time": per_team,
                "extra_end_thinking_time": dict.fromkeys(TEAMS, self.extra_time),
            },
            "simulator": {"type": self.announced, "seconds_per_frame": 0.001},
            "players": self.players,
        }

    def simulator(self, orders: tuple[Order, Order]) -> GameSimulator:
        """The simulator of the game, with the throwers in the order that the teams chose."""
        rules = self.rules
        by_stone = [
            [
                skill_of(PlayerMessage(stddev_speed=s.sigma_speed, stddev_angle=s.sigma_angle))
                for k in (rules.throwers if rules.placed_stones else np.repeat(order, 2))
                for s in (team[k],)
            ]
            for team, order in zip(self.throwers, orders, strict=True)
        ]
        return GameSimulator(
            self.ice,
            rules=rules,
            skills=(self.throwers[0][0], self.throwers[1][0]),
            throwers=(by_stone[0], by_stone[1]),
            ice_evolution=self.ice_evolution,
            sweeping=self.sweeping,
            delivery=replace(FROM_HACK, max_speed=self.max_speed),
        )


def throwers_from(text: str) -> tuple[Skill, ...]:
    """The execution errors of a team's four players, as they are given on a command line.

    Parameters
    ----------
    text : the name of a skill or ``SPEED:ANGLE`` [m/s, rad], once for all or four times with commas

    Raises
    ------
    InputError : another number of players, or an error that is none
    """
    given = [_thrower(part.strip()) for part in text.split(",")]
    if len(given) == 1:
        given *= THROWERS
    if len(given) != THROWERS:
        raise InputError(f"expected the errors of 1 or {THROWERS} players, got {len(given)}")
    return tuple(given)


def _thrower(text: str) -> Skill:
    speed, colon, angle = text.partition(":")
    if not colon:
        return skill_named(text)
    try:
        skill = Skill(name=text, sigma_speed=float(speed), sigma_angle=float(angle))
    except ValueError as error:
        raise InputError(
            f"an execution error is a name or SPEED:ANGLE, such as 0.0076:0.0018, got {text[:40]!r}"
        ) from error
    if skill.sigma_speed > 1 or skill.sigma_angle > 1:
        raise InputError(f"no player errs by {text[:40]} m/s and rad")
    return skill
