"""Random pictures of curling ice with stones on it, to train the detector on.

A patch is a piece of a picture in which a stone is about `STONE_PX` wide. Everything that differs
between rinks is drawn at random: rings of any colour and size, letters, logos, hacks, boards, lamps
mirrored in the ice, granite, handles, people, brooms, shadows, the height of the camera, blur,
exposure and compression. The ice is painted from above and foreshortened to the camera's elevation;
stones and people are drawn on it.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false, reportAttributeAccessIssue=false

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.random import Generator

from curling_env.typing import Floats, Image
from friction_estimation.tracking.detection.detector import STONE_PX

PATCH_PX = 96
"""Width and height of a patch [px]."""
FINER = 2
"""Factor by which patches are drawn larger, before they are reduced."""
MAX_STONES = 8
RADIUS, HEIGHT = 0.145, 0.114
"""Size of a stone [m]."""
OUTLINE = (
    (0.0, 0.062),
    (0.004, 0.1),
    (0.012, 0.125),
    (0.025, 0.138),
    (0.04, 0.1435),
    (0.055, 0.145),
    (0.07, 0.1435),
    (0.085, 0.138),
    (0.098, 0.127),
    (0.106, 0.112),
    (0.114, 0.095),
)
"""Heights above the ice and a stone's radii there [m]."""
FONTS = (
    cv2.FONT_HERSHEY_SIMPLEX,
    cv2.FONT_HERSHEY_DUPLEX,
    cv2.FONT_HERSHEY_TRIPLEX,
    cv2.FONT_HERSHEY_COMPLEX,
    cv2.FONT_HERSHEY_SCRIPT_SIMPLEX,
)
VIVID = (
    (200, 30, 40),
    (30, 60, 190),
    (20, 110, 60),
    (230, 190, 40),
    (20, 20, 20),
    (240, 240, 240),
    (120, 80, 40),
    (230, 120, 30),
    (60, 160, 210),
    (130, 30, 110),
)
"""Colours of paint, handles and clothes, red-green-blue."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Patch:
    """Picture and its contents.

    Parameters
    ----------
    picture : (`PATCH_PX`, `PATCH_PX`, 3) RGB
    stones : (n, 2) centres of the visible stones on the ice [px]
    people : (`PATCH_PX`, `PATCH_PX`) share of each pixel that people and brooms cover
    """

    picture: Image
    stones: Floats
    people: Floats


def draw_patch(rng: Generator, harder: bool = False) -> Patch:
    """Draw a random patch; the same generator state gives the same patch.

    Parameters
    ----------
    harder : handles often have the most vivid colour of the paint beneath stones, granite its
        brightness, and people's heads look like stones
    """
    scene = _Scene.random(rng)
    scene.look_at(_paint_ice(rng, int(scene.size * 1.5), scene.metre_px))
    stones = _stone_places(rng, scene)
    people_behind = rng.random() < 0.35
    people = int(rng.choice([0, 1, 2], p=[0.5, 0.33, 0.17]))
    _draw_shadows(rng, scene, stones)
    if people_behind:
        for _ in range(people):
            _draw_person(rng, scene, harder)
    _draw_stones(rng, scene, stones, harder)
    before = scene.people.copy()
    if not people_behind:
        for _ in range(people):
            _draw_person(rng, scene, harder)
    covered = np.clip(scene.people - before, 0, 1)
    return Patch(
        picture=_photograph(rng, scene.picture),
        stones=_visible(scene, stones, covered),
        people=np.asarray(
            cv2.resize(scene.people, (PATCH_PX, PATCH_PX), interpolation=cv2.INTER_AREA)
        ),
    )


# --- the camera ---------------------------------------------------------------------------------


@dataclass(kw_only=True, eq=False)
class _Scene:
    """A patch while it is drawn.

    Parameters
    ----------
    metre_px : pixels of a metre across the view
    to_px : (2, 2) metres on the ice to metres in the picture
    up : (2,) the picture of one metre of height [m]
    flat : height of a horizontal circle in the picture over its width
    turned : angle of the vertical in the picture [degrees]
    picture : (size, size, 3) RGB
    people : (size, size) where people are
    """

    metre_px: float
    to_px: Floats
    up: Floats
    flat: float
    turned: float
    picture: Floats = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    people: Floats = field(
        default_factory=lambda: np.zeros((PATCH_PX * FINER, PATCH_PX * FINER), np.float32)
    )
    size: int = PATCH_PX * FINER

    @classmethod
    def random(cls, rng: Generator) -> _Scene:
        metre_px = STONE_PX * FINER / (2 * RADIUS) * math.exp(rng.normal(0, 0.13))
        if rng.random() < 0.55:  # from above
            elevation = math.pi / 2 - min(abs(rng.normal(0, 0.35)), 1.4)
        else:
            elevation = rng.uniform(0.05, 1.5)
        # From above, the top of the picture may be any side; else it is up.
        turned = rng.uniform(0, 2 * math.pi) if elevation > 1.0 else rng.normal(0, 0.12)
        squash = np.diag([1.0, math.sin(elevation)])
        return cls(
            metre_px=metre_px,
            to_px=_rotation(turned) @ squash @ _rotation(rng.uniform(0, 2 * math.pi)),
            up=_rotation(turned) @ np.array([0.0, -math.cos(elevation)]),
            flat=math.sin(elevation),
            turned=math.degrees(turned),
        )

    def look_at(self, ice: Floats) -> None:
        """Take the picture of painted ice."""
        middle = np.full(2, ice.shape[0] / 2)
        shift = np.full(2, self.size / 2) - self.to_px @ middle
        matrix = np.hstack([self.to_px, shift[:, None]])
        kind = cv2.INTER_AREA if self.flat > 0.5 else cv2.INTER_LINEAR
        self.picture = np.asarray(
            cv2.warpAffine(
                ice.astype(np.float32),
                matrix,
                (self.size, self.size),
                flags=kind,
                borderMode=cv2.BORDER_REFLECT,
            )
        )

    def px(self, place: Floats, height: float = 0.0) -> Floats:
        """Pixel of a place on the ice [m] at a height [m]."""
        return (self.to_px @ place + self.up * height) * self.metre_px + self.size / 2

    def disc(self, centre: Floats, radius: float, colour: Floats, on: Floats | None = None) -> None:
        """Paint a horizontal disc; centre [px], radius [m]."""
        width = 2 * radius * self.metre_px
        box = (tuple(centre), (width, width * self.flat), self.turned)
        cv2.ellipse(self.picture if on is None else on, box, _tuple(colour), -1, cv2.LINE_AA)


def _photograph(rng: Generator, picture: Floats) -> Image:
    """Blur, sample, expose, add noise to and compress a picture."""
    blurred = cv2.GaussianBlur(np.clip(picture, 0, 255), (0, 0), rng.uniform(0.3, 1.6) * FINER)
    size = (PATCH_PX, PATCH_PX)
    out = cv2.resize(blurred, size, interpolation=cv2.INTER_AREA)
    if rng.random() < 0.45:  # a coarser camera
        small = max(8, int(PATCH_PX * rng.uniform(0.25, 1)))
        out = cv2.resize(out, (small, small), interpolation=cv2.INTER_AREA)
        out = cv2.resize(out, size, interpolation=cv2.INTER_CUBIC)
    gain, gamma = rng.uniform(0.5, 1.3), math.exp(rng.normal(0, 0.25))
    out = 255 * np.clip(out * gain / 255, 0, 1) ** gamma
    out = out * (1 + rng.normal(0, 0.05, 3))
    grey = out.mean(axis=2, keepdims=True)
    out = grey + (out - grey) * rng.uniform(0.3, 1.3)
    out = out + rng.normal(0, rng.uniform(0, 6), out.shape)
    result = np.clip(out, 0, 255).astype(np.uint8)
    if rng.random() < 0.6:
        quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.uniform(15, 95))]
        _, code = cv2.imencode(".jpg", result, quality)
        result = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), dtype=np.uint8)
    return result


# --- the ice ------------------------------------------------------------------------------------


def _paint_ice(rng: Generator, size: int, metre_px: float) -> Floats:
    """Paint ice as seen from above, (size, size, 3) RGB."""
    ice = np.empty((size, size, 3), np.uint8)
    ice[:] = np.clip(_white(rng), 0, 255)
    if rng.random() < 0.7:
        _paint_house(rng, ice, metre_px)
    for _ in range(rng.poisson(1.3)):
        _paint_logo(rng, ice, metre_px)
    if rng.random() < 0.35:
        for _ in range(rng.integers(1, 5)):
            _paint_words(rng, ice, metre_px)
    if rng.random() < 0.12:
        _paint_hack(rng, ice, metre_px)
    lit = ice.astype(np.float32)
    if rng.random() < 0.25:
        _paint_boards(rng, lit, metre_px)
    _light(rng, lit, metre_px)
    return lit


def _paint_house(rng: Generator, ice: Image, metre_px: float) -> None:
    size = ice.shape[0]
    centre = rng.uniform(-2.2, 2.2, 2) * metre_px + size / 2
    white = [_white(rng) if rng.random() < 0.7 else _colour(rng) for _ in range(2)]
    colours = (_colour(rng), white[0], _colour(rng), white[1])
    for radius, colour in zip((1.829, 1.219, 0.610, rng.uniform(0.12, 0.5)), colours, strict=True):
        _circle(ice, centre, radius * metre_px, colour)
        if rng.random() < 0.3:
            _circle(ice, centre, radius * metre_px, _colour(rng, 0.3), metre_px * 0.015)
    for _ in range(rng.choice([0, 1, 2], p=[0.45, 0.35, 0.2])):
        _letters_along_a_ring(rng, ice, metre_px, centre)
    for axis in (0, 1):
        if rng.random() < 0.8:
            ends = np.array([centre, centre])
            ends[:, axis] += np.array([-4, 4]) * metre_px
            width = max(1, int(0.015 * metre_px))
            cv2.line(ice, *_points(ends), _tuple(_colour(rng, 0.2) * 0.5), width, cv2.LINE_AA)


def _letters_along_a_ring(rng: Generator, ice: Image, metre_px: float, centre: Floats) -> None:
    ring, scale = rng.uniform(0.3, 1.7) * metre_px, rng.uniform(0.1, 0.35) * metre_px / 22
    colour, start, font = _colour(rng), rng.uniform(0, 2 * math.pi), FONTS[rng.integers(len(FONTS))]
    inward = rng.choice([-90, 90])
    for k in range(rng.integers(4, 18)):
        angle = start + k * scale * 24 / ring
        letter = np.zeros((int(60 * scale) + 4, int(40 * scale) + 4), np.uint8)
        begin = (2, letter.shape[0] - 3)
        width = max(1, int(rng.uniform(2, 5) * scale))
        cv2.putText(letter, _text(rng, 1), begin, font, scale, 255, width, cv2.LINE_AA)
        middle = (letter.shape[1] / 2, letter.shape[0] / 2)
        matrix = cv2.getRotationMatrix2D(middle, -math.degrees(angle) + inward, 1.0)
        matrix[:, 2] += centre + ring * np.array([math.cos(angle), math.sin(angle)]) - middle
        share = cv2.warpAffine(letter, matrix, (ice.shape[1], ice.shape[0]))[..., None] / 255.0
        ice[:] = ice * (1 - share) + share * colour


def _paint_words(rng: Generator, ice: Image, metre_px: float) -> None:
    """Paint letters 7 to 90 cm high, in any direction, some outlined or on a plate."""
    size = ice.shape[0]
    layer, plate = np.zeros((size, size), np.uint8), np.zeros((size, size), np.uint8)
    scale = rng.uniform(0.07, 0.9) * metre_px / 22
    font, stroke = FONTS[rng.integers(len(FONTS))], scale * rng.uniform(1, 7)
    text = _text(rng, int(rng.integers(1, 12)))
    (width, height), _ = cv2.getTextSize(text, font, scale, max(1, int(stroke)))
    x, y = rng.uniform(0.1, 0.9, 2) * size
    begin = (int(x - rng.uniform(0, 1) * width), int(y + height / 2))
    cv2.putText(layer, text, begin, font, scale, 255, max(1, int(stroke)), cv2.LINE_AA)
    margin = int(height * 0.4)
    corner = (begin[0] - margin, begin[1] - height - margin)
    cv2.rectangle(plate, corner, (begin[0] + width + margin, begin[1] + margin), 255, -1)
    turn = rng.choice([0, 90, 180, 270]) if rng.random() < 0.6 else rng.uniform(0, 360)
    matrix = cv2.getRotationMatrix2D((x, y), float(turn), 1.0)
    for picture, wanted in ((plate, rng.random() < 0.3), (layer, True)):
        if wanted:
            share = cv2.warpAffine(picture, matrix, (size, size))[..., None] / 255.0
            ice[:] = ice * (1 - share) + share * _colour(rng)
    if rng.random() < 0.3:
        edge = cv2.morphologyEx(layer, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
        share = cv2.warpAffine(edge, matrix, (size, size))[..., None] / 255.0
        ice[:] = ice * (1 - share) + share * _colour(rng)


def _paint_logo(rng: Generator, ice: Image, metre_px: float) -> None:
    """Paint one to four shapes near each other: polygons, discs, rings and bars."""
    centre = rng.uniform(0, ice.shape[0], 2)
    spread = rng.uniform(0.05, 0.7) * metre_px
    for _ in range(rng.integers(1, 5)):
        at, colour = centre + spread * rng.normal(0, 0.6, 2), _colour(rng)
        match rng.integers(4):
            case 0:
                corners = at + spread * rng.normal(0, 0.8, (rng.integers(3, 9), 2))
                cv2.fillPoly(ice, [corners.astype(np.int32)], _tuple(colour), cv2.LINE_AA)
            case 1:
                radius = rng.uniform(0.05, 0.5) * metre_px
                filled = rng.random() < 0.5
                _circle(ice, at, radius, colour, None if filled else radius * rng.uniform(0.1, 0.5))
                if rng.random() < 0.4:
                    _circle(ice, at, radius * rng.uniform(0.3, 0.9), _colour(rng))
            case 2:
                axes = rng.uniform(0.03, 0.6, 2) * metre_px
                box = (tuple(at), tuple(2 * axes), float(rng.uniform(0, 180)))
                width = (
                    -1 if rng.random() < 0.5 else max(1, int(rng.uniform(0.01, 0.08) * metre_px))
                )
                cv2.ellipse(ice, box, _tuple(colour), width, cv2.LINE_AA)
            case _:
                ends = at + spread * rng.normal(0, 1.5, (2, 2))
                width = max(1, int(rng.uniform(0.01, 0.25) * metre_px))
                cv2.line(ice, *_points(ends), _tuple(colour), width, cv2.LINE_AA)


def _paint_hack(rng: Generator, ice: Image, metre_px: float) -> None:
    """Paint two dark footholds beside a line."""
    centre, colour = rng.uniform(0.2, 0.8, 2) * ice.shape[0], _colour(rng, 0.2) * 0.3
    for side in (-1, 1):
        at = centre + np.array([side * rng.uniform(0.05, 0.15), 0]) * metre_px
        half = np.array([rng.uniform(0.03, 0.09), rng.uniform(0.06, 0.15)]) * metre_px
        cv2.rectangle(ice, *_points([at - half, at + half]), _tuple(colour), -1)


def _paint_boards(rng: Generator, ice: Floats, metre_px: float) -> None:
    """Paint boards, carpet or a divider beside the ice, plain or with letters."""
    size = ice.shape[0]
    begin = int(rng.integers(size // 4, size // 2))
    width = begin if rng.random() < 0.6 else int(rng.uniform(0.05, 0.3) * metre_px)
    boards = np.empty((size, width, 3), np.uint8)
    boards[:] = np.clip(_colour(rng, 0.5), 0, 255)
    if rng.random() < 0.5:
        square = np.zeros((size, size, 3), np.uint8)
        square[:, :width] = boards
        for _ in range(rng.integers(1, 4)):
            _paint_words(rng, square, metre_px)
        boards = square[:, :width]
    lines = rng.normal(0, rng.uniform(0, 15), (1, width, 1))
    left = begin - width if rng.random() < 0.5 else size - begin
    ice[:, left : left + width] = boards + lines
    if rng.random() < 0.5:
        ice[:] = np.rot90(ice, int(rng.integers(4))).copy()


def _light(rng: Generator, ice: Floats, metre_px: float) -> None:
    """Add lamps mirrored in the ice, and uneven light."""
    size = ice.shape[0]
    if rng.random() < 0.5:
        for _ in range(rng.integers(1, 4)):
            lamp = np.zeros((size, size), np.float32)
            axes = (
                int(rng.uniform(0.05, 1.2) * metre_px) + 1,
                int(rng.uniform(0.03, 0.2) * metre_px) + 1,
            )
            centre = _points([rng.uniform(0, size, 2)])[0]
            cv2.ellipse(lamp, centre, axes, rng.uniform(0, 180), 0, 360, 1.0, -1)
            lamp = cv2.GaussianBlur(lamp, (0, 0), rng.uniform(0.01, 0.15) * metre_px)
            ice += lamp[..., None] * rng.uniform(20, 160)
    across, along, twist = rng.normal(0, 18, 3)
    y, x = np.mgrid[-1 : 1 : size * 1j, -1 : 1 : size * 1j]
    ice += (across * x + along * y + twist * x * y)[..., None]


# --- stones and people --------------------------------------------------------------------------


def _stone_places(rng: Generator, scene: _Scene) -> list[Floats]:
    """Return positions of the stones [m], some of them touching."""
    half = scene.size / scene.metre_px / 2
    places: list[Floats] = []
    for _ in range(rng.choice([0, 1, 2, 3, 5, MAX_STONES], p=[0.2, 0.22, 0.2, 0.15, 0.13, 0.1])):
        for _ in range(20):
            if places and rng.random() < 0.5:
                apart = 2 * RADIUS * (1 + (0 if rng.random() < 0.4 else rng.uniform(0, 0.5)))
                place = places[rng.integers(len(places))] + apart * _direction(rng)
            else:
                place = np.linalg.solve(scene.to_px, rng.uniform(-half * 1.05, half * 1.05, 2))
            if all(np.hypot(*(place - other)) >= 2 * RADIUS * 0.99 for other in places):
                places.append(place)
                break
    # Those behind are drawn first.
    return sorted(places, key=lambda place: float(-scene.up @ (scene.to_px @ place)))


def _draw_shadows(rng: Generator, scene: _Scene, stones: list[Floats]) -> None:
    if rng.random() < 0.8:
        shade, off = np.zeros((scene.size, scene.size), np.float32), rng.normal(0, 0.06, 2)
        for place in stones:
            scene.disc(scene.px(place + off), RADIUS * 1.1, np.ones(1), shade)
        softness = max(0.5, rng.uniform(0.01, 0.06) * scene.metre_px)
        shade = cv2.GaussianBlur(shade, (0, 0), softness)
        scene.picture *= 1 - shade[..., None] * rng.uniform(0, 0.6)


def _draw_stones(rng: Generator, scene: _Scene, stones: list[Floats], alike: bool) -> None:
    """Draw stones of one rink: two handle colours, one kind of granite, one light."""
    teams = [_colour(rng, 0.85), _colour(rng, 0.85)]
    if alike and stones and rng.random() < 0.7:
        beneath = [_colour_at(scene, place) for place in stones]
        teams[0] = max(beneath, key=np.ptp) * rng.uniform(0.7, 1.15)
    granite = _grey(rng, 40, 200)
    if alike and stones and rng.random() < 0.3:
        paint = _colour_at(scene, stones[rng.integers(len(stones))])
        granite = np.clip(np.full(3, paint.mean()) * rng.uniform(0.8, 1.2), 30, 200)
    shade, rim = rng.uniform(0.5, 1.05), rng.uniform(0.35, 0.95)
    cap = rng.uniform(0.45, 0.8) * RADIUS if rng.random() < 0.75 else 0.0
    ring, number, shine = rng.random() < 0.4, rng.random() < 0.3, rng.random() < 0.5
    rise = 0.05 if rng.random() < 0.8 else 0.0
    length, width = rng.uniform(0.06, 0.11), rng.uniform(0.013, 0.03)
    sun, glare = _direction(rng), rng.uniform(0.01, 0.03)
    for place in stones:
        handle = teams[rng.integers(2)] * rng.uniform(0.85, 1.1)
        stone = np.clip(granite + rng.normal(0, 8, 3), 10, 245)
        for height, radius in OUTLINE:
            light = shade * (rim + (1 - rim) * height / HEIGHT)
            scene.disc(scene.px(place, height), radius, stone * light)
        top = np.clip(stone * rng.uniform(0.9, 1.25), 0, 255)
        scene.disc(scene.px(place, HEIGHT), 0.09, top)
        if ring:
            scene.disc(scene.px(place, HEIGHT * 0.8), 0.125, top)
        if cap:
            scene.disc(scene.px(place, HEIGHT + 0.01), cap, handle)
        along = _direction(rng)
        beside = np.array([-along[1], along[0]])
        bar = [
            (-length, -width),
            (length, -width),
            (length * 1.1, 0),
            (length, width),
            (-length, width),
        ]
        corners = [scene.px(place + a * along + b * beside, HEIGHT + rise) for a, b in bar]
        colour = np.clip(handle * rng.uniform(0.6, 1.15), 0, 255)
        cv2.fillPoly(scene.picture, [_fine(corners)], _tuple(colour), cv2.LINE_AA, 4)
        if shine:
            _circle(
                scene.picture,
                scene.px(place + 0.07 * sun, HEIGHT),
                glare * scene.metre_px,
                np.full(3, 250.0),
            )
        if number:
            at = scene.px(place, HEIGHT + 0.02)
            _circle(scene.picture, at, 0.03 * scene.metre_px, _colour(rng))


def _colour_at(scene: _Scene, place: Floats) -> Floats:
    """Colour of the picture at a place on the ice."""
    x, y = np.clip(scene.px(place), 0, scene.size - 1).astype(int)
    return np.asarray(scene.picture[y, x], dtype=float)


def _draw_person(rng: Generator, scene: _Scene, round_head: bool) -> None:
    """Draw a person with limbs, shoes and a head, from any side, with or without a broom."""
    metre, clothes = scene.metre_px, _colour(rng, 0.4) * rng.uniform(0.1, 1)
    centre = rng.uniform(0, scene.size, 2)

    def blob(at: Floats, axes: Floats, colour: Floats, turn: float) -> None:
        box = (tuple(at), tuple(2 * axes * metre), math.degrees(turn))
        for picture, value in ((scene.picture, _tuple(colour)), (scene.people, 1.0)):
            cv2.ellipse(picture, box, value, -1, cv2.LINE_AA)

    def limb(ends: Floats, width: float, colour: Floats) -> None:
        for picture, value in ((scene.picture, _tuple(colour)), (scene.people, 1.0)):
            cv2.line(picture, *_points(ends), value, max(1, int(width * metre)), cv2.LINE_AA)

    if rng.random() < 0.7:  # cast shadow
        shade = np.zeros((scene.size, scene.size), np.float32)
        box = (
            tuple(centre + rng.normal(0, 0.2, 2) * metre),
            tuple(rng.uniform(0.3, 1.2, 2) * metre),
            0.0,
        )
        cv2.ellipse(shade, box, 1.0, -1)
        shade = cv2.GaussianBlur(shade, (0, 0), rng.uniform(0.03, 0.15) * metre)
        scene.picture *= 1 - shade[..., None] * rng.uniform(0, 0.5)
    body = centre + rng.normal(0, 0.1, 2) * metre
    for _ in range(rng.integers(1, 5)):
        end = body + rng.normal(0, 0.35, 2) * metre
        trousers = np.clip(clothes * rng.uniform(0.3, 1.1) + rng.normal(0, 20, 3), 0, 255)
        limb(np.array([body, end]), rng.uniform(0.06, 0.18), trousers)
        shoe = _colour(rng, 0.3) * rng.uniform(0.1, 1)
        blob(
            end,
            np.array([rng.uniform(0.09, 0.17), rng.uniform(0.04, 0.07)]),
            shoe,
            rng.uniform(0, 6.3),
        )
    for _ in range(rng.integers(1, 4)):
        tint = np.clip(clothes + rng.normal(0, 25, 3), 0, 255)
        blob(
            body + rng.normal(0, 0.12, 2) * metre,
            rng.uniform(0.08, 0.3, 2),
            tint,
            rng.uniform(0, 3.2),
        )
    if round_head and rng.random() < 0.8:
        _draw_round_head(rng, scene, body)
    if rng.random() < 0.7:  # hair or a cap
        blob(
            body + rng.normal(0, 0.12, 2) * metre,
            rng.uniform(0.08, 0.13, 2),
            _colour(rng, 0.4),
            0.0,
        )
    if rng.random() < 0.6:
        head = body + rng.normal(0, 0.8, 2) * metre
        colour = _colour(rng, 0.4)
        limb(np.array([body, head]), 0.025, colour)
        blob(head, np.array([0.12, rng.uniform(0.03, 0.06)]), colour * 0.5, rng.uniform(0, 3.2))


def _draw_round_head(rng: Generator, scene: _Scene, body: Floats) -> None:
    """Draw a head from above: a disc in shades of one colour, beside or on the shoulders."""
    metre, colour = scene.metre_px, _colour(rng, 0.5) * rng.uniform(0.2, 1)
    at = body + rng.uniform(0, 0.45) * metre * _direction(rng)
    shoulders = np.clip(_colour(rng, 0.4) * rng.uniform(0.3, 1), 0, 255)
    for picture, value in ((scene.picture, _tuple(shoulders)), (scene.people, 1.0)):
        cv2.line(
            picture, *_points([body, at]), value, int(rng.uniform(0.1, 0.4) * metre), cv2.LINE_AA
        )
    size, squeeze, turn = rng.uniform(0.09, 0.17), rng.uniform(0.8, 1), rng.uniform(0, 180)
    off = rng.normal(0, 0.02, 2) * metre
    for share, light in ((1.0, 0.7), (0.8, 0.85), (0.55, 1.0), (0.3, rng.uniform(0.9, 1.3))):
        axes = (2 * size * share * metre, 2 * size * share * squeeze * metre)
        box = (tuple(at + (1 - share) * off), axes, turn)
        tint = np.clip(colour * light, 0, 255)
        for picture, value in ((scene.picture, _tuple(tint)), (scene.people, 1.0)):
            cv2.ellipse(picture, box, value, -1, cv2.LINE_AA)


def _visible(scene: _Scene, stones: list[Floats], covered: Floats) -> Floats:
    """Return the centres of stones in the patch less than 60 % hidden by people [px]."""
    found = []
    for place in stones:
        outline = np.zeros((scene.size, scene.size), np.uint8)
        width = 2 * RADIUS * scene.metre_px
        box = (
            tuple(scene.px(place, HEIGHT / 2)),
            (width, width * max(scene.flat, 0.4)),
            scene.turned,
        )
        cv2.ellipse(outline, box, 1, -1)
        if outline.any() and (covered[outline > 0] > 0.5).mean() < 0.6:
            found.append((scene.px(place) + 0.5) / FINER - 0.5)
    places = np.array(found).reshape(-1, 2)
    return places[((places > -0.5) & (places < PATCH_PX - 0.5)).all(axis=1)]


# --- small things -------------------------------------------------------------------------------


def _colour(rng: Generator, vivid: float = 0.7) -> Floats:
    if rng.random() < vivid:
        colour = np.array(VIVID[rng.integers(len(VIVID))], float) + rng.normal(0, 18, 3)
    else:
        colour = rng.uniform(0, 255, 3)
    return np.clip(colour, 0, 255)


def _grey(rng: Generator, low: float, high: float) -> Floats:
    return np.full(3, rng.uniform(low, high)) + rng.normal(0, 7, 3)


def _white(rng: Generator) -> Floats:
    return _grey(rng, 150, 250)


def _text(rng: Generator, letters: int) -> str:
    signs = "ABCDEFGHIJKLMNOPQRSTUVWXYZABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789&."
    return "".join(signs[rng.integers(len(signs))] for _ in range(letters))


def _rotation(angle: float) -> Floats:
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def _direction(rng: Generator) -> Floats:
    angle = rng.uniform(0, 2 * math.pi)
    return np.array([math.cos(angle), math.sin(angle)])


def _tuple(colour: Floats) -> tuple[float, ...]:
    return tuple(float(value) for value in colour)


def _points(places: Floats | list[Floats]) -> list[tuple[int, int]]:
    return [(int(x), int(y)) for x, y in places]


def _fine(places: list[Floats]) -> Image:
    """Return points in sixteenths of a pixel, for OpenCV's shift of 4."""
    return np.round(np.array(places) * 16).astype(np.int32)


def _circle(
    picture: Floats | Image,
    centre: Floats,
    radius: float,
    colour: Floats,
    width: float | None = None,
) -> None:
    (point,) = _fine([centre])
    line = -1 if width is None else max(1, int(width))
    at = (int(point[0]), int(point[1]))
    cv2.circle(picture, at, max(1, int(radius * 16)), _tuple(colour), line, cv2.LINE_AA, 4)
