"""Stones that are protected early in an end.

Fours (R6): until five stones are delivered, an opposition stone in the free guard zone may not be
put out of play; and one that touches the centre line there may not be moved off it (no-tick).
Digital Curling's libraries and servers differ in which guards are protected and from what.
Mixed doubles (R16): until three stones are delivered, no stone of either team may be put out.
"""

from __future__ import annotations

from collections.abc import Sequence

from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import RuleSet
from curling_env.game.rules.teams import RestingStone, Stones, Team

After = Sequence[RestingStone | None]
"""Where the stones that lay on the sheet came to rest, in order; None for one that left play."""


def guards(rules: RuleSet, lines: Lines, stones: Stones, team: Team, delivered: int) -> Stones:
    """Stones that the next stone, delivered by `team`, may not put out of play.

    Parameters
    ----------
    rules : the rules played by
    lines : lines of the sheet
    stones : stones on the sheet before the delivery
    team : the team to deliver
    delivered : number of stones delivered in this end before
    """
    if delivered < rules.no_takeout_until:
        return stones
    if delivered < rules.free_guard_until:
        return tuple(
            stone
            for stone in stones
            if stone.team != team
            and lines.in_free_guard_zone(stone.x, stone.y)
            and (not rules.centre_guards_only or lines.touches_centre_line(stone.x))
        )
    return ()


def put_out(protected: Stones, before: Stones, after: After) -> Stones:
    """Protected stones that the delivery put out of play."""
    return tuple(
        stone
        for stone, now in zip(before, after, strict=True)
        if now is None and stone in protected
    )


def driven_off(lines: Lines, protected: Stones, before: Stones, after: After) -> Stones:
    """Protected stones that the delivery moved out of the free guard zone, still in play."""
    return tuple(
        stone
        for stone, now in zip(before, after, strict=True)
        if now is not None and stone in protected and not lines.in_free_guard_zone(now.x, now.y)
    )


def ticked(lines: Lines, protected: Stones, before: Stones, after: After) -> Stones:
    """Protected stones that touched the centre line and now lie off it, still in play."""
    return tuple(
        stone
        for stone, now in zip(before, after, strict=True)
        if now is not None
        and stone in protected
        and lines.touches_centre_line(stone.x)
        and not lines.touches_centre_line(now.x)
    )
