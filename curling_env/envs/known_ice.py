"""Ice features of an observation, as numbers within ±1.

The mean friction, its differences from place to place, and every parameter of every effect
according to its card: one number each, unless a card combines two. Everything is relative to the
direction of play, so that a policy learned towards one end applies to the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from curling_env.ice import ActiveEffect, Ice
from curling_env.physics.effects import EffectCard, Parameter, catalogue
from curling_env.physics.effects.card import Values
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, TEE_Y, Direction, Sheet, to_sheet
from curling_env.typing import Floats, Singles

# The layout and the scales of an observation. A change to any of them makes a new version of the
# environments.
BANDS = 8
"""Number of bands of ice from the delivery hog line to the far back line whose μ is observed."""
LANES = ("left", "middle", "right")
"""Thirds of the sheet's width whose μ is observed, along the direction of play."""
MU_SCALE = 0.01
"""Friction that counts as 0; friction e² times as large counts as 1."""
VARIATION_SCALE = 0.2
"""Relative difference of a band's friction from the mean that counts as 1."""
WEAR_SCALE = 0.05
"""Relative change of a band's friction by wear that counts as 1."""
LINEAR = 0.5
"""Largest unchanged number; larger ones approach ±1 without clipping."""


def squash(value: ArrayLike) -> Floats:
    """Squash numbers into the range of an observation, ±1; different numbers stay different."""
    value = np.asarray(value, dtype=np.float64)
    size = np.abs(value)
    beyond = 1.0 - LINEAR**2 / np.maximum(size, LINEAR)
    return np.where(size <= LINEAR, value, np.copysign(beyond, value))


def unsquash(value: ArrayLike) -> Floats:
    """Invert `squash`."""
    value = np.asarray(value, dtype=np.float64)
    room = np.maximum(1.0 - np.abs(value), np.finfo(np.float32).eps)
    return np.where(room >= LINEAR, value, np.copysign(LINEAR**2 / room, value))


def mean_friction(value: ArrayLike) -> Floats:
    """Return the mean friction of the first number of `KnownIce.features`.

    It is limited to e² times more or less than `MU_SCALE`, far beyond any curling ice.
    """
    return MU_SCALE * np.exp(2 * np.clip(unsquash(value), -1.0, 1.0))


def observed_parameters() -> list[tuple[EffectCard, Parameter, float]]:
    """List the observed effect parameters of the ice, according to their cards.

    Returns
    -------
    card, parameter and the value that counts as 1, in order; an effect that the ice does not have
    reads 0, and one of which an ice may have several is listed as often as it is observed
    """
    return [
        (card, parameter, _scale(card, parameter))
        for card in _cards(of_stones=False)
        for _ in range(card.observed_times)
        for parameter in card.observed_parameters
    ]


def ice_names() -> tuple[str, ...]:
    """Return the names of the numbers of `KnownIce.features`, in order."""
    effects: list[str] = []
    for card in _cards(of_stones=False):
        for number in range(card.observed_times):
            name = card.name if number == 0 else f"{card.name} {number + 1}"
            effects += [f"{name}.{parameter.name}" for parameter in card.observed_parameters]
    bands = (f"friction of band {i + 1}, {lane}" for i in range(BANDS) for lane in LANES)
    return ("mean friction", *bands, *effects)


def wear_names() -> tuple[str, ...]:
    """Return the names of the numbers of `KnownIce.wear`, in order."""
    return tuple(f"wear of band {i + 1}, {lane}" for i in range(BANDS) for lane in LANES)


def stone_names() -> tuple[str, ...]:
    """Return the names of the numbers of `KnownIce.of_stones` for one stone, in order."""
    return tuple(f"{card.name}.{parameter.name}" for card, parameter in _stone_parameters())


class KnownIce:
    """An ice as an agent observes it.

    Parameters
    ----------
    ice : the ice as it is known
    observed : the ice with what else is observed, such as how it will change; by default the same
    """

    def __init__(self, ice: Ice, observed: Ice | None = None) -> None:
        self.ice = ice
        self._observed = observed or ice
        self._features: dict[Direction, Singles] = {}
        self._of_stones = _own_numbers(self._observed)
        self._numbers_of_a_stone = len(stone_names())

    def features(self, direction: Direction) -> Singles:
        """Return the ice features along a direction of play, in the order of `ice_names`."""
        if direction not in self._features:
            features = ice_features(self._observed, direction)
            features.setflags(write=False)
            self._features[direction] = features
        return self._features[direction]

    def of_stones(self, identifiers: Sequence[int]) -> Singles:
        """Return features of stones, (k, m) in the order of `stone_names`; 0 for usual ones."""
        numbers = np.zeros((len(identifiers), self._numbers_of_a_stone), dtype=np.float32)
        if self._of_stones:
            for row, identifier in enumerate(identifiers):
                if identifier in self._of_stones:
                    numbers[row] = squash(self._of_stones[identifier])
        return numbers

    def wear(self, wear: Floats | None, direction: Direction) -> Singles:
        """Return the wear of bands of the ice since the game began, in the order of `wear_names`.

        Parameters
        ----------
        wear : (rows, columns) logarithm of each cell's friction over what it was; None for no wear
        direction : the end played to
        """
        if wear is None:
            return np.zeros(BANDS * len(LANES), dtype=np.float32)
        worn = wear[self.ice.sheet.cell_of(_points(self.ice.sheet, direction))]
        return squash(_band_means(worn).ravel() / WEAR_SCALE).astype(np.float32)


def ice_features(ice: Ice, direction: Direction) -> Singles:
    """Return the observed features of an ice along a direction of play.

    Parameters
    ----------
    ice : the ice as the agent knows it
    direction : the end played to

    Returns
    -------
    within ±1, in the order of `ice_names`: the mean μ, the difference from it in each band and
    lane, the parameters of the effects
    """
    effects = effect_numbers(ice, direction)[None]
    return features_of_maps(ice, ice.friction.mu[None], effects, direction)[0]


def features_of_maps(ice: Ice, mu: Floats, effects: Floats, direction: Direction) -> Singles:
    """Return the features of many ices, (n, m) as `ice_features`.

    Parameters
    ----------
    ice : one of them, for its cells
    mu : (n, rows, columns) friction of each
    effects : (n, k) numbers of their effects, from `effect_numbers`
    direction : the end played to
    """
    return squash(np.hstack([_map_numbers(ice, mu, direction), effects])).astype(np.float32)


def _map_numbers(ice: Ice, mu: Floats, direction: Direction) -> Floats:
    """Return the mean of maps (n, rows, columns) on the cells of an ice, and differences from it,
    (n, 25).
    """
    weights = _band_weights(ice.sheet, ice.friction.interpolation == "bilinear", direction)
    bands = mu.reshape(len(mu), -1) @ weights
    mean = bands.mean(axis=1, keepdims=True)
    return np.hstack([np.log(mean / MU_SCALE) / 2, (bands / mean - 1) / VARIATION_SCALE])


@lru_cache(maxsize=16)
def _band_weights(sheet: Sheet, bilinear: bool, direction: Direction) -> Floats:
    """Weight of each cell's friction in the mean of each band and lane, (cells, bands)."""
    points = _points(sheet, direction)
    weights = np.zeros((*sheet.shape, BANDS * len(LANES)))
    band = np.repeat(np.arange(BANDS), _ALONG)[:, None] * len(LANES)
    band = band + np.repeat(np.arange(len(LANES)), _ACROSS)
    if not bilinear:
        np.add.at(weights, (*sheet.cell_of(points), band), 1.0)
    else:
        (i, i1), (j, j1), u, v = sheet.cells_around(points)
        for row, share in ((i, 1 - u), (i1, u)):
            for column, part in ((j, 1 - v), (j1, v)):
                np.add.at(weights, (row, column, band), share * part)
    return weights.reshape(-1, BANDS * len(LANES)) / (_ALONG * _ACROSS)


def effect_numbers(ice: Ice, direction: Direction) -> Floats:
    """Return the parameters of an ice's effects on the scales of their cards, before squashing."""
    numbers: list[float] = []
    for card in _cards(of_stones=False):
        effects = [effect for effect in ice.effects if effect.name == card.name]
        numbers += _numbers(card, effects, direction)
    return np.array(numbers)


def _cards(*, of_stones: bool) -> list[EffectCard]:
    """Return cards of the effects on a stone: those of single stones, or all others."""
    felt = [card for card in catalogue().values() if card.is_physical and card.acts != "map"]
    chosen = [card for card in felt if (card.search.stone is not None) is of_stones]
    return sorted(chosen, key=lambda card: card.observed_order)


def _numbers(card: EffectCard, effects: list[ActiveEffect], direction: Direction) -> list[float]:
    """Return the parameters of the effects of one name; surplus ones are added to the last."""
    rows = np.zeros((card.observed_times, len(card.observed_parameters)))
    for number, effect in enumerate(effects):
        given = _values(card, effect)
        if direction is Direction.HOME:
            given = card.from_other_end(given)
        rows[min(number, len(rows) - 1)] += [
            (given[p.name] - (p.neutral or 0.0)) / _scale(card, p) for p in card.observed_parameters
        ]
    return rows.ravel().tolist()


def _values(card: EffectCard, effect: ActiveEffect) -> Values:
    """Return all observed parameters of an effect, including those absent from the ice."""
    names = (parameter.name for parameter in card.parameters)
    given = dict(zip(names, card.theta(effect.parameters), strict=True))
    for parameter in card.parameters:
        if parameter.observed_with:
            given[parameter.observed_with] += given[parameter.name]
    return given


def _scale(card: EffectCard, parameter: Parameter) -> float:
    """Return the difference from the neutral value that counts as 1."""
    if parameter.name in card.observed:
        return card.observed[parameter.name]
    zero = parameter.neutral or 0.0
    widest = max(abs(parameter.low - zero), abs(parameter.high - zero))
    return widest if np.isfinite(widest) and widest > 0 else 1.0


def _stone_parameters() -> list[tuple[EffectCard, Parameter]]:
    return [
        (card, parameter)
        for card in _cards(of_stones=True)
        for parameter in card.observed_parameters
        if parameter.name != card.search.stone
    ]


def _own_numbers(ice: Ice) -> dict[int, Floats]:
    """Return the numbers of each stone with separate effects, in the order of `stone_names`."""
    parameters = _stone_parameters()
    found: dict[int, Floats] = {}
    for card in _cards(of_stones=True):
        for effect in ice.effects:
            if effect.name == card.name:
                given = _values(card, effect)
                stone = int(given[str(card.search.stone)])
                row = found.setdefault(stone, np.zeros(len(parameters)))
                for k, (owner, p) in enumerate(parameters):
                    if owner is card:
                        row[k] += (given[p.name] - (p.neutral or 0.0)) / _scale(card, p)
    return found


_ALONG, _ACROSS = 8, 6
"""Points along and across each band and lane over which friction is averaged."""


def _points(sheet: Sheet, direction: Direction) -> Floats:
    """Return points over all bands and lanes, (8 BANDS, 18, 2), sheet frame [m]."""
    along = np.linspace(-HOG_LINE_Y, BACK_LINE_Y, BANDS * _ALONG + 1)
    half = sheet.width / 2
    across = np.linspace(-half, half, len(LANES) * _ACROSS + 1)
    y = (along[:-1] + along[1:]) / 2 - TEE_Y
    x = (across[:-1] + across[1:]) / 2
    return to_sheet(np.stack(np.meshgrid(x, y), axis=-1), direction)


def _band_means(values: Floats) -> Floats:
    """Return means over each band and lane, (BANDS, 3)."""
    return values.reshape(BANDS, _ALONG, len(LANES), _ACROSS).mean(axis=(1, 3))
