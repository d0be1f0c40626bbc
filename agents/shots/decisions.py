"""Calls of teams in real positions, compared with those of `search`.

Calls are compared by families, because a table names tasks and a search names shots. The cost of a
call of another family is the difference between the win probabilities of the search's best shot and
of its best one of the called family. It paid if the resulting position is worth at least the value
that the search expected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agents.playing.board.recorded import state_before
from agents.playing.search import SearchPlayer
from agents.playing.search.evaluator import PositionEvaluator
from agents.playing.search.positions import position_of
from agents.playing.search.tuning import MIN_POWER_PLAY_GAIN
from agents.playing.search.value_network import skill_feature
from agents.playing.search.win_probability import WinProbability
from agents.playing.tournament import wilson
from agents.shots.inversion import Inversion
from agents.shots.records import record_of
from agents.shots.table import RULES, Shot, ShotTable, TableEnd, TableGame
from curling_env.game import GameSimulator
from curling_env.game.rules import Team
from curling_env.throw import Skill
from curling_env.typing import Floats, Progress, no_progress

FAMILIES = {
    "draw": ("draw", "come-around"),
    "front": ("guard", "cover"),
    "guard": ("guard", "cover"),
    "raise": ("tap",),
    "freeze": ("freeze",),
    "takeout": ("control-weight hit", "hit", "firm hit"),
    "hit and roll": ("control-weight hit", "hit", "firm hit"),
    "double takeout": ("control-weight hit", "hit", "firm hit", "peel"),
    "promotion takeout": ("hit", "firm hit", "peel"),
    "clearing": ("firm hit", "peel"),
    "through": ("through the house",),
}
"""Shots of a search that correspond to a task of the table."""
BUDGET = 500
"""Simulated throws of the search before each delivery."""


@dataclass(frozen=True, kw_only=True)
class Decision:
    """One call compared with the search's.

    Parameters
    ----------
    row : row of the table
    situation : hammer, and whether the end has a power play
    called, search : the team's task, and the shot that the search calls
    agrees : whether the search's shot belongs to the called family
    cost : win probability that the call gives away, by the search; None where it has no such shot
    expected, reached : win probability that the search expects of its call, and that of the
        position which the team came to
    """

    row: int
    situation: str
    called: str
    search: str
    agrees: bool
    cost: float | None
    expected: float
    reached: float

    @property
    def paid(self) -> bool:
        """True if the resulting position is worth as much as the search expected."""
        return self.reached >= self.expected


def decisions_of(
    table: ShotTable,
    skill: Skill,
    *,
    shots: int = 150,
    budget: int = BUDGET,
    seed: int = 0,
    progress: Progress = no_progress,
) -> list[Decision]:
    """Compare calls in a random sample of real positions.

    Parameters
    ----------
    table : the table
    skill : hands with which the search reckons
    shots : number of positions
    budget : simulated throws of the search before each delivery
    seed : seed of the choice
    progress : called after every position
    """
    every = [
        (game, end, shot)
        for game in table.games
        if game.ends and all(one.shots for one in game.ends)
        for end in game.ends
        for shot in end.shots
        if shot.task in FAMILIES and not end.stopped
    ]
    chosen = np.random.default_rng(seed).permutation(len(every))[:shots]
    simulator = GameSimulator("standard", rules=RULES, skills=skill)
    player, inversion = SearchPlayer(budget), Inversion(simulator.ice)
    found: list[Decision] = []
    for k, i in enumerate(sorted(chosen.tolist())):
        game, end, shot = every[i]
        found.append(_decision(game, end, shot, simulator, player, inversion))
        progress("deciding", k + 1, len(chosen))
    return found


def _decision(
    game: TableGame,
    end: TableEnd,
    shot: Shot,
    simulator: GameSimulator,
    player: SearchPlayer,
    inversion: Inversion,
) -> Decision:
    state = state_before(record_of(game), simulator, end.number + 1, shot.number + 1)
    view = simulator.view(state)
    ranked = player.shots_by_kind(view)
    best = player.ranked_shots(view)[0]
    family = FAMILIES[shot.task]
    own = next((one for one in ranked if one.shot in family), None)
    agrees = best.shot in family
    cost = None if own is None else max(best.win_probability - own.win_probability, 0.0)
    after = inversion.end_after(shot)
    evaluator = PositionEvaluator(
        player.network(simulator.rules, view.ice),
        simulator.rules,
        simulator.lines,
        skill_feature(view.skill),
    )
    reached = evaluator.win_probabilities(view, position_of(after)[None], after.delivered)[0]
    hammer = "with hammer" if shot.team is end.hammer else "without hammer"
    return Decision(
        row=shot.row,
        situation=hammer + (", power play" if end.power_play else ""),
        called=shot.task,
        search=best.shot,
        agrees=agrees,
        cost=0.0 if agrees else cost,
        expected=best.win_probability,
        reached=float(reached),
    )


def summary_of(decisions: Sequence[Decision]) -> dict[str, dict[str, Any]]:
    """Return number, agreement, cost and pay of calls by situation, and in all, with intervals."""
    situations = ["all", *sorted({one.situation for one in decisions})]
    found: dict[str, dict[str, Any]] = {}
    for situation in situations:
        own = [one for one in decisions if situation in ("all", one.situation)]
        other = [one for one in own if not one.agrees]
        costs = np.array([one.cost for one in other if one.cost is not None])
        found[situation] = {
            "calls": len(own),
            "others": len(other),
            "agree": _share([one.agrees for one in own]),
            "cost_of_others": _mean(costs),
            "others_paid": _share([one.paid for one in other]),
            "same_paid": _share([one.paid for one in own if one.agrees]),
        }
    return found


@dataclass(frozen=True, kw_only=True)
class PowerPlay:
    """Decision on a power play, before an end whose deciding team has not used its power play.

    Parameters
    ----------
    ends_left : scheduled ends that are not complete, with this one
    lead : lead of the team in points
    played : true if the team played it
    gain : win probability that a power play now gains over a later one, by the odds
    """

    ends_left: int
    lead: int
    played: bool
    gain: float

    @property
    def cost(self) -> float:
        """Loss of win probability by the decision, by the odds."""
        return max(-self.gain if self.played else self.gain, 0.0)


def power_plays_of(table: ShotTable) -> list[PowerPlay]:
    """Return the decision before each end in which a power play was available."""
    odds = WinProbability(RULES)
    found: list[PowerPlay] = []
    for game in table.games:
        had: set[Team] = set()
        home = 0
        for end in game.ends:
            team, left = end.hammer, RULES.ends - end.number
            if team not in had and left > 0:
                lead = home if team is Team.HOME else -home
                gain = odds.power_play_gain(lead, left, opponent=team.other not in had)
                played = end.power_play is not None
                found.append(PowerPlay(ends_left=left, lead=lead, played=played, gain=gain))
            if end.power_play is not None:
                had.add(team)
            home += 0 if end.score is None else end.score[0] - end.score[1]
    return found


def summary_of_power_plays(decisions: Sequence[PowerPlay]) -> dict[str, dict[str, Any]]:
    """Return how often power plays were played, and would be by the odds, by ends left and lead."""
    found: dict[str, dict[str, Any]] = {}
    for left in range(RULES.ends, 0, -1):
        for words, sign in (("behind", -1), ("level", 0), ("ahead", 1)):
            own = [one for one in decisions if (one.ends_left, np.sign(one.lead)) == (left, sign)]
            if own:
                found[f"{left} to play, {words}"] = {
                    "ends": len(own),
                    "played": _share([one.played for one in own]),
                    "by_the_odds": float(np.mean([one.gain > MIN_POWER_PLAY_GAIN for one in own])),
                    "cost": _mean(np.array([one.cost for one in own])),
                }
    return found


def _share(flags: Sequence[bool]) -> dict[str, float] | None:
    """Return a share with its 95 % interval (Wilson)."""
    if not flags:
        return None
    low, high = wilson(sum(flags), len(flags))
    return {"value": float(np.mean(flags)), "low": low, "high": high}


def _mean(values: Floats) -> dict[str, float] | None:
    """Return a mean with its 95 % interval."""
    if not len(values):
        return None
    spread = 1.96 * float(values.std()) / len(values) ** 0.5
    mean = float(values.mean())
    return {"value": mean, "low": mean - spread, "high": mean + spread}
