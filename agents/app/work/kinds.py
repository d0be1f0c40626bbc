"""The kinds of long work: each a function of club, session, progress, and what it was given."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from agents.app.club import Club, Session
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


KINDS: Mapping[str, Callable[[Club, Session, Reported, str], None]] = {
    "track": track,
    "record": record,
    "estimate": estimate,
}
IN_WORDS = {"track": "Tracking", "record": "Recording", "estimate": "Estimating the ice"}
"""What the pages call them."""
