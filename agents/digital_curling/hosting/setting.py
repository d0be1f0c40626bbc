"""Settings of a hosted game."""

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
"""Number of players of a team."""
Order = tuple[int, ...]
"""Lead, second, third and fourth among a team's players."""


@dataclass(frozen=True, kw_only=True)
class HostSetting:
    """Settings of a hosted game.

    Parameters
    ----------
    ice : ice at the start of the game
    ice_name : its name or file, for the record
    rule_name : name of the rules
    arrangement : arrangement of the placed stones, in mixed doubles
    ends : number of scheduled ends
    five_rock : protect guards for five stones, otherwise for four
    thinking_time, extra_time : clock of each team for the game, and for each extra end [s]
    throwers : execution errors of the four players of team 0 and of team 1; in mixed doubles, the
        first two play
    max_speed : maximum speed that a player may intend [m/s]
    announced : name of the physics announced to clients
    send_trajectory : send the paths of each shot to clients
    ice_evolution : change of the ice during the game
    sweeping : let the host's sweepers sweep light stones
    seed : seed of all randomness

    Raises
    ------
    InputError : invalid rules, clocks, throwers or speeds
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
            raise InputError("a clock must have more than 0 s and less than 1,000,000 s")
        if any(len(team) != THROWERS for team in self.throwers):
            raise InputError(f"expected {THROWERS} throwers in a team")
        rules = self.rules
        if not (rules.placed_stones or rules.stones == 2 * THROWERS):
            raise InputError(f"games with {rules.name} cannot be hosted")
        if not 0 < self.max_speed <= MAX_SPEED:
            raise InputError(f"the maximum speed must be above 0 and at most {MAX_SPEED} m/s")

    @property
    def rules(self) -> RuleSet:
        """Rules of the game."""
        message = SettingMessage(max_end=self.ends, five_rock_rule=self.five_rock)
        return rules_of(message, name=self.rule_name, arrangement=self.arrangement)

    @property
    def is_doubles(self) -> bool:
        """True for mixed doubles."""
        return self.rules.placed_stones

    @property
    def players(self) -> dict[str, list[dict[str, Any]]]:
        """Return the players of both teams in Digital Curling's form."""
        return {
            name: [
                {
                    "type": "normal_dist",
                    "max_speed": self.max_speed,
                    "stddev_speed": skill.sigma_speed,
                    "stddev_angle": skill.sigma_angle,
                    # Clients of the competition's library need these keys; the seed is not
                    # disclosed.
                    "seed": None,
                    "randomize_hand": False,
                }
                for skill in team
            ]
            for name, team in zip(TEAMS, self.throwers, strict=True)
        }

    @property
    def announcement(self) -> dict[str, Any]:
        """Return the `game` of `is_ready`."""
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
        """Make the simulator of the game, with the throwers in the teams' order."""
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
    """Parse the execution errors of a team's four players from a command line.

    Parameters
    ----------
    text : the name of a skill or ``SPEED:ANGLE`` [m/s, rad], once for all or four times with commas

    Raises
    ------
    InputError : another number of players, or an invalid error
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
            f"expected a skill's name or SPEED:ANGLE, such as 0.0076:0.0018, got {text[:40]!r}"
        ) from error
    if skill.sigma_speed > 1 or skill.sigma_angle > 1:
        raise InputError(f"execution error out of range: {text[:40]} m/s and rad")
    return skill
