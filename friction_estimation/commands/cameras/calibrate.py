"""`curling calibrate`: the lens of a camera, from pictures of a board."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import JsonOption, OutputFile, conclude, progress_bar, say
from curling_env.errors import InputError


class BoardChoice(StrEnum):
    """Boards that calibrate a camera."""

    chessboard = "chessboard"
    charuco = "charuco"


def calibrate(
    images: Annotated[
        list[Path],
        typer.Argument(
            metavar="IMAGE...", help="Pictures of the board, taken as the camera films."
        ),
    ],
    squares: Annotated[
        str, typer.Option(metavar="CxR", help="Number of squares, columns x rows.")
    ] = "9x7",
    square_size: Annotated[float, typer.Option(metavar="M", help="Side of a square [m].")] = 0.03,
    board: Annotated[BoardChoice, typer.Option(help="What is printed on the board.")] = (
        BoardChoice.chessboard
    ),
    marker_size: Annotated[
        float | None,
        typer.Option(
            metavar="M", help="Side of a ChArUco marker [m]; 0.75 of a square if not given."
        ),
    ] = None,
    dictionary: Annotated[
        str, typer.Option(help="Dictionary of the ChArUco markers, by its name in OpenCV.")
    ] = "4X4_250",
    output: OutputFile = Path("camera.json"),
    as_json: JsonOption = False,
) -> None:
    """Measure the lens of a camera from pictures of a chessboard or ChArUco board.

    Print the board, fix it to something flat, and take ten or more pictures with the same size,
    zoom and focus as the camera films: near the middle and in every corner of the picture, with
    the board tilted to all sides. Count squares, not inner corners: a usual chessboard is 8x8.

    The camera file holds camera_matrix, distortion, image_size and the reprojection error in
    pixels (good: below 0.5). Give it to `curling track --camera`, or copy its keys into a scene.
    Without a board at hand, tracking measures the lens on the painted lines.

    \b
    Example:
        curling calibrate board-*.png --squares 9x7 --square-size 0.03 -o camera.json
        curling calibrate board-*.png --board charuco --squares 8x6 --square-size 0.04
        curling track end.mp4 --scene end.scene.json --camera camera.json
    """
    from friction_estimation.camera.chessboard import Board, calibrate_lens, save_lens

    size = re.fullmatch(r"(\d{1,3})[x×X](\d{1,3})", squares)
    if size is None:
        raise InputError(
            f"expected columns x rows such as 9x7, got {squares!r}", source="--squares"
        )
    described = Board(
        kind=board.value,
        columns=int(size[1]),
        rows=int(size[2]),
        square=square_size,
        marker=marker_size,
        dictionary=dictionary,
    )
    with progress_bar("picture") as progress:
        found = calibrate_lens(images, described, progress=progress)
    save_lens(found, output)
    lens = found.lens
    for name in found.unused:
        say(f"{name}: no board found")
    words = (
        f"board found in {len(found.used)} of {len(images)} pictures; focal length "
        f"{lens.focal_px:.1f} ± {found.focal_sigma_px:.1f} px, corners met to "
        f"{found.rms_px:.2f} px"
    )
    conclude(
        {
            "camera": str(output),
            "focal_px": [lens.matrix[0, 0], lens.matrix[1, 1]],
            "principal_point_px": [lens.matrix[0, 2], lens.matrix[1, 2]],
            "distortion": lens.distortion.tolist(),
            "reprojection_px": found.rms_px,
            "used": list(found.used),
            "unused": list(found.unused),
        },
        words,
        as_json=as_json,
    )
