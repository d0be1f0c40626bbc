"""The rules agree with the scenario file, clause by clause."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from curling_env.errors import InputError
from curling_env.game import (
    Game,
    RestingStone,
    Result,
    Team,
    begin_end,
    concede,
    deliver,
    hammer_after,
    may_concede,
    new_game,
    rule_on,
    rule_set,
    score_of,
)

SCENARIOS = yaml.safe_load((Path(__file__).parent / "scenarios.yaml").read_text())


def by_clause(kind: str) -> Any:
    return pytest.mark.parametrize(
        "case", [pytest.param(case, id=case["clause"]) for case in SCENARIOS[kind]]
    )


def lying(name: str, place: list[float]) -> RestingStone:
    team, number = name.split()
    return RestingStone(Team[team.upper()], int(number) - 1, *place)


def stones_of(places: dict[str, list[float]]) -> tuple[RestingStone, ...]:
    return tuple(lying(name, place) for name, place in places.items())


def rules_of(case: dict[str, Any]) -> Any:
    return rule_set(case.get("rules", "world_curling_2024"))


@by_clause("deliveries")
def test_ruling(case: dict[str, Any]) -> None:
    before = case.get("before", {})
    after = case["after"]
    team = Team[case["team"].upper()]
    delivered_name = f"{team.label} {(case['stone'] + 1) // 2}"
    if delivered_name in before:  # that number is taken by a stone of the position
        delivered_name = f"{team.label} 8"

    def now(name: str, place: Any) -> RestingStone | None:
        return None if place == "out" else lying(name, place)

    def position(places: dict[str, Any]) -> set[RestingStone]:
        return {
            lying(delivered_name, place)
            if name == "delivered"
            else lying(name, before[name] if place == "here" else place)
            for name, place in places.items()
        }

    result = Result(
        after=(
            *(now(name, after.get(name, place)) for name, place in before.items()),
            now(delivered_name, after["delivered"]),
        ),
        struck=case.get("struck", False),
    )
    rules = rules_of(case)
    ruling = rule_on(rules, rules.lines(), stones_of(before), team, case["stone"] - 1, result)
    assert (ruling.fault or "none") == case["ruling"]
    assert set(ruling.stones) == position(case["stays"])
    assert (ruling.option is None) == ("or_stays" not in case)
    if ruling.option is not None:
        assert set(ruling.option) == position(case["or_stays"])


@by_clause("counting")
def test_count(case: dict[str, Any]) -> None:
    rules = rules_of(case)
    score = score_of(rules, rules.lines(), stones_of(case["stones"]))
    assert score == (case["home"], case["away"])
    assert (
        hammer_after(rules, Team[case["hammer"].upper()], score)
        is Team[case["next_hammer"].upper()]
    )


def play_end(game: Game, home: int, away: int) -> Game:
    """Play an end in which every stone goes through the house, but the last ones, which count."""
    game = begin_end(game)
    ends = len(game.line_score)
    while game.end is not None and len(game.line_score) == ends:
        end = game.end
        team = end.to_throw
        points = home if team is Team.HOME else away
        counts = game.rules.stones - end.number_of_stone <= points
        place = None
        if counts:
            place = RestingStone(team, end.number_of_stone, 0.3 * (end.number_of_stone - 4), 0.0)
        kept = tuple(s for s in end.stones if s.number < game.rules.stones)
        gone = tuple(s if s in kept else None for s in end.stones)
        if end.delivered < game.rules.no_takeout_until:
            gone = end.stones
        game, ruling = deliver(game, Result(after=(*gone, place), struck=False))
        assert ruling.fault is None
    return game


@by_clause("games")
def test_game(case: dict[str, Any]) -> None:
    game = new_game(rules_of(case))
    for home, away in case["ends"]:
        assert not game.is_over
        game = play_end(game, home, away)
    assert [list(end) for end in game.line_score] == case["ends"]
    if "concedes" in case:
        team = Team[case["concedes"].upper()]
        assert may_concede(game, team) == case["allowed"]
        if not case["allowed"]:
            with pytest.raises(InputError, match="6 complete ends"):
                concede(game, team)
            return
        game = concede(game, team)
    assert game.is_over == case["over"]
    if "winner" in case:
        assert game.winner is Team[case["winner"].upper()]
    if "hammer" in case:
        assert game.last_stone is Team[case["hammer"].upper()]
