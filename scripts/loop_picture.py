"""The moving picture of the README, from the outputs of the demo: film, map, throw.

curling demo -o runs/demo
python scripts/loop_picture.py runs/demo docs/pictures/loop.webp
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from PIL import Image as Picture

from curling_env import Ice, Throw, Trajectory, load_ice, read_tracks, simulate
from curling_env.infrastructure.files.storage import atomic_path
from curling_env.render import DrawnScene, DrawnStone, SheetRenderer
from curling_env.render.canvas import Canvas, blank, tint
from curling_env.render.text import write
from curling_env.sheet import HOG_LINE_Y, RING_RADII, TEE_Y
from curling_env.typing import Floats, Image

WIDE, HIGH, LEFT = 960, 540, 20
GROUND, ICE_WHITE, FAINT = (17, 24, 34), (238, 243, 248), (150, 162, 176)
KEEN, HEAVY = np.array([0.30, 0.72, 0.72]), np.array([0.93, 0.65, 0.26])
TRACK, THROWN = (235, 140, 30), (130, 20, 36)
RINGS = ((58, 110, 180), (243, 246, 249), (190, 62, 74), (243, 246, 249))
FILM = "A throw in a film, and its track"
MAP = "The ice that eight such films tell: keen is teal, heavy is amber"
THROW = "A draw to the button, planned on that ice"
FPS, QUALITY = 12.5, 62
FILMED, TOLD, PLAYED, HELD = 32, 26, 34, 4000
"""Pictures of the film, of the map and of the throw, and how long the last one stays [ms]."""


def main(demo: Path, picture: Path) -> None:
    ice, tracks = load_ice(demo / "ice.json"), read_tracks(demo / "tracks.csv")
    findings = json.loads((demo / "findings.json").read_text(encoding="utf-8"))
    planned = {key: findings["plan"][key] for key in ("speed", "angle", "spin", "x")}
    path = simulate(ice, [Throw(**planned)], fps=30)[0]
    words = in_words(findings)
    film = film_pictures(demo / "overlay.mp4")
    strip, seen = map_strip(ice), [strip_of(track) for track in tracks]
    shown: list[Image] = []
    close_up = SheetRenderer(ice)
    empty = house(SheetRenderer(load_ice("paper")), path, 0)
    for at in np.linspace(0.0, 1.0, FILMED):
        shown.append(page(film[round(at * (len(film) - 1))], blank_strip(ice), empty, []))
    for at in np.linspace(0.0, 1.0, TOLD):
        shown.append(page(film[-1], told(ice, strip, seen, at * len(seen)), empty, []))
    drawn = strip
    for at in np.linspace(0.0, 1.0, PLAYED) ** 0.8:
        until = round(at * (len(path) - 1)) + 1
        drawn = strip.copy()
        canvas_of(ice, drawn).line(path.xy[:until], THROWN, 2)
        canvas_of(ice, drawn).dot(path.xy[until - 1], 5, THROWN)
        shown.append(page(film[-1], drawn, house(close_up, path, until), words[:1]))
    shown.append(page(film[-1], drawn, house(close_up, path, len(path)), words))
    times = [round(1000 / FPS)] * (len(shown) - 1) + [HELD]
    first, *others = [Picture.fromarray(one) for one in shown]
    with atomic_path(picture) as draft:
        first.save(
            draft, "WEBP", save_all=True, append_images=others, duration=times, loop=0,
            quality=QUALITY, method=6, minimize_size=True,
        )  # fmt: skip


def film_pictures(path: Path) -> list[Image]:
    """The film with its track, cut to the sheet."""
    with av.open(str(path)) as container:
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    height, width = pictures[0].shape[:2]
    rows = slice(round(0.385 * height), round(0.605 * height))
    columns = slice(round(0.03 * width), round(0.95 * width))
    size = (WIDE - 2 * LEFT, round((WIDE - 2 * LEFT) * 0.22 * height / (0.92 * width)))
    return [
        np.asarray(cv2.resize(p[rows, columns], size, interpolation=cv2.INTER_AREA), np.uint8)
        for p in pictures
    ]


def canvas_of(ice: Ice, image: Image) -> Canvas:
    """The whole sheet on its side; x is drawn down, so that play runs to the right."""
    sheet = ice.sheet
    scale = image.shape[1] / sheet.length
    return Canvas(image=image, left_y=-sheet.length / 2, top_x=-sheet.width / 2, scale=scale)


def blank_strip(ice: Ice) -> Image:
    """The sheet without a colour."""
    wide = WIDE - 2 * LEFT
    image = blank(wide, round(wide * ice.sheet.width / ice.sheet.length), ICE_WHITE)
    canvas, half = canvas_of(ice, image), ice.sheet.width / 2
    for end in (-1, 1):
        for radius, colour in zip(RING_RADII, RINGS, strict=True):
            canvas.disc((0.0, end * TEE_Y), radius, colour)
        hog = end * HOG_LINE_Y
        canvas.band((-half, hog - 0.05), (half, hog + 0.05), (200, 50, 60))
    canvas.band((-0.02, -ice.sheet.length / 2), (0.02, ice.sheet.length / 2), (90, 110, 140))
    return image


def dye(ice: Ice) -> Floats:
    """Colour of the friction under every pixel of the strip, (rows, columns, 3) in 0–1."""
    points = canvas_of(ice, blank_strip(ice)).points()
    mu, middle = ice.mu_at(points), float(np.median(ice.friction.mu))
    spread = float(np.abs(ice.friction.mu - middle).max())
    depth = np.clip(np.abs(mu - middle) / spread, 0, 1)[..., None]
    return 1 - depth * (1 - np.where((mu < middle)[..., None], KEEN, HEAVY))


def map_strip(ice: Ice) -> Image:
    image = blank_strip(ice)
    tint(image, dye(ice))
    return image


def strip_of(track: Trajectory) -> Floats:
    """Some points of a track (n, 2) [m]."""
    return track.xy[np.linspace(0, len(track) - 1, 80).round().astype(int)]


def told(ice: Ice, strip: Image, tracks: list[Floats], number: float) -> Image:
    """The map as far as the first throws have told it, with their tracks."""
    empty = blank_strip(ice)
    points = canvas_of(ice, empty).points()
    known = np.zeros(points.shape[:2])
    for k, track in enumerate(tracks[: int(np.ceil(number))]):
        run = track[: max(2, round(min(number - k, 1.0) * len(track)))]
        for x, y in run:
            known += 0.5 * np.exp(-((points[..., 0] - x) ** 2 + (points[..., 1] - y) ** 2) / 0.8)
    share = np.clip(known, 0.0, 1.0)[..., None]
    if number >= len(tracks):
        share = np.ones_like(share)
    image = np.round(share * strip + (1 - share) * empty).astype(np.uint8)
    for k, track in enumerate(tracks[: int(np.ceil(number))]):
        run = track[: max(2, round(min(number - k, 1.0) * len(track)))]
        canvas_of(ice, image).line(run, TRACK, 1)
    return image


def in_words(findings: dict[str, Any]) -> list[str]:
    """The call of the planned draw, and what came of it."""
    call = findings["plan"]["in_words"]
    miss, other = findings["miss_on_true_ice_m"], findings["miss_planned_on_average_ice_m"]
    return [
        f"{call['hog_to_hog_s']:.1f} s hog to hog, {call['ice_m']:.2f} m of ice",
        f"On the hidden ice it stops {100 * miss:.0f} cm from the button.",
        f"Planned with one number for the ice: {100 * other:.0f} cm.",
    ]


def house(renderer: SheetRenderer, path: Trajectory, until: int) -> Image:
    """The house played to, with the stone on its way once it has left."""
    scene = DrawnScene()
    if until:
        x, y = path.xy[until - 1]
        theta = float(path.theta[until - 1])
        stone = DrawnStone(x=float(x), y=float(y), theta=theta, colour=THROWN)
        scene = DrawnScene(stones=[stone], paths=[(path.xy[:until], THROWN)])
    picture = renderer.draw(scene)
    half = renderer.ice.sheet.width / 2
    left, top = renderer.close_up_pixel((-half, -6.6)).round().astype(int)
    right, bottom = renderer.close_up_pixel((half, 2.6)).round().astype(int)
    return picture[top:bottom, left:right]


def page(film: Image, strip: Image, close_up: Image, words: list[str]) -> Image:
    """One picture: the film, the map below it, the throw below that."""
    image = blank(WIDE, HIGH, GROUND)
    row = 12
    for title, part in ((FILM, film), (MAP, strip)):
        write(image, title, (LEFT, row), size=16, colour=FAINT)
        row += 26
        image[row : row + part.shape[0], LEFT : LEFT + part.shape[1]] = part
        row += part.shape[0] + 12
    high = HIGH - row - 16
    wide = round(close_up.shape[1] * high / close_up.shape[0])
    left = WIDE - LEFT - wide
    image[row : row + high, left : left + wide] = cv2.resize(
        close_up, (wide, high), interpolation=cv2.INTER_AREA
    )
    write(image, THROW, (LEFT, row), size=16, colour=FAINT)
    for k, line in enumerate(words):
        write(image, line, (LEFT, row + 44 + 32 * k), size=15, bold=True)
    return image


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
