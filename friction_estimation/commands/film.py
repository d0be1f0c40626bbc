"""`curling film`: films of throws on known ice."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from typer import Option

from curling_env.commands.options import (
    IceOption,
    OutputDirectory,
    Results,
    SeedOption,
    grouped,
    numbers,
)
from curling_env.commands.simulate import ReleasesOption
from curling_env.commands.terminal import progress_bar
from curling_env.errors import InputError
from curling_env.infrastructure.files.limits import MAX_FRAME_PIXELS

MAX_FILMS = 1000
"""Maximum number of films of one command."""


@grouped
def film(
    ice: IceOption,
    releases: ReleasesOption,
    output: OutputDirectory,
    camera: Annotated[str, Option(metavar="NAME", help="Camera, see above.")] = "end",
    fps: Annotated[float, Option(help="Frames per second.")] = 30.0,
    size: Annotated[
        str | None, Option(metavar="WxH", help="Image size in pixels.  [default: 1280 wide]")
    ] = None,
    noise: Annotated[float, Option(help="Sensor noise (σ), in grey levels of 255.")] = 2.0,
    people: Annotated[bool, Option(help="Draw a thrower, sweepers and walkers.")] = True,
    seed: SeedOption = 0,
    *,
    results: Results,
) -> None:
    """Render films of throws on known ice, as a camera beside the sheet would see them.

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

    \b
    Files in DIR:
        NAME-K.mp4, NAME-K.truth.csv   throw K, and the stone's true t,x,y,theta in every frame
        NAME.scene.json                the scene for `curling track`
        NAME.truth.json                friction, release and rest of every throw, the camera's pose
        NAME.ice.json                  the ice itself
    """
    from curling_env.ice import load_ice, save_ice
    from curling_env.infrastructure.files.storage import check_writable, make_directory, together
    from curling_env.physics.session import slides_in_turn
    from curling_env.throw import read_releases
    from friction_estimation.synthetic import FilmSpec, render_films

    pixels = None if size is None else _size(size)
    spec = FilmSpec(camera=camera, size=pixels, fps=fps, noise=noise, people=people, seed=seed)
    known = load_ice(ice)
    played = read_releases(releases)
    if len(played) > MAX_FILMS:
        problem = f"has {len(played)} throws; at most {MAX_FILMS} are filmed at a time"
        raise InputError(problem, source=releases)
    numbered = [replace(release, throw=k) for k, release in enumerate(played)]
    # Four samples a frame: the cubic between them is then exact to a micrometre.
    thrown = [run.trajectory for run in slides_in_turn(known, numbered, fps=4 * fps)]
    folder = make_directory(output)
    for throw in range(len(thrown)):
        check_writable(folder / f"{spec.name}-{throw}.mp4", kinds=("made film",))
    with together(), progress_bar("frame") as progress:
        films = render_films(
            folder,
            [trajectory for trajectory in thrown if trajectory is not None],
            spec,
            sheet=known.sheet,
            stone=known.stone,
            notes={"mu": float(known.friction.mu.mean()), "ice": str(ice)},
            progress=progress,
        )
        save_ice(known, folder / f"{spec.name}.ice.json")
    results.show(
        {
            "films": [str(path) for path in films],
            "truth": [str(path.with_suffix(".truth.csv")) for path in films],
            "scene": str(folder / f"{spec.name}.scene.json"),
            "camera_truth": str(folder / f"{spec.name}.truth.json"),
            "ice": str(folder / f"{spec.name}.ice.json"),
        },
        f"{len(films)} film{'s' * (len(films) != 1)} with scene and true paths: {folder}",
    )


def _size(text: str) -> tuple[int, int]:
    millions = MAX_FRAME_PIXELS // 10**6
    form = f"WIDTHxHEIGHT such as 1280x720, at most {millions} million pixels"
    width, height = numbers(text, "--size", form)
    whole = width.is_integer() and height.is_integer()
    if not whole or width < 1 or height < 1 or width * height > MAX_FRAME_PIXELS:
        raise InputError(f"expected {form}, got {text[:40]!r}", source="--size")
    return int(width), int(height)
