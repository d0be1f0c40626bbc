"""`curling track`: from films to tracks."""

from __future__ import annotations

import sys
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from curling_env.commands.cli import (
    JsonOption,
    TracksFile,
    UnitsOption,
    Writes,
    conclude,
    progress_bar,
    say,
)
from curling_env.errors import InputError
from curling_env.infrastructure.files.kinds import FILM_SUFFIXES
from curling_env.units import Units
from friction_estimation.camera.scene import CAMERA_HEIGHTS

if TYPE_CHECKING:
    from curling_env.trajectory import Trajectory
    from friction_estimation.tracking import FilmTrack, TrackedFilm, Tracker

CameraOption = Annotated[
    Path | None,
    typer.Option(
        metavar="CAMERA.json", help="Lens from `curling calibrate`, instead of the scene's."
    ),
]
HeightOption = Annotated[
    float | None,
    typer.Option(
        metavar="M",
        min=CAMERA_HEIGHTS[0],
        max=CAMERA_HEIGHTS[1],
        help="Measured height of the camera above the ice [m]. From above, and in small pictures, "
        "nothing tells it as well where the lens is not known.",
    ),
]
TrackerOption = Annotated[
    str,
    typer.Option(
        metavar="NAME|MODULE:FUNCTION",
        help="Your own tracker: the name under which an installed package declares it, or a "
        "Python function, whose module may lie in the current folder.",
    ),
]
RefineOption = Annotated[
    bool,
    typer.Option(
        "--refine/--as-marked",
        help="Correct the points in the scene file by the paint on the ice, or trust them.",
    ),
]


SlowOption = Annotated[
    float | None,
    typer.Option(
        metavar="N",
        min=0.05,
        help="The film plays N times slower than life: 4 for 120 frames a second played at 30. "
        "Otherwise what the camera noted is believed.",
    ),
]


UNSURE_HEIGHT = 0.05
"""A camera's height whose standard error is a larger share than this is questioned."""


class FlowChoice(StrEnum):
    """The forms of Lucas-Kanade optical flow."""

    plain = "plain"
    pyramidal = "pyramidal"


def track(
    films: Annotated[
        list[str],
        typer.Argument(
            metavar="VIDEO...",
            help="Films of one throw or of many, or folders of films, in order of play.",
        ),
    ],
    scene: Annotated[
        list[Path],
        typer.Option(
            metavar="SCENE.json",
            help="Where the camera sees the sheet; one for all films, or one for each.",
        ),
    ],
    output: TracksFile = Path("tracks.csv"),
    append: Annotated[
        bool,
        typer.Option("--append", help="Add the throws to those that the tracks file holds."),
    ] = False,
    overlay: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT.mp4",
            help="Also draw the track into a copy of the film; for one film. Its further throws "
            "are drawn into OUT-1.mp4, OUT-2.mp4, ...",
        ),
        Writes(kinds=("made film",), suffixes=FILM_SUFFIXES),
    ] = None,
    camera: CameraOption = None,
    height: HeightOption = None,
    refine: RefineOption = True,
    flow: Annotated[
        FlowChoice,
        typer.Option(help="Optical flow that predicts where the stone is in the next frame."),
    ] = FlowChoice.pyramidal,
    slow: SlowOption = None,
    tracker: TrackerOption = "built-in",
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Follow the thrown stone through films: from video to positions in metres.

    A film may show one throw or a whole practice: a long film is cut into its throws, and empty ice
    is passed quickly. Instead of films, name a folder of films. No click is needed: the stone is
    what slides along the ice and has a stone's size; one that is carried or slid back is no throw.
    The scene file holds the four corners of the ice in the picture (corners_px),
    or four or more known points (points); `curling corners` helps to mark them. It may also hold
    the camera matrix and the distortion of the lens, see `curling calibrate`. Points may be some
    pixels off: the paint on the ice corrects them, and measures a lens that is not known.

    The tracks file has one row for each frame in which the stone was seen: throw, t (seconds since
    the first frame of the film, or of the part of it that shows this throw; clock says where in
    the film that part begins), x and y (metres from the middle of the sheet), theta (heading of
    the handle), and the standard errors sigma_xy and sigma_theta. sigma_xy includes errors that
    are the same in every frame: those of the camera's position and of the stone's shape. Other
    stones on the sheet have rows of their own, after the thrown one's. The column stone tells them
    apart: stones are numbered in order of play, and known again by the colour of the handle or by
    where they lie. A table throws.csv beside the tracks (athlete, stone, called, note; a row for
    each throw) is joined to every later table. A stone that was hit has rows from the contact on;
    one that nobody touched has two rows, for the first and the last frame.

    The camera of a scene is solved once, from its first films together, and kept beside the scene
    (end.solved.json beside end.scene.json). Later films use it at once. Where the paint shows that
    the tripod has moved, it is solved anew.

    If tracking many films is interrupted, repeat the command: films that were tracked before are
    not tracked again.

    For a camera that is filming now, see `curling live`; for one throw that several cameras filmed,
    see `curling join-cameras`.

    A tracker of your own (--tracker) is a Python function that is called as
    tracker(film, scene, progress=progress) and returns the tracks; see docs/tracking.md.

    \b
    Example:
        curling track practice.mp4 --scene end.scene.json -o tracks.csv
        curling track end-0.mp4 end-1.mp4 --scene end.scene.json -o tracks.csv
        curling track end-0.mp4 --scene end.scene.json --overlay seen.mp4
        curling track end-0.mp4 --scene end.scene.json --tracker our_tracker:track
    """
    import cv2

    from curling_env.infrastructure.files.storage import check_writable, fitted, together
    from curling_env.infrastructure.files.writing import note_rewritten
    from curling_env.trajectory import read_tracks, write_tracks
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.film.video import films_in, is_stream
    from friction_estimation.tracking import track_each
    from friction_estimation.tracking.films.resume import Checkpoints
    from friction_estimation.tracking.films.shared_cameras import SharedCameras
    from friction_estimation.tracking.overlay.film import write_overlay
    from friction_estimation.tracks.plausible_friction import question_about, rough_friction
    from friction_estimation.tracks.throw_list import ThrowNote, throws_beside

    for film in films:
        if is_stream(film):
            raise InputError("is a camera or a stream; `curling live` follows it", source=film)
    within = [films_in([film]) for film in films]
    paths = [path for some in within for path in some]
    if overlay is not None and len(paths) > 1:
        raise InputError("an overlay is drawn for one film at a time", source="--overlay")
    cv2.setNumThreads(1)
    scenes = [load_scene(path, camera, height) for path in scene]
    if len(scenes) == len(films):
        scenes = [one for one, some in zip(scenes, within, strict=True) for _ in some]
    function = choose_tracker(tracker, refine=refine, flow=flow, slow=slow)
    checkpoints = Checkpoints(output)
    tracked: list[TrackedFilm] = []
    earlier: list[Trajectory] = []
    if append and output.exists():
        note_rewritten(output)
        earlier = read_tracks(output)
    throws_beside(output)  # a table that cannot be read is refused before the work
    with together(), progress_bar("frame") as bar:
        for one in track_each(
            paths,
            scenes,
            tracker=function,
            checkpoints=checkpoints,
            cameras=SharedCameras(keep=True),
            always_track=0 if overlay is None else sys.maxsize,
            left_out=lambda why: say(f"left out: {why}"),
            progress=bar,
        ):
            say(f"{one.name}: {describe(one)}")
            asked = question_about(rough_friction(one.thrown))
            if asked is not None:
                say(f"{one.name}: {asked}")
                one = replace(one, summary={**one.summary, "question": asked})
            tracked.append(one)
            if overlay is not None:
                number = one.thrown.throw
                if one.found is None:
                    raise InputError(
                        "this tracker returns tracks alone, which do not suffice for an overlay",
                        source="--overlay",
                    )
                numbered = fitted(overlay.stem, f"-{number}{overlay.suffix}")
                drawn = overlay.with_name(numbered) if number else overlay
                check_writable(drawn, kinds=("made film",))
                if number and drawn.exists():
                    say(f"{drawn}: the earlier file of this name is replaced")
                write_overlay(
                    one.shown or one.film,
                    scenes[0],
                    one.found,
                    drawn,
                    units=units,
                    progress=bar,
                )
        if earlier:
            begin = 1 + max(track.throw for track in earlier)
            tracked = [_later(one, begin) for one in tracked]
        write_tracks(output, [*earlier, *(track for one in tracked for track in one.tracks)])
    checkpoints.delete()
    noted = throws_beside(output)
    done = f"{len(tracked)} throw{'s' * (len(tracked) != 1)}"
    done += f" added to {output}" if earlier else f": {output}"
    conclude(
        [
            {
                "film": str(one.film),
                "throw": one.thrown.throw,
                **one.summary,
                **noted.get(one.thrown.throw, ThrowNote()).row,
            }
            for one in tracked
        ],
        f"{done}; `curling throws {output}` shows what they were",
        as_json=as_json,
    )


def _later(one: TrackedFilm, begin: int) -> TrackedFilm:
    """A tracked film whose throws are numbered from `begin` on instead of 0."""
    return replace(one, tracks=tuple(replace(k, throw=k.throw + begin) for k in one.tracks))


def choose_tracker(
    name: str,
    *,
    refine: bool = True,
    flow: FlowChoice = FlowChoice.pyramidal,
    slow: float | None = None,
) -> Tracker:
    """The tracker of a name; the built-in one with the options that were chosen for it.

    Raises
    ------
    InputError : no such tracker, or options that it does not take
    """
    from friction_estimation.tracking import TrackingOptions, load_tracker
    from friction_estimation.tracking.tracker import BUILT_IN

    function = load_tracker(name)
    if refine and flow is FlowChoice.pyramidal and slow is None:
        return function
    if name == BUILT_IN:
        options = TrackingOptions(flow=flow.value, refine=refine, slow=slow)
        return partial(function, options=options)  # pyright: ignore[reportCallIssue]
    raise InputError(
        "--as-marked, --flow and --slow are options of the built-in tracker", source=name
    )


def describe(one: TrackedFilm) -> str:
    """What is said about a film at the terminal."""
    if one.resumed:
        return "tracked before the interruption"
    if one.found is None:
        return f"stone seen in {len(one.thrown)} frames"
    found = one.found
    known = 1000 * float(np.median(found.trajectory.sigma_xy))
    paint = (
        f"the paint on the ice agrees to {found.refined.rms_px:.2f} px"
        if found.refined.measured
        else "the paint on the ice could not check the points that were marked"
    )
    return (
        f"stone seen in {len(found.trajectory)} of {found.frame_count} frames, its place known "
        f"to about {known:.1f} mm{_not_seen(found)}; {paint}{_height(found)}{_moved(found)}"
        f"{_other_stones(found)}{_unexplained(found)}"
    )


def _not_seen(found: FilmTrack) -> str:
    return f"; it is hidden {found.not_seen}" if found.not_seen else ""


def _unexplained(found: FilmTrack) -> str:
    return "".join(f"; {said}" for said in found.unexplained)


def _height(found: FilmTrack) -> str:
    doubt = found.refined.height_doubt
    if doubt < UNSURE_HEIGHT:
        return ""
    return (
        f"; its camera hangs some {found.camera.position[2]:.1f} m above the ice, uncertain by "
        f"{100 * doubt:.0f} %: measure it and give --height"
    )


def _moved(found: FilmTrack) -> str:
    if not found.moved_px:
        return ""
    far = f"by about {found.moved_px:.1f} px" if found.moved_px < np.inf else "by more than 6 px"
    return f"; the camera has moved {far} since the scene was solved, and was solved anew"


def _other_stones(found: FilmTrack) -> str:
    struck = sum(bool(other.contacts) for other in found.others)
    still = len(found.others) - struck
    parts = [f"{struck} hit"] if struck else []
    parts += [f"{still} untouched"] if still else []
    return f"; other stones: {', '.join(parts)}" if parts else ""
