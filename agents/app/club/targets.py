"""Places on the ice that are asked for often: kept by a name, and called by it.

A call may say the name of a kept target where it would say a place. The files of a session, which
every command reads, have the place itself.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Sequence

import numpy as np

from agents.app.club.club import Club, added, changed, named
from agents.app.club.database import row_of, rows_of
from agents.app.club.records import Target
from agents.coaching import read_call
from agents.coaching.calls import KNOWN_WORDS
from curling_env.errors import InputError
from curling_env.sheet import Direction, to_delivery, to_sheet

MOST_TARGETS = 60


def keep_target(club: Club, name: str, x: float, y: float) -> Target:
    """Keep a place by a name; a target that no throw has called may be moved.

    Parameters
    ----------
    x, y : sheet frame, at either end [m]

    Raises
    ------
    InputError : a name that calls have a meaning for, that another target has, or a place where no
        stone can lie
    """
    name = named(name, "a target")
    right, past = to_delivery(np.array([x, y]), Direction.AWAY if y > 0 else Direction.HOME)
    _check_name(name)
    if read_call(f"draw {_place(right, past)}") is None:
        raise InputError("expected a place between the hog line and the back line, on the ice")
    x, y = (float(v) for v in to_sheet(np.array([right, past]), Direction.AWAY))
    with club.database.writing() as connection:
        query = "select * from target where name = ? collate nocase"
        found = row_of(connection, Target, query, (name,))
        if found is None:
            count = connection.execute("select count(*) from target").fetchone()[0]
            if count >= MOST_TARGETS:
                raise InputError(f"a club keeps at most {MOST_TARGETS} targets")
            number = added(connection, "target", name=name, x=x, y=y)
        else:
            number = found.id
            if np.hypot(found.x - x, found.y - y) > 0.005:
                calls = [row[0] for row in connection.execute("select called from throw")]
                if any(with_places(called, [found]) != called for called in calls):
                    raise InputError(f"throws were called with {found.name!r}; choose another name")
            changed(connection, "target", number, x=x, y=y, removed=None)
        kept = row_of(connection, Target, "select * from target where id = ?", (number,))
        # Calls that have named it before mean this place now.
        connection.execute(
            "update session set stale = 2 where stale <> 1 and id in "
            "(select session_id from throw where instr(lower(called), lower(?)))",
            (name,),
        )
    assert kept is not None
    return kept


def rename_in_calls(connection: sqlite3.Connection, number: int, name: str) -> None:
    """Write another name of a target into the calls and drills that name it.

    Raises
    ------
    InputError : a name that calls have a meaning for
    """
    _check_name(name)
    (old,) = rows_of(connection, Target, "select * from target where id = ?", (number,))
    for table, column in (("throw", "called"), ("session", "drill")):
        rows = connection.execute(f"select id, {column} from {table}").fetchall()
        for row, called in rows:
            now = _pattern(old).sub(name, called)
            if now != called:
                changed(connection, table, row, **{column: now})


def remove_target(club: Club, number: int) -> None:
    """Offer a target no longer; calls that name it keep their meaning."""
    club.database.write("update target set removed = datetime() where id = ?", number)


def with_places(called: str, targets: Sequence[Target]) -> str:
    """Return a call with places for the names of targets, as `read_call` reads it."""
    for one in sorted(targets, key=lambda target: -len(target.name)):
        right, past = to_delivery(np.array([one.x, one.y]), Direction.AWAY)
        called = _pattern(one).sub(_place(right, past), called)
    return called


def _pattern(target: Target) -> re.Pattern[str]:
    return re.compile(rf"(?<![\w-]){re.escape(target.name)}(?![\w-])", re.IGNORECASE)


def _check_name(name: str) -> None:
    if not re.fullmatch(r"[^\W\d_][\w' -]*", name):
        raise InputError("expected a name of letters and digits that begins with a letter")
    if KNOWN_WORDS.issuperset(name.lower().split()):
        raise InputError(f"{name!r} has a meaning in calls; choose another name")


def _place(right: float, past: float) -> str:
    return f"{right:.2f},{past:.2f}"
