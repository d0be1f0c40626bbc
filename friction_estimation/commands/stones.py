"""`curling stones`: positions of the stones, from one picture of the ice."""

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
    scene: Annotated[Path, Option(metavar="SCENE.json", help="Scene from `curling locate`.")],
    empty: Annotated[
        Path | None,
        Option(metavar="EMPTY", help="Picture of the empty ice in the same view."),
    ] = None,
    own: Annotated[HandleColour | None, Option(help="Handle colour of your team.")] = None,
    output: OutputFile = Path("stones.json"),
    drawn: PictureOption = None,
    *,
    results: Results,
) -> None:
    """Find the stones in play in a picture.

    \b
    Example:
        curling locate empty.png --mark away_tee=131,141 --mark away_hog_centre=131,509
        curling stones now.png --scene scene.json --own red --picture drawn.png
        curling plan --ice ice.json --task score --stones stones.json

    Players, letters and logos are ignored. A doubtful candidate is amber in the picture, "doubtful"
    in the stones file, and ignored by `curling plan`. With --empty, doubtful paint is recognised.

    The stones file lists x and y in metres, standard error, pixel, score and colours of each stone,
    and with --own its team, which `curling plan --task score` needs. See
    docs/how-to/ceiling-camera.md.
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
        DetectedStone,
        draw_stones,
        find_stones_in_image,
        with_camera_error,
        without_paint,
    )

    cv2.setNumThreads(1)
    known = load_scene(scene)
    model = StoneModel(radius=known.stone_radius, height=known.stone_height)
    image = Annotation.open(picture, known.sheet).stills[0]
    camera = camera_from_scene(known, (image.shape[1], image.shape[0]))
    found = find_stones_in_image(image, camera, model, known.sheet)
    found = with_camera_error(found, known, camera)
    bare: list[DetectedStone] = []
    if empty is not None:
        ice = Annotation.open(empty, known.sheet).stills[0]
        bare = find_stones_in_image(ice, camera, model, known.sheet)
        found = without_paint(found, bare)
    places = [stone.as_dict(own) for stone in found]
    with together():
        write_json(output, places)
        if drawn is not None:
            write_picture(drawn, draw_stones(image, found, camera, model))
    sure = [stone for stone in found if not stone.doubtful]
    seen = Counter(str(stone.handle) for stone in sure)
    colours = ", ".join(f"{count} {name}" for name, count in sorted(seen.items()))
    words = f"{len(sure)} stone{'s' * (len(sure) != 1)} on the ice"
    words += f" ({colours})" if sure else ""
    words += f", {len(found) - len(sure)} doubtful" if len(found) > len(sure) else ""
    words += f": {output}"
    if own is not None and sure and str(own) not in seen:
        words += f"; none has a {own} handle, so all count as the opponents'"
    remarks = [
        f"{empty}: expected empty ice, found a stone at ({stone.xy[0]:.2f}, {stone.xy[1]:.2f}) m"
        for stone in bare
        if not stone.doubtful
    ]
    results.show(places, words, *remarks)
