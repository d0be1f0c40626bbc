"""Lone throws one after the other, each on the ice as the previous ones have left it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from curling_env.errors import InputError, placed
from curling_env.ice import Ice, load_ice
from curling_env.infrastructure.files import limits
from curling_env.physics.slides import Slide, slide
from curling_env.physics.wear import PATH_FPS, IceInUse
from curling_env.throw import Release, Throw
from curling_env.trajectory import Trajectory
from curling_env.typing import Progress, no_progress, with_progress


def simulate(
    ice: str | Path | Ice,
    throws: Sequence[Release | Throw],
    *,
    fps: float = 30.0,
    progress: Progress = no_progress,
) -> list[Trajectory]:
    """Throw stones one after the other, each alone on the sheet, and return their true paths.

    Ice that wears, drifts or has tracks changes from throw to throw. An effect of the measurement
    in the ice file changes what a camera would report, not these paths.

    Parameters
    ----------
    ice : an `Ice`, the path of an ice file, or the name of a preset
    throws : in the order of play; a `Throw` is played towards the away end
    fps : samples per second of the paths
    progress : called with the number of throws done

    Returns
    -------
    One path per throw, from the release until the stone rests or touches the edge of the ice.

    Raises
    ------
    InputError : an ice that cannot be loaded, a throw that cannot be made on it, or more samples
        than a file of tracks may have
    """
    releases = [
        throw if isinstance(throw, Release) else replace(throw.release(order=k), throw=k)
        for k, throw in enumerate(throws)
    ]
    runs = slides_in_turn(load_ice(ice), releases, fps=fps)
    tracks: list[Trajectory] = []
    samples = 0
    for run in with_progress(runs, "throws", progress, len(releases)):
        if run.trajectory is not None:
            tracks.append(run.trajectory)
            samples += len(run.trajectory)
        if samples > limits.MAX_ROWS:
            raise InputError(
                f"{len(releases)} throws at {fps:g} samples a second exceed {limits.MAX_ROWS} "
                "rows of tracks: use fewer throws, or fewer samples"
            )
    return tracks


def slides_in_turn(ice: Ice, releases: Iterable[Release], *, fps: float) -> Iterator[Slide]:
    """Slide stones one after the other, each on the ice as the previous ones have left it.

    The wear does not depend on fps, the samples per second of the kept paths.

    Raises
    ------
    InputError : a release that cannot be thrown; the error names the throw
    """
    in_use = IceInUse(ice)
    runs_twice = in_use.remembers and fps != PATH_FPS
    for release in releases:
        with placed(where=f"throw {release.throw}"):
            run = slide(in_use.now, release, fps=fps, throw=release.throw)
            ran = slide(in_use.now, release, fps=PATH_FPS) if runs_twice else run
        if ran.trajectory is not None:
            in_use.ran(ran.trajectory.xy)
        yield run
