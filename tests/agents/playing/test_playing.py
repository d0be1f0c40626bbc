"""Games between players, their record, and the table of a tournament."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from agents.playing import (
    GreedyPlayer,
    Match,
    lines_of,
    outcome,
    page_of,
    play_game,
    play_tournament,
    ratings,
    read_record,
    wilson,
    write_record,
)
from agents.playing.scoreboard import scoreboard
from curling_env.errors import InputError
from curling_env.game import (
    TYPICAL_EVOLUTION,
    DrawPlayer,
    Game,
    GameSimulator,
    RuleBasedPlayer,
    Team,
    rule_set,
)
from curling_env.ice import ActiveEffect, load_ice, save_ice

PLAYERS = {"draw": DrawPlayer, "rulebased": RuleBasedPlayer, "greedy": GreedyPlayer}


def simulator(ends=2, rules="world_curling_2024", ice_evolution=TYPICAL_EVOLUTION, **settings):
    settings.setdefault("skills", "elite")
    return GameSimulator(
        rules=rule_set(rules, ends=ends), ice_evolution=ice_evolution, sweeping=True, **settings
    )


def test_a_game_on_ice_that_lacks_an_effect_warns_once(curling, tmp_path):
    marked = load_ice("standard").with_effect(ActiveEffect(name="unknown"))
    save_ice(marked, tmp_path / "ice.json")
    game = ("play", "--home", "draw", "--away", "draw", "--ends", 1, "--json")
    result = curling(*game, "--ice", tmp_path / "ice.json")
    assert result.err.count("lacks an effect") == 1
    assert "lacks" not in curling(*game).err


def test_a_tournament_is_the_same_on_any_number_of_workers():
    def table(workers, seed):
        return play_tournament(
            simulator(1),
            [DrawPlayer(), RuleBasedPlayer()],
            games=4,
            seed=seed,
            workers=workers,
        )

    alone, together = table(1, 5), table(2, 5)
    assert alone.standings == together.standings
    assert np.array_equal(alone.wins, together.wins)
    assert alone.standings != table(1, 6).standings


def test_the_same_seed_is_the_same_game():
    runs = [
        lines_of(
            play_game(simulator(1), (RuleBasedPlayer(), GreedyPlayer()), seed=seed, paths=True),
            simulator(1),
            ice="standard",
            seed=seed,
        )
        for seed in (4, 4, 5)
    ]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


def test_a_player_may_give_the_hammer_away():
    class First(DrawPlayer):
        def throws_first(self, view):
            return True

    place = simulator(1, "mixed_doubles_2024")
    played = play_game(place, (First(), First()), seed=6, last_stone=Team.HOME, paths=True)
    assert played.deliveries[0].shot.team is Team.HOME
    assert played.game.hammers[0] is Team.AWAY


def test_every_stone_that_moved_has_its_path(tmp_path):
    place = simulator(1)
    played = play_game(place, (RuleBasedPlayer(), RuleBasedPlayer()), seed=2, paths=True)
    path = tmp_path / "game.jsonl"
    lines = write_record(path, played, place, ice="standard", seed=2)
    assert len(lines) == 16 + 2
    for line in lines[1:-1]:
        before = {s["stone"]: (s["x"], s["y"]) for s in line["before"]}
        paths = {p["stone"]: p for p in line["paths"]}
        for stone in line["lying"]:
            end = (stone["x"], stone["y"])
            if line["fault"] is None and before.get(stone["stone"]) != end:
                walked = paths[stone["stone"]]
                assert (walked["x"][-1], walked["y"][-1]) == pytest.approx(end, abs=2e-3)
                assert np.all(np.diff(walked["t"]) > 0)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "expected a recorded game"),
        ('{"format": "else"}\n', "expected a recorded game"),
        ('{"format": "curling-game/1"}\n{"end": 1}\n', "incomplete"),
        ('{"format": "curling-game/1"}\n{nonsense\n', "line 2"),
    ],
)
def test_an_invalid_record_is_refused_with_the_place(tmp_path, text, problem):
    path = tmp_path / "game.jsonl"
    path.write_text(text)
    with pytest.raises(InputError, match=problem):
        read_record(path)


def test_a_record_whose_stones_do_not_follow_each_other_is_refused(tmp_path):
    place = simulator(1)
    played = play_game(place, (DrawPlayer(), DrawPlayer()), seed=2, paths=True)
    path = tmp_path / "game.jsonl"
    write_record(path, played, place, ice="standard", seed=2)
    head, *shots, score = path.read_text().splitlines(keepends=True)
    path.write_text("".join([head, *shots, *shots, score]))
    with pytest.raises(InputError, match="line 18: end 1, stone 1 comes after end 1, stone 16"):
        read_record(path)


def test_the_page_is_self_contained_and_contains_the_record():
    place = simulator(1)
    played = play_game(place, (RuleBasedPlayer(), DrawPlayer()), seed=2, paths=True)
    lines = lines_of(played, place, ice="</script><b>", seed=2)
    page = page_of(lines)
    found = re.search(r'<script id="record"[^>]*>(.*?)</script>', page, re.S)
    assert found is not None
    assert json.loads(found[1]) == json.loads(json.dumps(lines))
    assert not re.search(r"(src|href)\s*=", page)

    class Tags(HTMLParser):
        open_tags: list[str] = []

        def handle_starttag(self, tag, attrs):
            if tag not in ("meta", "input"):
                self.open_tags.append(tag)

        def handle_endtag(self, tag):
            assert self.open_tags.pop() == tag

    parser = Tags()
    parser.feed(page)
    assert parser.open_tags == []


def test_a_line_score_as_in_a_hall():
    game = Game(
        rules=rule_set("world_curling_2024", ends=4),
        line_score=((0, 1), (2, 0), (0, 0), (1, 0)),
        hammers=(Team.AWAY, Team.HOME, Team.AWAY, Team.AWAY),
    )
    lines = scoreboard(game, ("Reds", "Yellows")).splitlines()
    assert lines[0].split() == ["1", "2", "3", "4", "Total"]
    assert lines[1].split() == ["Reds", "0", "2", "0", "1", "3"]
    assert lines[2].split() == ["Yellows", "*", "1", "0", "0", "0", "1"]
    assert outcome(game, ("Reds", "Yellows")) == "Reds wins 3 : 1."


def test_a_conceded_game_ends_immediately():
    class Quitter(DrawPlayer):
        def concedes(self, view):
            return True

    match = Match(simulator(4, "digital_curling"), (DrawPlayer(), Quitter()), seed=0)
    deliveries = list(match)
    assert len(deliveries) <= 1
    assert match.game.winner is Team.HOME
    assert "concedes" in outcome(match.game, ("a", "b"))
    assert " X" in scoreboard(match.game, ("a", "b"))


def test_ratings_and_intervals():
    wins = np.array([[0.0, 30.0], [10.0, 0.0]])
    high, low = ratings(wins)
    assert high + low == pytest.approx(0, abs=1e-6)
    assert high - low == pytest.approx(400 * np.log10(30.5 / 10.5), rel=1e-3)
    # A third player without games, as in a bootstrap of few games, has the mean rating.
    third = ratings(np.pad(wins, (0, 1)))
    assert np.isfinite(third).all()
    assert third[2] == pytest.approx(0, abs=1e-6)
    assert wilson(30, 40) == pytest.approx((0.598, 0.858), abs=2e-3)
    with pytest.raises(InputError, match="different names"):
        play_tournament(simulator(), [DrawPlayer(), DrawPlayer()], games=1, seed=0)
