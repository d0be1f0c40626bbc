"""Ruling on a delivered stone: stones that stay at rest, and stones that are put back.

Some stones are protected early in an end. Fours (R6): until five stones are delivered, an
opposition stone in the free guard zone may not be put out of play; and one that touches the centre
line there may not be moved off it (no-tick). Digital Curling's libraries and servers differ in
which guards are protected and from what. Mixed doubles (R16): until three stones are delivered, no
stone of either team may be put out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from curling_env.errors import InputError
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import RuleSet
from curling_env.game.rules.teams import RestingStone, Stones, Team

After = Sequence[RestingStone | None]
"""Places of rest of the stones on the sheet, in order; None for one that left play."""


def guards(rules: RuleSet, lines: Lines, stones: Stones, team: Team, delivered: int) -> Stones:
    """Return stones that the next stone, delivered by `team`, may not put out of play.

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
    """Return protected stones that the delivery put out of play."""
    return tuple(
        stone
        for stone, now in zip(before, after, strict=True)
        if now is None and stone in protected
    )


def driven_off(lines: Lines, protected: Stones, before: Stones, after: After) -> Stones:
    """Return protected stones that the delivery moved out of the free guard zone, still in play."""
    return tuple(
        stone
        for stone, now in zip(before, after, strict=True)
        if now is not None and stone in protected and not lines.in_free_guard_zone(now.x, now.y)
    )


def ticked(lines: Lines, protected: Stones, before: Stones, after: After) -> Stones:
    """Return protected stones that touched the centre line and are now off it, still in play."""
    return tuple(
        stone
        for stone, now in zip(before, after, strict=True)
        if now is not None
        and stone in protected
        and lines.touches_centre_line(stone.x)
        and not lines.touches_centre_line(now.x)
    )


class Fault(StrEnum):
    """Fault of a delivery."""

    HOG_LINE = "hog_line"
    """It struck nothing and did not wholly clear the far hog line: removed."""
    FREE_GUARD_ZONE = "free_guard_zone"
    """It put an opposition guard out too early: removed, and all stones put back."""
    NO_TICK = "no_tick"
    """It moved a guard off the centre line too early: the opponent chooses, or all are put back."""
    EARLY_TAKEOUT = "early_takeout"
    """It put a stone out too early in mixed doubles: removed, and all stones put back."""


class Result(NamedTuple):
    """Result of a delivery, from physics or an umpire.

    Parameters
    ----------
    after : places of rest of the stones on the sheet, in their order, then of the delivered stone;
        None for one that touched a side line or went wholly past the back line
    struck : true if the delivered stone touched a stone in play
    """

    after: After
    struck: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class Ruling:
    """Valid position after a delivery.

    Parameters
    ----------
    stones : stones on the sheet
    fault : fault of the delivered stone, or None
    option : the position that the opponent may choose instead: with `Fault.NO_TICK`, all stones
        put back and the delivered one removed
    """

    stones: Stones
    fault: Fault | None = None
    option: Stones | None = None


def rule_on(
    rules: RuleSet, lines: Lines, before: Stones, team: Team, delivered: int, result: Result
) -> Ruling:
    """Rule on a delivery.

    Parameters
    ----------
    rules : the rules played by
    lines : lines of the sheet
    before : stones on the sheet before the delivery
    team : the team that delivered
    delivered : number of stones delivered in the end before this one
    result : result of the delivered stone

    Raises
    ------
    InputError : a result that does not fit these stones
    """
    after = result.after
    if len(after) != len(before) + 1:
        raise InputError(
            f"expected the places of {len(before)} stones and the delivered one, got {len(after)}"
        )
    thrown = after[-1]
    fault = None
    if thrown is not None and not lines.past_hog_line(thrown.y):
        if not result.struck:
            fault = Fault.HOG_LINE
        if not (result.struck and rules.hog_line_exception):
            thrown = None
    if not rules.hog_line_exception:
        after = [s if s is not None and lines.past_hog_line(s.y) else None for s in after]
    rest = tuple(after[:-1])
    if rest == before:  # nothing moved that a rule might protect
        return Ruling(stones=before if thrown is None else (*before, thrown), fault=fault)
    if delivered < rules.free_guard_until or delivered < rules.no_takeout_until:
        protected = guards(rules, lines, before, team, delivered)
        if put_out(protected, before, rest):
            fault = Fault.FREE_GUARD_ZONE
            if delivered < rules.no_takeout_until:
                fault = Fault.EARLY_TAKEOUT
            elif rules.centre_guards_only:
                fault = Fault.NO_TICK
            return Ruling(stones=before, fault=fault)
        if rules.guards_stay and driven_off(lines, protected, before, rest):
            return Ruling(stones=before, fault=Fault.FREE_GUARD_ZONE)
        if rules.no_tick and ticked(lines, protected, before, rest):
            if not rules.tick_choice:
                return Ruling(stones=before, fault=Fault.NO_TICK)
            return Ruling(
                stones=tuple([stone for stone in (*rest, thrown) if stone is not None]),
                fault=Fault.NO_TICK,
                option=before,
            )
    return Ruling(
        stones=tuple([stone for stone in (*rest, thrown) if stone is not None]), fault=fault
    )
