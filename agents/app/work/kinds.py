"""The kinds of long work: each a function of club, session, progress, and what it was given."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.club.club import DISCOVERY
from agents.app.work import causes, film_copy
from agents.app.work.recording import record
from agents.app.work.tracking import track

if TYPE_CHECKING:
    from agents.app.work.worker import Reported


def estimate(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """The ice of a session from its tracks, into its ``ice.json``."""
    from curling_env.ice import save_ice
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.estimation.whole_ice import estimate_ice
    from friction_estimation.tracks.throw_list import load_tracks

    found = estimate_ice(load_tracks(club.tracks_of(session)), progress=progress)
    save_ice(found.ice, club.ice_of(session), provenance=provenance(seed=0))
    causes.prepare(club, session)


def discover(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """What the ice of a session lacks, into the folder ``discovery`` of the session."""
    from curling_env.infrastructure.files.storage import make_directory, together
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.discovery.assessment import assess
    from friction_estimation.discovery.discover import discover as find
    from friction_estimation.discovery.report import write_files
    from friction_estimation.tracks.throw_list import load_tracks

    found = find(load_tracks(club.tracks_of(session)), progress=progress)
    folder = make_directory(club.folder_of(session) / DISCOVERY)
    with together():
        write_files(found, folder, assessment=assess(found), provenance=provenance(seed=0))


def import_files(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with the files of the folder that is given."""
    from agents.app.take_in import fill_from

    fill_from(club, session, Path(given))
    causes.prepare(club, session)


def make_up(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with a made-up evening."""
    from agents.app.demo import fill

    fill(club, session, progress=progress)
    causes.prepare(club, session)


KINDS: Mapping[str, Callable[[Club, Session, Reported, str], None]] = {
    "track": track,
    "record": record,
    "estimate": estimate,
    "discover": discover,
    causes.KIND: causes.work_out,
    film_copy.KIND: film_copy.make_copy,
    "import": import_files,
    "make up": make_up,
}
IN_WORDS = {
    "track": "Tracking",
    "record": "Recording",
    "estimate": "Estimating the ice",
    "discover": "Looking for what the ice lacks",
    causes.KIND: "Telling the hand from the ice",
    film_copy.KIND: "A copy for the browser",
    "import": "Taking in files",
    "make up": "Making up an evening",
}
"""What the pages call them."""
