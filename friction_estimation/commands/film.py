"""`curling film`: films of throws on known ice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import (
    IceOption,
    JsonOption,
    OutputDirectory,
    SeedOption,
    conclude,
    progress_bar,
)
from curling_env.errors import InputError
from curling_env.infrastructure.files.limits import MAX_FRAME_PIXELS

MAX_FILMS = 1000
"""Films of one command."""


def film(
    ice: IceOption,
    releases: Annotated[
        Path, typer.Option(help="The throws to film, one row each.", metavar="R.csv")
    ],
    output: OutputDirectory,
    camera: Annotated[
        str, typer.Option(metavar="NAME", help="Place to film from; see the list below.")
    ] = "end",
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 30.0,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Image size in pixels.  [default: 1280 wide]"),
    ] = None,
    noise: Annotated[
        float, typer.Option(help="Sensor noise, standard deviation in grey levels of 255.")
    ] = 2.0,
    people: Annotated[
        bool, typer.Option(help="A thrower, sweepers and walkers in the picture, or nobody.")
    ] = True,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Render films of throws on known ice, as a camera before the sheet would see them.

    Every row of the releases file becomes one film. Beside the films are the scene file that
    `curling track` needs and the truth to compare its tracks with.

    \b
    end       the whole sheet from a gallery behind the home end
    gantry    the whole sheet from above its middle
    side      the whole sheet from the stand beside its middle
    ceiling   the away house and its hog line from the ceiling
    ceiling_middle, ceiling_home   the ice between the hog lines, and the home house

    \b
    Example:
        curling film --ice standard --releases throws.csv --camera end -o films
        curling track films/end-0.mp4 --scene films/end.scene.json -o tracks.csv

    \b
    A releases file has the columns throw,x,y,vx,vy,theta,omega; a draw from the home hog line:
        throw,x,y,vx,vy,theta,omega
        0,0,-10.9725,0,2.1,0,1.5

    \b
    Written into DIR:
        NAME-K.mp4          throw K
        NAME-K.truth.csv    t,x,y,theta of the stone in every frame of it
        NAME.scene.json     the corners (or points) as one would mark them, lens and stone
        NAME.truth.json     friction, release and rest of every throw, the camera's place
        NAME.ice.json       the ice itself
    """
    from curling_env.ice import load_ice, save_ice
    from curling_env.infrastructure.files.storage import check_writable, make_directory, together
    from curling_env.physics.session import slides_in_turn
    from curling_env.throw import read_releases
    from friction_estimation.synthetic import FilmSpec, render_films

    spec = FilmSpec(camera=camera, size=_size(size), fps=fps, noise=noise, people=people, seed=seed)
    known = load_ice(ice)
    played = read_releases(releases)
    if len(played) > MAX_FILMS:
        raise InputError(
            f"has {len(played)} throws; at most {MAX_FILMS} are filmed at a time", source=releases
        )
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
    conclude(
        {
            "films": [str(path) for path in films],
            "truth": [str(path.with_suffix(".truth.csv")) for path in films],
            "scene": str(folder / f"{spec.name}.scene.json"),
            "camera_truth": str(folder / f"{spec.name}.truth.json"),
            "ice": str(folder / f"{spec.name}.ice.json"),
        },
        f"{len(films)} film{'s' * (len(films) != 1)} with scene and true paths: {folder}",
        as_json=as_json,
    )


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    width, _, height = text.lower().replace("×", "x").partition("x")
    if not (width.strip().isdecimal() and height.strip().isdecimal()):
        raise InputError(f"a size is WIDTHxHEIGHT in pixels, such as 1280x720; got {text!r}")
    if not 1 <= int(width[:9]) * int(height[:9]) <= MAX_FRAME_PIXELS:
        raise InputError(
            f"a film has at most {MAX_FRAME_PIXELS // 10**6} million pixels a frame, got "
            f"{text[:30]!r}"
        )
    return int(width), int(height)
