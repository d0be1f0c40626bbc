"""Table of throws with a coach's notes: athlete and called shot."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from agents.coaching.calls import Call, Handle, read_call
from curling_env.errors import InputError
from curling_env.infrastructure.files.table import read_table
from curling_env.throw import handles
from curling_env.trajectory import Trajectory
from curling_env.units import side
from friction_estimation.reports.throws_section import (
    NOT_SEEN,
    ThrowRows,
    handle_of,
    throw_rows,
    write_measures,
)
from friction_estimation.tracks.measured import Measured
from friction_estimation.tracks.throw_list import NO_NOTES, ThrowNote
from friction_estimation.tracks.throw_table import ThrowMeasures
from friction_estimation.tracks.throw_table import throw_table as measured_throws

Hand = Literal["right", "left"]
Hands = Mapping[str, Hand]
"""Hands of athletes by name; an athlete who is missing throws with the right."""
ALL_RIGHT: Hands = MappingProxyType({})
_NOTED = ("hand", "handle")
_CALLED = tuple(
    f"{name}{ending}"
    for name in ("off_broom", "miss_right", "miss_past")
    for ending in ("", "_sigma")
)
HANDS_LIST = "athletes.csv"
"""Name of the table of hands, in the folder of the tracks."""


@dataclass(frozen=True, kw_only=True)
class ThrowSheet:
    """One throw: its measures and a coach's notes.

    Parameters
    ----------
    measures : numbers of its track
    note : athlete, stone, call, and anything else
    call : the call in that note; None if absent
    hand : throwing hand of the athlete
    """

    measures: ThrowMeasures
    note: ThrowNote
    call: Call | None = None
    hand: Hand = "right"

    @property
    def throw(self) -> int:
        """Number of the throw in the tracks."""
        return self.measures.throw

    @property
    def athlete(self) -> str:
        """Athlete; empty if not noted."""
        return self.note.athlete

    @property
    def stone(self) -> str:
        """Stone as noted, else its number in the tracks."""
        return self.note.stone or str(self.measures.stone)

    @property
    def handle(self) -> Handle | None:
        """Handle by the athlete's hand; None if no turn was seen."""
        if handle_of(self.measures) in (NOT_SEEN, "hardly turns"):
            return None
        spin = self.measures.spin
        assert spin is not None  # the stone has a name
        return handle_by_hand(spin.value, self.hand)

    @property
    def off_broom(self) -> Measured | None:
        """Distance right of the called broom at which the line of delivery crosses the far tee line
        [m].
        """
        line = self.measures.line
        if line is None or self.call is None or self.call.broom is None:
            return None
        return Measured(line.value - self.call.broom, line.sigma)

    @property
    def miss(self) -> tuple[Measured, Measured] | None:
        """Distance right of and past the called target at which the stone came to rest [m].

        None for hits, for throws without a target, and if an undisturbed rest was not seen.
        """
        one, call = self.measures, self.call
        if call is None or call.target is None or not call.rests or one.touched:
            return None
        if one.right is None or one.past is None:
            return None
        right, past = call.target
        return (
            Measured(one.right.value - right, one.right.sigma),
            Measured(one.past.value - past, one.past.sigma),
        )

    def as_dict(self) -> dict[str, object]:
        """Return the numbers by name in SI units, and the notes."""
        found: dict[str, object] = {**self.measures.as_dict(), **self.note.row}
        if self.note.stone:
            found["stone_name"] = self.note.stone
        found["hand"], found["handle"] = self.hand, self.handle
        if self.call is not None and self.call.target is not None:
            found["target_right"], found["target_past"] = self.call.target
        missed = self.miss or (None, None)
        for name, value in zip(
            ("off_broom", "miss_right", "miss_past"), (self.off_broom, *missed), strict=True
        ):
            found[name] = None if value is None else value.value
            found[f"{name}_sigma"] = None if value is None else value.sigma
        return found


def throw_table(
    tracks: Sequence[Trajectory],
    notes: Mapping[int, ThrowNote] = NO_NOTES,
    hands: Hands = ALL_RIGHT,
) -> list[ThrowSheet]:
    """Measure every throw of a session and add the coach's notes.

    Parameters
    ----------
    tracks : tracks of a session; the stones of one throw share its number and are adjacent
    notes : notes on the throws, by number (`throws_beside`)
    hands : hands of the athletes, by name (`hands_beside`)
    """
    return [sheet_of(measures, notes, hands) for measures in measured_throws(tracks)]


def sheet_of(measures: ThrowMeasures, notes: Mapping[int, ThrowNote], hands: Hands) -> ThrowSheet:
    """Return the measures of a throw with its notes."""
    note = notes.get(measures.throw, ThrowNote())
    call, hand = read_call(note.called), hands.get(note.athlete, "right")
    if call is not None and call.ice is not None and call.handle and call.target:
        # A stone curls to the side of its spin, so the broom stands on the other one.
        broom = call.target[0] + spin_sign(call.handle, hand) * call.ice
        call = replace(call, broom=broom if call.broom is None else call.broom)
    return ThrowSheet(measures=measures, note=note, call=call, hand=hand)


def handle_by_hand(spin: float, hand: Hand) -> Handle | None:
    """Return the handle of a spin, counter-clockwise positive; None for no spin."""
    name = handles(spin)[0 if hand == "right" else 1]
    if name == "no turn":
        return None
    return "in-turn" if name == "in-turn" else "out-turn"


def spin_sign(handle: Handle, hand: Hand) -> float:
    """Return the sign of the spin of a handle: 1 counter-clockwise, −1 clockwise."""
    return 1.0 if handle_by_hand(1.0, hand) == handle else -1.0


def hands_beside(tracks: str | Path) -> Hands:
    """Read the hands of athletes from `athletes.csv` in the folder of a tracks file; empty without
    it.

    Its columns are `athlete` and `hand`, which is right, left, or empty for right.

    Raises
    ------
    InputError : a table that cannot be read, another word for a hand, or an athlete given twice
    """
    path = Path(tracks).parent / HANDS_LIST
    if not os.path.lexists(path):
        return ALL_RIGHT
    table = read_table(path, required=("athlete", "hand"))
    found: dict[str, Hand] = {}
    for row, (name, word) in enumerate(zip(table.text("athlete"), table.text("hand"), strict=True)):
        hand = word.strip().lower() or "right"
        if hand not in ("right", "left"):
            raise InputError(
                f"expected right or left, got {word[:40]!r}",
                source=path,
                where=table.where(row, "hand"),
            )
        if name in found:
            raise InputError(
                f"{name[:40]!r} is given twice", source=path, where=table.where(row, "athlete")
            )
        found[name] = "right" if hand == "right" else "left"
    return found


def sheet_rows(sheets: Sequence[ThrowSheet]) -> ThrowRows:
    """Return the table as text: the handle by the athlete's hand, and calls next to outcomes.

    Parameters
    ----------
    sheets : the throws
    """
    notes = {sheet.throw: sheet.note for sheet in sheets}
    table = throw_rows([sheet.measures for sheet in sheets], notes=notes, errors=False)
    head, rows = list(table.head), [list(row) for row in table.rows]
    if "handle" in head:
        at = head.index("handle")
        for row, sheet in zip(rows, sheets, strict=True):
            if sheet.handle is not None:
                row[at] = f"{sheet.handle} {row[at][-1]}"
    for name, after, cells in (
        ("off the broom", "line", [_off_broom(sheet) for sheet in sheets]),
        ("miss", "rest", [_miss(sheet) for sheet in sheets]),
    ):
        if after in head and any(cells):
            at = head.index(after) + 1
            head.insert(at, name)
            for row, cell in zip(rows, cells, strict=True):
                row.insert(at, cell or NOT_SEEN)
    words = ("throw", "back to hog", "hog to hog", "hog to tee", "speed", "turns")
    return ThrowRows(
        head=head, rows=rows, numeric={k for k, name in enumerate(head) if name in words}
    )


def _off_broom(sheet: ThrowSheet) -> str:
    off = sheet.off_broom
    return "" if off is None else side(off.value).replace("on the line", "on the broom")


def _miss(sheet: ThrowSheet) -> str:
    if sheet.miss is None:
        return ""
    right, past = (value.value for value in sheet.miss)
    if hypot(right, past) < 0.05:
        return "on the target"
    words = [
        side(value, right=name)
        for value, name in ((past, "past"), (right, "right"))
        if abs(value) >= 0.015
    ]
    return ", ".join(words)


def write_sheets(path: str | Path, sheets: Sequence[ThrowSheet]) -> None:
    """Write the table as CSV: SI units, every standard error, and the notes.

    Parameters
    ----------
    path : file to write
    sheets : the throws
    """
    notes = {sheet.throw: sheet.note for sheet in sheets}
    dicts = [sheet.as_dict() for sheet in sheets]
    others = {
        name: [one.get(name) for one in dicts]
        for name in (*_NOTED, *_CALLED)
        if any(one.get(name) is not None for one in dicts)
    }
    write_measures(path, [sheet.measures for sheet in sheets], notes, others)
