"""What a position is worth: how the end will be scored, learnt from ends played to their end.

A small network sees a position, the stones still to come, how closely the players throw, and what
each score of the end would be worth. It says how likely each score is. Every stone is first looked
at by itself, with its place in the order of shots and what lies before and behind it; what is
found is summed over the stones of each team, so that their order is nothing (Zaheer et al. 2017).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.playing.search.positions import SLOTS, points_of
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.physics.compiled import compiled
from curling_env.storage import atomic_path
from curling_env.throw import SKILLS
from curling_env.typing import Floats, Singles

MOST = 6
"""Points told apart; more count as so many."""
SCORES = np.arange(-MOST, MOST + 1)
"""Scores of the end for the hammer team."""
STONE_FEATURES = 20
POSITION_FEATURES = 17 + 9 + len(SCORES) + 1
FILE = "value_network.npz"


@dataclass(frozen=True, kw_only=True)
class Network:
    """Weights of the network; each layer a matrix and an offset.

    Parameters
    ----------
    layers : two for a stone, three for the position
    """

    layers: tuple[tuple[Singles, Singles], ...]

    def chances(
        self, lines: Lines, stones: Floats, left: int, scores_worth: Floats, skill: Floats | float
    ) -> Floats:
        """How likely each of `SCORES` is, (n, 13).

        Parameters
        ----------
        stones : (n, 16, 2) positions, see `positions`
        left : stones still to be delivered in the end
        scores_worth : (13,) or (n, 13) worth of each score to the hammer team, in any unit
        skill : of the players, for all or (n,); see `skill_of`
        """
        seen, which = stone_features(lines, stones)
        (a, a0), (b, b0), *rest = self.layers
        hidden = np.maximum(np.maximum(seen @ a + a0, 0) @ b + b0, 0)
        summed = np.zeros((len(stones) * SLOTS, hidden.shape[1]), dtype=np.float32)
        summed[which] = hidden
        teams = summed.reshape(len(stones), 2, STONES_PER_TEAM, -1).sum(axis=2)
        x = np.concatenate(
            [
                teams.reshape(len(stones), -1),
                position_features(lines, stones, left, scores_worth, skill),
            ],
            axis=1,
        )
        for weights, offset in rest[:-1]:
            x = np.maximum(x @ weights + offset, 0)
        logits = x @ rest[-1][0] + rest[-1][1]
        logits -= logits.max(axis=1, keepdims=True)
        np.exp(logits, out=logits)
        return (logits / logits.sum(axis=1, keepdims=True)).astype(np.float64)


def load_network(path: Path | None = None) -> Network:
    """A network of `save_network`; without a path the package's own."""
    file = files("agents.playing.search").joinpath(FILE) if path is None else path
    with np.load(BytesIO(file.read_bytes()), allow_pickle=False) as archive:
        layers = len(archive.files) // 2
        return Network(
            layers=tuple(
                (
                    archive[f"weights_{k}"].astype(np.float32),
                    archive[f"offset_{k}"].astype(np.float32),
                )
                for k in range(layers)
            )
        )


def save_network(path: Path, network: Network) -> None:
    """Write a network's arrays in half precision: it is a small file of the package.

    Raises
    ------
    OutputError : the file cannot be written
    """
    arrays: dict[str, Any] = {}
    for k, (weights, offset) in enumerate(network.layers):
        arrays[f"weights_{k}"] = weights.astype(np.float16)
        arrays[f"offset_{k}"] = offset.astype(np.float16)
    with atomic_path(path) as draft, draft.open("wb") as file:
        np.savez_compressed(file, **arrays)


def skill_of(sigma_angle: float) -> float:
    """A player's spread as the network sees it: 0 for `elite`, 1 for e times as wide."""
    elite = SKILLS["elite"].sigma_angle
    return float(np.log(np.clip(sigma_angle / elite, 0.2, 4.0)))


def stone_features(lines: Lines, stones: Floats) -> tuple[Singles, NDArray[np.intp]]:
    """What is seen of each stone.

    Returns
    -------
    features (m, STONE_FEATURES) of the stones there are, and their place in the flat (n · 16)
    """
    which = np.flatnonzero(np.isfinite(stones[:, :, 0].ravel()))
    features = np.zeros((len(which), STONE_FEATURES), dtype=np.float32)
    places = np.ascontiguousarray(stones.reshape(-1, 2)[which])
    _look_at_stones(places, which, lines.reach, lines.stone_radius, features)
    return features, which


@compiled
def _look_at_stones(places: Any, which: Any, reach: float, radius: float, features: Any) -> None:
    begin = 0
    for i in range(len(which)):
        if which[i] // SLOTS != which[begin] // SLOTS:
            begin = i
        end = i + 1
        while end < len(which) and which[end] // SLOTS == which[begin] // SLOTS:
            end += 1
        x, y = places[i]
        distance = math.hypot(x, y)
        own = which[i] % SLOTS < STONES_PER_TEAM
        in_house = distance <= reach
        nearer_own = nearer_other = 0
        line = far = wide = backing = close = close_other = 0.0
        for j in range(begin, end):
            if j == i:
                continue
            dx, dy = places[j, 0] - x, places[j, 1] - y
            same = (which[j] % SLOTS < STONES_PER_TEAM) == own
            other_distance = math.hypot(places[j, 0], places[j, 1])
            if other_distance < distance and other_distance <= reach:
                if same:
                    nearer_own += 1
                else:
                    nearer_other += 1
            narrow = math.exp(-((dx / 0.2) ** 2))
            if dy < -0.25:
                line += narrow
                wide += math.exp(-((dx / 0.45) ** 2))
                if dy < -1.2:
                    far += narrow
            elif dy > 0.1:
                backing += narrow * math.exp(-((dy / 0.5) ** 2))
            near = math.exp(-(dx * dx + dy * dy) / 0.5)
            close += near
            if not same:
                close_other += near
        seen = features[i]
        seen[0] = 1.0 if own else -1.0
        seen[1] = x / 1.5
        seen[2] = y / 1.5
        seen[3] = abs(x) / 1.5
        seen[4] = min(distance, 3.0) / 1.5
        seen[5] = math.exp(-((distance / 0.35) ** 2))
        seen[6] = math.exp(-((distance / 0.9) ** 2))
        seen[7] = in_house
        seen[8] = in_house and nearer_other == 0
        seen[9] = in_house and nearer_other == 0 and nearer_own == 0
        seen[10] = min(nearer_other, 4) / 2
        seen[11] = min(nearer_own, 4) / 2
        seen[12] = line
        seen[13] = far
        seen[14] = wide
        seen[15] = backing
        seen[16] = close
        seen[17] = close_other
        seen[18] = y + radius < 0 and not in_house
        seen[19] = math.exp(-((x / 0.4) ** 2))


def position_features(
    lines: Lines, stones: Floats, left: int, scores_worth: Floats, skill: float | Floats
) -> Singles:
    """What is seen of the position as a whole, (n, POSITION_FEATURES)."""
    n = len(stones)
    features = np.zeros((n, POSITION_FEATURES), dtype=np.float32)
    features[:, min(left, 16)] = 1
    points = np.clip(points_of(lines, stones), -4, 4)
    features[np.arange(n), 17 + 4 + points] = 1
    low = scores_worth.min(axis=-1, keepdims=True)
    span = scores_worth.max(axis=-1, keepdims=True) - low
    features[:, 26 : 26 + len(SCORES)] = (scores_worth - low) / np.maximum(span, 1e-9)
    features[:, -1] = skill
    return features
