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
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import av
import cv2
import numba
import numpy as np
import other_people
import typer
from av.container import OutputContainer
from av.video.stream import VideoStream
from numpy.typing import NDArray
from other_views import PLACES, View, view_of

Array = NDArray[np.floating[Any]]

LENGTH, WIDTH = 44.5, 4.5
TEE, HOG = 17.3735, 10.9725
RINGS = ((1.829, (150, 70, 40)), (1.219, (235, 235, 235)), (0.610, (50, 50, 190)),
         (0.152, (235, 235, 235)))  # fmt: skip
ICE, FLOOR, DARK = (232, 228, 224), (70, 64, 60), (60, 60, 60)
STONE_HEIGHT = 0.1143
BAND = 0.0625
"""Radius of a stone's running band [m]."""
GRAVITY = 9.80665
MIXED = ("both", "left", "both", "right")
"""Where sweepers go in one throw after the other, see `other_people.SIDES`."""
LEAD, TAIL = 0.6, 1.0
"""What is filmed before the release and after the stone rests [s]."""
REAL, ROUND = (6.0, 12.0), (2.2, 3.4)
"""Exponents of a stone's profile. Of granite of 2.65 g/cm³ and with a handle of 0.5 kg, stones of
the first kind weigh 17.2 to 19.6 kg, of the second 14.9 to 17.4; the rules ask for 17.24 to 19.96.
"""
LAYERS = 44
"""Levels at which a ray is tested against the stone."""
FINE = 4
"""Rays along each side of a pixel."""
NOISE = 2.0
"""Standard deviation of the camera's noise [grey levels]."""
SOFT = 0.55
"""Standard deviation of the lens's blur [px]."""


# --- the ice ------------------------------------------------------------------------------------


def colour_of_ice(x: Array, y: Array) -> Array:
    """What is painted at places on the ice, (..., 3) BGR."""
    colour = np.empty((*x.shape, 3), np.float32)
    colour[:] = ICE
    for end in (-1, 1):
        away = np.hypot(x, y - end * TEE)
        for radius, paint in RINGS:
            colour[away <= radius] = paint
    depth = np.abs(y)
    colour[(np.abs(x) < 0.00635) & (depth < TEE + 3.66)] = DARK
    for line in (TEE, TEE + 1.829 - 0.00635):
        colour[np.abs(depth - line) < 0.00635] = DARK
    colour[(depth >= HOG) & (depth <= HOG + 0.1016)] = (40, 40, 170)
    colour[(np.abs(x) > WIDTH / 2) | (depth > LENGTH / 2)] = FLOOR
    return colour


def picture_of_ice(view: View, rng: np.random.Generator) -> Array:
    """The empty sheet, (rows, columns, 3), unevenly lit."""
    width, height = view.size
    picture = np.empty((height, width, 3), np.float32)
    part = (np.arange(5) + 0.5) / 5 - 0.5
    for row in range(height):
        u, v = np.meshgrid((np.arange(width)[:, None] + part).ravel(), row + part)
        rays = view.rays(u, v)
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.where(rays[..., 2] < -1e-3, -view.place[2] / rays[..., 2], np.nan)
        x, y = (np.nan_to_num(view.place[k] + far * rays[..., k], nan=99.0) for k in (0, 1))
        picture[row] = colour_of_ice(x, y).reshape(5, width, 5, 3).mean(axis=(0, 2))
    glow = rng.uniform(-0.08, 0.08, 2)
    down, across = np.linspace(-1, 1, height), np.linspace(-1, 1, width)
    lit = 1 + np.add.outer(glow[0] * down, glow[1] * across)
    grain = cv2.GaussianBlur(rng.normal(0, 1, (height, width)), (0, 0), 1.2)
    return picture * (lit + 0.02 * grain)[..., None].astype(np.float32)


# --- the stone ----------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Granite:
    """A stone: radius [m], the exponents of its profile below and above, colours, and the light.

    Its shade is the share of the light that the ice under its edge loses.
    """

    radius: float
    below: float
    above: float
    body: Array
    handle: Array
    sun: Array
    shade: float

    def radii(self, z: Array) -> Array:
        """Radius at heights (n,): widest at 48 % of the height, with a flat striking band."""
        middle, band = 0.48 * STONE_HEIGHT, 0.011
        up = np.clip((z - middle - band) / (STONE_HEIGHT - middle - band), 0, 1)
        down = np.clip((middle - band - z) / (middle - band), 0, 1)
        top = self.radius * (1 - 0.52 * up**self.above)
        return np.where(z > middle, top, self.radius - (self.radius - BAND) * down**self.below)


def draw_stone(
    picture: Array, view: View, stone: Granite, x: float, y: float, turn: float
) -> tuple[slice, slice] | None:
    """Draw a stone with its handle, its shade and its mirror image into a picture, in place.

    Returns the rows and columns that have changed; None where the stone is not in view.
    """
    reach = stone.radius + 0.12
    box = np.array([(x + a, y + b, c) for a in (-reach, reach) for b in (-reach, reach)
                    for c in (-0.1, 0.19)])  # fmt: skip
    px = view.pixels(box)
    low = np.maximum(np.floor(px.min(axis=0)).astype(int) - 2, 0)
    high = np.minimum(np.ceil(px.max(axis=0)).astype(int) + 3, view.size)
    if (high - low < 3).any():
        return None
    part = (np.arange(FINE) + 0.5) / FINE - 0.5
    u, v = np.meshgrid((np.arange(low[0], high[0])[:, None] + part).ravel(),
                       (np.arange(low[1], high[1])[:, None] + part).ravel())  # fmt: skip
    rays = view.rays(u, v)
    slope = rays[..., :2] / rays[..., 2:]
    foot = view.place[:2] - view.place[2] * slope - np.array([x, y])
    rows, columns = slice(low[1], high[1]), slice(low[0], high[0])
    levels = np.linspace(0, STONE_HEIGHT, LAYERS)
    radii = stone.radii(levels)
    seen = np.empty((high[1] - low[1], high[0] - low[0], 3))
    cast(np.asarray(picture[rows, columns], np.float64), foot, slope, FINE, levels, radii,
         np.gradient(radii, levels), np.array([np.cos(turn), np.sin(turn)]), stone.sun,
         stone.radius, stone.shade, stone.body, stone.handle, seen)  # fmt: skip
    picture[rows, columns] = seen
    return rows, columns


@numba.njit(cache=True)
def cast(ice, foot, slope, fine, levels, radii, tilt, heading, sun, radius, shade, body, handle,
         seen):  # fmt: skip
    """Colour of every pixel, the mean over its rays: what each meets first on its way down.

    `foot` (rows·fine, columns·fine, 2) is where rays meet the ice, from the stone's centre;
    `slope` their way sideways per metre of height.
    """
    last = len(levels) - 1
    for row in range(seen.shape[0]):
        for column in range(seen.shape[1]):
            total = np.zeros(3)
            for i in range(row * fine, (row + 1) * fine):
                for j in range(column * fine, (column + 1) * fine):
                    fx, fy = foot[i, j]
                    sx, sy = slope[i, j]
                    hit = False
                    for k in range(10):
                        z = levels[last] + 0.045 - 0.005 * k
                        x, y = fx + z * sx, fy + z * sy
                        along, across = (
                            x * heading[0] + y * heading[1],
                            y * heading[0] - x * heading[1],
                        )
                        high = k < 5
                        if -0.035 < along < (0.105 if high else -0.005) and abs(across) < (
                            0.015 if high else 0.012):  # fmt: skip
                            total += handle
                            hit = True
                            break
                    if hit:
                        continue
                    for k in range(last, -1, -1):
                        x, y = fx + levels[k] * sx, fy + levels[k] * sy
                        away = np.hypot(x, y)
                        if away > radii[k]:
                            continue
                        if k == last:
                            light = max(sun[2], 0.0)
                        else:
                            length = np.hypot(1.0, tilt[k])
                            out = max(away, 1e-9)
                            nz = -tilt[k] / length
                            light = (x * sun[0] + y * sun[1]) / (out * length) + nz * sun[2]
                            light = min(max(light, 0.0), 1.0) + 0.25 * min(max(-nz, 0.0), 1.0)
                        total += body * (0.62 + 0.38 * light)
                        hit = True
                        break
                    if hit:
                        continue
                    away = np.hypot(fx - 0.03 * sun[0], fy - 0.03 * sun[1])
                    lost = shade * min(max((radius - away) / 0.04, 0.0), 1.0)
                    mirrored = False
                    for k in range(last + 1):
                        if np.hypot(fx - levels[k] * sx, fy - levels[k] * sy) <= radii[k]:
                            mirrored = True
                            break
                    for c in range(3):
                        light = ice[row, column, c] * (1 - lost)
                        total[c] += 0.92 * light + 0.08 * body[c] if mirrored else light
            for c in range(3):
                seen[row, column, c] = total[c] / fine**2


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
    view: View,
    ice: Array,
    stone: Granite,
    path: tuple[Array, Array],
    quality: int,
    rng: np.random.Generator,
    people: other_people.People | None = None,
) -> None:
    """Write one throw's films and their truths, by frames per second; slower ones leave out frames.

    Every rate divides the fastest.
    """
    t, rows = path
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
        streams = {fps: open_films.enter_context(opened(base, view, fps, quality))
                   for fps, base in bases.items()}  # fmt: skip
        for k, (x, y, turn) in enumerate(there):
            picture = blurred
            if people is not None:
                full, own = ice.copy(), there[k]
                parts = people.parts(moments[k] - LEAD, own)
                draw = partial(draw_stone, full, view, stone, *own)
                other_people.draw(full, view, parts, own[:2], draw)
                picture = cv2.GaussianBlur(full, (0, 0), SOFT)
            elif (changed := draw_stone(sharp, view, stone, x, y, turn)) is not None:
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
    base: Path, view: View, fps: int, quality: int
) -> Iterator[tuple[OutputContainer, VideoStream]]:
    """A film that is being written."""
    with av.open(str(base.with_suffix(".mp4")), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps))
        assert isinstance(stream, VideoStream)
        stream.width, stream.height, stream.pix_fmt = *view.size, "yuv420p"
        stream.options = {"crf": str(quality), "preset": "ultrafast", "threads": "1"}
        yield container, stream


def places_marked(view: View) -> tuple[list[tuple[float, float]], bool]:
    """What a user would mark, and whether those are the corners, or else paint at the ends."""

    def seen(points: list[tuple[float, float]]) -> NDArray[np.bool_]:
        px = view.pixels(np.array([(*p, 0.0) for p in points]))
        low, high = px.min(axis=1) > 2, (px - view.size).max(axis=1) < -3
        return low & high

    corners = [(s * WIDTH / 2, e * LENGTH / 2) for e in (-1, 1) for s in (-1, 1)]
    if seen(corners).all():
        return corners, True
    points: list[tuple[float, float]] = []
    for e in (-1, 1):
        points += [(s * 1.829, e * TEE) for s in (-1, 0, 1)]
        points += [(0, e * (TEE + 1.829)), (0, e * (TEE - 1.829))]
        points += [(s * WIDTH / 2, e * (HOG + 0.0508)) for s in (-1, 1)]
    return [points[k] for k in np.flatnonzero(seen(points))], False


def main(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR")] = Path("runs/other"),
    cameras: Annotated[str, typer.Option(help="Names, with commas.")] = "end,gantry,side,ceiling",
    sizes: Annotated[str, typer.Option(help="Lines of the picture, with commas.")] = "1080,720,480",
    rates: Annotated[
        str, typer.Option(help="Frames per second, with commas; each divides the fastest.")
    ] = "15,30,60",
    films: Annotated[int, typer.Option(min=1, help="Of each camera.")] = 1,
    quality: Annotated[int, typer.Option(help="Of H.264: 18 is fine, 30 coarse.")] = 21,
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
    fastest = max(map(int, rates.split(",")))
    if any(fastest % int(fps) for fps in rates.split(",")):
        raise typer.BadParameter("each must divide the fastest", param_hint="--rates")
    output.mkdir(parents=True, exist_ok=True)
    for camera in cameras.split(","):
        kind = list(PLACES).index(camera)
        mu = float(np.random.default_rng([seed, kind]).uniform(0.0078, 0.0105))
        for height in map(int, sizes.split(",")):
            rng = np.random.default_rng([seed, kind, 1])  # the same camera and stone in all sizes
            view = view_of(camera, height, rng)
            sun = np.array([rng.normal(0, 0.5), rng.normal(0, 0.5), 1.0])
            grey = rng.uniform(70, 120)
            below, above = rng.uniform(*(ROUND if round_stones else REAL), 2).tolist()
            stone = Granite(radius=float(rng.uniform(0.140, 0.146)), below=below, above=above,
                            body=np.array([grey, grey, 0.97 * grey]),
                            handle=np.array([(40, 40, 200), (40, 190, 220)][seed % 2], float),
                            sun=sun / np.linalg.norm(sun), shade=rng.uniform(0.1, 0.3))  # fmt: skip
            ice = picture_of_ice(view, np.random.default_rng([seed, kind, 2]))
            marked, corners = places_marked(view)
            px = view.pixels(np.array([(*place, 0.0) for place in marked]))
            scene: dict[str, Any] = {
                "camera_matrix": [[view.focal, 0, view.axis[0]], [0, view.focal, view.axis[1]],
                                  [0, 0, 1]],
                "distortion": [view.k1, view.k2, 0, 0, 0],
                "stone": {"radius": stone.radius, "height": STONE_HEIGHT},
            }  # fmt: skip
            if not corners:
                scene["points"] = [
                    {"sheet": a, "px": b} for a, b in zip(marked, px.tolist(), strict=True)
                ]
            else:
                names = ("home_left", "home_right", "away_left", "away_right")
                scene["corners_px"] = dict(zip(names, px.tolist(), strict=True))
            names = {fps: f"{camera}{height}f{fps}" for fps in map(int, rates.split(","))}
            for fps, name in names.items():
                (output / f"{name}.scene.json").write_text(json.dumps(scene))
                truth = {"mu": mu, "released_at_s": LEAD, "fps": fps, "height": view.place[2]}
                (output / f"{name}.truth.json").write_text(json.dumps(truth))
            for k in range(films):
                bases = {fps: output / f"{name}-{k}" for fps, name in names.items()}
                if all(base.with_suffix(".truth.csv").exists() for base in bases.values()):
                    continue
                way = 1 if k % 2 == 0 or camera == "ceiling" else -1
                path = path_of(mu, np.random.default_rng([seed, kind, 3 + k]), way)
                on_ice = None
                if people != "no":
                    sides = MIXED[k % len(MIXED)] if people == "mixed" else people
                    on_ice = other_people.People(
                        sides, path, way, np.random.default_rng([seed, kind, k, 1])
                    )
                film(
                    bases,
                    view,
                    ice,
                    stone,
                    path,
                    quality,
                    np.random.default_rng([seed, kind, k]),
                    on_ice,
                )
                print(*(base.with_suffix(".mp4") for base in bases.values()), flush=True)


if __name__ == "__main__":
    typer.run(main)
