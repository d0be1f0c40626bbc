"""The ruling on a delivered stone: what stays where it came to rest, and what is put back."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from curling_env.errors import InputError
from curling_env.game.rules.free_guard_zone import After, driven_off, guards, put_out, ticked
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.rulesets import RuleSet
from curling_env.game.rules.teams import Stones, Team


class Fault(StrEnum):
    """What was wrong with a delivery."""

    HOG_LINE = "hog_line"
    """It struck nothing and did not wholly clear the far hog line: removed."""
    FREE_GUARD_ZONE = "free_guard_zone"
    """It put an opposition guard out too early: removed, and all stones put back."""
    NO_TICK = "no_tick"
    """It moved a guard off the centre line too early: the opponent chooses, or all are put back."""
    EARLY_TAKEOUT = "early_takeout"
    """It put a stone out too early in mixed doubles: removed, and all stones put back."""


class Result(NamedTuple):
    """What a delivery did, as physics or an umpire saw it.

    Parameters
    ----------
    after : where the stones that lay on the sheet came to rest, in their order, then the delivered
        stone; None for one that touched a side line or went wholly past the back line
    struck : whether the delivered stone touched a stone in play
    """

    after: After
    struck: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class Ruling:
    """The position that stands after a delivery.

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
    result : what the delivered stone did

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
    if rest == before:  # nothing was moved that a rule might protect
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
