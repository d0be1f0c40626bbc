"""Many games, and what they say of who is better."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from agents.playing.match import play_game
from curling_env.errors import InputError
from curling_env.executor import executor
from curling_env.game import GameSimulator, Player
from curling_env.game.rules import Game, Team
from curling_env.typing import Floats

Through = Callable[[Iterable[Any], str], Iterable[Any]]
"""Passes items on and shows how far it is: (items, label) -> the same items."""

ELO = 400 / np.log(10)
"""Points of an Elo rating for each unit of log odds."""
RESAMPLES = 400
"""Tournaments drawn from the games played, for the intervals of the ratings."""
PRIOR = 0.5
"""Drawn games added between each two players, so that a rating stays finite."""


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What a player reached.

    Parameters
    ----------
    name : of the player
    games, wins : played and won; half a win for a tie
    share, share_low, share_high : wins over games, and its 95 % interval (Wilson)
    elo, elo_low, elo_high : rating with mean 0 over the players, and its 95 % interval (bootstrap)
    points_for, points_against : an end
    """

    name: str
    games: int
    wins: float
    share: float
    share_low: float
    share_high: float
    elo: float
    elo_low: float
    elo_high: float
    points_for: float
    points_against: float


@dataclass(frozen=True, kw_only=True)
class Tournament:
    """Everybody against everybody.

    Parameters
    ----------
    standings : best first
    names : of the players, as in the table
    wins : (n, n) games that the row's player won against the column's; ties count half
    """

    standings: tuple[Standing, ...]
    names: tuple[str, ...]
    wins: Floats


@dataclass(frozen=True, kw_only=True)
class Fixture:
    """A game to be played, with all it depends on.

    Parameters
    ----------
    simulator, seed, last_stone : see `play_game`
    players : of home and away
    places : of home and away among the tournament's players
    """

    simulator: GameSimulator
    players: tuple[Player, Player]
    places: tuple[int, int]
    seed: int
    last_stone: Team


def play_tournament(
    simulator: GameSimulator,
    players: list[Player],
    *,
    games: int,
    seed: int,
    through: Through,
    workers: int | str = 1,
) -> Tournament:
    """Every two players meet in a number of games, each as home and with the hammer equally often.

    Parameters
    ----------
    games : of every two players
    through : shows progress
    workers : who plays the games, see `executor`; players that think by the clock apart, the
        tournament is the same on any number of them

    Raises
    ------
    InputError : fewer than two players, two of one name, or workers that there are not
    """
    names = tuple(player.name for player in players)
    if len(players) < 2 or len(set(names)) < len(names):
        raise InputError("a tournament needs two players or more, each of another name")
    fixtures = _fixtures(simulator, players, games, seed)
    rows: list[tuple[int, int, float]] = []
    points = np.zeros((len(players), 3))  # for, against, ends
    with executor(workers) as crew:
        played = crew.map(_play, fixtures)
        for fixture, game in zip(through(fixtures, "games"), played, strict=True):
            for place, team in zip(fixture.places, Team, strict=True):
                points[place] += game.score[team], game.score[team.other], len(game.line_score)
            won = 0.5 if game.winner is None else float(game.winner is Team.HOME)
            rows.append((*fixture.places, won))
    results = np.array(rows)
    return Tournament(
        standings=_standings(names, results, points, seed),
        names=names,
        wins=_table(len(players), results),
    )


def _fixtures(
    simulator: GameSimulator, players: list[Player], games: int, seed: int
) -> list[Fixture]:
    """All games in their order: each two players once, then each two again, and so on."""
    fixtures: list[Fixture] = []
    for g in range(games):
        for number, pair in enumerate(combinations(range(len(players)), 2)):
            home, away = pair if g % 2 == 0 else pair[::-1]
            fixtures.append(
                Fixture(
                    simulator=simulator,
                    players=(players[home], players[away]),
                    places=(home, away),
                    seed=seed + 1000 * g + number,
                    last_stone=Team((g // 2) % 2),
                )
            )
    return fixtures


def _play(fixture: Fixture) -> Game:
    """The game as it ended."""
    return play_game(
        fixture.simulator, fixture.players, seed=fixture.seed, last_stone=fixture.last_stone
    ).game


def _table(n: int, results: Floats) -> Floats:
    wins = np.zeros((n, n))
    for i, j, won in results:
        wins[int(i), int(j)] += won
        wins[int(j), int(i)] += 1 - won
    return wins


def ratings(wins: Floats) -> Floats:
    """Elo ratings (n,) with mean 0 that make the wins (n, n) likeliest (Bradley and Terry)."""
    # Among all, also those whose games a bootstrap happens to leave out.
    wins = wins + PRIOR * (1 - np.eye(len(wins)))
    games = wins + wins.T
    strength = np.ones(len(wins))
    for _ in range(2000):
        expected = (games / (strength[:, None] + strength[None, :])).sum(axis=1)
        new = wins.sum(axis=1) / expected
        new /= np.exp(np.log(new).mean())
        if np.abs(np.log(new / strength)).max() < 1e-9:
            break
        strength = new
    return ELO * np.log(strength)


def wilson(wins: float, games: int) -> tuple[float, float]:
    """95 % interval of a share of wins."""
    z, share = 1.959964, wins / games
    middle = share + z**2 / (2 * games)
    half = z * np.sqrt(share * (1 - share) / games + z**2 / (4 * games**2))
    scale = 1 + z**2 / games
    return float((middle - half) / scale), float((middle + half) / scale)


def _standings(
    names: tuple[str, ...], results: Floats, points: Floats, seed: int
) -> tuple[Standing, ...]:
    n = len(names)
    wins = _table(n, results)
    elo = ratings(wins)
    rng = np.random.default_rng(seed)
    drawn = [
        ratings(_table(n, results[rng.integers(len(results), size=len(results))]))
        for _ in range(RESAMPLES)
    ]
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    standings: list[Standing] = []
    for k, name in enumerate(names):
        games = int((wins[k] + wins[:, k]).sum())
        won = float(wins[k].sum())
        share_low, share_high = wilson(won, games)
        standings.append(
            Standing(
                name=name,
                games=games,
                wins=won,
                share=won / games,
                share_low=share_low,
                share_high=share_high,
                elo=float(elo[k]),
                elo_low=float(low[k]),
                elo_high=float(high[k]),
                points_for=float(points[k, 0] / max(points[k, 2], 1)),
                points_against=float(points[k, 1] / max(points[k, 2], 1)),
            )
        )
    return tuple(sorted(standings, key=lambda standing: -standing.elo))


def as_text(tournament: Tournament) -> str:
    """Standings, and who beat whom, for people."""
    width = max(len(name) for name in tournament.names) + 2
    lines = [f"{'':<{width}}{'won':>11}   {'95 %':>9}   {'Elo':>5}   {'95 %':>13}   points an end"]
    for s in tournament.standings:
        lines.append(
            f"{s.name:<{width}}{f'{s.wins:g} of {s.games}':>11}   "
            f"{f'{s.share_low:.0%}–{s.share_high:.0%}':>9}   {s.elo:>+5.0f}   "
            f"{f'{s.elo_low:+.0f} to {s.elo_high:+.0f}':>13}   "
            f"{s.points_for:.2f} : {s.points_against:.2f}"
        )
    lines += ["", "Games won by the row against the column:"]
    lines.append(" " * width + "".join(f"{name:>{width}}" for name in tournament.names))
    for k, name in enumerate(tournament.names):
        row = "".join(
            f"{'·' if j == k else f'{tournament.wins[k, j]:g}':>{width}}"
            for j in range(len(tournament.names))
        )
        lines.append(f"{name:<{width}}{row}")
    return "\n".join(lines)
