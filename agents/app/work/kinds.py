"""The kinds of long work: each a function of club, session and progress."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from agents.app.club import Club, Session

if TYPE_CHECKING:
    from agents.app.work.worker import Reported


def estimate(club: Club, session: Session, progress: Reported) -> None:
    """The ice of a session from its tracks, into its ``ice.json``."""
    from curling_env.ice import save_ice
    from friction_estimation.estimation.whole_ice import estimate_ice
    from friction_estimation.tracks.throw_list import load_tracks

    progress("estimating the ice from the tracks", 0.0)
    found = estimate_ice(load_tracks(club.tracks_of(session)))
    save_ice(found.ice, club.ice_of(session))


KINDS: Mapping[str, Callable[[Club, Session, Reported], None]] = {"estimate": estimate}
