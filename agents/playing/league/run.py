"""A league for ends: a player meets itself and its past, and learns what positions are worth.

Each generation plays ends, tries shots in the mind before every delivery and throws the one whose
position it thinks worth most. From how those ends were scored a network learns what the positions
were worth, and is the next generation. The first goes by a rule of thumb. Half of a generation's
ends are against a past self, so that it does not forget what beat those.

Every batch of ends has randomness by the run's seed, its generation and its place, and what a
generation played is kept in its file: a run that was killed goes on from its last whole generation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.learning.model_file import read_model, write_model
from agents.playing.league.self_play import (
    AGAIN,
    LEADS,
    MOST_ENDS_LEFT,
    SIDE_BY_SIDE,
    TRIED,
    WIDTHS,
    Ends,
    Players,
    Through,
    learn,
    play_ends,
    sheet_for,
    spread_of,
    worth_of_scores,
)
from agents.playing.search.positions import Sheet
from agents.playing.search.value_network import POSITION_FEATURES, SCORES, STONE_FEATURES, Network
from curling_env.errors import InputError
from curling_env.game.rules import rule_set
from curling_env.storage import make_directory
from curling_env.throw import skill_named


@dataclass(frozen=True, kw_only=True)
class LeagueSettings:
    """Who plays whom, how often, and how it learns.

    Parameters
    ----------
    generations : ends that each plays
    past : share of them against past selves
    tried : shots tried in the mind before each delivery
    layers : units: two for what is seen of a stone, two for the position
    epochs : how often a generation goes through what was played
    learning_rate : at its highest
    ice : file or preset that is played on
    skill : of all players' hands
    rules : of the game
    seed : of all randomness

    Raises
    ------
    InputError : a setting that makes no sense, or that nobody knows
    """

    generations: tuple[int, ...] = (512, 768, 1536)
    past: float = 0.5
    tried: int = TRIED
    layers: tuple[int, int, int, int] = WIDTHS
    epochs: int = 8
    learning_rate: float = 3e-3
    ice: str = "standard"
    skill: str = "elite"
    rules: str = "world_curling_2024"
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in (("generations", 1), ("layers", 1)):
            value = getattr(self, name)
            if not value or not all(isinstance(n, int) and n >= least for n in value):
                raise InputError(f"{name} must list whole numbers of 1 or more, got {value!r}")
        if len(self.layers) != 4:
            raise InputError(f"layers must be four, got {self.layers!r}")
        if not 0 <= self.past <= 1:
            raise InputError(f"past must lie within 0 and 1, got {self.past}")
        if self.tried < AGAIN or self.epochs < 1 or not 0 < self.learning_rate < 1:
            raise InputError(f"tried is at least {AGAIN}, epochs 1, learning_rate within 0 and 1")
        skill_named(self.skill)
        rule_set(self.rules)


def league_from(document: dict[str, Any], **others: Any) -> LeagueSettings:
    """Settings from the mapping that a configuration file holds.

    Raises
    ------
    InputError : an unknown key, or a value that makes no sense
    """
    given = {**document, **others}
    given.pop("algorithm", None)
    known = [f.name for f in fields(LeagueSettings)]
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise InputError(f"unknown key {unknown[0]!r} in a league; known are {', '.join(known)}")
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in given.items()
    }
    return LeagueSettings(**values)


class Meeting(NamedTuple):
    """What a generation scored against an opponent.

    Parameters
    ----------
    opponent : generation; 0 for the rule of thumb
    ends : played
    points : scored less conceded, an end
    error : standard error of that
    """

    opponent: int
    ends: int
    points: float
    error: float


def run_league(
    directory: str | Path,
    settings: LeagueSettings,
    *,
    through: Through = lambda items, label: items,
    tell: Callable[[str], None] = lambda text: None,
) -> Network:
    """Play the league, generation after generation, and leave each one's file in a folder.

    What is already there, of the same settings, is taken up. The last is `model.npz` too.

    Raises
    ------
    InputError : a file in the folder of other settings
    OutputError : a file cannot be written
    """
    import torch

    torch.set_num_threads(1)
    folder = make_directory(directory)
    sheet = sheet_for(settings.ice, settings.rules)
    players: list[Network | None] = [None]
    lived: list[Ends] = []
    for number in range(len(settings.generations)):
        path = folder / f"generation-{number + 1}.npz"
        if path.exists():
            network, fresh = _taken_up(path, settings)
        else:
            fresh, meetings = _season(sheet, players, settings, number, through)
            for meeting in meetings:
                tell(_in_words(number, meeting))
            # How the rule of thumb plays is soon of no interest.
            torch.manual_seed(settings.seed + number)
            network = learn(
                sheet.lines,
                [*(lived if number > 1 else []), *fresh],
                np.random.default_rng((settings.seed, number, 2**21)),
                layers=settings.layers,
                epochs=settings.epochs,
                learning_rate=settings.learning_rate,
                through=through,
            )
            write_model(
                path, {**_document(network, settings), "ends": [e._asdict() for e in fresh]}
            )
        players.append(network)
        lived = [*(lived if number > 1 else []), *fresh]
    best = players[-1]
    assert best is not None
    write_model(folder / "model.npz", _document(best, settings))
    return best


def load_ends_network(document: dict[str, Any], source: str | Path) -> Network:
    """The network of a model's document.

    Raises
    ------
    InputError : weights that are not those of such a network
    """
    try:
        layers = tuple((np.asarray(w), np.asarray(b)) for w, b in document["layers"])
        sizes = [w.shape for w, _ in layers]
        fits = all(w.shape[1] == len(b) for w, b in layers) and len(layers) == 5
        fits &= sizes[0][0] == STONE_FEATURES and sizes[-1][1] == len(SCORES)
        fits &= sizes[2][0] == 2 * sizes[1][1] + POSITION_FEATURES
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError("is not a trained model of this project", source=source) from error
    if not fits:
        raise InputError("holds weights that do not fit its settings", source=source)
    return Network(layers=layers)


# --- playing --------------------------------------------------------------------------------------


def _season(
    sheet: Sheet,
    players: list[Network | None],
    settings: LeagueSettings,
    number: int,
    through: Through,
) -> tuple[list[Ends], list[Meeting]]:
    """The ends of one generation, and what it scored against past selves."""
    batches = -(-settings.generations[number] // SIDE_BY_SIDE)
    newest, fresh = len(players) - 1, []
    scored: dict[int, list[NDArray[np.int64]]] = {}
    for place in through(range(batches), f"generation {number + 1}"):
        # Two batches after another have one opponent, once with and once without the hammer.
        draw = np.random.default_rng((settings.seed, number, 2**20 + place // 2))
        past = newest > 0 and draw.random() < settings.past
        opponent = int(draw.integers(newest)) if past else newest
        rng = np.random.default_rng((settings.seed, number, place))
        with_hammer = bool(place % 2)
        first, second = players[newest], players[opponent]
        pair = (first, second) if with_hammer else (second, first)
        ends = _play_batch(sheet, pair, settings, rng)
        fresh.append(ends)
        if past:
            scored.setdefault(opponent, []).append(ends.score if with_hammer else -ends.score)
    meetings = []
    for opponent, scores in sorted(scored.items()):
        every = np.concatenate(scores)
        error = float(every.std() / np.sqrt(len(every)))
        meetings.append(Meeting(opponent, len(every), float(every.mean()), error))
    return fresh, meetings


def _play_batch(
    sheet: Sheet, players: Players, settings: LeagueSettings, rng: np.random.Generator
) -> Ends:
    """Ends of games as they come, by hands of the league's skill."""
    left = rng.integers(1, MOST_ENDS_LEFT + 1, SIDE_BY_SIDE)
    lead = np.rint(rng.normal(0, LEADS, SIDE_BY_SIDE)).astype(int)
    worth = worth_of_scores(sheet.rules, lead, left)
    sigma = spread_of(skill_named(settings.skill))
    return play_ends(sheet, players, worth, sigma, rng, tried=settings.tried)


# --- files ----------------------------------------------------------------------------------------


def _document(network: Network, settings: LeagueSettings) -> dict[str, Any]:
    return {"league": asdict(settings), "layers": [list(layer) for layer in network.layers]}


def _taken_up(path: Path, settings: LeagueSettings) -> tuple[Network, list[Ends]]:
    document = read_model(path)
    try:
        saved = league_from(document["league"])
        ends = [Ends(**played) for played in document["ends"]]
    except (KeyError, TypeError, InputError) as error:
        raise InputError("is not a generation of a league", source=path) from error
    if saved != settings:
        raise InputError("is of a league with other settings; choose another folder", source=path)
    return load_ends_network(document, path), ends


def _in_words(number: int, meeting: Meeting) -> str:
    who = f"generation {meeting.opponent}" if meeting.opponent else "the rule of thumb"
    return (
        f"generation {number} against {who}: {meeting.points:+.2f} ± {meeting.error:.2f} points an "
        f"end in {meeting.ends} ends"
    )
