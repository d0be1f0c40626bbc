"""Hands of championship players: errors of openings and hits, and each player's by its grades.

The errors of all hands together come from openings (`openings`) and hits (`hits`). A player's
differ from them by its grades: an ability that is worth one in the logit of a grade makes errors
smaller by e to the power of one over `Openings.slope`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agents.shots.grades import (
    Effect,
    GradeModel,
    HeldOut,
    fit_grades,
    graded_shots,
    held_out_score,
)
from agents.shots.hits import POSITIONS, HitErrors, fit_hits
from agents.shots.openings import Measured, Openings, fit_openings
from agents.shots.table import ShotTable, TableGame
from curling_env.game.skill_file import save_skill
from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import write_json
from curling_env.infrastructure.files.writing import make_directory, together
from curling_env.infrastructure.provenance import provenance
from curling_env.throw import Skill
from curling_env.typing import Progress, no_progress

SPIN = 0.1
"""Standard deviation of the spin, which the table says nothing of [rad/s]."""
NOT_SEPARATED = (
    "ice: its weight and curl differ between sheets and games, and count as errors",
    "sweeping: weight is the speed that explains the rest, after the sweepers",
    "intent: teams that call other openings than most, or other hits than the surest one, "
    "seem to throw worse",
    "grades: whoever grades more strictly in a game makes its players seem worse",
)
"""Influences that the table cannot separate from hands."""


@dataclass(frozen=True, kw_only=True)
class PlayerHand:
    """The hand of one player.

    Parameters
    ----------
    name : team, competition and number, as in file names
    shots : number of graded shots
    ability : effect of team and player on the logit of a grade, and its standard error
    by_handle : by how much the logit is higher with the counter-clockwise handle
    factor : errors over those of all hands
    skill : the hand, for `--skill`
    """

    name: str
    shots: int
    ability: Effect
    by_handle: Effect
    factor: Measured
    skill: Skill


@dataclass(frozen=True, kw_only=True)
class Hands:
    """Hands as estimated from a table of shots.

    Parameters
    ----------
    openings : errors of first deliveries, all hands together
    hits : errors of hits by task
    grades : the model of grades
    held_out : how well it predicts the grades of other games; None for a single game
    players : the hand of each player
    """

    openings: Openings
    hits: list[HitErrors]
    grades: GradeModel
    held_out: HeldOut | None
    players: list[PlayerHand]

    @property
    def skill(self) -> Skill:
        """All hands together."""
        return skill_of(self.openings)

    def as_dict(self) -> dict[str, Any]:
        """The report."""
        grades = self.grades
        return {
            "openings": asdict(self.openings),
            "hits": [asdict(one) for one in self.hits],
            "grades": {
                "scatter": grades.scatter,
                "handle_by_task": {
                    str(task): asdict(effect)
                    for task, effect in grades.effects["task by handle"].items()
                },
                "teams": {
                    str(team): asdict(effect) for team, effect in grades.effects["team"].items()
                },
                "held_out": None if self.held_out is None else asdict(self.held_out),
            },
            "players": [asdict(one) for one in self.players],
            "not_separated": list(NOT_SEPARATED),
        }


def skill_of(openings: Openings, factor: float = 1.0, name: str = "all") -> Skill:
    """The hand with the errors of openings times a factor."""
    return Skill(
        name=name,
        sigma_speed=factor * openings.speed.value,
        sigma_angle=factor * openings.line.value,
        sigma_spin=SPIN,
        tails=openings.tails,
        source="first deliveries and grades of a table of shots; with sweeping, ice and intent",
    )


def fit_hands(
    table: ShotTable,
    ice: Ice,
    *,
    positions: int = POSITIONS,
    seed: int = 0,
    progress: Progress = no_progress,
) -> Hands:
    """Fit the hands of all players of a table.

    Parameters
    ----------
    table : the table
    ice : the ice on which stones are thrown
    positions : number of real positions for each task of hits
    seed : seed of everything random
    progress : called after every part

    Raises
    ------
    InputError : fewer first deliveries than a fit needs
    """
    games = table.games
    openings = fit_openings(games, ice, seed=seed)
    shots = graded_shots(games)
    model = fit_grades(shots)
    return Hands(
        openings=openings,
        hits=fit_hits(
            shots, ice, skill_of(openings), positions=positions, seed=seed, progress=progress
        ),
        grades=model,
        held_out=held_out_score(games) if len(games) > 1 else None,
        players=_players(games, model, openings),
    )


def _players(games: Sequence[TableGame], model: GradeModel, openings: Openings) -> list[PlayerHand]:
    """The hand of each player, in order of name."""
    names = {
        team: name for game in games for team, name in zip(game.teams, game.names, strict=True)
    }
    none = Effect(value=0.0, stderr=0.0, shots=0)
    found: list[PlayerHand] = []
    for key, own in model.effects["player"].items():
        competition, team, player = key  # pyright: ignore[reportGeneralTypeIssues]
        of_team = model.effects["team"].get(team, none)
        ability = Effect(
            value=own.value + of_team.value,
            stderr=float(np.hypot(own.stderr, of_team.stderr)),
            shots=own.shots,
        )
        name = f"{names[team]}-{competition}-{player}"
        factor = _factor(ability, openings.slope)
        found.append(
            PlayerHand(
                name=name,
                shots=own.shots,
                ability=ability,
                by_handle=model.effects["player by handle"].get(key, none),
                factor=factor,
                skill=skill_of(openings, factor.value, name),
            )
        )
    return sorted(found, key=lambda one: one.name)


def _factor(ability: Effect, slope: Measured) -> Measured:
    """Errors over those of all hands, by ability; the slope's own error counts too."""
    value = -ability.value / slope.value
    of_slope = ability.value / slope.value**2 * (slope.high - slope.low) / 3.92
    spread = 1.96 * float(np.hypot(ability.stderr / slope.value, of_slope))
    ends = (float(np.exp(value + sign * spread)) for sign in (-1.0, 1.0))
    low, high = ends
    return Measured(value=float(np.exp(value)), low=low, high=high)


def write_hands(folder: str | Path, hands: Hands, source: str | Path, *, seed: int) -> list[Path]:
    """Write the report, and a skill file for all hands together and for each player.

    Parameters
    ----------
    folder : folder of the files, which is made
    hands : the hands
    source : the table that they come from
    seed : seed of the fit

    Returns
    -------
    the files
    """
    place = make_directory(folder)
    origin = provenance([source], seed=seed)
    files = [place / "report.json"]
    with together():
        write_json(files[0], {**hands.as_dict(), "provenance": origin})
        for skill in (hands.skill, *(player.skill for player in hands.players)):
            files.append(place / f"{skill.name}.skill.json")
            save_skill(skill, files[-1], provenance=origin)
    return files


def in_words(hands: Hands) -> list[str]:
    """The result in sentences."""
    openings, held = hands.openings, hands.held_out
    text = [
        f"{openings.shots} first draws: speed ± {1000 * openings.speed.value:.0f} mm/s "
        f"({1000 * openings.speed.low:.0f} to {1000 * openings.speed.high:.0f}), line ± "
        f"{np.degrees(openings.line.value):.2f}° ({np.degrees(openings.line.low):.2f} to "
        f"{np.degrees(openings.line.high):.2f}), {openings.tails:.1f} degrees of freedom"
    ]
    text += [
        f"{one.task}: {100 * one.made:.0f} % made, {100 * one.with_openings:.0f} % with these "
        f"errors; errors × {one.factor.value:.2f} ({one.factor.low:.2f} to {one.factor.high:.2f})"
        for one in hands.hits
    ]
    ratios = [one.factor.value for one in hands.players]
    text.append(
        f"{len(ratios)} players: errors × {min(ratios):.2f} to {max(ratios):.2f} of all hands"
    )
    if held is not None:
        text.append(
            f"grades of {held.games} held-out games: {held.gain:+.4f} ± {held.stderr:.4f} a shot "
            "over the shares of each task (mean log score)"
        )
    return text
