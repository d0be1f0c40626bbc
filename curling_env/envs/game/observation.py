"""Observation of a team before it delivers: a flat vector, a dictionary, or planes from above.

Everything is in the delivery frame and from the point of view of the observing team: its own stones
come first, and hammer and lead are its own. A policy learned towards one end, or as one team,
therefore applies to the other end and the other team. The ice is the team's known ice.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from gymnasium import spaces

from curling_env.envs.core import row_of
from curling_env.envs.known_ice import (
    LINEAR,
    KnownIce,
    ice_names,
    squash,
    stone_names,
    wear_names,
)
from curling_env.envs.options import one_of
from curling_env.envs.sheet.observation import LENGTH_SCALE
from curling_env.game import GameState, PlayerView
from curling_env.game.rules.game import Game
from curling_env.game.rules.lines import BACK_LINE, HOG_LINE, Lines
from curling_env.game.rules.teams import STONES_PER_TEAM, Team
from curling_env.sheet import RING_RADII, Direction, to_sheet
from curling_env.typing import Floats, Singles

ObservationKind = Literal["flat", "dict", "planes"]

CONTEXT = (
    "stones delivered",
    "own stones left",
    "hammer",
    "lead",
    "ends left",
    "extra end",
    "guards protected",
    "own power play left",
    "their power play left",
    "clock",
    "throws",
)
"""Numbers of the context (not of stones or ice), each within ±1."""
LEAD_SCALE = 8.0
"""The lead that counts as 1 [points]."""
CLOCK_SCALE = 3.0 * 3600.0
"""Time since the first delivery of the game that counts as 1 [s]."""
THROWS_SCALE = 160.0
"""Number of throws since the game began that counts as 1."""
SLOTS = 2 * STONES_PER_TEAM
STONES = tuple(
    f"{whose} stone {k + 1}" for whose in ("own", "their") for k in range(STONES_PER_TEAM)
)
PLANES = ("own stones", "their stones", "house", "friction")
PLANE_CELL = 0.1
"""Side of a cell of a plane [m]; a stone covers about seven cells."""
PLANE_Y = (HOG_LINE - 0.2, BACK_LINE + 0.2)
"""Range of y that the planes show, delivery frame [m]."""


class GameObservation:
    """Maker of the observations of a game.

    Parameters
    ----------
    kind : ``flat`` (a vector), ``dict`` (context, ice and stones apart) or ``planes`` (stones and
        ice from above, and the numbers of context and ice)
    known : the ice as the team knows it
    lines : lines of the sheet

    Raises
    ------
    InputError : an unknown kind
    """

    def __init__(self, kind: ObservationKind, known: KnownIce, lines: Lines) -> None:
        self.kind: ObservationKind = one_of("observation", kind, ("flat", "dict", "planes"))
        self.lines = lines
        self.known = known
        of_stones = known.of_stones(range(SLOTS))
        self._of_stones = {
            team: np.roll(of_stones, -STONES_PER_TEAM * team, axis=0).ravel() for team in Team
        }
        self._ice_size = len(_ice_names())
        self._new_ice: dict[tuple[Direction, Team], Singles] = {}
        if kind == "planes":
            x = np.arange(-lines.width / 2 + PLANE_CELL / 2, lines.width / 2, PLANE_CELL)
            y = np.arange(PLANE_Y[0] + PLANE_CELL / 2, PLANE_Y[1], PLANE_CELL)[::-1]
            self._x, self._y = np.meshgrid(x, y)
            self._fixed = {d: self._fixed_planes(d) for d in Direction}

    def on(self, known: KnownIce) -> GameObservation:
        """Return the maker for another ice; itself for the same ice."""
        return self if known is self.known else GameObservation(self.kind, known, self.lines)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers of a flat observation, in order."""
        return (
            *CONTEXT,
            *_ice_names(),
            *(f"{stone} {what}" for stone in STONES for what in ("present", "x", "y")),
        )

    @property
    def space(self) -> spaces.Space[Any]:
        """The space of the observations."""

        def box(*shape: int) -> spaces.Box:
            return spaces.Box(-1.0, 1.0, shape, np.float32)

        if self.kind == "flat":
            return box(len(self.names))
        if self.kind == "planes":
            numbers = len(CONTEXT) + self._ice_size
            return spaces.Dict(
                {"planes": box(len(PLANES), *self._x.shape), "numbers": box(numbers)}
            )
        return spaces.Dict(
            {
                "context": box(len(CONTEXT)),
                "ice": box(self._ice_size),
                "stones": box(SLOTS, 3),
            }
        )

    def of_view(self, view: PlayerView) -> Any:
        """Return the observation of a player before its call, for policies as players."""
        state = GameState(game=view.game, throws=view.entropy[1], clock=view.clock, wear=view.wear)
        return row_of(self.observe([state], view.team, view.direction), 0)

    def observe(self, states: Sequence[GameState], team: Team, direction: Direction) -> Any:
        """Return the observations of games, each in play, between ends or over.

        Parameters
        ----------
        states : n games
        team : the team that observes
        direction : the end played to

        Returns
        -------
        one array (n, …), or a dictionary of such
        """
        games = [state.game for state in states]
        context = np.array([_context(state, team) for state in states], dtype=np.float32)
        ice = self._ice([state.wear for state in states], team, direction)
        if self.kind == "planes":
            numbers = np.concatenate([context, ice], axis=1)
            return {"planes": self._planes(games, team, direction), "numbers": numbers}
        stones = self._stones(games, team)
        if self.kind == "dict":
            return {"context": context, "ice": ice, "stones": stones}
        return np.concatenate([context, ice, stones.reshape(len(games), -1)], axis=1)

    def _ice(self, wears: Sequence[Floats | None], team: Team, direction: Direction) -> Singles:
        """Return ice features, (n, m): the initial ice, its wear, the factors of each stone."""
        features, of_stones = self.known.features(direction), self._of_stones[team]
        if (direction, team) not in self._new_ice:
            unworn = self.known.wear(None, direction)
            self._new_ice[direction, team] = np.concatenate([features, unworn, of_stones])
        out = np.empty((len(wears), self._ice_size), dtype=np.float32)
        out[:] = self._new_ice[direction, team]
        for row, wear in enumerate(wears):
            if wear is not None:
                out[row, len(features) : -len(of_stones)] = self.known.wear(wear, direction)
        return out

    def _stones(self, games: Sequence[Game], team: Team) -> Singles:
        """Return presence, x and y of every stone, (n, 16, 3); own stones first, by number."""
        out = np.zeros((len(games), SLOTS, 3), dtype=np.float32)
        lying = [() if game.end is None else game.end.stones for game in games]
        numbers = [value for stones in lying for stone in stones for value in stone]
        if numbers:
            whose, number, x, y = np.array(numbers, dtype=np.float64).reshape(-1, 4).T
            rows = np.repeat(np.arange(len(games)), [len(stones) for stones in lying])
            slots = (number + STONES_PER_TEAM * (whose != team)).astype(np.intp)
            out[rows, slots, 0] = 1.0
            out[rows, slots, 1] = x / (self.lines.width / 2)
            out[rows, slots, 2] = np.maximum(y / LENGTH_SCALE, -1.0)
        return out

    def _planes(self, games: Sequence[Game], team: Team, direction: Direction) -> Singles:
        out = np.zeros((len(games), len(PLANES), *self._x.shape), dtype=np.float32)
        out[:, 2:4] = self._fixed[direction]
        for row, game in enumerate(games):
            radius = game.lines.stone_radius
            for whose, _, x, y in () if game.end is None else game.end.stones:
                covered = (self._x - x) ** 2 + (self._y - y) ** 2 <= radius**2
                out[row, 0 if whose is team else 1][covered] = 1.0
        return out

    def _fixed_planes(self, direction: Direction) -> Singles:
        """Share of the rings that contain each point, and friction relative to the local mean."""
        distance = np.hypot(self._x, self._y)
        house = np.mean([distance <= radius for radius in RING_RADII], axis=0)
        points = to_sheet(np.stack([self._x, self._y], axis=-1), direction)
        mu = self.known.ice.mu_at(points)
        return np.stack([house, squash((mu / mu.mean() - 1) / 0.2)]).astype(np.float32)


def _ice_names() -> tuple[str, ...]:
    """Return the names of the ice features: initial ice, wear, per-stone factors."""
    each = (f"{stone} {what}" for stone in STONES for what in stone_names())
    return (*ice_names(), *wear_names(), *each)


def _context(state: GameState, team: Team) -> list[float]:
    """Return the numbers named in `CONTEXT`."""
    game = state.game
    end, rules = game.end, game.rules
    delivered = rules.deliveries if end is None else end.delivered
    own_left = 0
    if end is not None:
        first = team is end.hammer.other
        own_left = rules.stones - (end.delivered + first) // 2
    hammer = game.last_stone if end is None else end.hammer
    protected = max(rules.free_guard_until, rules.no_takeout_until)
    return [
        delivered / rules.deliveries,
        own_left / rules.stones,
        1.0 if hammer is team else -1.0,
        min(max(game.lead(team) / LEAD_SCALE, -1.0), 1.0),
        game.ends_left / rules.ends,
        float(game.is_extra_end),
        float(delivered < protected),
        float(rules.power_play and team not in game.power_plays),
        float(rules.power_play and team.other not in game.power_plays),
        _pressed(state.clock / CLOCK_SCALE),
        _pressed(state.throws / THROWS_SCALE),
    ]


def _pressed(value: float) -> float:
    """Scale a non-negative number as `squash` does."""
    return value if value <= LINEAR else 1.0 - LINEAR**2 / value
