"""A league for ends: a player meets itself and its past, and learns what positions are worth.

Each generation plays ends, tries shots in the mind before every delivery and throws the one whose
position it thinks worth most. From how those ends were scored a network learns what the positions
were worth, and is the next generation. The first goes by a rule of thumb. Half of a generation's
ends are against a past self, so that it does not forget what beat those.

Every batch of ends has randomness by the run's seed, its generation and its place, and what a
generation played is kept in its file: a run that was killed goes on from its last whole generation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.models import read_model, write_model
from agents.playing.search.atlas import Atlas
from agents.playing.search.positions import SLOTS, Sheet, points_of
from agents.playing.search.shots import Shots, shots_for
from agents.playing.search.winning import Winning
from agents.playing.search.worth import (
    MOST,
    POSITION_FEATURES,
    SCORES,
    STONE_FEATURES,
    Network,
    position_features,
    stone_features,
)
from curling_env.errors import InputError
from curling_env.ice import load_ice
from curling_env.rules import rule_set
from curling_env.rules.lines import Lines
from curling_env.sheet import Direction
from curling_env.skill import skill_named
from curling_env.storage import make_directory

Floats = NDArray[np.float64]
Through = Callable[[Iterable[Any], str], Iterable[Any]]
"""Passes items on and shows how far it is: (items, label) -> the same items."""

SIDE_BY_SIDE = 128
"""Ends played at once."""
AGAIN, TIMES = 6, 3
"""How many of the shots tried are tried again, and how often."""
MOST_ENDS_LEFT, LEADS = 8, 1.7
"""Ends are played as if of games with up to so many ends to come, and leads of this spread."""
GROUP = 8
"""Deliveries of a batch of ends that make one step of learning."""
NEAR = 0.7
"""Distance from the tee at which the rule of thumb counts a stone 1/e [m]."""


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
    tried: int = 32
    layers: tuple[int, int, int, int] = (48, 32, 96, 64)
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


class Ends(NamedTuple):
    """Ends that were played side by side.

    Parameters
    ----------
    stones : (deliveries, n, 16, 2) positions after each delivery, hammer's stones first
    score : (n,) of the team with the hammer
    worth : (n, 13) what each score was worth to it
    """

    stones: NDArray[np.float32]
    score: NDArray[np.int64]
    worth: Floats


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
    sheet = Sheet(
        ice=load_ice(settings.ice),
        direction=Direction.AWAY,
        rules=rule_set(settings.rules),
        lines=Lines(),
    )
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
            network = learn(
                sheet.lines, [*(lived if number > 1 else []), *fresh], settings, number, through
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
        ends = play_ends(sheet, pair, settings, rng)
        fresh.append(ends)
        if past:
            scored.setdefault(opponent, []).append(ends.score if with_hammer else -ends.score)
    meetings = []
    for opponent, scores in sorted(scored.items()):
        every = np.concatenate(scores)
        error = float(every.std() / np.sqrt(len(every)))
        meetings.append(Meeting(opponent, len(every), float(every.mean()), error))
    return fresh, meetings


def play_ends(
    sheet: Sheet,
    players: tuple[Network | None, Network | None],
    settings: LeagueSettings,
    rng: np.random.Generator,
    n: int = SIDE_BY_SIDE,
) -> Ends:
    """Play ends side by side.

    Parameters
    ----------
    players : with the hammer, and without; None goes by the rule of thumb
    n : ends
    """
    atlas = Atlas(sheet.ice, sheet.direction)
    winning = Winning(sheet.rules)
    left = rng.integers(1, MOST_ENDS_LEFT + 1, n).tolist()
    lead = np.rint(rng.normal(0, LEADS, n)).astype(int).tolist()
    worth = np.array([winning.of_scores(*game) for game in zip(lead, left, strict=True)])
    hand = skill_named(settings.skill)
    sigma = np.array([hand.sigma_speed, hand.sigma_angle, hand.sigma_spin])
    stones = np.full((n, SLOTS, 2), np.nan)
    seen: list[Floats] = []
    for delivered in range(sheet.rules.deliveries):
        mover = sheet.mover(delivered)
        moment = _Moment(sheet, players[mover], stones, delivered, worth)
        shots = shots_for(atlas, sheet, stones, delivered)
        shots = shots[_best(shots.position, rng.random(len(shots)), settings.tried)]
        first = moment.value(shots, rng.standard_normal((len(shots), 3)) * sigma)
        best = _best(shots.position, first, AGAIN)
        again = shots[np.repeat(best, TIMES)]
        more = moment.value(again, rng.standard_normal((len(again), 3)) * sigma)
        mean = (first[best] + more.reshape(-1, TIMES).sum(axis=1)) / (TIMES + 1)
        chosen = best[_best(shots.position[best], mean, 1)]
        meant = np.empty((n, 3))
        meant[shots.position[chosen]] = shots.throws[chosen]
        stones = sheet.play(stones, delivered, meant + rng.standard_normal((n, 3)) * sigma)
        seen.append(stones)
    return Ends(np.array(seen, dtype=np.float32), points_of(sheet.lines, stones), worth)


class _Moment(NamedTuple):
    """Positions of ends side by side, before the same delivery of each."""

    sheet: Sheet
    player: Network | None
    stones: Floats
    delivered: int
    worth: Floats

    def value(self, shots: Shots, errors: Floats) -> Floats:
        """What each shot with its error leads to, for the team that throws it."""
        at, sheet = shots.position, self.sheet
        after = sheet.play(self.stones[at], self.delivered, shots.throws + errors)
        left = sheet.rules.deliveries - self.delivered - 1
        worth = self.worth[at]
        points = points_of(sheet.lines, after)
        if left == 0:
            value = worth[np.arange(len(after)), np.clip(points, -MOST, MOST) + MOST]
        elif self.player is None:
            value = _by_thumb(sheet, after, points, left, worth)
        else:
            chances = self.player.chances(sheet.lines, after, left, worth, 0.0)
            value = (chances * worth).sum(axis=1)
        return value if sheet.mover(self.delivered) == 0 else -value


def _by_thumb(
    sheet: Sheet, stones: Floats, points: NDArray[np.int64], left: int, worth: Floats
) -> Floats:
    """What lies counts the more the later, and near stones are worth having."""
    near = np.nan_to_num(np.exp(-np.hypot(stones[:, :, 0], stones[:, :, 1]) / NEAR))
    half = SLOTS // 2
    net = near[:, :half].sum(axis=1) - near[:, half:].sum(axis=1)
    played = 1 - left / sheet.rules.deliveries
    guess = played * points + (1 - 0.5 * played) * net + 0.5 * (1 - played)
    at = np.clip(guess + MOST, 0, 2 * MOST - 1e-9)
    k, rows = at.astype(int), np.arange(len(stones))
    return worth[rows, k] * (1 - at + k) + worth[rows, k + 1] * (at - k)


def _best(position: NDArray[np.intp], value: Floats, most: int) -> NDArray[np.intp]:
    """Indices of the best `most` of each position."""
    order = np.lexsort((-value, position))
    starts = np.r_[True, np.diff(position[order]) != 0]
    begin = np.maximum.accumulate(np.where(starts, np.arange(len(order)), 0))
    return order[np.arange(len(order)) - begin < most]


# --- learning -------------------------------------------------------------------------------------


class _Row(NamedTuple):
    """What is seen of a batch's positions after one delivery, and how the ends were scored."""

    stones: NDArray[np.float32]
    which: NDArray[np.intp]
    position: NDArray[np.float32]
    score: NDArray[np.int64]


def learn(
    lines: Lines,
    lived: list[Ends],
    settings: LeagueSettings,
    number: int,
    through: Through = lambda items, label: items,
) -> Network:
    """The network that says best how ends were scored; each is seen in the mirror too."""
    import torch
    from torch import nn

    rows = [row for ends in lived for row in _rows_of(lines, ends)]
    torch.manual_seed(settings.seed + number)
    rng = np.random.default_rng((settings.seed, number, 2**21))
    a, b, c, d = settings.layers
    stone = nn.Sequential(nn.Linear(STONE_FEATURES, a), nn.ReLU(), nn.Linear(a, b), nn.ReLU())
    position = nn.Sequential(
        nn.Linear(2 * b + POSITION_FEATURES, c), nn.ReLU(), nn.Linear(c, d), nn.ReLU(),
        nn.Linear(d, len(SCORES)),
    )  # fmt: skip
    steps = settings.epochs * -(-len(rows) // GROUP)
    optimiser = torch.optim.AdamW([*stone.parameters(), *position.parameters()], weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, settings.learning_rate, total_steps=steps + 1
    )
    for _ in through(range(settings.epochs), "learning"):
        order = rng.permutation(len(rows))
        for begin in range(0, len(rows), GROUP):
            some = [rows[k] for k in order[begin : begin + GROUP]]
            begins = np.cumsum([0, *(SLOTS * len(row.score) for row in some)])
            team = np.concatenate([r.which + at for r, at in zip(some, begins, strict=False)])
            team //= SLOTS // 2
            ends = sum(len(row.score) for row in some)
            looked = stone(torch.from_numpy(np.concatenate([row.stones for row in some])))
            teams = torch.zeros(2 * ends, b).index_add(0, torch.from_numpy(team), looked)
            whole = torch.from_numpy(np.concatenate([row.position for row in some]))
            logits = position(torch.cat([teams.reshape(ends, -1), whole], dim=1))
            score = torch.from_numpy(np.concatenate([row.score for row in some]))
            loss = nn.functional.cross_entropy(logits, score)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
    linear = [module for module in (*stone, *position) if isinstance(module, nn.Linear)]
    return Network(
        layers=tuple(
            (m.weight.detach().numpy().T.copy(), m.bias.detach().numpy().copy()) for m in linear
        )
    )


def _rows_of(lines: Lines, ends: Ends) -> Iterable[_Row]:
    deliveries = len(ends.stones)
    score = np.clip(ends.score, -MOST, MOST) + MOST
    for delivered in range(deliveries - 1):
        for mirror in (1.0, -1.0):
            stones = ends.stones[delivered] * np.array([mirror, 1.0])
            seen, which = stone_features(lines, stones)
            left = deliveries - 1 - delivered
            yield _Row(seen, which, position_features(lines, stones, left, ends.worth, 0.0), score)


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
