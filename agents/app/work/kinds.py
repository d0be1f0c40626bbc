"""The kinds of long work: each a function of club, session, progress, and what it was given.

A process does one piece of work, and loads only what that needs: the functions import inside.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from agents.app.club import Club, Session
from agents.app.club.club import DISCOVERY
from agents.app.work.jobs import CAUSES, COPY

if TYPE_CHECKING:
    from agents.app.work.reported import Reported


def track(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """See `agents.app.work.tracking`."""
    from agents.app.work.tracking import track

    track(club, session, progress, given)


def record(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """See `agents.app.work.recording`."""
    from agents.app.work.recording import record

    record(club, session, progress, given)


def tell_causes(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """See `agents.app.work.causes`."""
    from agents.app.work.causes import work_out

    work_out(club, session, progress, given)


def copy_film(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """See `agents.app.work.film_copy`."""
    from agents.app.work.film_copy import make_copy

    make_copy(club, session, progress, given)


def estimate(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """The ice of a session from its tracks, into its ``ice.json``."""
    from agents.app.work.causes import prepare
    from curling_env.ice import save_ice
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.estimation.whole_ice import estimate_ice
    from friction_estimation.tracks.throw_list import load_tracks

    found = estimate_ice(load_tracks(club.tracks_of(session)), progress=progress)
    save_ice(found.ice, club.ice_of(session), provenance=provenance(seed=0))
    prepare(club, session)


def discover(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """What the ice of a session lacks, into the folder ``discovery`` of the session."""
    from curling_env.infrastructure.files.writing import make_directory, together
    from curling_env.infrastructure.provenance import provenance
    from friction_estimation.discovery.discover import discover as find
    from friction_estimation.discovery.evidence.next_throws import next_throws
    from friction_estimation.discovery.report import write_files
    from friction_estimation.tracks.throw_list import load_tracks

    found = find(load_tracks(club.tracks_of(session)), progress=progress)
    following = next_throws(found.final)
    folder = make_directory(club.folder_of(session) / DISCOVERY)
    with together():
        write_files(found, folder, following=following, provenance=provenance(seed=0))


def import_files(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with the files of the folder that is given."""
    from agents.app.take_in import fill_from
    from agents.app.work.causes import prepare

    fill_from(club, session, Path(given))
    prepare(club, session)


def make_up(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with a made-up evening."""
    from agents.app.demo import fill
    from agents.app.work.causes import prepare

    fill(club, session, progress=progress)
    prepare(club, session)


KINDS: Mapping[str, Callable[[Club, Session, Reported, str], None]] = {
    "track": track,
    "record": record,
    "estimate": estimate,
    "discover": discover,
    CAUSES: tell_causes,
    COPY: copy_film,
    "import": import_files,
    "make up": make_up,
}
IN_WORDS = {
    "track": "Tracking",
    "record": "Recording",
    "estimate": "Estimating the ice",
    "discover": "Looking for what the ice lacks",
    CAUSES: "Telling the hand from the ice",
    COPY: "A copy for the browser",
    "import": "Taking in files",
    "make up": "Making up an evening",
}
"""What the pages call them."""
