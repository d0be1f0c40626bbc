"""Tournament of many games between players, with uncertainties of the ranking."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np

from agents.playing.match import play_game
from curling_env.errors import InputError
from curling_env.game import GameSimulator, Player
from curling_env.game.rules import Game, Team
from curling_env.infrastructure.executor import executor
from curling_env.typing import Floats, Progress, no_progress, with_progress

ELO_PER_LOG_ODDS = 400 / np.log(10)
"""Points of an Elo rating per unit of log odds."""
BOOTSTRAP_SAMPLES = 400
"""Number of resampled tournaments for the intervals of the ratings."""
PRIOR_GAMES = 0.5
"""Number of tied games added for every pair of players, so that ratings stay finite."""


@dataclass(frozen=True, kw_only=True)
class Standing:
    """Result of a player.

    Parameters
    ----------
    name : name of the player
    games, wins : games played and won; a tie is half a win
    share, share_low, share_high : wins over games, and its 95 % interval (Wilson)
    elo, elo_low, elo_high : rating with mean 0 over the players, and its 95 % interval (bootstrap)
    points_for, points_against : points made and conceded per end
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
    """Results of a tournament.

    Parameters
    ----------
    standings : results of the players, the best first
    names : names of the players, in the order of the table
    wins : (n, n) games that the row's player won against the column's; ties count half
    """

    standings: tuple[Standing, ...]
    names: tuple[str, ...]
    wins: Floats

    def as_dict(self) -> dict[str, Any]:
        """Return the results for JSON."""
        return {
            "standings": [asdict(standing) for standing in self.standings],
            "players": list(self.names),
            "wins": self.wins.tolist(),
        }


@dataclass(frozen=True, kw_only=True)
class Fixture:
    """Game to be played, with everything it depends on.

    Parameters
    ----------
    simulator, seed, last_stone : see `play_game`
    players : players of home and away
    places : their indices among the tournament's players
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
    progress: Progress = no_progress,
    workers: int | str = 1,
) -> Tournament:
    """Play a tournament: every pair meets, each player as home and with the hammer equally often.

    Parameters
    ----------
    simulator : ice, rules and skills
    players : two or more players with different names
    games : number of games of every pair of players
    seed : seed of all randomness
    progress : called after each game
    workers : workers that play the games, see `executor`. The result is the same on any number of
        workers, unless a player has a time limit

    Raises
    ------
    InputError : fewer than two players, two with one name, or unknown workers
    """
    names = tuple(player.name for player in players)
    if len(players) < 2 or len(set(names)) < len(names):
        raise InputError("expected two or more players with different names")
    fixtures = _fixtures(simulator, players, games, seed)
    rows: list[tuple[int, int, float]] = []
    points = np.zeros((len(players), 3))  # for, against, ends
    with executor(workers) as crew:
        played = crew.map(_play, fixtures)
        watched = with_progress(fixtures, "games", progress)
        for fixture, game in zip(watched, played, strict=True):
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
    """Return all games in order: every pair meets once, then every pair again, and so on."""
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
    """Play a fixture; return the game at its end."""
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
    """Return Elo ratings (n,) with mean 0 that make the wins (n, n) most likely (Bradley and
    Terry).
    """
    # Every pair gets prior games, also those whose games a bootstrap sample lacks.
    wins = wins + PRIOR_GAMES * (1 - np.eye(len(wins)))
    games = wins + wins.T
    strength = np.ones(len(wins))
    for _ in range(2000):
        expected = (games / (strength[:, None] + strength[None, :])).sum(axis=1)
        new = wins.sum(axis=1) / expected
        new /= np.exp(np.log(new).mean())
        if np.abs(np.log(new / strength)).max() < 1e-9:
            break
        strength = new
    return ELO_PER_LOG_ODDS * np.log(strength)


def wilson(wins: float, games: int) -> tuple[float, float]:
    """Return the 95 % interval of a share of wins."""
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
        for _ in range(BOOTSTRAP_SAMPLES)
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
    """Return the standings and the table of wins as lines of text."""
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
