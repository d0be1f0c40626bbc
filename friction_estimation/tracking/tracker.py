"""Interface of a tracker, and lookup by name: the built-in one, a plug-in, or a function."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from curling_env.errors import InputError, NoThrowError
from curling_env.infrastructure.plugins import load_plugin
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking.films.film_track import FilmTrack, TrackingOptions

TRACKER_GROUP = "curling.trackers"
"""Entry-point group of trackers."""
BUILT_IN = "built-in"
"""Name of the built-in tracker, `track_film`."""
USUAL = TrackingOptions()


class Tracker(Protocol):
    """Function that finds the stones in the film of one throw.

    Parameters
    ----------
    film : path of the film; its first frame is at t = 0
    scene : the camera's view of the sheet, and the sizes of sheet and stone
    progress : call it now and then with how much of the film is done, or ignore it

    Returns
    -------
    The tracks of all stones that were found, in the sheet frame, the thrown stone first; a single
    `Trajectory` will do. Give `t`, `xy`, and where they are known `theta`, `sigma_xy` and
    `sigma_theta`. `throw` and `stone` are numbered by the caller. A `FilmTrack` holds tracks too,
    and lets overlays and pictures for reports be drawn.

    Raises
    ------
    InputError : a film in which no thrown stone is found, or that cannot be read
    """

    def __call__(
        self, film: Path, scene: Scene, /, *, progress: Progress
    ) -> FilmTrack | Trajectory | Sequence[Trajectory]: ...


def load_tracker(name: str = BUILT_IN, options: TrackingOptions = USUAL) -> Tracker:
    """Load the tracker of a name.

    Parameters
    ----------
    name : a name that an installed package declares under the entry-point group
        `curling.trackers`, or ``module:function``, whose module may lie in the current folder
    options : options of the built-in tracker

    Raises
    ------
    InputError : an unknown name, a module that cannot be imported, something that is no tracker, or
        options for another tracker than the built-in one
    """
    found = load_plugin("tracker", TRACKER_GROUP, name, form="module:function")
    if not _is_tracker(found):
        raise InputError(
            f"the tracker {name!r} must be a function that can be called as "
            "tracker(film, scene, progress=progress)"
        )
    if options == USUAL:
        return found
    if name != BUILT_IN:
        problem = "--as-marked and --slow are options of the built-in tracker"
        raise InputError(problem, source=name)
    return partial(found, options=options)


def tracks_in(found: Any, film: Path) -> tuple[Trajectory, ...]:
    """Return the tracks in what a tracker returned, the thrown stone first.

    Raises
    ------
    InputError : no track, or something else than tracks
    """
    if isinstance(found, FilmTrack):
        return found.trajectories
    tracks = (found,) if isinstance(found, Trajectory) else found
    if not isinstance(tracks, Sequence) or not all(isinstance(k, Trajectory) for k in tracks):
        raise InputError(
            f"the tracker returned {type(found).__name__}, expected tracks (Trajectory)",
            source=film,
        )
    if not tracks or not len(tracks[0]):
        raise NoThrowError("the tracker found no thrown stone", source=film)
    return tuple(tracks)


def _is_tracker(found: Any) -> bool:
    if not callable(found):
        return False
    try:
        inspect.signature(found).bind(Path(), None, progress=no_progress)
    except TypeError:
        return False
    except ValueError:  # a function in C has no signature
        return True
    return True
