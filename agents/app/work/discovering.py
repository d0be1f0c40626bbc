"""Discovery of the effects that the ice of a session lacks, from its tracks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.club.club import DISCOVERY
from curling_env.infrastructure.files.writing import make_directory, together
from curling_env.infrastructure.provenance import provenance
from friction_estimation.discovery.discover import discover
from friction_estimation.discovery.evidence.next_throws import next_throws
from friction_estimation.discovery.report import write_files
from friction_estimation.tracks.throw_list import load_tracks

if TYPE_CHECKING:
    from agents.app.work.reported import Reported


def do_discover(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Find what the ice of a session lacks, into the folder ``discovery`` of the session."""
    found = discover(load_tracks(club.tracks_of(session)), progress=progress)
    following = next_throws(found.final)
    folder = make_directory(club.folder_of(session) / DISCOVERY)
    with together():
        write_files(found, folder, following=following, provenance=provenance(seed=0))
