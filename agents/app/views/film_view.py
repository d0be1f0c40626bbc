"""View of a throw beside its film: its path in the picture, and its speed."""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.app.club import Club, Film, Session, Throw
from agents.app.club.session_files import load_part, part_path
from curling_env.errors import CurlingError
from curling_env.sheet import RULE_BOOK_STONE
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.camera.scene import load_scene
from friction_estimation.film.video import Film as OpenedFilm
from friction_estimation.tracking.films.shared_cameras import camera_from

WINDOW = 0.35
"""Half of the time over which a speed is measured [s]."""
CORNERS = 16
"""Of the outline of a stone in the picture."""
STILL = 0.02
"""A stone slower than this rests [m/s]."""


def speeds(track: Trajectory) -> Floats:
    """Speed along a track, (n,) [m/s]: the slope of a line through the places around each time."""
    found = np.empty(len(track))
    for k, t in enumerate(track.t):
        near = np.flatnonzero(np.abs(track.t - t) <= WINDOW)
        if len(near) < 3:
            near = np.arange(max(k - 1, 0), min(k + 2, len(track)))
        u = track.t[near] - track.t[near].mean()
        spread = float(u @ u)
        slope = u @ track.xy[near] / spread if spread > 0 else np.zeros(2)
        found[k] = np.hypot(slope[0], slope[1])
    return np.where(found < STILL, 0.0, found)


def throw_view(club: Club, session: Session, throw: Throw) -> dict[str, Any] | None:
    """A throw's speed, and its path and outline in the film's picture, for JSON.

    Returns
    -------
    ``t`` [s] counts as the film does, or from the track's beginning where there is no film;
    ``speed`` [m/s]; ``frame`` is the time between two frames [s];
    ``ahead`` and ``right`` as the thrower sees it [m];
    ``picture`` with ``size``, ``path`` and ``outlines`` in pixels, or None where
    no film shows it. None where the track is not there.
    """
    film = club.film(throw.film_id)
    part = load_part(part_path(club, session, film))
    if part is None or throw.part >= len(part.throws):
        return None
    tracks = part.throws[throw.part]
    track = tracks[0]
    begin = 0.0 if film is None else throw.clock
    sign = 1.0 if track.xy[-1, 1] >= track.xy[0, 1] else -1.0
    camera = None
    if film is not None:
        try:
            camera = _camera(club, session, film, part.camera)
        except CurlingError:  # the film was moved, or its scene is no longer there
            camera = None
    return {
        "t": np.round(track.t + begin, 3).tolist(),
        "speed": np.round(speeds(track), 3).tolist(),
        "frame": round(float(np.median(np.diff(track.t))), 4),
        "ahead": np.round(sign * track.xy[:, 1], 3).tolist(),
        "right": np.round(sign * track.xy[:, 0], 3).tolist(),
        "picture": None if camera is None else _in_picture(camera, track),
    }


def _camera(
    club: Club, session: Session, film: Film, solved: dict[str, Any] | None
) -> Camera | None:
    """The camera of a film: as it was solved for it, or as its scene has it."""
    if solved is not None:
        return camera_from(solved).camera
    camera = club.camera_of(session, film)
    if camera is None or camera.scene is None:
        return None
    size = OpenedFilm.open(club.path(film.file)).size
    return camera_from_scene(load_scene(club.path(camera.scene)), size)


def _in_picture(camera: Camera, track: Trajectory) -> dict[str, Any]:
    around = np.linspace(0, 2 * np.pi, CORNERS, endpoint=False)
    ring = RULE_BOOK_STONE.radius * np.column_stack([np.cos(around), np.sin(around)])
    places = track.xy[:, None, :] + ring
    outlines = camera.project(_on_ice(places.reshape(-1, 2))).reshape(len(track), CORNERS, 2)
    path = camera.project(_on_ice(track.xy))
    return {
        "size": list(camera.size),
        "path": _plain(path),
        "outlines": [_plain(outline) for outline in outlines],
    }


def _on_ice(xy: Floats) -> Floats:
    return np.column_stack([xy, np.zeros(len(xy))])


def _plain(px: Floats) -> list[list[float]]:
    return np.round(np.nan_to_num(px), 1).tolist()
