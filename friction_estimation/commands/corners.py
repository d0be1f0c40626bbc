"""`curling corners`: mark the sheet in a film's picture, by hand, in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import OutputFile, print_json, say
from curling_env.errors import InputError

if TYPE_CHECKING:
    from curling_env.sheet import Sheet


def corners(
    film: Annotated[
        Path, typer.Argument(metavar="VIDEO|PICTURE", help="A film of the camera, or one picture.")
    ],
    output: OutputFile = Path("scene.json"),
    camera: Annotated[
        Path | None,
        typer.Option(metavar="CAMERA.json", help="The lens, from `curling calibrate`."),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(metavar="SCENE.json", help="A scene to go on from: its marks and its lens."),
    ] = None,
    sheet: Annotated[
        str, typer.Option(metavar="LxW", help="Length and width of the ice [m].")
    ] = "44.5x4.5",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0: any that is free.")] = 0,
    browser: Annotated[
        bool, typer.Option(help="Open the page; else its address is only printed.")
    ] = True,
) -> None:
    """Mark the corners of the sheet in a picture and write the scene that tracking needs.

    A page opens in your browser. Click each corner of the ice in turn, or, where the camera sees
    only a part of the sheet, choose places on the small sheet (tee, hog line, ring) and click
    those: four or more. The wheel zooms, dragging moves the picture, arrow keys move the chosen
    mark by a quarter of a pixel. The sheet's lines are drawn back into the picture and the ice is
    shown from above at once: they must lie on the paint. Some pixels do not matter; tracking lets
    the paint on the ice correct them.

    The page is served to this machine alone, and the command ends when you save.

    \b
    Example:
        curling corners end.mp4 -o end.scene.json
        curling corners ceiling.png --start ceiling.scene.json -o ceiling.scene.json
    """
    import webbrowser

    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.annotation.server import AnnotationServer
    from friction_estimation.camera.scene import Scene, load_lens, load_scene, save_scene

    before = None if start is None else load_scene(start, camera)
    if before is not None:
        picking = Annotation.from_scene(film, before)
    else:
        picking = Annotation.open(
            film, _sheet(sheet), None if camera is None else load_lens(camera)
        )

    def save(scene: Scene) -> None:
        save_scene(scene, output)

    with AnnotationServer(picking, save, port=port) as pages:
        say(f"mark the sheet at {pages.url}")
        if browser:
            webbrowser.open(pages.url)
        saved = pages.wait()
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
