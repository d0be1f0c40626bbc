"""`curling corners`: mark the sheet in a picture by hand, in the browser."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from curling_env.commands.cli import JsonOption, UnitsOption, Writes, conclude, say
from curling_env.errors import InputError
from curling_env.units import Units
from friction_estimation.commands.track import HeightOption

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
    height: HeightOption = None,
    sheet: Annotated[
        str, typer.Option(metavar="LxW", help="Length and width of the ice [m].")
    ] = "44.5x4.5",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 takes any free port.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page, or only print its address.")] = True,
    share: Annotated[
        bool,
        typer.Option(
            "--share",
            help="Let other machines in the network open the page: mark on a tablet or phone.",
        ),
    ] = False,
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Mark the corners of the sheet in a picture, and write the scene file that tracking needs.

    A page opens in your browser. Click each corner of the ice in turn; home is the end at which the
    thrower stands, and left is the thrower's left. Where boards or the picture's edge hide one,
    press Hidden, and another place of that end is proposed (hog line, ring, tee); or choose any on
    the small sheet. The wheel or two fingers zoom, dragging moves the picture, and the arrow keys
    move the selected mark by a quarter of a pixel; Ctrl Z takes a step back. The lines of the sheet
    and a thrower are drawn back into the picture at once: the lines must lie on the paint, and the
    thrower at the thrower's end (Swap ends turns them round). A few pixels do not matter: tracking
    corrects the marks by the painted lines. From straight above the points do not tell how high the
    camera hangs; the page then gives the range. Measure it (a laser or a tape from the ice to the
    lens) and give --height, unless the lens is known.

    Only this machine can open the page, unless you --share it: then whoever has its address, which
    is also shown as a QR code, may mark and save. The command ends when you save.

    \b
    Example:
        curling corners end.mp4 -o end.scene.json
        curling corners end.mp4 -o end.scene.json --share
        curling corners ceiling.png --start ceiling.scene.json -o ceiling.scene.json
    """
    import webbrowser

    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.annotation.server import AnnotationServer
    from friction_estimation.camera.scene import load_lens, load_scene, save_scene

    before = None if start is None else load_scene(start, camera, height)
    if before is not None:
        annotation = Annotation.from_scene(film, before)
    else:
        known = {} if camera is None else load_lens(camera)
        annotation = Annotation.open(film, _sheet(sheet), {**known, "camera_height": height})

    server = AnnotationServer(
        annotation, lambda scene: save_scene(scene, output), port=port, share=share, units=units
    )
    with server:
        say(f"mark the sheet at {server.url}", now=True)
        if share and sys.stderr.isatty():
            from curling_env.infrastructure.qr_code import qr_code

            say(qr_code(server.url))
        if browser and not share:
            webbrowser.open(server.url)
        saved = server.wait()
    assert saved is not None
    count = len(saved.points_px)
    conclude(
        {"scene": str(output), "points": count, "corners": saved.has_corners},
        f"{count} places marked: {output}; `curling track FILM --scene {output}` is next",
        as_json=as_json,
    )


def _sheet(text: str) -> Sheet:
    from curling_env.sheet import Sheet

    length, _, width = text.replace("×", "x").partition("x")
    try:
        return Sheet(length=float(length), width=float(width))
    except ValueError:
        raise InputError(
            f"expected length x width such as 44.5x4.5, got {text!r}", source="--sheet"
        ) from None
