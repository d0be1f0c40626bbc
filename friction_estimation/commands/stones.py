"""`curling stones`: where the stones lie, from one picture of the ice."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import (
    JsonOption,
    OutputFile,
    Writes,
    conclude,
)
from friction_estimation.appearance.colour_names import HandleColour


def stones(
    picture: Annotated[Path, typer.Argument(metavar="PICTURE", help="Stones on the ice.")],
    empty: Annotated[
        Path, typer.Option(metavar="EMPTY", help="The same camera's picture of the empty ice.")
    ],
    scene: Annotated[
        Path,
        typer.Option(metavar="SCENE.json", help="The camera, from `curling locate EMPTY`."),
    ],
    output: OutputFile = Path("stones.json"),
    drawn: Annotated[
        Path | None,
        typer.Option("--picture", metavar="P.png", help="Draw what was found into the picture."),
        Writes(kinds=("picture",)),
    ] = None,
    own: Annotated[
        HandleColour | None,
        typer.Option(help="Colour of the own team's handles; all other stones are the opponents'."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the stones that lie on the ice in a picture; players are left out.

    Both pictures must come from a camera that did not move in between. `curling plan --stones`
    reads the stones file: a list of x and y in metres, each with its standard error sigma, its
    pixel, its colour (red, green, blue), and the colour of its handle by name. With --own each also
    gets its team, own or other, which `curling plan --task score` needs.

    \b
    Example:
        curling locate empty.png --mark away_tee=131,141 --mark away_hog_centre=131,509
        curling stones now.png --empty empty.png --scene scene.json
        curling plan --ice ice.json --target 0,17.37 --stones stones.json
        curling stones now.png --empty empty.png --scene scene.json --own red
        curling plan --ice ice.json --task score --stones stones.json
    """
    import cv2

    from curling_env.infrastructure.files.storage import together, write_json
    from friction_estimation.appearance import StoneModel
    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.pose import camera_from_scene
    from friction_estimation.camera.scene import load_scene
    from friction_estimation.film.pictures import write_picture
    from friction_estimation.tracking.detection.single_image import (
        draw_stones,
        find_stones_in_image,
    )

    cv2.setNumThreads(1)
    known = load_scene(scene)
    images = [Annotation.open(path, known.sheet).stills[0] for path in (picture, empty)]
    camera = camera_from_scene(known, (images[0].shape[1], images[0].shape[0]))
    model = StoneModel(radius=known.stone_radius, height=known.stone_height)
    found = find_stones_in_image(images[0], images[1], camera, model, known.sheet)
    places = [
        {
            "x": round(float(stone.xy[0]), 4),
            "y": round(float(stone.xy[1]), 4),
            "sigma": round(stone.sigma, 4),
            "px": [float(value) for value in stone.px],
            "colour": [int(value) for value in stone.colour[::-1]],
            "handle": str(stone.handle),
            **({} if own is None else {"team": "own" if stone.handle is own else "other"}),
        }
        for stone in found
    ]
    with together():
        write_json(output, places)
        if drawn is not None:
            write_picture(drawn, draw_stones(images[0], found, camera, model))
    seen = Counter(str(stone.handle) for stone in found)
    colours = ", ".join(f"{count} {name}" for name, count in sorted(seen.items()))
    words = f"{len(found)} stone{'s' * (len(found) != 1)} on the ice"
    words += f" ({colours}): {output}" if found else f": {output}"
    if own is not None and found and str(own) not in seen:
        words += f"; none has a {own} handle, so that all are the opponents'"
    conclude(places, words, as_json=as_json)
