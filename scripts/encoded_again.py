"""Copies of films as messengers and editors make them: smaller, and compressed once more.

python scripts/encoded_again.py --films-in DIR -o runs/small --lines 478 --kbit 400
python scripts/encoded_again.py --films-in DIR -o runs/coarse --lines 720 --quality 28
python scripts/encoded_again.py --films-in DIR -o runs/slow --lines 480 --every 2 --codec mp4v \
    --quality 3
python scripts/tracking_accuracy.py --films-in runs/small --cameras end,side

DIR holds films with their scenes and truths, as `tracking_accuracy.py --films-in` reads them. Of
each film a copy is written, with a scene that fits its size.
"""

from __future__ import annotations

import json
import shutil
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import av
import cv2
import numpy as np
import typer
from av.video.stream import VideoStream
from other_films import Coding, coding


def copied(film: Path, copy: Path, lines: int, every: int, coded: Coding) -> tuple[float, float]:
    """Write the copy of a film, and return by how much its picture is wider and higher."""
    with av.open(str(film)) as source, av.open(str(copy), "w") as target:
        seen = source.streams.video[0]
        height = lines // 2 * 2
        width = round(seen.width * height / seen.height / 2) * 2
        assert seen.average_rate is not None
        stream = target.add_stream(coded[0], rate=seen.average_rate / every)
        assert isinstance(stream, VideoStream)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = coded[1]
        for frame in islice(source.decode(seen), None, None, every):
            picture = frame.to_ndarray(format="bgr24")
            small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
            target.mux(
                stream.encode(av.VideoFrame.from_ndarray(small.astype(np.uint8), format="bgr24"))
            )
        target.mux(stream.encode(None))
        return width / seen.width, height / seen.height


def scaled(scene: dict[str, Any], wider: float, higher: float) -> dict[str, Any]:
    """The scene of a film in another size; pixels are counted from the middle of the first."""

    def at(px: list[float]) -> list[float]:
        return [(px[0] + 0.5) * wider - 0.5, (px[1] + 0.5) * higher - 0.5]

    scene = dict(scene)
    if "corners_px" in scene:
        scene["corners_px"] = {name: at(px) for name, px in scene["corners_px"].items()}
    if "points" in scene:
        scene["points"] = [point | {"px": at(point["px"])} for point in scene["points"]]
    if "camera_matrix" in scene:
        (fx, _, u), (_, fy, v), last = scene["camera_matrix"]
        u, v = at([u, v])
        scene["camera_matrix"] = [[fx * wider, 0.0, u], [0.0, fy * higher, v], last]
    return scene


def copied_with_truth(
    film: Path, output: Path, coded: Coding, *, lines: int, every: int = 1
) -> Path:
    """Write the copy of a film into another folder, with a scene that fits it and its truth.

    Parameters
    ----------
    film : FOLDER/NAME-K.mp4
    output : a folder that exists
    coded : encoder and options, see `other_films.coding`
    lines : height of the copy's picture
    every : step between the frames that are kept
    """
    camera = film.stem.rpartition("-")[0]
    factors = copied(film, output / film.name, lines, every, coded)
    scene = json.loads((film.parent / f"{camera}.scene.json").read_text())
    (output / f"{camera}.scene.json").write_text(json.dumps(scaled(scene, *factors)))
    for truth in (f"{camera}.truth.json", f"{film.stem}.truth.csv"):
        shutil.copyfile(film.parent / truth, output / truth)
    return output / film.name


def main(
    films_in: Annotated[Path, typer.Option(metavar="DIR", help="Films with scenes and truths.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")],
    lines: Annotated[int, typer.Option(min=120, help="Of the copies' pictures.")] = 478,
    every: Annotated[int, typer.Option(min=1, help="Every how manyth frame is kept.")] = 1,
    codec: Annotated[str, typer.Option(help="h264, or mp4v as OpenCV writes it.")] = "h264",
    kbit: Annotated[int, typer.Option(min=0, help="A second, of h264; 0: by --quality.")] = 0,
    quality: Annotated[
        int, typer.Option(help="18 is fine and 33 coarse for h264, 3 and 10 for mp4v.")
    ] = 28,
) -> None:
    """Write smaller copies of films with known truth."""
    films = sorted(films_in.glob("*-[0-9]*.mp4"))
    if not films:
        raise typer.BadParameter(f"no films NAME-K.mp4 in {films_in}", param_hint="--films-in")
    output.mkdir(parents=True, exist_ok=True)
    if output.samefile(films_in):
        raise typer.BadParameter("the films themselves are there", param_hint="--output")
    encoder, options = coding(codec, quality)
    if kbit and codec != "h264":
        raise typer.BadParameter("only h264 is written so; use --quality", param_hint="--kbit")
    if kbit:
        del options["crf"]
        options |= {"b": f"{kbit}k", "maxrate": f"{kbit}k", "bufsize": f"{2 * kbit}k"}
    for film in films:
        copy = copied_with_truth(film, output, (encoder, options), lines=lines, every=every)
        print(copy, flush=True)


if __name__ == "__main__":
    typer.run(main)
