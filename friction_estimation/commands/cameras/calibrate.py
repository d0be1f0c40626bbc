"""`curling calibrate`: the lens of a camera, from pictures of a board."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Option

from curling_env.commands.options import OutputFile, Results, grouped, numbers
from curling_env.commands.terminal import print_remark, progress_bar


@grouped
def calibrate(
    images: Annotated[list[Path], Argument(metavar="IMAGE...", help="Pictures of the board.")],
    squares: Annotated[str, Option(metavar="CxR", help="Squares, columns x rows.")] = "9x7",
    square_size: Annotated[float, Option(metavar="M", help="Side of a square [m].")] = 0.03,
    board: Annotated[Literal["chessboard", "charuco"], Option(help="Pattern.")] = "chessboard",
    marker_size: Annotated[
        float | None, Option(metavar="M", help="Side of a ChArUco marker [m].")
    ] = None,
    dictionary: Annotated[str, Option(help="OpenCV's name of the ChArUco dictionary.")] = "4X4_250",
    output: OutputFile = Path("camera.json"),
    *,
    results: Results,
) -> None:
    """Measure the lens of a camera from pictures of a chessboard or ChArUco board.

    \b
    Examples:
        curling calibrate board-*.png --squares 9x7 --square-size 0.03 -o camera.json
        curling calibrate board-*.png --board charuco --squares 8x6 --square-size 0.04
        curling track end.mp4 --scene end.scene.json --camera camera.json

    Print the board, fix it to something flat, and take ten or more pictures with the resolution,
    zoom and focus of your films: near the middle and in every corner of the picture, with the board
    tilted to all sides. Count squares, not inner corners: a chessboard is 8x8. A reprojection error
    below 0.5 px is good.
    """
    from friction_estimation.camera.chessboard import Board, calibrate_lens, save_lens

    form = "columns x rows such as 9x7"
    columns, rows = numbers(squares, "--squares", form, kind=int)
    described = Board(
        kind=board,
        columns=columns,
        rows=rows,
        square=square_size,
        marker=marker_size,
        dictionary=dictionary,
    )
    with progress_bar("picture") as progress:
        found = calibrate_lens(images, described, progress=progress)
    save_lens(found, output)
    lens = found.lens
    for name in found.unused:
        print_remark(f"{name}: no board found")
    results.show(
        {"camera": str(output), **found.summary()},
        f"board found in {len(found.used)} of {len(images)} pictures; focal length "
        f"{lens.focal_px:.1f} ± {found.focal_sigma_px:.1f} px, reprojection error "
        f"{found.rms_px:.2f} px",
    )
