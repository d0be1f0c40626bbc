"""Ends played side by side, and a value network fitted to how they were scored.

Before each delivery candidate shots are simulated, and the one is thrown that leads to the highest
value. A league (`agents.playing.league.run`) and `scripts/train_value_network.py` both play and
learn this way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.playing.players.aiming import SPIN
from agents.playing.search.aiming_table import Atlas
from agents.playing.search.positions import SLOTS, Sheet, points_of
from agents.playing.search.shots import Shots, shots_for
from agents.playing.search.value_network import (
    MOST,
    POSITION_FEATURES,
    SCORES,
    STONE_FEATURES,
    Network,
    position_features,
    stone_features,
)
from agents.playing.search.win_probability import Winning
from curling_env.game.rules import RuleSet, rule_set
from curling_env.game.rules.lines import Lines
from curling_env.ice import load_ice
from curling_env.sheet import Direction
from curling_env.throw import Skill
from curling_env.typing import Floats

Players = tuple[Network | None, Network | None]
"""With the hammer, and without; None goes by the rule of thumb."""
Through = Callable[[Iterable[Any], str], Iterable[Any]]
"""Passes items on and shows how far it is: (items, label) -> the same items."""

SIDE_BY_SIDE = 128
"""Ends played at once."""
TRIED, AGAIN, TIMES = 32, 6, 3
"""Shots tried once before a delivery; how many of these are tried again, and how often."""
MOST_ENDS_LEFT, LEADS = 8, 1.7
"""Ends are played as if of games with up to so many ends to come, and leads of this spread."""
WIDTHS = (48, 32, 96, 64)
"""Units of the hidden layers: two for a stone, two for the position."""
GROUP = 8
"""Deliveries of a batch of ends that make one step of learning."""
NEAR = 0.7
"""Distance from the tee at which the rule of thumb counts a stone 1/e [m]."""


class Ends(NamedTuple):
    """Ends that were played side by side.

    Parameters
    ----------
    stones : (deliveries, n, 16, 2) positions after each delivery, hammer's stones first
    score : (n,) of the team with the hammer
    worth : (n, 13) what each score was worth to it
    skill : of the players, for all or (n,); see `agents.playing.search.value_network.skill_of`
    earnest : the delivery from which on nobody threw without a thought, for all or (n,)
    """

    stones: NDArray[np.float32]
    score: NDArray[np.int64]
    worth: Floats
    skill: Floats | float = 0.0
    earnest: NDArray[np.int64] | int = 0


class Careless(NamedTuple):
    """Throws without a thought, with which an end begins.

    Parameters
    ----------
    until : (n,) the delivery from which on each end is in earnest
    habits : (2, n) how fond each team is of draws to the button, the hammer's first
    """

    until: NDArray[np.int64]
    habits: Floats


def sheet_for(ice: str, rules: str) -> Sheet:
    """The sheet that ends are played on; `ice` a file or preset."""
    return Sheet(ice=load_ice(ice), direction=Direction.AWAY, rules=rule_set(rules), lines=Lines())


def worth_of_scores(rules: RuleSet, lead: NDArray[np.int64], left: NDArray[np.int64]) -> Floats:
    """What each score of an end is worth in games with such leads and ends left, (n, 13)."""
    winning = Winning(rules)
    games = zip(lead.tolist(), left.tolist(), strict=True)
    return np.array([winning.of_scores(*game) for game in games])


def spread_of(hand: Skill) -> Floats:
    """Spread of the errors of a hand, (3,): speed [m/s], angle [rad], spin [rad/s]."""
    return np.array([hand.sigma_speed, hand.sigma_angle, hand.sigma_spin])


# --- playing --------------------------------------------------------------------------------------


def play_ends(
    sheet: Sheet,
    players: Players,
    worth: Floats,
    sigma: Floats,
    rng: np.random.Generator,
    *,
    tried: int = TRIED,
    skill: Floats | float = 0.0,
    careless: Careless | None = None,
) -> Ends:
    """Play ends side by side.

    Parameters
    ----------
    worth : (n, 13) of each score to the team with the hammer
    sigma : spread of the throws' errors, (3,) or (n, 3)
    tried : shots tried in the mind before each delivery
    skill : the same spread as the networks see it, for all or (n,)
    careless : how the ends begin; None in earnest
    """
    n = len(worth)
    atlas = Atlas(sheet.ice, sheet.direction)
    sigma, level = np.broadcast_to(sigma, (n, 3)), np.broadcast_to(skill, n)
    earnest = np.zeros(n, dtype=np.int64) if careless is None else careless.until
    stones = np.full((n, SLOTS, 2), np.nan)
    seen: list[Floats] = []
    for delivered in range(sheet.rules.deliveries):
        mover = sheet.mover(delivered)
        shots = shots_for(atlas, sheet, stones, delivered)
        meant = np.empty((n, 3))
        if careless is not None:
            meant = _by_habit(shots, careless.habits[mover], atlas, rng)
        if (earnest <= delivered).any():
            shots = shots[(earnest <= delivered)[shots.position]]
            moment = _Moment(sheet, players[mover], stones, delivered, worth, level)
            chosen = _considered(moment, shots, sigma, tried, rng)
            meant[chosen.position] = chosen.throws
        stones = sheet.play(stones, delivered, meant + rng.standard_normal((n, 3)) * sigma)
        seen.append(stones)
    score = points_of(sheet.lines, stones)
    late = 0 if careless is None else earnest
    return Ends(np.array(seen, dtype=np.float32), score, worth, skill, late)


class _Moment(NamedTuple):
    """Positions of ends side by side, before the same delivery of each."""

    sheet: Sheet
    player: Network | None
    stones: Floats
    delivered: int
    worth: Floats
    skill: Floats

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
            chances = self.player.chances(sheet.lines, after, left, worth, self.skill[at])
            value = (chances * worth).sum(axis=1)
        return value if sheet.mover(self.delivered) == 0 else -value


def _considered(
    moment: _Moment, shots: Shots, sigma: Floats, tried: int, rng: np.random.Generator
) -> Shots:
    """The best shot of each position, by trials: some once, the best of them again."""
    shots = shots[_best(shots.position, rng.random(len(shots)), tried)]
    first = moment.value(shots, rng.standard_normal((len(shots), 3)) * sigma[shots.position])
    best = _best(shots.position, first, AGAIN)
    again = shots[np.repeat(best, TIMES)]
    more = moment.value(again, rng.standard_normal((len(again), 3)) * sigma[again.position])
    mean = (first[best] + more.reshape(-1, TIMES).sum(axis=1)) / (TIMES + 1)
    return shots[best[_best(shots.position[best], mean, 1)]]


def _by_habit(shots: Shots, habit: Floats, atlas: Atlas, rng: np.random.Generator) -> Floats:
    """A throw for each position without a thought, (n, 3): any shot, or a draw to the button."""
    # Hits are many in number; a kind is drawn first.
    rank = rng.random(len(shots)) ** np.bincount(shots.kind)[shots.kind]
    any_shot = shots.throws[_best(shots.position, rank, 1)]
    n = len(habit)
    button = atlas.draws(np.zeros(n), np.zeros(n), SPIN)
    draws = rng.random(n) < np.clip(2 * habit - 0.6, 0, 1)
    return np.where(draws[:, None], button, any_shot)


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
    lived: Iterable[Ends],
    rng: np.random.Generator,
    *,
    layers: Sequence[int] = WIDTHS,
    epochs: int = 8,
    learning_rate: float = 3e-3,
    through: Through = lambda items, label: items,
) -> Network:
    """The network that says best how ends were scored; each is seen in the mirror too.

    Its first weights come from torch's own generator, which the caller seeds.
    """
    import torch
    from torch import nn

    rows = [row for ends in lived for row in _rows_of(lines, ends)]
    a, b, c, d = layers
    stone = nn.Sequential(nn.Linear(STONE_FEATURES, a), nn.ReLU(), nn.Linear(a, b), nn.ReLU())
    position = nn.Sequential(
        nn.Linear(2 * b + POSITION_FEATURES, c), nn.ReLU(), nn.Linear(c, d), nn.ReLU(),
        nn.Linear(d, len(SCORES)),
    )  # fmt: skip
    steps = epochs * -(-len(rows) // GROUP)
    optimiser = torch.optim.AdamW([*stone.parameters(), *position.parameters()], weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, learning_rate, total_steps=steps + 1)
    for _ in through(range(epochs), "learning"):
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


def surprise(network: Network, lines: Lines, ends: Ends) -> float:
    """Minus the log of how likely the network held the scores that came, mean over positions."""
    said: list[Floats] = []
    for left, stones, here, score in _positions_of(ends):
        skill = np.broadcast_to(ends.skill, len(here))[here]
        chances = network.chances(lines, stones, left, ends.worth[here], skill)
        said.append(-np.log(chances[np.arange(len(score)), score] + 1e-9))
    return float(np.concatenate(said).mean())


def _positions_of(ends: Ends) -> Iterable[tuple[int, Floats, NDArray[np.bool_], Any]]:
    """After each delivery in earnest: stones still to come, positions, of which ends, scores."""
    deliveries = len(ends.stones)
    score = np.clip(ends.score, -MOST, MOST) + MOST
    for delivered in range(deliveries - 1):
        here = np.broadcast_to(ends.earnest, len(score)) <= delivered
        stones = ends.stones[delivered][here].astype(np.float64)
        yield deliveries - 1 - delivered, stones, here, score[here]


def _rows_of(lines: Lines, ends: Ends) -> Iterable[_Row]:
    for left, stones, here, score in _positions_of(ends):
        skill = np.broadcast_to(ends.skill, len(here))[here]
        for mirror in (1.0, -1.0):
            mirrored = stones * np.array([mirror, 1.0])
            seen, which = stone_features(lines, mirrored)
            whole = position_features(lines, mirrored, left, ends.worth[here], skill)
            yield _Row(seen, which, whole, score)
