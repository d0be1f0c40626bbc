"""`curling track`: from films to tracks."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from curling_env.cli import OutputFile, print_json, progress, say
from curling_env.errors import InputError


class FlowChoice(StrEnum):
    """The forms of Lucas-Kanade."""

    plain = "plain"
    pyramidal = "pyramidal"


def track(
    films: Annotated[
        list[Path],
        typer.Argument(metavar="VIDEO...", help="Films of one camera, in order of play."),
    ],
    scene: Annotated[
        Path, typer.Option(metavar="SCENE.json", help="Where the camera sees the sheet.")
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
    flow: Annotated[
        FlowChoice, typer.Option(help="Optical flow that predicts the stone's next place.")
    ] = FlowChoice.pyramidal,
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
    frame too: the camera's place and the stone's shape.

    \b
    Example:
        curling track end-0.mp4 end-1.mp4 --scene end.scene.json -o tracks.csv
        curling track end-0.mp4 --scene end.scene.json --overlay seen.mp4
    """
    import cv2

    from curling_env.trajectory import write_tracks
    from friction_estimation.scene import load_scene
    from friction_estimation.tracking import TrackingOptions, track_film

    if overlay is not None and len(films) > 1:
        raise InputError("an overlay is drawn for one film at a time", source="--overlay")
    cv2.setNumThreads(1)
    known = load_scene(scene, camera)
    results = []
    for i, film in enumerate(films):
        result = track_film(
            film,
            known,
            throw=i,
            options=TrackingOptions(flow=flow.value, refine=refine),
            progress=lambda frames, total, name=film.name: progress(
                frames, f"track {name}", total=total, unit="frame"
            ),
        )
        results.append(result)
        say(
            f"{film.name}: stone seen in {len(result.trajectory)} of {result.frame_count} frames, "
            f"its place known to about {1000 * float(_median(result.trajectory.sigma_xy)):.1f} mm; "
            + (
                f"the paint on the ice agrees to {result.landmarks.rms_px:.2f} px"
                if result.landmarks.readings
                else "the paint on the ice could not check the points that were marked"
            )
        )
    if overlay is not None:
        from friction_estimation.tracking.overlay import write_overlay

        write_overlay(
            films[0],
            known,
            results[0],
            overlay,
            progress=lambda frames, total: progress(frames, "overlay", total=total, unit="frame"),
        )
    write_tracks(output, [result.trajectory for result in results])
    print_json(
        [
            {
                "film": str(film),
                "throw": result.trajectory.throw,
                "frames": result.frame_count,
                "tracked": len(result.trajectory),
                "from_s": float(result.trajectory.t[0]),
                "to_s": float(result.trajectory.t[-1]),
            }
            for film, result in zip(films, results, strict=True)
        ]
    )


def _median(values: object) -> float:
    import numpy as np

    return float(np.median(values))  # pyright: ignore[reportCallIssue, reportArgumentType]
