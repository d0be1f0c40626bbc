"""Value of a position: the score of its end, learned from complete ends.

A small network sees a position, the stones still to come, the players' accuracy, and the value of
each score of the end. It predicts the probability of each score. Every stone is first described
separately, with its place in the order of shots and the stones in front of it and behind it. These
descriptions are summed over the stones of each team, so that their order does not matter (Zaheer et
al. 2017).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri, stdtrit

from agents.learning.model_file import check_finite, read_model, write_model
from agents.playing.search.positions import SCORES, SLOTS, points_of
from curling_env.errors import InputError
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.physics.compiled import compiled
from curling_env.throw import SKILLS, Skill
from curling_env.typing import Floats, Indices, Singles

FILE = "value_network.npz"
"""The package's own network."""

(
    IS_HAMMERS,
    X,
    Y,
    ABS_X,
    DISTANCE,
    NEAR_BUTTON,
    NEAR_TEE,
    IN_HOUSE,
    COUNTS,
    IS_SHOT_STONE,
    NEARER_OPPONENTS,
    NEARER_OWN,
    IN_FRONT,
    FAR_IN_FRONT,
    WIDELY_IN_FRONT,
    BEHIND,
    CLOSE_BY,
    OPPONENTS_CLOSE_BY,
    IN_FREE_GUARD_ZONE,
    NEAR_CENTRE_LINE,
    STONE_FEATURES,
) = range(21)
"""Columns of the features of a stone, and their number."""
STONES_LEFT = slice(0, SLOTS + 1)
POINTS_NOW = slice(STONES_LEFT.stop, STONES_LEFT.stop + 9)
SCORE_VALUES = slice(POINTS_NOW.stop, POINTS_NOW.stop + len(SCORES))
POSITION_FEATURES = SCORE_VALUES.stop + 1
"""Columns of the features of a position: one-hot stones left and points now (−4 to 4), score values
from 0 to 1, and last the skill."""


@dataclass(frozen=True, kw_only=True)
class ValueNetwork:
    """Weights of the network.

    Parameters
    ----------
    layers : a matrix and an offset for each layer; two layers for a stone, three for the position
    """

    layers: tuple[tuple[Singles, Singles], ...]

    def score_probabilities(
        self, lines: Lines, stones: Floats, left: int, score_values: Floats, skill: Floats | float
    ) -> Floats:
        """Return the probability of each of `SCORES`, (n, 13).

        Parameters
        ----------
        lines : lines of the sheet
        stones : (n, 16, 2) positions, see `positions`
        left : number of stones still to come in the end
        score_values : (13,) or (n, 13) value of each score to the hammer team, in any unit
        skill : skill of the players, for all or (n,); see `skill_feature`
        """
        features, places = stone_features(lines, stones)
        (a, a0), (b, b0), *rest = self.layers
        hidden = np.maximum(np.maximum(features @ a + a0, 0) @ b + b0, 0)
        summed = np.zeros((len(stones) * SLOTS, hidden.shape[1]), dtype=np.float32)
        summed[places] = hidden
        teams = summed.reshape(len(stones), 2, STONES_PER_TEAM, hidden.shape[1]).sum(axis=2)
        whole = position_features(lines, stones, left, score_values, skill)
        x = np.concatenate([teams.reshape(len(stones), 2 * hidden.shape[1]), whole], axis=1)
        for weights, offset in rest[:-1]:
            x = np.maximum(x @ weights + offset, 0)
        logits = x @ rest[-1][0] + rest[-1][1]
        logits -= logits.max(axis=1, keepdims=True)
        np.exp(logits, out=logits)
        return (logits / logits.sum(axis=1, keepdims=True)).astype(np.float64)


def network_from(document: Mapping[str, Any], source: str | Path) -> ValueNetwork:
    """Return the network in the document of a model file; see `agents.learning.model_file`.

    Raises
    ------
    InputError : the weights are not those of such a network
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
        raise InputError("contains weights that do not fit its settings", source=source)
    check_finite(document["layers"], source)
    return ValueNetwork(
        layers=tuple((w.astype(np.float32), b.astype(np.float32)) for w, b in layers)
    )


def load_network(path: Path | None = None) -> ValueNetwork:
    """Load a network from a file; without a path, the package's own.

    Raises
    ------
    InputError : a missing file, or another kind of network
    """
    if path is not None:
        return network_from(read_model(path), path)
    with as_file(files("agents.playing.search").joinpath(FILE)) as own:
        return network_from(read_model(own), own)


def save_network(path: Path, network: ValueNetwork) -> None:
    """Write a network in half precision, so that the package's own file stays small.

    Raises
    ------
    OutputError : the file cannot be written
    """
    layers = [[array.astype(np.float16) for array in layer] for layer in network.layers]
    write_model(path, {"layers": layers})


def skill_feature(skill: Skill) -> float:
    """Return a player's error of line on the network's scale: 0 for `elite`, 1 for e times as
    much.

    The networks learned from normal errors. Errors with heavy tails count as the normal errors with
    the same median: the same standard deviation would take the usual throws for much worse.
    """
    usual = skill.sigma_angle / SKILLS["elite"].sigma_angle
    if skill.tails < math.inf:
        core = float(stdtrit(skill.tails, 0.75) / ndtri(0.75))
        usual *= core * math.sqrt((skill.tails - 2) / skill.tails)
    return float(np.log(np.clip(usual, 0.2, 4.0)))


def stone_features(lines: Lines, stones: Floats) -> tuple[Singles, Indices]:
    """Return features of every stone in positions (n, 16, 2).

    Returns
    -------
    features (m, STONE_FEATURES) of the m stones, and their places in the flattened (n · 16)
    positions
    """
    present = np.flatnonzero(np.isfinite(stones[:, :, 0].ravel()))
    features = np.zeros((len(present), STONE_FEATURES), dtype=np.float32)
    places = np.ascontiguousarray(stones.reshape(-1, 2)[present])
    _fill_stone_features(places, present, lines.reach, lines.stone_radius, features)
    return features, present


@compiled
def _fill_stone_features(
    places: Any, present: Any, reach: float, radius: float, features: Any
) -> None:
    begin = 0
    for i in range(len(present)):
        if present[i] // SLOTS != present[begin] // SLOTS:
            begin = i
        end = i + 1
        while end < len(present) and present[end] // SLOTS == present[begin] // SLOTS:
            end += 1
        x, y = places[i]
        distance = math.hypot(x, y)
        own = present[i] % SLOTS < STONES_PER_TEAM
        in_house = distance <= reach
        nearer_own = nearer_opponents = 0
        line = far = wide = behind = close = opponents_close = 0.0
        for j in range(begin, end):
            if j == i:
                continue
            dx, dy = places[j, 0] - x, places[j, 1] - y
            same = (present[j] % SLOTS < STONES_PER_TEAM) == own
            other_distance = math.hypot(places[j, 0], places[j, 1])
            if other_distance < distance and other_distance <= reach:
                if same:
                    nearer_own += 1
                else:
                    nearer_opponents += 1
            narrow = math.exp(-((dx / 0.2) ** 2))
            if dy < -0.25:
                line += narrow
                wide += math.exp(-((dx / 0.45) ** 2))
                if dy < -1.2:
                    far += narrow
            elif dy > 0.1:
                behind += narrow * math.exp(-((dy / 0.5) ** 2))
            near = math.exp(-(dx * dx + dy * dy) / 0.5)
            close += near
            if not same:
                opponents_close += near
        row = features[i]
        row[IS_HAMMERS] = 1.0 if own else -1.0
        row[X] = x / 1.5
        row[Y] = y / 1.5
        row[ABS_X] = abs(x) / 1.5
        row[DISTANCE] = min(distance, 3.0) / 1.5
        row[NEAR_BUTTON] = math.exp(-((distance / 0.35) ** 2))
        row[NEAR_TEE] = math.exp(-((distance / 0.9) ** 2))
        row[IN_HOUSE] = in_house
        row[COUNTS] = in_house and nearer_opponents == 0
        row[IS_SHOT_STONE] = in_house and nearer_opponents == 0 and nearer_own == 0
        row[NEARER_OPPONENTS] = min(nearer_opponents, 4) / 2
        row[NEARER_OWN] = min(nearer_own, 4) / 2
        row[IN_FRONT] = line
        row[FAR_IN_FRONT] = far
        row[WIDELY_IN_FRONT] = wide
        row[BEHIND] = behind
        row[CLOSE_BY] = close
        row[OPPONENTS_CLOSE_BY] = opponents_close
        row[IN_FREE_GUARD_ZONE] = y + radius < 0 and not in_house
        row[NEAR_CENTRE_LINE] = math.exp(-((x / 0.4) ** 2))


def position_features(
    lines: Lines, stones: Floats, left: int, score_values: Floats, skill: float | Floats
) -> Singles:
    """Return features of positions as a whole, (n, POSITION_FEATURES); see
    `score_probabilities`.
    """
    n = len(stones)
    features = np.zeros((n, POSITION_FEATURES), dtype=np.float32)
    features[:, min(left, SLOTS)] = 1
    points = np.clip(points_of(lines, stones), -4, 4)
    features[np.arange(n), POINTS_NOW.start + 4 + points] = 1
    low = score_values.min(axis=-1, keepdims=True)
    span = score_values.max(axis=-1, keepdims=True) - low
    features[:, SCORE_VALUES] = (score_values - low) / np.maximum(span, 1e-9)
    features[:, -1] = skill
    return features
