"""The ice of a session, estimated from its tracks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.club.club import digest_of_file
from agents.app.work.causes import prepare
from curling_env.ice import save_ice
from curling_env.infrastructure.provenance import provenance
from friction_estimation.estimation.whole_ice import estimate_ice
from friction_estimation.tracks.throw_list import load_tracks

if TYPE_CHECKING:
    from agents.app.work.reported import Reported


def do_estimate(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Estimate the ice of a session, into its ``ice.json``."""
    tracks = club.tracks_of(session)
    digest = digest_of_file(tracks)
    found = estimate_ice(load_tracks(tracks), progress=progress)
    save_ice(found.ice, club.ice_of(session), provenance=provenance(seed=0))
    with club.database.writing() as connection:
        query = "update session set ice_of = ? where id = ?"
        connection.execute(query, (digest, session.id))
    prepare(club, session)
