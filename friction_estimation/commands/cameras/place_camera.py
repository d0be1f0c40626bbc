"""`curling place-camera`: the error of tracks to expect from a camera, before it films."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot
from typing import TYPE_CHECKING, Annotated

from typer import Argument

from curling_env.commands.options import Measured, PictureOption, grouped, numbers, option
from curling_env.errors import InputError
from curling_env.sheet import PAPER_SHEET

if TYPE_CHECKING:
    from collections.abc import Sequence

    from curling_env.typing import Image
    from curling_env.units import Units
    from friction_estimation.camera.camera import Camera
    from friction_estimation.camera.expected import ExpectedError

FILM_DIAGONAL = 43.27
"""Diagonal of the 35 mm film to which makers of cameras refer focal lengths [mm]."""


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Other position or lens"""

    position: str | None = option(None, "Position of the lens [m].", metavar="X,Y,Z")
    target: str | None = option(
        None, "Point on the ice at the picture's centre [m].", metavar="X,Y"
    )
    focal: float | None = option(
        None, "Focal length on the 35 mm scale [mm].", metavar="MM", min=5, max=500
    )
    size: str = option("1920x1080", "Picture size [px].", metavar="WxH")


@dataclass(frozen=True, kw_only=True)
class Knowledge:
    """Known conditions"""

    lens_known: bool = option(False, "Lens measured by `curling calibrate`.", "--lens-known")
    height_known: bool = option(False, "Height measured with a laser or tape.", "--height-known")
    paint: float = option(2.0, "Error of the painted lines [mm].", min=0, max=50)


@grouped
def place_camera(
    cameras: Annotated[list[str], Argument(metavar="CAMERA...", help="Camera, see above.")],
    picture: PictureOption = None,
    *,
    placement: Placement,
    known: Knowledge,
    results: Measured,
) -> None:
    """Predict the error of tracks from a planned camera.

    \b
    Examples:
        curling place-camera phone --picture view.png
        curling place-camera ceiling ceiling_home --lens-known
        curling place-camera gallery --position 1.5,-31,6 --focal 50 --size 3840x2160

    \b
    Cameras:
        phone          on a tripod, 1.7 m high and 1.7 m behind the home hack
        gallery        in a gallery window, 4.5 m high and 8.8 m behind the ice
        ceiling        6 m above the away house; ceiling_home: above the home house
        end, gantry, side, ceiling_middle: see `curling film`

    Positions are in metres from the middle of the sheet: x to the right, y towards the away end, z
    up; the home hack is at 0,-21. With several joined cameras, each place has the error of the best
    one. See docs/how-to/camera-place.md.
    """
    from friction_estimation.camera.expected import (
        expected_camera,
        expected_errors,
        expected_in_words,
    )

    moved = any((placement.position, placement.target, placement.focal))
    if moved and len(cameras) > 1:
        raise InputError("only one camera can be moved at a time", source="CAMERA")
    seen = [_placed(name, placement) for name in cameras]
    errors = expected_errors(
        [
            expected_camera(
                camera,
                PAPER_SHEET,
                lens_known=known.lens_known,
                height_known=known.height_known,
                paint=known.paint / 1000,
            )
            for camera in seen
        ]
    )
    if picture is not None:
        from friction_estimation.film.pictures import write_picture

        write_picture(picture, _drawn(seen, errors, results.units))
    shown = None if picture is None else str(picture)
    words = expected_in_words(errors, results.units)
    results.show(
        {"picture": shown, "expected": [error.document() for error in errors]},
        f"expected error of tracks: {words}" if words else "no place of the sheet is seen",
    )


def _placed(name: str, placement: Placement) -> Camera:
    """Return the camera of a name, moved by the options."""
    from friction_estimation.camera.camera import Camera
    from friction_estimation.synthetic.cameras import CAMERAS, named_camera

    width, height = numbers(placement.size, "--size", "width x height such as 1920x1080", kind=int)
    if not (64 <= width <= 20_000 and 48 <= height <= 20_000):
        raise InputError(f"expected 64x48 to 20000x20000, got {width}x{height}", source="--size")
    camera = named_camera(name, (width, height))
    place, target = CAMERAS[name].position, CAMERAS[name].target
    if placement.position is not None:
        place = numbers(placement.position, "--position", "three coordinates X,Y,Z", counts=(3,))
    if placement.target is not None:
        target = [*numbers(placement.target, "--target", "two coordinates X,Y"), 0.0]
    if not 0.3 <= place[2] <= 50 or max(map(abs, [*place, *target])) > 1000:
        raise InputError("expected a camera 0.3 to 50 m above the ice, near the sheet")
    focal = camera.lens.focal_px
    if placement.focal is not None:
        focal = placement.focal / FILM_DIAGONAL * hypot(width, height)
    placed = Camera.looking_at(
        position=place,
        target=target,
        up=CAMERAS[name].up,
        focal_px=focal,
        size=(width, height),
        distortion=camera.lens.distortion,
    )
    return placed if placement.focal is None else replace(placed, lens=placed.lens.bent(0.0))


def _drawn(cameras: Sequence[Camera], errors: Sequence[ExpectedError], units: Units) -> Image:
    """Draw views of the cameras, one below the other: a stone at each place, and its expected
    error.
    """
    import cv2
    import numpy as np

    from friction_estimation.camera.expected import PLACES, expected_in_words
    from friction_estimation.synthetic import FilmRenderer, FilmSpec, StoneOnIce

    stones = [StoneOnIce(x=0.0, y=PLACES[one.place]) for one in errors if one.along is not None]
    views: list[Image] = []
    for camera in cameras:
        view = FilmRenderer(FilmSpec(camera=camera, people=False), resting=stones).still
        size = camera.size[0] / 1920
        for number, error in enumerate(errors, 1):
            words = expected_in_words([error], units)
            at = np.array([[0.3, PLACES[error.place], 0.0]])
            if not words or not camera.sees(at).all():
                continue
            u, v = np.round(camera.project(at)[0]).astype(int).tolist()
            below = (round(30 * size), round(45 * size * number))
            for text, where, colour in (
                (f"{number}: {words}", below, (255, 255, 255)),
                (str(number), (u, v), (0, 0, 0)),
            ):
                font, width = cv2.FONT_HERSHEY_SIMPLEX, max(1, round(2 * size))
                cv2.putText(view, text, where, font, size, colour, width, cv2.LINE_AA)
        views.append(view)
    return np.concatenate(views)
