"""`curling corners`: marks of the sheet in a picture, set by hand in the browser."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from curling_env.commands.options import Measured, grouped, numbers, option, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import print_remark
from friction_estimation.camera.scene import PAINT_DEPTHS
from friction_estimation.commands.film_options import HeightOption, LensOption

SceneFile = Annotated[
    Path,
    output_to("SCENE.json", "The scene file to write."),
    Writes(kinds=("scene",), rewrites=("start",)),
]
StartOption = Annotated[
    Path | None, Option(metavar="SCENE.json", help="Scene with marks to start from.")
]
PaintDepthOption = Annotated[
    float | None,
    Option(
        metavar="M",
        min=PAINT_DEPTHS[0],
        max=PAINT_DEPTHS[1],
        help="Thickness of the clear ice above the paint [m].",
    ),
]


@dataclass(frozen=True, kw_only=True)
class Page:
    """Page"""

    sheet: str = option("44.5x4.5", "Length and width of the ice [m].", metavar="LxW")
    port: int = option(0, "Port of the page; 0 takes any free one.", min=0, max=65535)
    browser: bool = option(True, "Open the page in the browser.")
    share: bool = option(False, "Open the page to tablets and phones in the network.", "--share")


@grouped
def corners(
    film: Annotated[Path, Argument(metavar="VIDEO|PICTURE", help="Film or picture.")],
    output: SceneFile = Path("scene.json"),
    camera: LensOption = None,
    start: StartOption = None,
    height: HeightOption = None,
    paint_depth: PaintDepthOption = None,
    *,
    page: Page,
    results: Measured,
) -> None:
    """Mark the corners of the sheet in a picture, and write the scene file.

    \b
    Examples:
        curling corners end.mp4 -o end.scene.json
        curling corners end.mp4 -o end.scene.json --share
        curling corners ceiling.png --start ceiling.scene.json -o ceiling.scene.json

    A page opens in your browser. Click each corner of the ice in turn; home is the thrower's end,
    and left is the thrower's left. The lines drawn into the picture must lie on the paint; a few
    pixels do not matter. With --share anyone with the address, also shown as a QR code, can mark
    and save. The command ends when you save. See docs/tracking.md.
    """
    import webbrowser

    from curling_env.infrastructure.qr_code import qr_code
    from curling_env.sheet import Sheet
    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.annotation.server import AnnotationServer
    from friction_estimation.camera.expected import expected_in_words, expected_of_scene
    from friction_estimation.camera.pose import camera_from_scene
    from friction_estimation.camera.scene import load_lens, load_scene, save_scene

    if start is not None:
        scene = load_scene(start, camera, height)
        if paint_depth is not None:
            scene = replace(scene, paint_depth=paint_depth)
        annotation = Annotation.from_scene(film, scene)
    else:
        known = {} if camera is None else load_lens(camera)
        length, width = numbers(page.sheet, "--sheet", "length x width such as 44.5x4.5")
        size = Sheet(length=length, width=width)
        known |= {"camera_height": height, "paint_depth": paint_depth}
        annotation = Annotation.open(film, size, known)

    server = AnnotationServer(
        annotation,
        lambda scene: save_scene(scene, output),
        port=page.port,
        share=page.share,
        units=results.units,
    )
    with server:
        print_remark(f"mark the sheet at {server.url}", now=True)
        if page.share and sys.stderr.isatty():
            print_remark(qr_code(server.url))
        if page.browser and not page.share:
            webbrowser.open(server.url)
        saved = server.wait()
    assert saved is not None
    count = len(saved.points_px)
    expected = expected_of_scene(saved, camera_from_scene(saved, annotation.size))
    results.show(
        {
            "scene": str(output),
            "points": count,
            "corners": saved.has_corners,
            "expected": [error.document() for error in expected],
        },
        f"{count} points marked: {output}; next: `curling track FILM --scene {output}`",
        f"expected error of tracks: {expected_in_words(expected, results.units)}",
    )
