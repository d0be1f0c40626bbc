"""`curling locate`: where a camera hangs, from one photo of the empty ice."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import (
    JsonOption,
    UnitsOption,
    Writes,
    conclude,
)
from curling_env.errors import InputError
from curling_env.units import Units, length
from friction_estimation.commands.track import UNSURE_HEIGHT, HeightOption


def locate(
    photo: Annotated[
        Path, typer.Argument(metavar="PHOTO", help="One photo, or a film, of the empty ice.")
    ],
    mark: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PLACE=U,V",
            help="A place on the ice and its pixel, roughly; may be given again and again.",
        ),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(metavar="SCENE.json", help="A scene whose points serve as marks."),
    ] = None,
    height: HeightOption = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="P.png", help="Draw the rings and lines found into the photo."),
        Writes(kinds=("picture",)),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="SCENE.json", help="The scene file to write."),
        Writes(kinds=("scene",), rewrites=("start",)),
    ] = Path("scene.json"),
    units: UnitsOption = Units.METRES,
    as_json: JsonOption = False,
) -> None:
    """Locate a camera that sees one house and its hog line, from one photo of the empty ice.

    This is for cameras such as those under a club's ceiling, which see no corner of the sheet.
    Mark at least the tee and the place where the centre line crosses the hog line (away_tee and
    away_hog_centre, or home_tee and home_hog_centre), to a third of a metre. From there the rings
    and the hog line are found, and with them where the camera hangs, how its lens bends, and how
    the picture was cut or stretched.

    The scene file serves `curling track` and `curling stones`. Look at the picture: the drawn
    lines must lie on the painted ones. Looking straight down, the paint cannot tell a near camera
    from a far one with a longer lens; measure the height and give --height.

    \b
    Example:
        curling locate ice.png --mark away_tee=131,141 --mark away_hog_centre=131,509 \\
            --picture drawn.png -o scene.json
        curling locate ice.png --start scene.json --height 6.1 -o scene.json
    """
    import cv2

    from curling_env.infrastructure.files.storage import together
    from curling_env.sheet import PAPER_SHEET
    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.scene import load_scene, save_scene
    from friction_estimation.camera.single_photo import camera_from_photo, draw_markings
    from friction_estimation.film.pictures import write_picture

    cv2.setNumThreads(1)
    if not mark and start is None:
        raise InputError(
            "mark the tee and the middle of the hog line, or give a scene with --start",
            source="--mark",
        )
    known = Annotation.open(photo, PAPER_SHEET)
    if start is not None:
        known = Annotation.from_scene(photo, load_scene(start))
    clicks = {**known.clicks, **dict(_read_mark(text) for text in mark or [])}
    empty = known.stills[0]
    found = camera_from_photo(empty, clicks, sheet=known.sheet, height=height)
    with together():
        save_scene(found.scene, output)
        if picture is not None:
            scale = max(1, round(1200 / max(known.size)))
            write_picture(picture, draw_markings(empty, found.camera, known.sheet, scale))
    lens = found.camera.lens
    x, y, z = found.camera.position.tolist()
    spread = found.refined.log_focal_sigma
    words = [
        f"{found.refined.measured} places on rings and lines agree to "
        f"{found.refined.rms_px:.2f} px; the camera hangs {length(z, units)} above "
        f"({x:.1f}, {y:.1f}) m"
    ]
    if spread > UNSURE_HEIGHT and height is None:
        words.append(
            f"its height is uncertain by {100 * spread:.0f} %: measure it and give --height"
        )
    conclude(
        {
            "scene": str(output),
            "picture": None if picture is None else str(picture),
            "misses_px": dict(found.misses_px),
            "position_m": [x, y, z],
            "height_uncertainty": spread,
            "focal_px": [lens.matrix[0, 0], lens.matrix[1, 1]],
            "principal_point_px": lens.matrix[:2, 2].tolist(),
            "distortion": lens.distortion.tolist(),
        },
        *words,
        as_json=as_json,
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
