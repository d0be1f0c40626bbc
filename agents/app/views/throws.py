"""Measured throws with the coach's entries: their numbers as people read them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, log10

from agents.app.club import Club, Session, Throw
from agents.app.club.records import Hand, State
from agents.app.club.session_files import measures_of
from agents.app.club.targets import with_places
from agents.coaching import ThrowSheet
from agents.coaching.throw_sheet import Hands, sheet_of
from curling_env.units import miss, side
from friction_estimation.tracks.measured import Measured
from friction_estimation.tracks.throw_list import ThrowNote
from friction_estimation.tracks.throw_table import ThrowMeasures

COLUMNS = (
    ("Back line to hog", "from the back line to the hog line at the thrower's end"),
    ("Hog to hog", "from hog line to hog line"),
    ("Hog to tee", "from the first hog line to the tee played to"),
    ("Line", "the line of delivery, from the called broom, or else from the centre line"),
    ("Turns", "full turns from the hog line to the rest"),
    ("Curl", "distance of the rest from the line of delivery"),
    ("Rest", "past or short of the tee"),
    ("Beside", "right or left of the centre line, as the thrower sees it"),
)
"""Heads of the table, and what they mean."""
NO_MORE = 2
"""Maximum number of decimals: no one at a rink reads more."""


@dataclass(frozen=True, kw_only=True)
class ShownNumber:
    """A number as it is shown.

    Parameters
    ----------
    name, meaning : of the column
    value : with its unit; empty where it was not seen
    sigma : its standard error; empty where it is not known
    """

    name: str
    meaning: str
    value: str = ""
    sigma: str = ""


def throw_numbers(sheet: ThrowSheet) -> list[ShownNumber]:
    """The numbers of a throw, one for each of the columns."""
    one = sheet.measures
    line, off = one.line, sheet.off_broom
    values = (
        _seconds(one.back_to_hog),
        _seconds(one.hog_to_hog),
        _seconds(one.hog_to_tee),
        _beside(line, "the centre line") if off is None else _beside(off, "the broom"),
        _number(one.turns),
        _beside(_right(one.curl)),
        _along(one),
        _beside(one.right),
    )
    return [
        ShownNumber(name=name, meaning=meaning, value=value, sigma=sigma)
        for (name, meaning), (value, sigma) in zip(COLUMNS, values, strict=True)
    ]


def rounded(value: float, sigma: float | None) -> tuple[str, str]:
    """A number and its standard error, to the decimals that the error leaves."""
    if sigma is None or sigma <= 0:
        return f"{value:.{NO_MORE}f}", ""
    decimals = min(max(-floor(log10(sigma) + 1e-9), 0), NO_MORE)
    error = max(sigma, 10.0**-NO_MORE / 2)
    return f"{value:.{decimals}f}", f"± {error:.{decimals}f}" if decimals else f"± {error:.0f}"


def _seconds(one: Measured | None) -> tuple[str, str]:
    value, sigma = _number(one)
    return (f"{value} s" if value else "", sigma)


def _number(one: Measured | None) -> tuple[str, str]:
    return ("", "") if one is None else rounded(*one)


def _beside(one: Measured | None, what: str = "") -> tuple[str, str]:
    """A length to the right (or left), to the centimetre."""
    if one is None:
        return "", ""
    words = side(one.value)
    if words == "on the line":
        words = f"on {what or 'the line'}"
    elif what == "the broom":
        words = f"{words} of the broom"
    return words, _within(one.sigma)


def _along(one: ThrowMeasures) -> tuple[str, str]:
    if one.past is None:
        return "", ""
    words = side(one.past.value, right="past")
    return words.replace("on the line", "level with the tee"), _within(one.past.sigma)


def _right(one: Measured | None) -> Measured | None:
    return None if one is None else Measured(-one.value, one.sigma)


def _within(sigma: float | None) -> str:
    return "" if sigma is None else f"± {miss(sigma)}"


def sheets_of(club: Club, session: Session) -> list[ThrowSheet]:
    """Return the throws of a session that are measured; throws that slid too short are not."""
    throws = [(throw, measures_of(throw.measures)) for throw in club.throws(session)]
    return _sheets(club, throws)


def sheet_seen_live(club: Club, session: Session) -> ThrowSheet | None:
    """Return the throw that a camera shows now, of the athlete whose turn it is; None without."""
    session = club.session(session.id) or session
    measures = measures_of(session.live)
    if measures is None:
        return None
    turn = session.turn(untracked(club, session))
    hand = next((one.hand for one in club.athletes() if one.name == turn), Hand.RIGHT)
    called = session.drill
    throw = Throw(id=0, session_id=session.id, number=0, athlete=turn, hand=hand, called=called)
    return next(iter(_sheets(club, [(throw, measures)])))


def untracked(club: Club, session: Session) -> int:
    """Return the number of films whose throws are still to come into the table."""
    open_states = (State.WAITING, State.RUNNING)
    return sum(film.is_whole and film.state in open_states for film in club.films(session))


def _sheets(club: Club, throws: Sequence[tuple[Throw, ThrowMeasures | None]]) -> list[ThrowSheet]:
    targets, found = club.named_targets(), list[ThrowSheet]()
    for throw, measures in throws:
        if measures is not None:
            called = with_places(throw.called, targets)
            note = ThrowNote(
                athlete=throw.athlete, stone=throw.stone, called=called, note=throw.note
            )
            hands: Hands = {throw.athlete: "left" if throw.hand is Hand.LEFT else "right"}
            found.append(sheet_of(measures, {measures.throw: note}, hands))
    return found
