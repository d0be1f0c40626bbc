"""Hands of championship players: errors of all, of each task, and of each player.

The errors of all hands together and of each task come from the positions of stones (`execution`). A
player's factor on them combines its grades, an ability in the logit of a grade over
`Execution.slope`, and the positions of its stones (`scatter`), weighted by their precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from agents.shots.execution import Execution, Measured, TaskErrors, fit_execution
from agents.shots.grades import (
    Effect,
    GradeModel,
    HeldOut,
    fit_grades,
    graded_shots,
    held_out_score,
)
from agents.shots.table import ShotTable, TableGame
from curling_env.game.skill_file import save_skill
from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import write_json
from curling_env.infrastructure.files.writing import make_directory, together
from curling_env.infrastructure.provenance import provenance
from curling_env.throw import Skill
from curling_env.typing import Progress, no_progress

NONE = Effect(value=0.0, stderr=0.0, shots=0)
"""Unknown effect."""
SPIN = 0.1
"""Standard deviation of the spin, on which the table has no information [rad/s]."""
POSITIONS = 100
"""Default number of real positions of each task."""
NOT_SEPARATED = (
    "ice: its weight and curl differ between sheets and games, and count as errors",
    "sweeping: weight is the speed that explains the rest, after the sweepers",
    "intent: teams that value positions otherwise than the search seem to throw worse, and less "
    "so in depth than across",
    "speed of hits: the stones hardly show it",
    "grades: a stricter grader makes the players of a game seem worse",
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
    """Estimated hands from a table of shots.

    Parameters
    ----------
    execution : errors of all hands together, and of each task
    grades : the model of grades
    held_out : how well it predicts the grades of other games; None for a single game
    players : the hand of each player
    """

    execution: Execution
    grades: GradeModel
    held_out: HeldOut | None
    players: list[PlayerHand]

    @property
    def skills(self) -> list[Skill]:
        """All hands together, those of each task, and each player's."""
        return [
            skill_of(self.execution),
            *(
                skill_of(self.execution, f"task-{one.task.replace(' ', '-')}", task=one)
                for one in self.execution.tasks
            ),
            *(player.skill for player in self.players),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return the report."""
        grades = self.grades
        return {
            "execution": {
                name: value for name, value in asdict(self.execution).items() if name != "players"
            },
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


def skill_of(
    execution: Execution,
    name: str = "all",
    *,
    task: TaskErrors | None = None,
    factor: float = 1.0,
) -> Skill:
    """Return all hands with their errors times a factor, or those of one task.

    A task without an error of speed has that of all.
    """
    speed, line = execution.speed, execution.line
    if task is not None:
        speed, line = task.speed or speed, task.line
    return Skill(
        name=name,
        sigma_speed=factor * speed.value,
        sigma_angle=factor * line.value,
        sigma_spin=SPIN,
        tails=execution.tails,
        source="places of stones and grades of a table of shots; with sweeping, ice and intent",
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
    shots = graded_shots(table.games)
    model = fit_grades(shots)
    execution = fit_execution(
        shots,
        ice,
        positions=positions,
        seed=seed,
        progress=progress,
    )
    return Hands(
        execution=execution,
        grades=model,
        held_out=held_out_score(table.games) if len(table.games) > 1 else None,
        players=_players(table.games, model, execution),
    )


def _players(
    games: Sequence[TableGame], model: GradeModel, execution: Execution
) -> list[PlayerHand]:
    """Return the hand of each player, in order of name."""
    names = {
        team: name for game in games for team, name in zip(game.teams, game.names, strict=True)
    }
    found: list[PlayerHand] = []
    for key, own in model.effects["player"].items():
        competition, team, player = cast("tuple[int, int, int]", key)
        of_team = model.effects["team"].get(team, NONE)
        ability = Effect(
            value=own.value + of_team.value,
            stderr=float(np.hypot(own.stderr, of_team.stderr)),
            shots=own.shots,
        )
        name = f"{names[team]}-{competition}-{player}"
        factor = _factor(ability, execution.slope, execution.players.get(key, (0.0, 0.0)))
        found.append(
            PlayerHand(
                name=name,
                shots=ability.shots,
                ability=ability,
                by_handle=model.effects["player by handle"].get(key, NONE),
                factor=factor,
                skill=skill_of(execution, name, factor=factor.value),
            )
        )
    return sorted(found, key=lambda one: one.name)


def _factor(ability: Effect, slope: Measured, shown: tuple[float, float]) -> Measured:
    """Return errors over those of all hands, from ability and positions of stones.

    Parameters
    ----------
    ability : effect of team and player on the logit of a grade
    slope : by how much the logit falls when errors grow e-fold; its own error counts too
    shown : the logarithm of that factor by where the player's stones went, and its precision
    """
    of_slope = ability.value / slope.value**2 * (slope.high - slope.low) / 3.92
    graded = 1 / float(np.hypot(ability.stderr / slope.value, of_slope)) ** 2
    value, weight = shown
    precision = graded + weight
    value = (weight * value - graded * ability.value / slope.value) / precision
    spread = 1.96 / np.sqrt(precision)
    low, high = (float(np.exp(value + sign * spread)) for sign in (-1.0, 1.0))
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
        for skill in hands.skills:
            files.append(place / f"{skill.name}.skill.json")
            save_skill(skill, files[-1], provenance=origin)
    return files


def in_words(hands: Hands) -> list[str]:
    """Return the result in sentences."""
    execution, held = hands.execution, hands.held_out
    text = [
        f"{execution.shots} shots of {len(execution.tasks)} tasks: speed {_mm(execution.speed)}, "
        f"line {_degrees(execution.line)}, {execution.tails:.0f} degrees of freedom"
    ]
    text.append(
        "errors differ by "
        + ", ".join(
            f"{100 * one.value:.0f} % between {kind}s ({100 * one.low:.0f} to {100 * one.high:.0f})"
            for kind, one in execution.scatter.items()
        )
    )
    text += [
        f"{one.task}: line {_degrees(one.line)}"
        + ("" if one.speed is None else f", speed {_mm(one.speed)}")
        for one in execution.tasks
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


def _mm(speed: Measured) -> str:
    low, high = 1000 * speed.low, 1000 * speed.high
    return f"± {1000 * speed.value:.0f} mm/s ({low:.0f} to {high:.0f})"


def _degrees(line: Measured) -> str:
    value, low, high = np.degrees([line.value, line.low, line.high])
    return f"± {value:.2f}° ({low:.2f} to {high:.2f})"
