"""`curling locate`: the pose of a camera, from one photo of the empty ice."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from curling_env.commands.options import Measured, PictureOption, grouped, numbers
from curling_env.errors import InputError
from curling_env.units import length
from friction_estimation.commands.cameras.corners import SceneFile, StartOption
from friction_estimation.commands.film_options import HeightOption


@grouped
def locate(
    photo: Annotated[Path, Argument(metavar="PHOTO", help="Photo or film of the empty ice.")],
    mark: Annotated[
        list[str] | None, Option(metavar="PLACE=U,V", help="Pixel of a point; may be repeated.")
    ] = None,
    start: StartOption = None,
    height: HeightOption = None,
    picture: PictureOption = None,
    output: SceneFile = Path("scene.json"),
    *,
    results: Measured,
) -> None:
    """Locate a camera over one house from one photo of the empty ice.

    \b
    Examples:
        curling locate ice.png --mark away_tee=131,141 --mark away_hog_centre=131,509 \\
            --picture drawn.png -o scene.json
        curling locate ice.png --start scene.json --height 6.1 -o scene.json

    This is for cameras that see no corner of the sheet, such as those under a club's ceiling. Mark
    at least the tee and the crossing of the centre line and the hog line, to a third of a metre.
    Look at the picture: the drawn lines must lie on the painted ones. From straight above, measure
    the height of the camera and give --height. See docs/how-to/ceiling-camera.md.
    """
    import cv2

    from curling_env.infrastructure.files.writing import together
    from curling_env.sheet import PAPER_SHEET
    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.expected import expected_errors, expected_in_words
    from friction_estimation.camera.locate import camera_from_photo, draw_markings
    from friction_estimation.camera.scene import load_scene, save_scene
    from friction_estimation.camera.tuning import STONE_HEIGHT_SIGMA
    from friction_estimation.film.pictures import write_picture

    cv2.setNumThreads(1)
    if not mark and start is None:
        problem = (
            "no marks: give --mark for the tee and the middle of the hog line, or --start SCENE"
        )
        raise InputError(problem, source="--mark")
    known = (
        Annotation.open(photo, PAPER_SHEET)
        if start is None
        else Annotation.from_scene(photo, load_scene(start))
    )
    clicks = {**known.clicks, **dict(_read_mark(text) for text in mark or [])}
    empty = known.stills[0]
    found = camera_from_photo(empty, clicks, sheet=known.sheet, height=height)
    with together():
        save_scene(found.scene, output)
        if picture is not None:
            scale = max(1, round(1200 / max(known.size)))
            write_picture(picture, draw_markings(empty, found.camera, known.sheet, scale))
    x, y, z = found.camera.position.tolist()
    spread = found.refined.log_focal_sigma
    at = f"the camera is {length(z, results.units)} above ({x:.1f}, {y:.1f}) m"
    words = [
        f"{found.refined.measured} points on rings and lines agree to "
        f"{found.refined.rms_px:.2f} px; {at}"
    ]
    if found.refined.missed:
        misses = found.refined.misses_px
        missed = ", ".join(f"{name} {misses[name]:.1f} px" for name in found.refined.missed)
        words = [f"some of the paint deviates by more than 2 px: {missed}; {at}"]
    if spread > STONE_HEIGHT_SIGMA and height is None:
        uncertainty = f"its height is uncertain by {100 * spread:.0f} %"
        words.append(f"{uncertainty}: measure it and give --height")
    expected = expected_errors([found.refined], found.scene.stone_radius, found.scene.stone_height)
    words.append(f"expected error of tracks: {expected_in_words(expected, results.units)}")
    shown = None if picture is None else str(picture)
    errors = {"expected": [error.document() for error in expected]}
    results.show({"scene": str(output), "picture": shown, **found.summary(), **errors}, *words)


def _read_mark(text: str) -> tuple[str, tuple[float, float]]:
    place, _, pixel = text.partition("=")
    u, v = numbers(pixel, "--mark", "a point and its pixel such as away_tee=131,141")
    return place.strip(), (u, v)
