"""`curling stones`: where the stones lie, from one picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from curling_env.commands.cli import OutputFile, print_json, say


def stones(
    picture: Annotated[Path, typer.Argument(metavar="PICTURE", help="Stones on the ice.")],
    empty: Annotated[
        Path, typer.Option(metavar="EMPTY", help="The same camera's picture of the empty ice.")
    ],
    scene: Annotated[
        Path,
        typer.Option(metavar="SCENE.json", help="The camera, from `curling calibrate EMPTY`."),
    ],
    output: OutputFile = Path("stones.json"),
    drawn: Annotated[
        Path | None,
        typer.Option("--picture", metavar="P.png", help="Draw what was found into the picture."),
    ] = None,
) -> None:
    """Find the stones that lie on the ice in a picture, and no player.

    Both pictures must come from a camera that did not move in between. The stones file is what
    `curling plan --stones` reads: a list of x and y in metres, with the standard error sigma, the
    pixel, and the colour (red, green, blue) of what stands out of the ice, by which the teams can
    be told.

    \b
    Example:
        curling calibrate empty.png --mark away_tee=131,141 --mark away_hog_centre=131,509
        curling stones now.png --empty empty.png --scene scene.json
        curling plan --ice ice.json --target 0,17.37 --stones stones.json
    """
    import cv2

    from curling_env.storage import atomic_path, write_json
    from friction_estimation.appearance import StoneModel
    from friction_estimation.camera.annotation.annotate import Annotation
    from friction_estimation.camera.pose import camera_from_scene
    from friction_estimation.camera.scene import load_scene
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
        }
        for stone in found
    ]
    write_json(output, places)
    if drawn is not None:
        with atomic_path(drawn) as draft:
            sketch = draw_stones(images[0], found, camera, model)
            draft.write_bytes(cv2.imencode(".png", sketch)[1].tobytes())
    say(f"{len(found)} stone{'s' * (len(found) != 1)} on the ice")
    print_json(places)
