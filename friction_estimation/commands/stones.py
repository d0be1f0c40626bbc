"""`curling stones`: where the stones lie, from one picture of the ice."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from curling_env.commands.options import OutputFile, PictureOption, Results, grouped
from friction_estimation.appearance.colour_names import HandleColour


@grouped
def stones(
    picture: Annotated[Path, Argument(metavar="PICTURE", help="Stones on the ice.")],
    empty: Annotated[Path, Option(metavar="EMPTY", help="Picture of the empty ice.")],
    scene: Annotated[Path, Option(metavar="SCENE.json", help="From `curling locate EMPTY`.")],
    own: Annotated[HandleColour | None, Option(help="Handle colour of the own team.")] = None,
    output: OutputFile = Path("stones.json"),
    drawn: PictureOption = None,
    *,
    results: Results,
) -> None:
    """Find the stones that lie on the ice in a picture; players are ignored.

    \b
    Example:
        curling locate empty.png --mark away_tee=131,141 --mark away_hog_centre=131,509
        curling stones now.png --empty empty.png --scene scene.json --own red
        curling plan --ice ice.json --task score --stones stones.json

    The camera must not move between the two pictures. `curling plan --stones` reads the stones
    file: x and y in metres, standard error, pixel and colours of each stone, and with --own its
    team, which `curling plan --task score` needs. See docs/how-to/ceiling-camera.md.
    """
    import cv2

    from curling_env.infrastructure.files.storage import write_json
    from curling_env.infrastructure.files.writing import together
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
    image, bare = (Annotation.open(path, known.sheet).stills[0] for path in (picture, empty))
    camera = camera_from_scene(known, (image.shape[1], image.shape[0]))
    model = StoneModel(radius=known.stone_radius, height=known.stone_height)
    found = find_stones_in_image(image, bare, camera, model, known.sheet)
    places = [stone.as_dict(own) for stone in found]
    with together():
        write_json(output, places)
        if drawn is not None:
            write_picture(drawn, draw_stones(image, found, camera, model))
    seen = Counter(str(stone.handle) for stone in found)
    colours = ", ".join(f"{count} {name}" for name, count in sorted(seen.items()))
    words = f"{len(found)} stone{'s' * (len(found) != 1)} on the ice"
    words += f" ({colours}): {output}" if found else f": {output}"
    if own is not None and found and str(own) not in seen:
        words += f"; none has a {own} handle, so that all are the opponents'"
    results.show(places, words)
