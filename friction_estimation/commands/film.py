"""`curling film`: films of throws on known ice."""

from __future__ import annotations

from dataclasses import dataclass

from curling_env.commands.options import (
    IceOption,
    OutputDirectory,
    Results,
    SeedOption,
    grouped,
    numbers,
    option,
)
from curling_env.commands.simulate import ReleasesOption
from curling_env.commands.terminal import progress_bar
from curling_env.errors import InputError
from curling_env.infrastructure.files.limits import MAX_FRAME_PIXELS

MAX_FILMS = 1000
"""Maximum number of films of one command."""


@dataclass(frozen=True, kw_only=True)
class View:
    """Camera"""

    camera: str = option("end", "Camera, see above.", metavar="NAME")
    fps: float = option(30.0, "Frames per second.")
    size: str | None = option(None, "Image size in pixels.  [default: 1280 wide]", metavar="WxH")
    noise: float = option(2.0, "Sensor noise, standard deviation in grey levels of 255.")
    people: bool = option(True, "Draw a thrower, sweepers and walkers.")


@grouped
def film(
    ice: IceOption,
    releases: ReleasesOption,
    output: OutputDirectory,
    seed: SeedOption = 0,
    *,
    view: View,
    results: Results,
) -> None:
    """Render films of throws on known ice.

    \b
    Example, and throws.csv with a draw from the home hog line:
        curling film --ice standard --releases throws.csv --camera end -o films
        throw,x,y,vx,vy,theta,omega
        0,0,-10.9725,0,2.1,0,1.5

    \b
    Cameras:
        end, gantry, side   the whole sheet: behind the home end, above its middle, beside it
        ceiling             the away house and its hog line from the ceiling
        ceiling_middle      the ice between the hog lines
        ceiling_home        the home house
        phone, gallery      the sheet from behind the home hack, and from a gallery window

    \b
    Files in DIR:
        NAME-K.mp4, NAME-K.truth.csv   throw K, and the stone's true t,x,y,theta in every frame
        NAME.scene.json                the scene for `curling track`
        NAME.truth.json                friction, release and rest of every throw, the camera's pose
        NAME.ice.json                  the ice itself
    """
    from curling_env.ice import load_ice
    from curling_env.infrastructure.files.writing import make_directory
    from curling_env.throw import read_releases
    from friction_estimation.synthetic import FilmSpec
    from friction_estimation.synthetic.films import film_throws

    size = None if view.size is None else _size(view.size)
    spec = FilmSpec(**{**vars(view), "size": size}, seed=seed)
    known = load_ice(ice)
    played = read_releases(releases)
    if len(played) > MAX_FILMS:
        problem = f"has {len(played)} throws; expected at most {MAX_FILMS}"
        raise InputError(problem, source=releases)
    folder = make_directory(output)
    with progress_bar("frame") as progress:
        films = film_throws(folder, known, played, spec, ice_name=ice, progress=progress)
    parts = {"scene": "scene", "camera_truth": "truth", "ice": "ice"}
    results.show(
        {
            "films": [str(path) for path in films],
            "truth": [str(path.with_suffix(".truth.csv")) for path in films],
            **{part: str(folder / f"{spec.name}.{kind}.json") for part, kind in parts.items()},
        },
        f"{len(films)} film{'s' * (len(films) != 1)} with scene and true paths: {folder}",
    )


def _size(text: str) -> tuple[int, int]:
    millions = MAX_FRAME_PIXELS // 10**6
    form = f"WIDTHxHEIGHT such as 1280x720, at most {millions} million pixels"
    width, height = numbers(text, "--size", form, kind=int)
    if width < 1 or height < 1 or width * height > MAX_FRAME_PIXELS:
        raise InputError(f"expected {form}, got {text[:40]!r}", source="--size")
    return width, height
