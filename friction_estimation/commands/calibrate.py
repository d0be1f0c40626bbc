"""`curling calibrate`: the lens from pictures of a board, or all of a camera from painted ice."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import print_json, progress, say
from curling_env.errors import InputError

UNSURE = 0.05
"""Standard error of a height, as a share, from which on it is mentioned."""


class BoardChoice(StrEnum):
    """Boards that calibrate a camera."""

    chessboard = "chessboard"
    charuco = "charuco"


def calibrate(
    images: Annotated[
        list[Path],
        typer.Argument(
            metavar="IMAGE...",
            help="Pictures of the board, taken as the camera films; or one photo of the empty ice.",
        ),
    ],
    squares: Annotated[
        str, typer.Option(metavar="CxR", help="Squares of the board, columns x rows.")
    ] = "9x7",
    square_size: Annotated[float, typer.Option(metavar="M", help="Side of a square [m].")] = 0.03,
    board: Annotated[BoardChoice, typer.Option(help="What is drawn on it.")] = (
        BoardChoice.chessboard
    ),
    marker_size: Annotated[
        float | None,
        typer.Option(
            metavar="M", help="Side of a ChArUco marker [m]; 0.75 of a square if not given."
        ),
    ] = None,
    dictionary: Annotated[
        str, typer.Option(help="Dictionary of the ChArUco markers, as OpenCV calls it.")
    ] = "4X4_250",
    mark: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PLACE=U,V",
            help="A place on the ice and its pixel, roughly; may be given again and again.",
        ),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(metavar="SCENE.json", help="A scene whose points are such marks."),
    ] = None,
    height: Annotated[
        float | None, typer.Option(metavar="M", help="The camera's height above the ice [m].")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="P.png", help="Draw rings and lines into the photo of the ice."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Where the result is written.  [default: camera.json; of the ice: scene.json]",
        ),
    ] = None,
) -> None:
    """Measure a camera: its lens from pictures of a board, or all of it from the painted ice.

    Of a board: print it, fix it to something flat, and take ten or more pictures with the camera
    as it films (same size, same zoom, same focus): near the middle and in every corner of the
    picture, tilted to all sides. Count squares, not inner corners: a usual chessboard is 8x8.

    The camera file holds camera_matrix, distortion, image_size and the reprojection error in
    pixels (good: below 0.5). Give it to `curling track --camera`, or copy its keys into a scene.

    Of the ice: for a camera that sees one house and its hog line, such as those under a club's
    ceiling, give one photo of the empty ice and mark at least the tee and where the centre line
    crosses the hog line (away_tee and away_hog_centre, or home_...), to a third of a metre. The
    rings and the hog line are found from there, and with them where the camera hangs, how its lens
    bends, and how the picture was cut or stretched. The scene file serves `curling track` and
    `curling stones`. Look at the picture: the drawn lines must lie on the painted ones. Straight
    down, paint cannot tell a near camera from a far one with a longer lens; --height can.

    \b
    Example:
        curling calibrate board-*.png --squares 9x7 --square-size 0.03 -o camera.json
        curling calibrate board-*.png --board charuco --squares 8x6 --square-size 0.04
        curling track end.mp4 --scene end.scene.json --camera camera.json
        curling calibrate ice.png --mark away_tee=131,141 --mark away_hog_centre=131,509 \\
            --picture drawn.png -o scene.json
    """
    if mark or start:
        _of_the_ice(images, mark or [], start, height, picture, output or Path("scene.json"))
        return
    for option, given in (("--height", height), ("--picture", picture)):
        if given is not None:
            raise InputError("is for a photo of the ice; mark its tee and hog line", source=option)
    output = output or Path("camera.json")
    from friction_estimation.camera.chessboard import Board, calibrate_lens, save_lens

    size = re.fullmatch(r"(\d{1,3})[x×X](\d{1,3})", squares)
    if size is None:
        raise InputError(
            f"expected columns x rows such as 9x7, got {squares!r}", source="--squares"
        )
    found = calibrate_lens(
        images,
        Board(
            kind=board.value,
            columns=int(size[1]),
            rows=int(size[2]),
            square=square_size,
            marker=marker_size,
            dictionary=dictionary,
        ),
        progress=lambda paths, total: progress(paths, "calibrate", total=total, unit="picture"),
    )
    save_lens(found, output)
    lens = found.lens
    for name in found.unused:
        say(f"{name}: no board found")
    say(
        f"board found in {len(found.used)} of {len(images)} pictures; focal length "
        f"{lens.matrix[0, 0]:.1f} ± {found.focal_sigma_px:.1f} px, corners met to "
        f"{found.rms_px:.2f} px"
    )
    print_json(
        {
            "camera": str(output),
            "focal_px": [lens.matrix[0, 0], lens.matrix[1, 1]],
            "principal_point_px": [lens.matrix[0, 2], lens.matrix[1, 2]],
            "distortion": lens.distortion.tolist(),
            "reprojection_px": found.rms_px,
            "used": list(found.used),
            "unused": list(found.unused),
        }
    )


def _of_the_ice(
    images: list[Path],
    mark: list[str],
    start: Path | None,
    height: float | None,
    picture: Path | None,
    output: Path,
) -> None:
    import cv2

    from curling_env.sheet import PAPER_SHEET
    from curling_env.storage import atomic_path
    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.scene import load_scene, save_scene
    from friction_estimation.camera.single_photo import camera_from_photo, draw_markings

    cv2.setNumThreads(1)
    if len(images) != 1:
        raise InputError(f"one photo of the ice at a time, got {len(images)}")
    if height is not None and not 1.0 <= height <= 50.0:
        raise InputError(
            f"a camera hangs 1 to 50 m above the ice, got {height:g}", source="--height"
        )
    known = Annotation.open(images[0], PAPER_SHEET)
    if start is not None:
        known = Annotation.from_scene(images[0], load_scene(start))
    clicks = {**known.marks, **dict(_read_mark(text) for text in mark)}
    photo = known.stills[0]
    found = camera_from_photo(photo, clicks, sheet=known.sheet, height=height)
    save_scene(found.scene, output)
    if picture is not None:
        scale = max(1, round(1200 / max(known.size)))
        drawn = draw_markings(photo, found.camera, known.sheet, scale)
        with atomic_path(picture) as draft:
            draft.write_bytes(cv2.imencode(".png", drawn)[1].tobytes())
    x, y, z = found.camera.position.tolist()
    spread = found.refined.log_focal_sigma
    say(
        f"{found.refined.readings} places on rings and lines agree to "
        f"{found.refined.rms_px:.2f} px; the camera hangs {z:.1f} m above ({x:.1f}, {y:.1f}) m"
    )
    if spread > UNSURE and height is None:
        say(f"its height is uncertain by {100 * spread:.0f} %: measure it and give --height")
    print_json(
        {
            "scene": str(output),
            "picture": None if picture is None else str(picture),
            "misses_px": dict(found.misses_px),
            "position_m": [x, y, z],
            "height_uncertainty": spread,
            "focal_px": [found.camera.lens.matrix[0, 0], found.camera.lens.matrix[1, 1]],
            "principal_point_px": found.camera.lens.matrix[:2, 2].tolist(),
            "distortion": found.camera.lens.distortion.tolist(),
        }
    )


def _read_mark(text: str) -> tuple[str, tuple[float, float]]:
    found = re.fullmatch(r"\s*(\w+)\s*=\s*([-+.\d]+)\s*,\s*([-+.\d]+)\s*", text)
    try:
        if found is None:
            raise ValueError
        return found[1], (float(found[2]), float(found[3]))
    except ValueError:
        raise InputError(
            f"expected a place and its pixel such as away_tee=131,141, got {text!r}",
            source="--mark",
        ) from None
