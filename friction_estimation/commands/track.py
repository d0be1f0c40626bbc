"""`curling track`: from films to tracks."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from curling_env.commands.cli import OutputFile, print_json, progress, say
from curling_env.errors import InputError

if TYPE_CHECKING:
    from friction_estimation.camera.scene import Scene
    from friction_estimation.tracking import FilmTrack


class FlowChoice(StrEnum):
    """The forms of Lucas-Kanade."""

    plain = "plain"
    pyramidal = "pyramidal"


def track(
    films: Annotated[
        list[str],
        typer.Argument(
            metavar="VIDEO...",
            help="Films of one camera, in order of play; with --together, one throw by several "
            "cameras; or a camera's number or stream's URL.",
        ),
    ],
    scene: Annotated[
        list[Path],
        typer.Option(
            metavar="SCENE.json",
            help="Where the camera sees the sheet; one for all films, or one for each.",
        ),
    ],
    output: OutputFile = Path("tracks.csv"),
    camera: Annotated[
        Path | None,
        typer.Option(
            metavar="CAMERA.json", help="Lens from `curling calibrate`, instead of the scene's."
        ),
    ] = None,
    overlay: Annotated[
        Path | None,
        typer.Option(metavar="OUT.mp4", help="Also draw what was tracked into the (only) film."),
    ] = None,
    refine: Annotated[
        bool,
        typer.Option(
            "--refine/--as-marked",
            help="Let rings, hog lines and border correct the points in the scene file.",
        ),
    ] = True,
    keep: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Where a live camera's films are kept; beside -o if not."),
    ] = None,
    throws: Annotated[
        int | None, typer.Option(min=1, help="Of a live camera: end after so many throws.")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Of a live camera: a page that shows the ice so far, and loads itself again.",
        ),
    ] = None,
    flow: Annotated[
        FlowChoice, typer.Option(help="Optical flow that predicts the stone's next place.")
    ] = FlowChoice.pyramidal,
    together: Annotated[
        bool,
        typer.Option("--together", help="The films show one throw by several cameras: join them."),
    ] = False,
    bridge: Annotated[
        bool,
        typer.Option("--bridge", help="With --together: also rows where no camera saw the stone."),
    ] = False,
) -> None:
    """Follow the thrown stone through films: from VIDEO to positions in metres.

    Each film shows one throw. The scene file holds the four ice corners in the image
    (corners_px), or four or more known points (points), and, where known, the camera matrix and
    the distortion (see `curling calibrate`). Points may be some pixels off: the paint on the ice
    corrects them, and finds a lens that is not known. No click is needed: the stone is what
    slides along the ice at a stone's size.

    The tracks file has one row per frame in which the stone was seen: throw, t (seconds from the
    film's first frame), x, y (metres from mid-sheet), theta (heading of the handle), and the
    standard errors sigma_xy and sigma_theta. sigma_xy holds what stays the same from frame to
    frame too: the camera's place and the stone's shape. Other stones on the sheet have rows of
    their own, told apart by stone (the thrown one is 0): one that is struck from the contact on,
    one that nobody touches in the first and in the last frame.

    Instead of films, give the number of a camera (0 is the first) or the URL of a stream: each
    throw is recorded as a film of its own, tracked as soon as it is over, and added to the tracks
    file, and what the throws so far say of the ice is told; with --report a page shows it, map and
    all, and follows as the throws come. Ctrl-C ends it, and what was recorded is still tracked.

    Work on many films that was interrupted goes on where it was when the command is given again.

    Cameras that see a part of the sheet each, as those over the houses, are joined with
    --together: their clocks need not agree, the offsets are found from where the stone passes
    from one to the next, or, where none saw it in between, from how a stone slides on. With
    --bridge the gap is filled with what that motion says; sigma_xy grows there, and rows of later
    cameras carry the uncertainty of their clocks.

    \b
    Example:
        curling track 0 --scene end.scene.json -o tracks.csv --report ice
        curling track end-0.mp4 end-1.mp4 --scene end.scene.json -o tracks.csv
        curling track end-0.mp4 --scene end.scene.json --overlay seen.mp4
        curling track home.mp4 mid.mp4 away.mp4 --together \\
            --scene home.json --scene mid.json --scene away.json
    """
    import cv2

    from curling_env.storage import file_digest
    from curling_env.trajectory import write_tracks
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.film.video import is_stream
    from friction_estimation.tracking import TrackingOptions, track_film
    from friction_estimation.tracking.resume import Unfinished

    if overlay is not None and len(films) > 1:
        raise InputError("an overlay is drawn for one film at a time", source="--overlay")
    cv2.setNumThreads(1)
    if len(scene) not in (1, len(films)):
        raise InputError(
            f"one scene for all films or one for each: {len(films)} films, {len(scene)} scenes",
            source="--scene",
        )
    if bridge and not together:
        raise InputError(
            "fills the gaps between cameras; it goes with --together", source="--bridge"
        )
    if together and len(films) < 2:
        raise InputError("joins the films of two cameras or more", source="--together")
    scenes = [load_scene(path, camera) for path in scene]
    scenes *= len(films) // len(scenes)
    streams = [source for source in films if is_stream(source)]
    if streams:
        from friction_estimation.commands.track_live import track_live

        if len(films) > 1:
            raise InputError("a live camera is followed alone", source=streams[0])
        if overlay is not None:
            raise InputError("a live camera has no overlay; track its films again for that",
                             source="--overlay")  # fmt: skip
        track_live(streams[0], scenes[0], output, keep=keep, throws=throws, report=report)
        return
    for name, given in (("--report", report), ("--throws", throws), ("--keep", keep)):
        if given is not None:
            raise InputError("goes with a live camera's number or a stream's URL", source=name)
    unfinished = Unfinished(
        output,
        {
            "scenes": [file_digest(path) for path in (*scene, *([camera] if camera else []))],
            "refine": refine,
            "flow": flow.value,
        },
    )
    tracks, said = [], []
    for i, film in enumerate(map(Path, films)):
        throw = 0 if together else i
        before = None if overlay is not None else unfinished.recall(i, film)
        if before is not None:
            of_film, about = before
            say(f"{film.name}: tracked before the interruption")
        else:
            result = track_film(
                film,
                scenes[i],
                throw=throw,
                options=TrackingOptions(flow=flow.value, refine=refine),
                progress=lambda frames, total, name=film.name: progress(
                    frames, f"track {name}", total=total, unit="frame"
                ),
            )
            of_film, about = result.trajectories, _about(result)
            say(f"{film.name}: {_words(result)}")
            if overlay is not None:
                _draw(film, scenes[i], result, overlay)
            if len(films) > 1:
                unfinished.keep(i, film, of_film, about)
        # What several cameras see of one throw is joined for the thrown stone.
        tracks += of_film[:1] if together else of_film
        said.append({"film": films[i], "throw": throw, **about})
    if together:
        from friction_estimation.tracks.camera_fusion import join_cameras

        joined = join_cameras(tracks)
        tracks = [joined.whole if bridge else joined.trajectory]
        for k, film in enumerate(films):
            say(
                f"{Path(film).name}: {joined.offset[k]:+.3f} s ± "
                f"{1000 * joined.offset_sigma[k]:.0f} ms on the clock of "
                f"{Path(films[joined.order[0]]).name}"
            )
            said[k] |= {
                "offset_s": float(joined.offset[k]),
                "offset_sigma_s": float(joined.offset_sigma[k]),
            }
    write_tracks(output, tracks)
    unfinished.done()
    print_json(said)


def _draw(film: Path, scene: Scene, result: FilmTrack, output: Path) -> None:
    from friction_estimation.tracking.overlay import write_overlay

    write_overlay(
        film,
        scene,
        result,
        output,
        progress=lambda frames, total: progress(frames, "overlay", total=total, unit="frame"),
    )


def _about(result: FilmTrack) -> dict[str, Any]:
    """What of a film's track is printed."""
    return {
        "frames": result.frame_count,
        "tracked": len(result.trajectory),
        "from_s": float(result.trajectory.t[0]),
        "to_s": float(result.trajectory.t[-1]),
        **({"contacts_s": list(result.contacts)} if result.contacts else {}),
        **({"others": [_about_other(other) for other in result.others]} if result.others else {}),
    }


def _about_other(other: FilmTrack) -> dict[str, object]:
    """What of a stone that was not thrown is printed."""
    begin, end = other.trajectory.xy[0], other.trajectory.xy[-1]
    return {
        "stone": other.trajectory.stone,
        "struck": bool(other.contacts),
        "lay": [round(float(value), 4) for value in begin],
        **({"rests": [round(float(value), 4) for value in end]} if other.contacts else {}),
    }


def _words(result: FilmTrack) -> str:
    known = 1000 * _median(result.trajectory.sigma_xy)
    paint = (
        f"the paint on the ice agrees to {result.landmarks.rms_px:.2f} px"
        if result.landmarks.readings
        else "the paint on the ice could not check the points that were marked"
    )
    return (
        f"stone seen in {len(result.trajectory)} of {result.frame_count} frames, its place known "
        f"to about {known:.1f} mm; {paint}{_company(result)}"
    )


def _company(result: FilmTrack) -> str:
    struck = sum(bool(other.contacts) for other in result.others)
    still = len(result.others) - struck
    parts = [f"{struck} struck"] if struck else []
    parts += [f"{still} untouched"] if still else []
    return f"; other stones: {', '.join(parts)}" if parts else ""


def _median(values: object) -> float:
    import numpy as np

    return float(np.median(values))  # pyright: ignore[reportCallIssue, reportArgumentType]
