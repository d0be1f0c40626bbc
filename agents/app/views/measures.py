"""The measured throws of a session, with the coach's entries."""

from __future__ import annotations

from agents.app.club import Club, Session
from agents.app.club.records import Hand
from agents.app.club.session_files import measures_of
from agents.app.club.targets import with_places
from agents.coaching import ThrowSheet
from agents.coaching.throw_sheet import Hands, sheet_of
from friction_estimation.tracks.throw_list import ThrowNote


def sheets_of(club: Club, session: Session) -> list[ThrowSheet]:
    """Return the throws of a session that are measured; throws that slid too short are not."""
    athletes = {one.id: one for one in club.athletes()}
    stones = {one.id: one.name for one in club.stones()}
    hands: Hands = {
        one.name: "left" if one.hand is Hand.LEFT else "right" for one in athletes.values()
    }
    targets = club.named_targets()
    found: list[ThrowSheet] = []
    for throw in club.throws(session):
        measures = measures_of(throw)
        if measures is not None:
            athlete = athletes.get(throw.athlete_id or 0)
            note = ThrowNote(
                athlete="" if athlete is None else athlete.name,
                stone=stones.get(throw.stone_id or 0, ""),
                called=with_places(throw.called, targets),
                note=throw.note,
            )
            found.append(sheet_of(measures, {throw.number: note}, hands))
    return found
