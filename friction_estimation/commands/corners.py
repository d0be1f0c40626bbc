"""`curling corners`: mark the sheet in a picture by hand, in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import Writes, print_json, say
from curling_env.errors import InputError

if TYPE_CHECKING:
    from curling_env.sheet import Sheet


def corners(
    film: Annotated[
        Path, typer.Argument(metavar="VIDEO|PICTURE", help="A film of the camera, or one picture.")
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="SCENE.json", help="The scene file to write."),
        Writes(kinds=("scene",), rewrites=("start",)),
    ] = Path("scene.json"),
    camera: Annotated[
        Path | None,
        typer.Option(metavar="CAMERA.json", help="The lens, from `curling calibrate`."),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(metavar="SCENE.json", help="A scene to continue from."),
    ] = None,
    sheet: Annotated[
        str, typer.Option(metavar="LxW", help="Length and width of the ice [m].")
    ] = "44.5x4.5",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes any free port.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page, or only print its address.")] = True,
) -> None:
    """Mark the corners of the sheet in a picture, and write the scene file that tracking needs.

    A page opens in your browser. Click each corner of the ice in turn. Where the camera sees only
    part of the sheet, choose four or more other keypoints on the small sheet (tee, hog line, ring)
    and click those. The wheel zooms, dragging moves the picture, and the arrow keys move the
    selected click by a quarter of a pixel. The lines of the sheet are drawn back into the picture
    at once and must lie on the paint. A few pixels do not matter: tracking corrects the clicks by
    the painted lines.

    Only this machine can open the page, and the command ends when you save.

    \b
    Example:
        curling corners end.mp4 -o end.scene.json
        curling corners ceiling.png --start ceiling.scene.json -o ceiling.scene.json
    """
    import webbrowser

    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.annotation.server import AnnotationServer
    from friction_estimation.camera.scene import load_lens, load_scene, save_scene

    before = None if start is None else load_scene(start, camera)
    if before is not None:
        annotation = Annotation.from_scene(film, before)
    else:
        annotation = Annotation.open(
            film, _sheet(sheet), None if camera is None else load_lens(camera)
        )

    with AnnotationServer(annotation, lambda scene: save_scene(scene, output), port=port) as server:
        say(f"mark the sheet at {server.url}")
        if browser:
            webbrowser.open(server.url)
        saved = server.wait()
    assert saved is not None
    print_json({"scene": str(output), "points": len(saved.points_px), "corners": saved.has_corners})


def _sheet(text: str) -> Sheet:
    from curling_env.sheet import Sheet

    length, _, width = text.replace("×", "x").partition("x")
    try:
        return Sheet(length=float(length), width=float(width))
    except ValueError:
        raise InputError(
            f"expected length x width such as 44.5x4.5, got {text!r}", source="--sheet"
        ) from None
