"""Built-in players, which need nothing but this package.

`AimingPlayer` converts a shot in the sport's words to a throw on the ice as the player knows it.
`DrawPlayer` throws every stone to the button. `RuleBasedPlayer` plays as a club skip is taught:
with the hammer it plays for two and spreads its stones; without it, it keeps the centre covered and
tries to steal, or to hold the other team to one. Ahead it hits; behind it leaves stones in play.

Positions are in the delivery frame: the tee at the origin, +y along the direction of play.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from curling_env.game.players import Call, Player, PlayerView
from curling_env.game.rules import End, RestingStone, Team, count, shot_order
from curling_env.game.rules.delivery import guards
from curling_env.game.rules.rulesets import Side
from curling_env.physics.aim import Aim
from curling_env.sheet import HOUSE_RADIUS, Direction
from curling_env.throw import Delivery, Throw

BOARD_WEIGHT = 1.25
"""Speed of a takeout over draw weight; it would run a few metres past the house."""
PEEL_WEIGHT = 1.6
"""Speed of a peel over draw weight."""


class AimingPlayer(Player):
    """Player that chooses shots; its methods convert them to throws."""

    def __init__(self) -> None:
        self._aims: dict[tuple[Direction, Delivery], Aim] = {}

    def aim(self, view: PlayerView) -> Aim:
        """Return the aim on the known ice towards the end played to."""
        key = view.direction, view.delivery
        if key not in self._aims or self._aims[key].ice is not view.ice:
            self._aims[key] = Aim(view.ice, view.direction, delivery=view.delivery)
        return self._aims[key]

    def to_button(self, view: PlayerView) -> Throw:
        """Return the draw to the button on the empty sheet."""
        spin = view.delivery.spin
        return self.aim(view).draw(0.0, 0.0, spin) or Throw(speed=2.1, spin=spin)

    # --- shots ------------------------------------------------------------------------------------

    def draw_to(self, view: PlayerView, x: float, y: float, shot: str) -> Call | None:
        """Return a draw or guard to (x, y) with a free path, with either handle."""
        aim, stones = self.aim(view), _centres(view)
        for spin in _sides(x, view.delivery.spin):
            throw = aim.draw(x, y, spin)
            if throw is not None and aim.path_clears(throw, stones, until=y + 0.5):
                return Call(throw=throw, shot=shot)
        return None

    def hit(
        self,
        view: PlayerView,
        target: RestingStone,
        shot: str,
        *,
        weight: float = BOARD_WEIGHT,
        off: float = 0.0,
        clear: bool = True,
    ) -> Call | None:
        """Return a takeout of a stone, with either handle.

        Parameters
        ----------
        target : the stone to hit
        shot : name of the shot
        weight : speed over that of a draw to the button
        off : offset of the aim to the right of the stone's centre [m]
        clear : require a free path; otherwise a stone in the way is driven onto the target
        """
        aim = self.aim(view)
        speed = min(weight * self.to_button(view).speed, view.delivery.max_speed)
        others = _centres(view, but=target)
        for spin in _sides(target.x, view.delivery.spin):
            throw = aim.through(target.x + off, target.y, speed, spin)
            if throw is None:
                continue
            if not clear or aim.path_clears(throw, others, until=target.y):
                return Call(throw=throw, shot=shot)
        return None

    def through(self, view: PlayerView) -> Call:
        """Return a throw through the house that touches no stone."""
        aim, stones, spin = self.aim(view), _centres(view), view.delivery.spin
        speed = min(1.4 * self.to_button(view).speed, view.delivery.max_speed)
        for x in (1.6, -1.6, 1.9, -1.9, 1.0, -1.0):
            throw = aim.through(x, 0.0, speed, -spin if x < 0 else spin)
            if throw is not None and aim.path_clears(throw, stones, until=2.5):
                return Call(throw=throw, shot="through the house")
        return Call(throw=Throw(speed=0.5 * self.to_button(view).speed), shot="short")


def _centres(view: PlayerView, but: RestingStone | None = None) -> np.ndarray:
    end = view.game.end
    stones = () if end is None else end.stones
    return np.array([(s.x, s.y) for s in stones if s is not but], dtype=np.float64).reshape(-1, 2)


def _sides(x: float, spin: float) -> Iterable[float]:
    """Return the spins to try; first the one that curls towards the centre, where there is most
    room.
    """
    return (spin, -spin) if x >= 0 else (-spin, spin)


class DrawPlayer(AimingPlayer):
    """Player that throws the draw to the button of an empty sheet."""

    name = "draw"

    def call(self, view: PlayerView) -> Call:
        return Call(throw=self.to_button(view), shot="draw to the button")


CENTRE_GUARD_Y = -3.5
"""Place of a centre guard in front of the tee [m]."""
CORNER_GUARD = (1.2, -3.0)
"""Place of a corner guard, on either side [m]."""
COMFORTABLE_LEAD = 2
"""Lead from which the house is kept clean."""
MIN_POINTS_FOR_HAMMER = 2
"""Minimum points for giving up the hammer while ends remain; for fewer the end is blanked."""
HALF_HIT = 0.12
"""Offset from the centre at which a half-hidden stone is hit [m]."""
CONCEDE_BEHIND = 6
"""Deficit at which it concedes with three ends to play; one less for each end fewer."""

BUTTON = ((0.0, 0.0), (0.25, 0.1), (-0.25, 0.1), (0.0, 0.45), (0.5, 0.0), (-0.5, 0.0))
"""Places for a stone that should count, the best first [m]."""
SPREAD = ((1.0, 0.3), (-1.0, 0.3), (0.8, -0.6), (-0.8, -0.6), (0.0, 1.0))
"""Places for a second stone, away from others that could be hit together with it [m]."""


class RuleBasedPlayer(AimingPlayer):
    """Player that guards early, takes out and draws around guards, by the score and the hammer."""

    name = "rulebased"

    def call(self, view: PlayerView) -> Call:
        for call in self._candidates(view):
            if call is not None:
                return call
        return Call(throw=self.to_button(view), shot="draw to the button")

    def concedes(self, view: PlayerView) -> bool:
        left = view.game.ends_left
        return left <= 3 and -view.game.lead(view.team) >= CONCEDE_BEHIND - (3 - left) and left > 0

    def power_play(self, view: PlayerView) -> Side | None:
        """Return a power play in the last ends but one, for a team that is not ahead."""
        return "right" if view.game.ends_left in (2, 3) and view.game.lead(view.team) <= 0 else None

    # --- candidate shots, the best first ----------------------------------------------------------

    def _candidates(self, view: PlayerView) -> Iterator[Call | None]:
        end = view.game.end
        assert end is not None
        lines, team = view.game.lines, view.team
        house = shot_order(lines, end.stones)
        whose, points = count(lines, end.stones)
        lead = view.game.lead(team)
        last = view.own_stones_left == 1
        protected = guards(view.game.rules, lines, end.stones, team, end.delivered)
        if last and view.has_hammer:
            yield from self._hammer(view, house, whose, points)
            return
        early = end.number_of_stone < 2
        if whose is team.other:
            patient = early and points == 1 and lead < -COMFORTABLE_LEAD
            if not patient:
                yield from self._hits(view, house, protected, "takeout")
            if not early or lead >= COMFORTABLE_LEAD:
                yield from self._peels(view, end, protected)
            yield from self._draws(view, BUTTON, "draw around")
            if points > 1 and house[0] not in protected:
                yield self.hit(view, house[0], "raise", weight=PEEL_WEIGHT, clear=False)
            return
        if whose is team:
            if lead >= COMFORTABLE_LEAD or view.has_hammer:
                yield from self._hits(view, house, protected, "takeout")
            if view.has_hammer:
                yield from self._draws(view, SPREAD, "draw for a second")
            elif not _guarded(end.stones, house[0]):
                yield self.draw_to(view, house[0].x * 0.8, CENTRE_GUARD_Y, "guard")
            yield from self._draws(view, (*BUTTON, *SPREAD), "draw")
            return
        yield from self._empty_house(view, end, lead, early)

    def _empty_house(
        self, view: PlayerView, end: End, lead: int, early: bool
    ) -> Iterator[Call | None]:
        centre = any(abs(stone.x) < 0.5 and stone.y < -HOUSE_RADIUS for stone in end.stones)
        if not early or lead >= COMFORTABLE_LEAD:
            yield from self._draws(view, BUTTON, "draw")
        elif view.has_hammer:
            side = 1 if sum(stone.x for stone in end.stones) <= 0 else -1
            if not centre:
                yield self.draw_to(view, side * CORNER_GUARD[0], CORNER_GUARD[1], "corner guard")
            yield from self._draws(view, BUTTON, "come around")
        else:
            if not centre:
                yield self.draw_to(view, 0.0, CENTRE_GUARD_Y, "centre guard")
            yield from self._draws(view, BUTTON, "come around")

    def _hammer(
        self, view: PlayerView, house: tuple[RestingStone, ...], whose: Team | None, points: int
    ) -> Iterator[Call | None]:
        """Return the last stone of the end."""
        team, game = view.team, view.game
        more_to_play = game.ends_left > 1
        if whose is team.other:
            # It has to score one or to save the end, whichever shot is open.
            near = house[0].distance
            if near < 0.6 or points > 1:
                yield from self._hits(view, house[:1], (), "takeout for the end")
            yield from self._draws(view, _inside(near), "draw for the end")
            yield from self._hits(view, house, (), "takeout for the end")
            yield self.hit(view, house[0], "raise", weight=PEEL_WEIGHT, clear=False)
            return
        if points + 1 < MIN_POINTS_FOR_HAMMER and more_to_play and game.lead(team) >= -2:
            yield self.through(view)  # a blank keeps the hammer
        yield from self._draws(view, (*BUTTON, *SPREAD), "draw for another")

    def _draws(
        self, view: PlayerView, places: tuple[tuple[float, float], ...], shot: str
    ) -> Iterator[Call | None]:
        end = view.game.end
        assert end is not None
        room = 2 * view.game.lines.stone_radius + 0.02
        for x, y in places:
            if all((s.x - x) ** 2 + (s.y - y) ** 2 > room**2 for s in end.stones):
                yield self.draw_to(view, x, y, shot)

    def _hits(
        self,
        view: PlayerView,
        house: tuple[RestingStone, ...],
        protected: tuple[RestingStone, ...],
        shot: str,
    ) -> Iterator[Call | None]:
        """Return takeouts of the opponent's stones, the nearest first, full or on one side."""
        for stone in house:
            if stone.team is not view.team and stone not in protected:
                for off in (0.0, HALF_HIT, -HALF_HIT):
                    yield self.hit(view, stone, shot, off=off)

    def _peels(
        self, view: PlayerView, end: End, protected: tuple[RestingStone, ...]
    ) -> Iterator[Call | None]:
        if view.game.lead(view.team) < COMFORTABLE_LEAD:
            return
        for stone in end.stones:
            opponents = stone.team is not view.team and stone not in protected
            if opponents and stone.y < -HOUSE_RADIUS:
                yield self.hit(view, stone, "peel", weight=PEEL_WEIGHT)


def _inside(distance: float) -> tuple[tuple[float, float], ...]:
    """Return places nearer to the tee than a stone at a distance [m]."""
    places = tuple(p for p in BUTTON if (p[0] ** 2 + p[1] ** 2) ** 0.5 < distance - 0.05)
    return places or BUTTON[:1]


def _guarded(stones: tuple[RestingStone, ...], stone: RestingStone) -> bool:
    return any(other.y < stone.y - 1.0 and abs(other.x - stone.x) < 0.4 for other in stones)
