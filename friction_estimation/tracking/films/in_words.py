"""A tracked throw in words, for the terminal."""

from __future__ import annotations

import numpy as np

from friction_estimation.camera.tuning import STONE_HEIGHT_SIGMA
from friction_estimation.tracking.films.film_track import FilmTrack
from friction_estimation.tracking.films.tracked_film import TrackedFilm


def film_in_words(one: TrackedFilm) -> str:
    """Describe a tracked throw: its rows, their error, the camera and the other stones."""
    if one.resumed:
        return "tracked before the interruption"
    if one.found is None:
        return f"stone seen in {len(one.thrown)} frames"
    found = one.found
    sigma = 1000 * float(np.median(found.trajectory.sigma_xy))
    hidden = f"; it is hidden {found.not_seen}" if found.not_seen else ""
    parts = [
        f"stone seen in {len(found.trajectory)} of {found.frame_count} frames, its place known "
        f"to about {sigma:.1f} mm{hidden}",
        f"the paint on the ice agrees to {found.refined.rms_px:.2f} px"
        if found.refined.measured
        else "the marked points could not be compared with the paint",
        *_camera_in_words(found),
    ]
    struck = sum(bool(other.contacts) for other in found.others)
    counts = {"hit": struck, "untouched": len(found.others) - struck}
    if found.others:
        stones = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
        parts.append(f"other stones: {stones}")
    return "; ".join([*parts, *found.unexplained])


def _camera_in_words(found: FilmTrack) -> list[str]:
    words: list[str] = []
    uncertainty = found.refined.height_uncertainty
    if uncertainty >= STONE_HEIGHT_SIGMA:
        words.append(
            f"its camera is about {found.camera.position[2]:.1f} m above the ice, uncertain by "
            f"{100 * uncertainty:.0f} %: measure it and give --height"
        )
    if found.moved_px:
        far = "about {:.1f}" if found.moved_px < np.inf else "more than 6"
        words.append(
            f"the camera has moved by {far.format(found.moved_px)} px since the scene was solved, "
            "and was solved again"
        )
    return words
