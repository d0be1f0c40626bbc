"""Films of known throws by a renderer that shares no code with this project.

python scripts/other_films.py -o runs/other --cameras end,side --sizes 1080,480 --rates 15,30
python scripts/tracking_accuracy.py --films-in runs/other --cameras end480f15,side480f15

Its lens, ray caster, stone, paint and motion are written anew here; OpenCV blurs and PyAV
compresses. Cameras hang a little elsewhere for every seed, stones have radii of 0.140 to
0.146 m and a profile of their own, and lenses bend and sit a little askew. Every film is written in
all sizes and rates asked for; those that are there are kept. With `--people` there are a thrower, a
skip and sweepers at work, see `other_people.py`. What a user would know goes into
NAME.scene.json, the truth into NAME.truth.json and NAME-K.truth.csv, as
`tracking_accuracy.py --films-in` reads them.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from fractions import Fraction
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import av
import cv2
import numpy as np
import other_people
import typer
from av.container import OutputContainer
from av.video.stream import VideoStream
from numpy.typing import NDArray
from other_rink import BAND, HOG, Rink, draw_stone, rink_of

Array = NDArray[np.floating[Any]]

GRAVITY = 9.80665
MIXED = ("both", "left", "both", "right")
"""Where sweepers go in one throw after the other, see `other_people.SIDES`."""
LEAD, TAIL = 0.6, 1.0
"""What is filmed before the release and after the stone rests [s]."""
NOISE = 2.0
"""Standard deviation of the camera's noise [grey levels]."""
SOFT = 0.55
"""Standard deviation of the lens's blur [px]."""


Coding = tuple[str, dict[str, object]]
"""An encoder and its options."""


def coding(codec: str, quality: int, preset: str = "medium") -> Coding:
    """How a film is encoded.

    Parameters
    ----------
    codec : h264, as phones and messengers have it, or mp4v, MPEG-4 part 2 as OpenCV writes it
    quality : 18 is fine and 30 coarse for h264; 3, as OpenCV takes it, and 10 for mp4v
    preset : x264's name for how much work it takes
    """
    if codec == "h264":
        return "libx264", {"crf": str(quality), "preset": preset, "threads": "1"}
    if codec == "mp4v":
        return "mpeg4", {"qmin": str(quality), "qmax": str(quality), "g": "12", "threads": "1"}
    raise typer.BadParameter("h264 or mp4v", param_hint="--codec")


# --- the throw ----------------------------------------------------------------------------------


def path_of(mu: float, rng: np.random.Generator, way: int) -> tuple[Array, Array]:
    """Times, and x, y and heading of a throw to rest, from the release at the hog line."""
    speed = np.sqrt(2 * GRAVITY * mu * rng.uniform(25.5, 29.5))
    aim, spin = rng.uniform(-0.015, 0.015), rng.choice([-1, 1]) * rng.uniform(0.7, 1.5)
    state = np.array([rng.uniform(-0.3, 0.3), -HOG * way, speed * np.sin(aim),
                      way * speed * np.cos(aim), rng.uniform(0, 6.28), spin])  # fmt: skip
    around = 2 * np.pi * (np.arange(32) + 0.5) / 32
    ring = BAND * np.stack([np.cos(around), np.sin(around)], 1)
    dt, t, rows = 1 / 480, [0.0], [state[[0, 1, 4]].copy()]

    def change(s: Array) -> Array:
        slip = s[2:4] + s[5] * np.stack([-ring[:, 1], ring[:, 0]], 1)
        push = -slip / (np.linalg.norm(slip, axis=1) + 1e-7)[:, None]
        force = mu * GRAVITY * push.mean(axis=0)
        force += 0.0045 * np.sign(s[5]) * np.array([-s[3], s[2]]) / (np.hypot(s[2], s[3]) + 1e-3)
        torque = mu * GRAVITY * (ring[:, 0] * push[:, 1] - ring[:, 1] * push[:, 0]).mean()
        return np.array([s[2], s[3], force[0], force[1], s[5], torque / (0.5 * 0.1435**2)])

    while np.hypot(state[2], state[3]) > 0.004 and t[-1] < 60:
        half = state + 0.5 * dt * change(state)
        state = state + dt * change(half)
        t.append(t[-1] + dt)
        rows.append(state[[0, 1, 4]].copy())
    return np.array(t), np.array(rows)


# --- films --------------------------------------------------------------------------------------


def film(
    bases: dict[int, Path],
    rink: Rink,
    path: tuple[Array, Array],
    coded: Coding,
    rng: np.random.Generator,
    people: other_people.People | None = None,
) -> None:
    """Write one throw's films and their truths, by frames per second; slower ones leave out frames.

    Every rate divides the fastest.
    """
    t, rows = path
    view, ice = rink.view, rink.ice
    fastest = max(bases)
    count = int((LEAD + t[-1] + TAIL) * fastest)
    moments = np.arange(count) / fastest
    there = np.stack([np.interp(moments - LEAD, t, row) for row in rows.T], 1)
    early = moments < LEAD
    there[early] += (moments[early] - LEAD)[:, None] * (rows[1] - rows[0]) * 480
    blurred, sharp = cv2.GaussianBlur(ice, (0, 0), SOFT), ice.copy()
    grain = np.repeat(
        rng.normal(0, NOISE, (view.size[1] + 97, view.size[0] + 97)).astype(np.float32)[..., None],
        3, axis=2)  # fmt: skip
    with ExitStack() as open_films:
        streams = {fps: open_films.enter_context(opened(base, rink, fps, coded))
                   for fps, base in bases.items()}  # fmt: skip
        for k, (x, y, turn) in enumerate(there):
            picture = blurred
            if people is not None:
                full, own = ice.copy(), there[k]
                parts = people.parts(moments[k] - LEAD, own)
                draw = partial(draw_stone, full, view, rink.stone, *own)
                other_people.draw(full, view, parts, own[:2], draw)
                picture = cv2.GaussianBlur(full, (0, 0), SOFT)
            elif (changed := draw_stone(sharp, view, rink.stone, x, y, turn)) is not None:
                near = tuple(slice(max(s.start - 6, 0), s.stop + 6) for s in changed)
                picture = blurred.copy()
                picture[near] = cv2.GaussianBlur(sharp[near], (0, 0), SOFT)
                sharp[changed] = ice[changed]
            a, b = rng.integers(0, 97, 2)
            noise = grain[a : a + view.size[1], b : b + view.size[0]]
            shown = np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), np.uint8)
            for fps, (container, stream) in streams.items():
                if k % (fastest // fps) == 0:
                    frame = av.VideoFrame.from_ndarray(shown, format="bgr24")
                    container.mux(stream.encode(frame))
        for container, stream in streams.values():
            container.mux(stream.encode(None))
    for fps, base in bases.items():
        every = slice(None, None, fastest // fps)
        with base.with_suffix(".truth.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["t", "x", "y", "theta"])
            writer.writerows(np.column_stack([moments, there])[every].round(6).tolist())


@contextmanager
def opened(
    base: Path, rink: Rink, fps: int, coded: Coding
) -> Iterator[tuple[OutputContainer, VideoStream]]:
    """A film that is being written."""
    encoder, options = coded
    with av.open(str(base.with_suffix(".mp4")), "w") as container:
        stream = container.add_stream(encoder, rate=Fraction(fps))
        assert isinstance(stream, VideoStream)
        stream.width, stream.height, stream.pix_fmt = *rink.view.size, "yuv420p"
        stream.options = options
        yield container, stream


def rendered(
    output: Path,
    coded: Coding,
    *,
    cameras: Sequence[str],
    sizes: Sequence[int],
    rates: Sequence[int],
    films: int = 1,
    round_stones: bool = False,
    people: str = "no",
    seed: int = 0,
) -> Iterator[Path]:
    """Render films of known throws, with their scenes and truths; keep those that are there.

    Parameters
    ----------
    coded : see `coding`
    cameras, sizes, rates : names, lines of the picture, frames per second; each rate divides the
        fastest
    films : number of throws for each camera and size
    round_stones, people, seed : see the options of this script

    Yields
    ------
    the films, as soon as they are complete
    """
    output.mkdir(parents=True, exist_ok=True)
    for camera, height in product(cameras, sizes):
        names = {fps: f"{camera}{height}f{fps}" for fps in rates}
        bases = [{fps: output / f"{name}-{k}" for fps, name in names.items()} for k in range(films)]
        todo = [
            k
            for k, of_throw in enumerate(bases)
            if not all(base.with_suffix(".truth.csv").exists() for base in of_throw.values())
        ]
        rink = rink_of(camera, height, seed, round_stones=round_stones) if todo else None
        for k, of_throw in enumerate(bases):
            if rink is not None and k in todo:
                for fps, name in names.items():
                    (output / f"{name}.scene.json").write_text(json.dumps(rink.scene))
                    truth = {"mu": rink.mu, "released_at_s": LEAD, "fps": fps,
                             "height": rink.view.place[2]}  # fmt: skip
                    (output / f"{name}.truth.json").write_text(json.dumps(truth))
                away = k % 2 == 0 or camera == "ceiling"
                throw(of_throw, rink, k, coded, way=1 if away else -1, people=people)
            yield from (base.with_suffix(".mp4") for base in of_throw.values())


def throw(
    bases: dict[int, Path], rink: Rink, k: int, coded: Coding, *, way: int, people: str
) -> None:
    """Render the k-th throw before a camera, away from home (way 1) or back (-1)."""
    path = path_of(rink.mu, np.random.default_rng([*rink.key, 3 + k]), way)
    on_ice = None
    if people != "no":
        sides = MIXED[k % len(MIXED)] if people == "mixed" else people
        on_ice = other_people.People(sides, path, way, np.random.default_rng([*rink.key, k, 1]))
    film(bases, rink, path, coded, np.random.default_rng([*rink.key, k]), on_ice)


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path("runs/other"),
    cameras: Annotated[str, typer.Option(help="Names, with commas.")] = "end,gantry,side,ceiling",
    sizes: Annotated[str, typer.Option(help="Lines of the picture, with commas.")] = "1080,720,480",
    rates: Annotated[
        str, typer.Option(help="Frames per second, with commas; each divides the fastest.")
    ] = "15,30,60",
    films: Annotated[int, typer.Option(min=1, help="Of each camera.")] = 1,
    codec: Annotated[str, typer.Option(help="h264, or mp4v as OpenCV writes it.")] = "h264",
    quality: Annotated[
        int, typer.Option(help="18 is fine and 30 coarse for h264, 3 and 10 for mp4v.")
    ] = 21,
    round_stones: Annotated[
        bool, typer.Option("--round", help="Stones rounder, and lighter, than the rules allow.")
    ] = False,
    people: Annotated[
        str,
        typer.Option(
            help="Nobody (no), or a thrower, a skip and sweepers: none, left, right, "
            "both, or mixed, which differs from throw to throw."
        ),
    ] = "no",
    seed: Annotated[int, typer.Option(help="Of cameras, stones and throws.")] = 0,
) -> None:
    """Render films of known throws."""
    coded = coding(codec, quality, "ultrafast")
    fastest = max(map(int, rates.split(",")))
    if any(fastest % int(fps) for fps in rates.split(",")):
        raise typer.BadParameter("each must divide the fastest", param_hint="--rates")
    made = rendered(
        output,
        coded,
        cameras=cameras.split(","),
        sizes=[int(lines) for lines in sizes.split(",")],
        rates=[int(fps) for fps in rates.split(",")],
        films=films,
        round_stones=round_stones,
        people=people,
        seed=seed,
    )
    for path in made:
        print(path, flush=True)


if __name__ == "__main__":
    typer.run(main)
