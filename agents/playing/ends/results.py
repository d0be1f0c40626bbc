"""What was found of played games, and what of it is kept with the package."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from agents.playing.ends.play import Conditions, GameRecord
from agents.playing.ends.published import CLASSES, score_shares
from agents.playing.ends.records import conditions_document, games_in
from agents.playing.ends.summary import (
    calls_calibration,
    course,
    end_comparison,
    ends_of,
    grades,
    odds_of,
    shares_won,
    table_calibration,
    win_table,
)
from agents.playing.search.positions import SCORES, SLOTS
from agents.playing.search.value_network import load_network, skill_feature
from agents.playing.search.win_probability import WinProbability
from curling_env.game.rules import rule_set
from curling_env.infrastructure.files.storage import read_json
from curling_env.throw import SKILLS
from curling_env.typing import Floats

RESULTS = Path(str(files("agents.playing.ends").joinpath("results.json")))
"""The kept results."""
COMMAND = "python scripts/ends.py play NAME; python scripts/ends.py keep"


def counted(path: Path, conditions: Conditions) -> dict[str, Any]:
    """How the ends of a file of games were scored, for JSON.

    Parameters
    ----------
    path : the games
    conditions : those under which they were played
    """
    games = games_in(path)
    comparison = end_comparison(games)
    return {
        "conditions": conditions_document(conditions),
        "games": len(games),
        "seeds": [min(game.seed for game in games), max(game.seed for game in games)],
        "ends": int(comparison.counts.sum()),
        "counts": comparison.counts.tolist(),
        "net": sum(end.score for end in ends_of(games)) / max(len(ends_of(games)), 1),
        "chi_square": comparison.chi_square,
        "p_value": comparison.p_value,
    }


def summary(path: Path, conditions: Conditions) -> dict[str, Any]:
    """What `counted` gives, grades, the course of an end, and chances to win."""
    games = games_in(path)
    rules = rule_set(conditions.rules, ends=conditions.ends)
    return {
        **counted(path, conditions),
        "grades": [asdict(one) for one in grades(games)],
        "course": course(games),
        "win_table": win_table(odds_of(rules, end_comparison(games))),
        "won": shares_won(games),
    }


def calibration(paths: Sequence[Path]) -> dict[str, Any]:
    """How chances to win came true in the games of some files, for JSON.

    Parameters
    ----------
    paths : games of ten ends by the rules of 2024
    """
    games = [game for path in paths for game in games_in(path)]
    rules = rule_set("world_curling_2024")
    tables = {"search": WinProbability(rules), "published": WinProbability(rules, score_shares())}
    return {
        "games": len(games),
        "calls": calls_calibration(games).as_dict(),
        "table_of_search": table_calibration(games, tables["search"]).as_dict(),
        "table_of_published_ends": table_calibration(games, tables["published"]).as_dict(),
    }


def summary_text(games: Sequence[GameRecord]) -> str:
    """The numbers of games for people."""
    lines = [end_comparison(games).text(), "  grades"]
    lines += [
        f"    {one.type:<16}{one.mean:6.1f} %   {one.low:.1f} to {one.high:.1f} %   "
        f"{one.shots} shots, {100 * one.perfect:.0f} % perfect, {100 * one.missed:.0f} % missed"
        for one in grades(games)
    ]
    lines.append("  what the value network expects in the course of an end")
    lines += [
        f"    {one['left']:2.0f} stones to come: {one['points']:+.2f} points, "
        f"{100 * one['blank']:.0f} % blanks"
        for one in course(games)
    ]
    calls = calls_calibration(games)
    lines.append(f"  chances seen in calls (Brier {calls.brier:.3f}, 0.25 for one half)")
    lines += [
        f"    {one.predicted:5.2f}  won {one.share:.2f} ({one.low:.2f} to {one.high:.2f}) "
        f"of {one.number}"
        for one in calls.bins
    ]
    return "\n".join(lines)


def kept_document(found: dict[str, dict[str, Any]], calibration: dict[str, Any]) -> dict[str, Any]:
    """What the package keeps: the summaries by name, `calibration`, and how they are made anew."""
    rules = rule_set("world_curling_2024")
    return {
        "command": COMMAND,
        "win_table_of_search": win_table(WinProbability(rules)),
        "network_before_an_end": {
            name: expected_before_an_end(SKILLS[name].sigma_angle).tolist()
            for name in ("elite", "champion", "club")
        },
        "win_table_of_published_ends": win_table(WinProbability(rules, score_shares())),
        "calibration": calibration,
        "found": found,
    }


def expected_before_an_end(sigma_angle: float, *, lead: int = 0, ends_left: int = 10) -> Floats:
    """Shares of `published.CLASSES`, (7,), that the value network expects of an end.

    Parameters
    ----------
    sigma_angle : players' error of line [rad]
    lead, ends_left : the game before the end, as the team with the hammer sees it
    """
    rules = rule_set("world_curling_2024")
    worth = WinProbability(rules).by_score(lead, ends_left)
    nothing = np.full((1, SLOTS, 2), np.nan)
    shares = load_network().score_probabilities(
        rules.lines(), nothing, rules.deliveries, worth, skill_feature(sigma_angle)
    )[0]
    found = np.zeros(len(CLASSES))
    np.add.at(found, np.clip(SCORES, -3, 3) + 3, shares)
    return found


def kept_results() -> dict[str, Any]:
    """The kept results, as `kept_document` made them."""
    document = read_json(RESULTS)
    assert isinstance(document, dict)
    return document  # pyright: ignore[reportUnknownVariableType]
