"""Work on the throws of a session: files in, its ice, effects, causes of misses."""

from __future__ import annotations

from pathlib import Path

from agents.app.club import Club, Session
from agents.app.club.club import DISCOVERY, digest_of_file
from agents.app.work.causes import prepare
from agents.app.work.jobs import Reported
from curling_env.infrastructure.files.writing import make_directory, together
from curling_env.infrastructure.provenance import provenance
from friction_estimation.tracks.throw_list import load_tracks


def do_import(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with the files of the folder that is given."""
    from agents.app.sheet.choices import centre_of_session
    from agents.app.take_in import fill_from

    fill_from(club, session, Path(given))
    centre_of_session(club, session)
    prepare(club, session)


def do_make_up(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Fill a session with a made-up evening."""
    from agents.app.take_in import fill_evening

    fill_evening(club, session, progress=progress)
    prepare(club, session)


def do_estimate(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Estimate the ice of a session, into its ``ice.json``."""
    from agents.app.sheet.choices import centre_of_session
    from curling_env.ice import save_ice
    from friction_estimation.estimation.whole_ice import estimate_ice

    tracks = club.tracks_of(session)
    digest = digest_of_file(tracks)
    found = estimate_ice(load_tracks(tracks), progress=progress)
    save_ice(found.ice, club.ice_of(session), provenance=provenance(seed=0))
    club.change("session", session.id, ice_of=digest)
    centre_of_session(club, session)
    prepare(club, session)


def do_discover(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Find what the ice of a session lacks, into the folder ``discovery`` of the session."""
    from friction_estimation.discovery.discover import discover
    from friction_estimation.discovery.evidence.next_throws import next_throws
    from friction_estimation.discovery.report import write_files as write_report

    found = discover(load_tracks(club.tracks_of(session)), progress=progress)
    following = next_throws(found.final)
    folder = make_directory(club.folder_of(session) / DISCOVERY)
    with together():
        write_report(found, folder, following=following, provenance=provenance(seed=0))


def do_causes(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Work out why throws missed, and how athletes throw."""
    from agents.app.work.causes import prepare_errors, work_out

    work_out(club, session, progress, given)
    prepare_errors(club, session)
