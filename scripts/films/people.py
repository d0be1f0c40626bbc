"""People in films of known throws: a thrower, sweepers at work, a skip. Spheres and lines in depth.

They share no code with the people that the project renders. A sweeper brushes 5 to 15 cm ahead of
the stone's edge, bent over, for some seconds at a time; nearer parts are drawn later, so that
heads, arms and brooms hide the stone as in a camera.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from films.rink import View

Array = NDArray[np.floating[Any]]

SHOE, SKIN, PAD, SHAFT = (35, 35, 35), (110, 140, 190), (40, 40, 40), (60, 170, 205)
COATS = ((45, 45, 130), (50, 100, 60), (70, 60, 50), (120, 70, 40), (40, 40, 45))
HAIR = ((40, 55, 80), (70, 110, 150), (30, 30, 35))
SIDES = {"none": (), "left": (-1,), "right": (1,), "both": (-1, 1)}
"""Sides of the stone, from the thrower's view, on which sweepers go."""
HOUSE = 17.4
"""Position of the skip [m]."""
RELAX = 3.0
"""Time at which the thrower gets up [s]."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """Sphere, or rod with round ends if `to` is given; (3,) each, radius and colour."""

    at: Array
    radius: float
    colour: tuple[float, ...]
    to: Array | None = None


@dataclass(frozen=True, kw_only=True)
class Sweeper:
    """Sweeper: side -1 or 1, with an individual stride and broom."""

    side: int
    beside: float
    ahead: float
    rate: float
    phase: float
    gap: float
    bouts: tuple[tuple[float, float], ...]
    coat: tuple[float, ...]
    hair: tuple[float, ...]

    def parts(self, t: float, stone: Array, way: int) -> list[Part]:
        """Return all parts of the sweeper at a time since the release [s]."""
        across, along = np.array([way, 0.0, 0.0]), np.array([0.0, way, 0.0])
        up = np.array([0.0, 0.0, 1.0])

        def at(right: float, ahead: float, high: float) -> Array:
            return np.array([*stone[:2], 0.0]) + right * across + ahead * along + high * up

        s, a, b = self.side, self.ahead, self.beside
        step = np.sin(2 * np.pi * 1.1 * t + self.phase)
        sweeps = any(low <= t <= high for low, high in self.bouts)
        if sweeps:
            stroke = 0.09 * np.sin(2 * np.pi * self.rate * t + self.phase)
            pad = at(stroke + 0.04 * s, 0.143 + self.gap + 0.035, 0.02)
            hips, neck, head = (
                at(s * (b + 0.25), a, 0.85),
                at(s * b, a, 1.15),
                at(s * (b - 0.18), a, 1.25),
            )
        else:
            pad = at(s * (b - 0.1), a + 0.5, 0.02)
            hips, neck, head = (
                at(s * (b + 0.25), a, 0.95),
                at(s * (b + 0.2), a, 1.4),
                at(s * (b + 0.15), a + 0.05, 1.62),
            )
        hands = pad + 0.55 * (neck - 0.25 * up - pad)
        legs = [
            Part(at=at(s * (b + 0.3), a + 0.3 * f * step, 0.06), radius=0.07, colour=SHOE, to=hips)
            for f in (-1, 1)
        ]
        ends = [pad - 0.1 * across, pad + 0.1 * across]
        return [
            *legs,
            Part(at=hips, radius=0.17, colour=self.coat, to=neck),
            Part(at=neck, radius=0.05, colour=self.coat, to=hands),
            Part(at=head, radius=0.115, colour=self.hair),
            Part(at=pad, radius=0.014, colour=SHAFT, to=hands + 0.3 * (hands - pad)),
            Part(at=ends[0], radius=0.035, colour=PAD, to=ends[1]),
        ]  # fmt: skip


class People:
    """All people of one film.

    Parameters
    ----------
    sides : a name of `SIDES`
    path : times (n,) [s] since the release, and x, y and heading (n, 3) of the stone
    way : 1 towards y > 0, otherwise -1
    """

    def __init__(
        self, sides: str, path: tuple[Array, Array], way: int, rng: np.random.Generator
    ) -> None:
        self.sides = sides
        self._t, self._rows, self._way = *path, way
        self._hand = int(rng.choice([-1, 1]))
        coats = rng.permutation(len(COATS))
        self._coats = [COATS[k] for k in coats]
        self._hair = [HAIR[k] for k in rng.integers(len(HAIR), size=5)]
        last = float(self._t[-1])
        self._sweepers = []
        for k, side in enumerate(SIDES[sides]):
            first = rng.uniform(2.0, 5.0)
            pause = rng.uniform(0.35, 0.65) * last
            bouts = ((first, pause), (pause + rng.uniform(0.5, 3), last - rng.uniform(0.5, 3)))
            self._sweepers.append(
                Sweeper(side=side, beside=rng.uniform(0.5, 0.65),
                        ahead=rng.uniform(0.25, 0.6) + 0.35 * k,
                        rate=rng.uniform(2.0, 3.5), phase=rng.uniform(0, 6.28),
                        gap=rng.uniform(0.05, 0.15) + 0.1 * k, bouts=bouts,
                        coat=self._coats[k], hair=self._hair[k])
            )  # fmt: skip

    def parts(self, t: float, stone: Array) -> list[Part]:
        """Return all people at a time since the release [s], with the stone at x, y and heading
        (3,).
        """
        found = self._thrower(t, stone)
        for sweeper in self._sweepers:
            found += sweeper.parts(t, stone, self._way)
        return found + self._skip(t)

    def _thrower(self, t: float, stone: Array) -> list[Part]:
        way, hand = self._way, self._hand
        start = self._rows[0]
        fast = abs(self._rows[1, 1] - self._rows[0, 1]) / self._t[1]
        glide = 1.6 * (1 - np.exp(-max(t, 0.0) * fast / 1.6))  # slows down soon
        x, y = (stone[0], stone[1]) if t < 0 else (start[0], start[1] + way * glide)
        x -= 0.14 * hand * way

        def at(right: float, ahead: float, high: float) -> Array:
            return np.array([x + way * right, y + way * ahead, high])

        up = float(np.clip(t - RELAX, 0, 1))
        aside = -hand * 0.6 * max(t - RELAX, 0) if t < RELAX + 4 else -hand * 2.4
        hips, neck = at(aside, -0.75 + 0.2 * up, 0.35 + 0.55 * up), at(aside, -0.5, 0.5 + 0.9 * up)
        found = [
            Part(at=at(aside, -0.6, 0.08), radius=0.08, colour=SHOE, to=hips),
            Part(at=at(aside - 0.1, -1.5 + 0.9 * up, 0.08), radius=0.08, colour=SHOE, to=hips),
            Part(at=hips, radius=0.17, colour=self._coats[3], to=neck),
            Part(at=at(aside, -0.42 - 0.05 * up, 0.62 + 1.0 * up), radius=0.115,
                 colour=self._hair[3]),
        ]  # fmt: skip
        if t < 0.1:
            grip = np.array([stone[0], stone[1] - 0.05 * way, 0.16])
            found.append(Part(at=neck, radius=0.045, colour=self._coats[3], to=grip))
            found.append(Part(at=grip, radius=0.045, colour=SKIN))
        return found

    def _skip(self, t: float) -> list[Part]:
        way = self._way
        x, y = -0.5 * way + 0.15 * np.sin(0.4 * t), way * (HOUSE + 0.9 + 0.1 * np.sin(0.7 * t))
        hips, neck, head = (np.array([x, y, z]) for z in (0.9, 1.4, 1.62))
        shoe = np.array([x, y, 0.06])
        pad = np.array([x + 0.45 * way, y - 0.25 * way, 0.03])
        half = np.array([0.1, 0.0, 0.0])
        return [
            Part(at=shoe, radius=0.09, colour=SHOE, to=hips),
            Part(at=hips, radius=0.18, colour=self._coats[4], to=neck),
            Part(at=head, radius=0.115, colour=self._hair[4]),
            Part(at=pad, radius=0.014, colour=SHAFT, to=np.array([x + 0.2 * way, y, 1.1])),
            Part(at=pad - half, radius=0.035, colour=PAD, to=pad + half),
        ]


def walker(
    x: float, y: float, way: int, t: float, look: int, *, broom: bool = True, bent: float = 0.0
) -> list[Part]:
    """Return a person who walks, or stands.

    Parameters
    ----------
    x, y : place on the ice [m]
    way : 1 towards y > 0, otherwise -1
    t : time since they began to walk [s]
    look : index of coat and hair
    broom : true if they carry one
    bent : degree of bending down, 0 to 1
    """
    step = np.sin(2 * np.pi * t)
    hips, neck, head = (
        np.array([x, y, 0.92 - 0.3 * bent]),
        np.array([x, y + 0.35 * bent * way, 1.42 - 0.6 * bent]),
        np.array([x, y + (0.05 + 0.5 * bent) * way, 1.63 - 0.65 * bent]),
    )
    coat = COATS[look % len(COATS)]
    found = [
        Part(at=np.array([x + 0.12 * f, y + 0.28 * f * step * way, 0.06]), radius=0.07,
             colour=SHOE, to=hips)
        for f in (-1, 1)
    ]  # fmt: skip
    found += [
        Part(at=hips, radius=0.17, colour=coat, to=neck),
        Part(at=head, radius=0.115, colour=HAIR[look % len(HAIR)]),
    ]
    if broom:
        pad, half = np.array([x + 0.35, y + 0.7 * way, 0.03]), np.array([0.1, 0.0, 0.0])
        found += [
            Part(at=pad, radius=0.014, colour=SHAFT, to=np.array([x + 0.2, y, 1.2])),
            Part(at=pad - half, radius=0.035, colour=PAD, to=pad + half),
        ]
    return found


def draw(
    picture: Array, view: View, parts: list[Part], stone: Array, draw_stone: Callable[[], object]
) -> None:
    """Draw people and the stone into a picture, in place, the farthest first.

    Parameters
    ----------
    stone : (2,) its place; `draw_stone` draws it
    """
    centre = np.array([*stone, 0.06])

    def away(part: Part) -> float:
        middle = part.at if part.to is None else (part.at + part.to) / 2
        return float(np.linalg.norm(view.place - middle))

    own = float(np.linalg.norm(view.place - centre))
    drawn = False
    for part in sorted(parts, key=away, reverse=True):
        if not drawn and away(part) < own:
            draw_stone()
            drawn = True
        _draw_part(picture, view, part)
    if not drawn:
        draw_stone()


def _draw_part(picture: Array, view: View, part: Part) -> None:
    to = part.at if part.to is None else part.to
    line = to - view.place
    aside = np.cross(line, [0.0, 0.0, 1.0])
    aside *= part.radius / (np.linalg.norm(aside) + 1e-9)
    ends = view.pixels(np.array([part.at, to, to + aside, part.at + aside]))
    size = picture.shape[1], picture.shape[0]
    if (ends.min(axis=0) < -400).any() or (ends.max(axis=0) > np.array(size) + 400).any():
        return
    radii = [np.hypot(*(ends[3] - ends[0])), np.hypot(*(ends[2] - ends[1]))]
    q = [tuple(np.round(end * 16).astype(int).tolist()) for end in ends[:2]]
    for p, radius in zip(q, radii, strict=True):
        cv2.circle(picture, p, max(4, round(16 * radius)), part.colour, -1, cv2.LINE_AA, 4)
    if part.to is not None:
        along = ends[1] - ends[0]
        normal = np.array([-along[1], along[0]]) / (np.hypot(*along) + 1e-9)
        corners = np.array([ends[0] - radii[0] * normal, ends[0] + radii[0] * normal,
                            ends[1] + radii[1] * normal, ends[1] - radii[1] * normal])  # fmt: skip
        polygon = np.round(corners * 16).astype(np.int32)
        cv2.fillConvexPoly(picture, polygon, part.colour, cv2.LINE_AA, 4)
