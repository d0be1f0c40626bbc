"""A copy of a film that every browser plays: H.264, at most as large as a screen.

Some phones and cameras write HEVC, and old ones Motion JPEG, which most browsers do not play. The
film itself stays as it is, and is what is tracked.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from agents.app.club import Club, Film, Session
from agents.app.club.club import PLAYABLE
from agents.app.work.jobs import Reported
from curling_env.errors import InputError
from curling_env.infrastructure.files.writing import atomic_path, make_directory
from curling_env.typing import Progress
from friction_estimation.film.video import Film as OpenedFilm
from friction_estimation.film.writer import film_writer

WIDEST = 1280
"""Of a copy [px]."""
QUALITY = 24.0
"""See `friction_estimation.film.writer`."""
STILL = 160
"""Width of a small picture [px]."""


def copy_of(club: Club, film: Film) -> Path:
    """Return the path of a film's copy, whether or not it exists yet."""
    return club.path(f"{PLAYABLE}/film-{film.id}.mp4")


def still_of(club: Club, film: Film) -> Path:
    """Return a small picture of a film, made when it is first asked for.

    Raises
    ------
    InputError : the film cannot be read
    """
    path = club.path(f"{PLAYABLE}/film-{film.id}.jpg")
    if not path.exists():
        make_directory(path.parent)
        _, frame = OpenedFilm.open(club.path(film.file)).pick([0])[0]
        height = round(STILL * frame.shape[0] / frame.shape[1])
        small = cv2.resize(frame, (STILL, height), interpolation=cv2.INTER_AREA)
        with atomic_path(path) as draft:
            cv2.imwrite(str(draft), small)
    return path


def do_copy(club: Club, session: Session, progress: Reported, given: str = "") -> None:
    """Make the copy of a film whose number is given.

    Raises
    ------
    InputError : the film is not there, or cannot be read
    """
    film = club.film(int(given)) if given.isdecimal() else None
    if film is None:
        raise InputError("that film does not exist or was removed")
    path = copy_of(club, film)
    if path.exists():
        return
    make_directory(path.parent)
    smaller(OpenedFilm.open(club.path(film.file)), path, WIDEST, QUALITY, progress)


def smaller(
    film: OpenedFilm,
    path: Path,
    widest: int,
    quality: float,
    progress: Progress,
    *,
    every: int = 1,
) -> None:
    """Write a film as H.264.

    Parameters
    ----------
    widest : greatest width [px]
    quality : see `friction_estimation.film.writer`
    every : which of the frames are kept
    """
    scale = min(1.0, widest / film.size[0])
    width, height = (2 * max(round(scale * side / 2), 1) for side in film.size)
    with film_writer(path, (width, height), film.fps / every, quality=quality) as writer:
        for k, (t, frame) in enumerate(film.frames()):
            if k % every == 0:
                small = cv2.resize(frame, (width, height), interpolation=cv2.INTER_AREA)
                writer.write(np.asarray(small, dtype=np.uint8), t)
            progress("converting the film for browsers", t, film.duration)
