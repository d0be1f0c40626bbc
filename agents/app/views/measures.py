"""The measured throws of a session, with the coach's entries."""

from __future__ import annotations

from collections.abc import Sequence

from agents.app.club import Club, Session, Throw
from agents.app.club.records import Hand, State
from agents.app.club.session_files import measures_of
from agents.app.club.targets import with_places
from agents.coaching import ThrowSheet
from agents.coaching.throw_sheet import Hands, sheet_of
from friction_estimation.tracks.throw_list import ThrowNote
from friction_estimation.tracks.throw_table import ThrowMeasures


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
    athlete = next((one.id for one in club.athletes() if one.name == turn), None)
    throw = Throw(id=0, session_id=session.id, number=0, athlete_id=athlete, called=session.drill)
    return next(iter(_sheets(club, [(throw, measures)])))


def untracked(club: Club, session: Session) -> int:
    """Return the number of films whose throws are still to come into the table."""
    open_states = (State.WAITING, State.RUNNING)
    return sum(film.is_whole and film.state in open_states for film in club.films(session))


def _sheets(club: Club, throws: Sequence[tuple[Throw, ThrowMeasures | None]]) -> list[ThrowSheet]:
    athletes = {one.id: one for one in club.athletes()}
    stones = {one.id: one.name for one in club.stones()}
    hands: Hands = {
        one.name: "left" if one.hand is Hand.LEFT else "right" for one in athletes.values()
    }
    targets = club.named_targets()
    found: list[ThrowSheet] = []
    for throw, measures in throws:
        if measures is not None:
            athlete = athletes.get(throw.athlete_id or 0)
            note = ThrowNote(
                athlete="" if athlete is None else athlete.name,
                stone=stones.get(throw.stone_id or 0, ""),
                called=with_places(throw.called, targets),
                note=throw.note,
            )
            found.append(sheet_of(measures, {measures.throw: note}, hands))
    return found
