"""What a team sees before it delivers: a flat vector, a dictionary, or planes seen from above.

Everything is in the delivery frame and from the point of view of the observing team: its own stones
come first, and hammer and lead are its own. So what is learnt towards one end, or as one team,
serves towards the other end and as the other team. The ice is shown as the team knows it.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from gymnasium import spaces

from curling_env.envs.sheet.observation import (
    BANDS,
    LANES,
    LENGTH_SCALE,
    ice_features,
    observed_parameters,
)
from curling_env.errors import InputError
from curling_env.game.rules.game import Game
from curling_env.game.rules.lines import BACK_LINE, HOG_LINE, Lines
from curling_env.game.rules.teams import STONES_PER_TEAM, Team
from curling_env.ice import Ice
from curling_env.sheet import RING_RADII, Direction, to_sheet
from curling_env.typing import Singles

ObservationKind = Literal["flat", "dict", "planes"]

CONTEXT = (
    "stones delivered",
    "own stones left",
    "hammer",
    "lead",
    "ends left",
    "extra end",
    "guards protected",
)
"""The numbers besides those of stones and ice, each within ±1."""
LEAD_SCALE = 8.0
"""The lead that counts as 1 [points]."""
SLOTS = 2 * STONES_PER_TEAM
PLANES = ("own stones", "their stones", "house", "friction", *CONTEXT)
PLANE_CELL = 0.1
"""Side of a cell of a plane [m]; a stone covers about seven cells."""
PLANE_Y = (HOG_LINE - 0.2, BACK_LINE + 0.2)
"""Range of y that the planes show, delivery frame [m]."""


class GameObservation:
    """Makes the observations of a game.

    Parameters
    ----------
    kind : ``flat`` (a vector), ``dict`` (context, ice and stones apart) or ``planes`` (from above)
    ice : the ice as the team knows it
    lines : lines of the sheet

    Raises
    ------
    InputError : an unknown kind
    """

    def __init__(self, kind: ObservationKind, ice: Ice, lines: Lines) -> None:
        if kind not in ("flat", "dict", "planes"):
            raise InputError(f"observation must be 'flat', 'dict' or 'planes', got {kind!r}")
        self.kind = kind
        self.lines = lines
        self._known = {d: ice_features(ice, d) for d in Direction}
        self._known_size = len(self._known[Direction.AWAY])
        if kind == "planes":
            x = np.arange(-lines.width / 2 + PLANE_CELL / 2, lines.width / 2, PLANE_CELL)
            y = np.arange(PLANE_Y[0] + PLANE_CELL / 2, PLANE_Y[1], PLANE_CELL)[::-1]
            self._x, self._y = np.meshgrid(x, y)
            self._fixed = {d: self._fixed_planes(ice, d) for d in Direction}

    @property
    def names(self) -> tuple[str, ...]:
        """What each number of a flat observation is."""
        return (
            *CONTEXT,
            "mean friction",
            *(f"friction of band {i + 1}, {lane}" for i in range(BANDS) for lane in LANES),
            *(f"{card.name}.{parameter.name}" for card, parameter, _ in observed_parameters()),
            *(
                f"{whose} stone {k + 1} {what}"
                for whose in ("own", "their")
                for k in range(STONES_PER_TEAM)
                for what in ("present", "x", "y")
            ),
        )

    @property
    def space(self) -> spaces.Space[Any]:
        """The space of the observations."""

        def box(*shape: int) -> spaces.Box:
            return spaces.Box(-1.0, 1.0, shape, np.float32)

        if self.kind == "flat":
            return box(len(CONTEXT) + self._known_size + 3 * SLOTS)
        if self.kind == "planes":
            return box(len(PLANES), *self._x.shape)
        return spaces.Dict(
            {
                "context": box(len(CONTEXT)),
                "ice": box(self._known_size),
                "stones": box(SLOTS, 3),
            }
        )

    def observe(self, game: Game, team: Team, direction: Direction) -> Any:
        """What a team sees of a game.

        Parameters
        ----------
        game : a game in play, between ends or over
        team : the team that observes
        direction : the end played to
        """
        context = _context(game, team)
        if self.kind == "planes":
            return self._planes(game, team, direction, context)
        stones = self._stones(game, team)
        if self.kind == "dict":
            return {"context": context, "ice": self._known[direction].copy(), "stones": stones}
        return np.concatenate([context, self._known[direction], stones.ravel()])

    def _stones(self, game: Game, team: Team) -> Singles:
        """Presence, x and y of every stone, (16, 3); own stones first, by number."""
        out = np.zeros((SLOTS, 3), dtype=np.float32)
        half = self.lines.width / 2
        for whose, number, x, y in () if game.end is None else game.end.stones:
            slot = number if whose is team else STONES_PER_TEAM + number
            out[slot] = 1.0, x / half, max(y / LENGTH_SCALE, -1.0)
        return out

    def _planes(self, game: Game, team: Team, direction: Direction, context: Singles) -> Singles:
        out = np.empty((len(PLANES), *self._x.shape), dtype=np.float32)
        out[:2] = 0.0
        out[2:4] = self._fixed[direction]
        out[4:] = context[:, None, None]
        radius = self.lines.stone_radius
        for whose, _, x, y in () if game.end is None else game.end.stones:
            covered = (self._x - x) ** 2 + (self._y - y) ** 2 <= radius**2
            out[0 if whose is team else 1][covered] = 1.0
        return out

    def _fixed_planes(self, ice: Ice, direction: Direction) -> Singles:
        """The share of the rings that hold each point, and friction relative to its mean here."""
        distance = np.hypot(self._x, self._y)
        house = np.mean([distance <= radius for radius in RING_RADII], axis=0)
        points = to_sheet(np.stack([self._x, self._y], axis=-1), direction)
        mu = ice.mu_at(points)
        relative = np.clip((mu / mu.mean() - 1) / 0.2, -1.0, 1.0)
        return np.stack([house, relative]).astype(np.float32)


def _context(game: Game, team: Team) -> Singles:
    """The numbers named in `CONTEXT`."""
    end, rules = game.end, game.rules
    delivered = rules.deliveries if end is None else end.delivered
    own_left = 0
    if end is not None:
        first = team is end.hammer.other
        own_left = rules.stones - (end.delivered + first) // 2
    hammer = game.last_stone if end is None else end.hammer
    protected = max(rules.free_guard_until, rules.no_takeout_until)
    return np.array(
        [
            delivered / rules.deliveries,
            own_left / rules.stones,
            1.0 if hammer is team else -1.0,
            min(max(game.lead(team) / LEAD_SCALE, -1.0), 1.0),
            game.ends_left / rules.ends,
            float(game.is_extra_end),
            float(delivered < protected),
        ],
        dtype=np.float32,
    )
