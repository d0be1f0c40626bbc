"""Sheet from above as in a broadcast: the whole sheet, and a close-up of the house."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from curling_env.ice import Ice
from curling_env.render.canvas import Canvas, Colour, write
from curling_env.sheet import (
    BACK_LINE_Y,
    HACK_Y,
    HOG_LINE_WIDTH,
    HOG_LINE_Y,
    LINE_WIDTH,
    RING_RADII,
    TEE_Y,
    Direction,
    to_delivery,
    to_sheet,
)
from curling_env.typing import Floats, Image

RED: Colour = (206, 38, 50)
YELLOW: Colour = (244, 190, 32)
BLUE: Colour = (36, 92, 170)

_SURROUND: Colour = (17, 26, 38)
_PANEL: Colour = (26, 38, 54)
_ICE: Colour = (240, 246, 250)
_RINGS: tuple[Colour, ...] = ((64, 116, 186), (240, 246, 250), (214, 74, 82), (250, 250, 250))
_LINE: Colour = (70, 82, 98)
_HOG: Colour = (196, 52, 60)
_HACK: Colour = (40, 44, 50)
_GRANITE: Colour = (138, 142, 148)
_GRANITE_EDGE: Colour = (78, 82, 88)
_GRANITE_LIGHT: Colour = (172, 176, 182)
_FAINT: Colour = (140, 156, 174)
_BRIGHT: Colour = (236, 241, 246)
_AIM: Colour = (10, 110, 72)

_KEEN = np.array([0.35, 0.78, 0.76])
"""Teal: the picture of the keenest ice is multiplied by this colour."""
_HEAVY = np.array([1.0, 0.70, 0.30])
"""Amber: the picture of the heaviest ice is multiplied by this colour."""
_FULL_COLOUR = 0.02
"""Smallest relative difference from the median friction that is shown in full colour."""

_WIDTH, _HEIGHT, _MARGIN = 1280, 720, 24
_STRIP_TOP, _PANEL_WIDTH = 76, 268
_HOUSE_FROM, _HOUSE_TO = HOG_LINE_Y - TEE_Y - 0.55, BACK_LINE_Y - TEE_Y + 0.95
"""Range of y that the close-up shows, delivery frame [m]."""


@dataclass(frozen=True, kw_only=True)
class DrawnStone:
    """Stone to draw.

    Parameters
    ----------
    x, y : centre, sheet frame [m]
    theta : heading of the handle [rad]
    colour : colour of the handle
    """

    x: float
    y: float
    theta: float = 0.0
    colour: Colour = RED


@dataclass(frozen=True, kw_only=True)
class DrawnScene:
    """Stones and paths to draw, and the text beside them.

    Parameters
    ----------
    stones : the stones, in the order in which they are drawn
    paths : paths (n, 2), sheet frame [m], each with the colour of its stone
    target : (2,) sheet frame [m], or None
    title : the headline
    facts : labels and values of the panel
    """

    stones: Sequence[DrawnStone] = ()
    paths: Sequence[tuple[Floats, Colour]] = ()
    target: Floats | None = None
    title: str = ""
    facts: Sequence[tuple[str, str]] = field(default=())


class SheetRenderer:
    """Renderer of scenes on one ice, seen along one direction of play.

    The empty sheet with its friction is painted once and copied for every scene.

    Parameters
    ----------
    ice : ice whose friction is the colour under the lines: teal where keen, amber where heavy
    direction : the end played to, on the right of the picture
    """

    size = (_WIDTH, _HEIGHT)
    """Width and height of every picture [pixels]."""

    def __init__(self, ice: Ice, direction: Direction = Direction.AWAY) -> None:
        self.ice, self.direction = ice, direction
        self._radius = ice.stone.radius
        self._empty = np.full((_HEIGHT, _WIDTH, 3), _SURROUND, dtype=np.uint8)
        self._strip, self._house = self._views(self._empty)
        for view in (self._strip, self._house):
            self._paint_ice(view)
        self._paint_labels()

    def draw(self, scene: DrawnScene) -> Image:
        """Return the picture of a scene, (720, 1280, 3) RGB."""
        picture = self._empty.copy()
        strip, house = self._views(picture)
        for path, colour in scene.paths:
            along = to_delivery(path, self.direction)
            house.line(along, _BRIGHT, 5)
            house.line(along, _deeper(colour), 2)
            strip.line(along, _deeper(colour), 1)
        if scene.target is not None:
            aim = to_delivery(scene.target, self.direction)
            self._paint_target(house, aim)
            strip.ring(aim, 0.2, _AIM, 2)
        for stone in scene.stones:
            centre = to_delivery((stone.x, stone.y), self.direction)
            self._paint_stone(house, centre, stone)
            strip.dot(centre, max(self._radius * strip.scale, 4.5), _GRANITE_EDGE)
            strip.dot(centre, max(self._radius * strip.scale, 4.5) - 1.2, stone.colour)
        self._write_panel(picture, scene)
        return picture

    def close_up_pixel(self, xy: ArrayLike) -> Floats:
        """Return column and row (..., 2) of points in the picture's close-up [pixels].

        Parameters
        ----------
        xy : (..., 2) points in the delivery frame [m]
        """
        return np.array([_MARGIN, _house_top(self._strip)]) + self._house.pixels(xy)

    # --- the sheet -----------------------------------------------------------------------------

    def _views(self, picture: Image) -> tuple[Canvas, Canvas]:
        """Return the parts of a picture that show the whole sheet and the house played to."""
        sheet = self.ice.sheet
        scale = (_WIDTH - 2 * _MARGIN) / sheet.length
        height = round(sheet.width * scale)
        strip = Canvas(
            image=picture[_STRIP_TOP : _STRIP_TOP + height, _MARGIN : _WIDTH - _MARGIN],
            left_y=-sheet.length / 2 - TEE_Y,
            top_x=-sheet.width / 2,
            scale=scale,
        )
        top = _STRIP_TOP + height + 44
        wide = _WIDTH - 2 * _MARGIN - _PANEL_WIDTH - 16
        scale = min((_HEIGHT - _MARGIN - top) / sheet.width, wide / (_HOUSE_TO - _HOUSE_FROM))
        width, height = round((_HOUSE_TO - _HOUSE_FROM) * scale), round(sheet.width * scale)
        house = Canvas(
            image=picture[top : top + height, _MARGIN : _MARGIN + width],
            left_y=_HOUSE_FROM,
            top_x=-sheet.width / 2,
            scale=scale,
        )
        return strip, house

    def _paint_ice(self, view: Canvas) -> None:
        half = self.ice.sheet.width / 2
        view.image[:] = _ICE
        for end in (0.0, -2 * TEE_Y):
            for radius, colour in zip(RING_RADII, _RINGS, strict=True):
                view.disc((0.0, end), radius, colour)
                view.ring((0.0, end), radius, _LINE)
            toward = 1 if end == 0.0 else -1
            hog, back, hack = (
                end + toward * (line - TEE_Y) for line in (HOG_LINE_Y, BACK_LINE_Y, HACK_Y)
            )
            # The line is measured at its sheet-side edge; it is painted towards the house.
            edges = sorted((hog, hog + toward * HOG_LINE_WIDTH))
            view.band((-half, edges[0]), (half, edges[1]), _HOG)
            for line in (end, back):
                view.band((-half, line - LINE_WIDTH / 2), (half, line + LINE_WIDTH / 2), _LINE)
            for side in (-0.15, 0.15):
                view.band((side - 0.07, hack - 0.1), (side + 0.07, hack + 0.1), _HACK)
        view.band((-LINE_WIDTH / 2, -HACK_Y - TEE_Y), (LINE_WIDTH / 2, HACK_Y - TEE_Y), _LINE)
        if not self.ice.friction.is_uniform:
            view.image[:] = np.round(view.image * self._dye(view)).astype(np.uint8)

    def _dye(self, view: Canvas) -> Floats:
        """Return the colour of the friction under every pixel, (height, width, 3) in 0–1."""
        low, middle, high = self._range()
        mu = self.ice.mu_at(to_sheet(view.points(), self.direction))
        depth = np.where(
            mu < middle, (middle - mu) / (middle - low), (mu - middle) / (high - middle)
        )
        colour = np.where((mu < middle)[..., None], _KEEN, _HEAVY)
        return 1 - np.clip(depth, 0, 1)[..., None] * (1 - colour)

    def _range(self) -> tuple[float, float, float]:
        """Return the friction shown in full teal, without colour and in full amber."""
        mu = self.ice.friction.mu
        middle = float(np.median(mu))
        spread = max(float(np.abs(mu - middle).max()), _FULL_COLOUR * middle)
        return middle - spread, middle, middle + spread

    def _paint_labels(self) -> None:
        """Paint the names of the lines above the close-up, and the colour scale of the friction."""
        picture, house = self._empty, self._house
        top = _house_top(self._strip)
        for name, y in (
            ("hog line", HOG_LINE_Y - TEE_Y),
            ("tee line", 0.0),
            ("back line", BACK_LINE_Y - TEE_Y),
        ):
            u = float(self.close_up_pixel((0.0, y))[0])
            write(picture, name, (u, top - 21), size=13, colour=_FAINT, align=0.5)
        u, v = _WIDTH - _MARGIN - _PANEL_WIDTH, top
        picture[v : v + house.image.shape[0], u : _WIDTH - _MARGIN] = _PANEL
        self._paint_scale(u + 18, v + house.image.shape[0] - 74)

    def _paint_scale(self, u: int, v: int) -> None:
        picture, wide = self._empty, _PANEL_WIDTH - 36
        if self.ice.friction.is_uniform:
            mu = float(self.ice.friction.mu.flat[0])
            write(picture, "Friction", (u, v + 26), size=13, colour=_FAINT)
            write(picture, f"{mu:.4g} everywhere", (u, v + 44), size=14, colour=_BRIGHT)
            return
        low, middle, high = self._range()
        write(picture, "Friction", (u, v - 6), size=13, colour=_FAINT)
        place = np.linspace(-1, 1, wide)
        colour = np.where(place[:, None] < 0, _KEEN, _HEAVY)
        dye = 1 - np.abs(place)[:, None] * (1 - colour)
        picture[v + 16 : v + 30, u : u + wide] = np.round(np.array(_ICE) * dye)
        for text, word, share in (
            (f"{low:.4f}", "keen", 0.0),
            (f"{middle:.4f}", "", 0.5),
            (f"{high:.4f}", "heavy", 1.0),
        ):
            write(picture, text, (u + share * wide, v + 33), size=12, colour=_BRIGHT, align=share)
            write(picture, word, (u + share * wide, v + 48), size=12, colour=_FAINT, align=share)

    # --- what lies on it -----------------------------------------------------------------------

    def _paint_stone(self, view: Canvas, centre: Floats, stone: DrawnStone) -> None:
        radius = self._radius
        view.disc(centre + np.array([0.022, 0.018]), radius, (176, 186, 196))
        view.disc(centre, radius, _GRANITE_EDGE)
        view.disc(centre, 0.93 * radius, _GRANITE)
        view.disc(centre, 0.72 * radius, _GRANITE_LIGHT)
        view.disc(centre, 0.60 * radius, stone.colour)
        # A heading of 0 points along play, and counter-clockwise is positive.
        heading = np.array([-np.sin(stone.theta), np.cos(stone.theta)])
        across = np.array([heading[1], -heading[0]])
        grip = [
            centre + along * radius * heading + side * 0.13 * radius * across
            for along, side in ((-0.42, -1), (0.62, -1), (0.62, 1), (-0.42, 1))
        ]
        view.polygon(grip, _deeper(stone.colour))
        view.disc(centre + 0.62 * radius * heading, 0.13 * radius, _deeper(stone.colour))
        view.disc(centre - 0.42 * radius * heading, 0.2 * radius, _deeper(stone.colour))
        view.line([grip[0], grip[1]], _BRIGHT, 1)

    def _paint_target(self, view: Canvas, aim: Floats) -> None:
        view.ring(aim, 0.20, _BRIGHT, 5)
        view.ring(aim, 0.20, _AIM, 2)
        for step in ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)):
            arm = np.array([0.12 * np.array(step), 0.30 * np.array(step)]) + aim
            view.line(arm, _BRIGHT, 5)
            view.line(arm, _AIM, 2)

    def _write_panel(self, picture: Image, scene: DrawnScene) -> None:
        write(picture, scene.title, (_MARGIN, 22), size=24, bold=True)
        left = _WIDTH - _MARGIN - _PANEL_WIDTH
        v = _house_top(self._strip) + 18
        for label, value in scene.facts:
            write(picture, label, (left + 18, v + 2), size=14, colour=_FAINT)
            write(picture, value, (left + _PANEL_WIDTH - 18, v), size=16, bold=True, align=1.0)
            v += 31


def _house_top(strip: Canvas) -> int:
    return _STRIP_TOP + strip.image.shape[0] + 44


def _deeper(colour: Colour) -> Colour:
    """Return the same colour, darker, to stand out on ice."""
    r, g, b = colour
    return (int(0.68 * r), int(0.68 * g), int(0.68 * b))
