"""Renderer of the frames of a throw.

The sheet is rendered once. In every frame only stones and people that move are drawn into it, the
farthest ones first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import PAPER_SHEET, RULE_BOOK_STONE, Sheet, Stone
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Image
from friction_estimation.synthetic.film_spec import FilmSpec, all_on_film
from friction_estimation.synthetic.people import Cast, Person, draw_person
from friction_estimation.synthetic.ray_tracing import StoneShape
from friction_estimation.synthetic.sheet_drawing import PixelRays, paint_sheet
from friction_estimation.synthetic.stone_drawing import (
    PixelBox,
    StoneOnIce,
    draw_stones,
    stone_box,
)
from friction_estimation.synthetic.tuning import (
    HANDLE_COLOURS,
    NOISE_MARGIN_PX,
    SHADOW_REACH,
    STEPS_PER_GREY_LEVEL,
)


class FilmRenderer:
    """Renderer of throws on one sheet with one camera.

    Parameters
    ----------
    spec : specification of the films
    sheet, stone : the ice and the kind of stone
    resting : resting stones in every frame
    """

    def __init__(
        self,
        spec: FilmSpec,
        *,
        sheet: Sheet = PAPER_SHEET,
        stone: Stone = RULE_BOOK_STONE,
        resting: Sequence[StoneOnIce] = (),
    ) -> None:
        self.spec = spec
        self.sheet = sheet
        self.camera = spec.resolved()
        self.shape = StoneShape.of(stone)
        self.resting = tuple(resting)
        rng = np.random.default_rng(spec.seed)
        self._rays = PixelRays.of(self.camera)
        bare = paint_sheet(self._rays, sheet, light=spec.light, rng=rng)
        self._speckle = rng.standard_normal(65536, dtype=np.float32)
        self._bare = _to_steps(bare)
        self._still = self._bare.copy()
        self._resting_boxes = [self._box_of(stone) for stone in self.resting]
        for group in _touching(self._resting_boxes):
            box = _around([self._resting_boxes[k] for k in group])
            self._draw_stones(self._still, box, [self.resting[k] for k in group])
        self._noise: NDArray[np.int16] | None = None
        if spec.noise > 0:
            width, height = self.camera.size
            shape = (height + NOISE_MARGIN_PX, width + NOISE_MARGIN_PX, 3)
            grain = rng.standard_normal(shape, dtype=np.float32)
            grain *= STEPS_PER_GREY_LEVEL * spec.noise
            self._noise = np.rint(grain, out=grain).astype(np.int16)

    @property
    def still(self) -> Image:
        """Return the sheet with its resting stones, without noise and people, (height, width, 3)
        BGR.
        """
        return _to_frame(self._still, 1.0)

    def frames(
        self, trajectory: Trajectory, *, others: Sequence[Trajectory] = (), seed: int = 0
    ) -> Iterator[Image]:
        """Yield the frames of one throw, (height, width, 3) blue-green-red.

        Parameters
        ----------
        trajectory : the thrown stone's trajectory, sheet frame; its first sample is the release
        others : trajectories of the struck stones on the same clock; each stone rests until its
            first sample
        seed : number that gives throws with the same spec different noise and people
        """
        paths = all_on_film([trajectory, *others], self.spec)
        rng = np.random.default_rng([self.spec.seed, seed])
        cast = Cast(paths[0], self.spec.lead_in, self.sheet, rng) if self.spec.people else None
        moving = [_stones_along(path) for path in paths]
        picture = self._still.copy()
        touched: list[PixelBox] = []
        for k in range(len(paths[0])):
            for box in touched:
                picture[box.slices] = self._still[box.slices]
            touched = self._draw_moving(
                picture, [stones[k] for stones in moving], cast.at(k) if cast else []
            )
            yield self._expose(picture, rng)

    def _draw_moving(
        self,
        picture: NDArray[np.int16],
        moving: Sequence[StoneOnIce],
        people: Sequence[Person],
    ) -> list[PixelBox]:
        """Draw moving stones and people, the farthest first, and return the boxes drawn into."""
        drawings: list[tuple[float, PixelBox, Callable[[], None]]] = []
        for box, stones in self._grouped(moving):
            if len(stones) > 1:
                picture[box.slices] = self._bare[box.slices]
            paint = partial(self._draw_stones, picture, box, stones)
            foremost = np.array([stones[0].x, stones[0].y])
            drawings.append((self._distance(foremost), box, paint))
        for person in people:
            where = person.box(self.camera)
            if not where.empty:
                paint = partial(self._draw_person, picture, where, person)
                drawings.append((self._distance(person.position), where, paint))
        for _, _, paint in sorted(drawings, key=lambda drawing: -drawing[0]):
            paint()
        return [where for _, where, _ in drawings]

    def _grouped(self, moving: Sequence[StoneOnIce]) -> list[tuple[PixelBox, list[StoneOnIce]]]:
        """Return groups of stones that are drawn together: moving ones, and resting ones next to
        them.
        """
        stones = [*moving, *self.resting]
        boxes = [*(self._box_of(stone) for stone in moving), *self._resting_boxes]
        return [
            (_around([boxes[k] for k in group]), [stones[k] for k in sorted(group)])
            for group in _touching(boxes)
            if min(group) < len(moving)
        ]

    def _distance(self, position: Floats) -> float:
        return float(np.linalg.norm(np.array([*position, 0.1]) - self.camera.position))

    def _box_of(self, stone: StoneOnIce) -> PixelBox:
        return stone_box(self.camera, self.shape, stone, reach=SHADOW_REACH)

    def _draw_stones(
        self, picture: NDArray[np.int16], box: PixelBox, stones: Sequence[StoneOnIce]
    ) -> None:
        if box.empty:
            return
        patch = picture[box.slices] * np.float32(1 / STEPS_PER_GREY_LEVEL)
        draw_stones(
            patch,
            self._rays,
            box,
            stones,
            self.shape,
            light=self.spec.light,
            speckle=self._speckle,
            exposure=self.spec.exposure,
        )
        picture[box.slices] = _to_steps(patch)

    def _draw_person(self, picture: NDArray[np.int16], box: PixelBox, person: Person) -> None:
        patch = picture[box.slices] * np.float32(1 / STEPS_PER_GREY_LEVEL)
        draw_person(patch, self.camera, box, person, self.spec.light.shadow)
        picture[box.slices] = _to_steps(patch)

    def _expose(self, picture: NDArray[np.int16], rng: np.random.Generator) -> Image:
        """Return the frame that the sensor records: with noise and flicker, rounded to eight
        bits.
        """
        gain = 1.0 + self.spec.light.flicker * rng.standard_normal()
        if self._noise is not None:
            row, column = rng.integers(0, NOISE_MARGIN_PX, 2)
            height, width = picture.shape[:2]
            grain = self._noise[row : row + height, column : column + width]
            picture = np.asarray(cv2.add(picture, grain), dtype=np.int16)
            # `convertScaleAbs` takes absolute values, which would brighten noisy black pixels.
            np.maximum(picture, 0, out=picture)
        return _to_frame(picture, gain)


def _to_frame(picture: NDArray[np.int16], gain: float) -> Image:
    return np.asarray(
        cv2.convertScaleAbs(picture, alpha=gain / STEPS_PER_GREY_LEVEL), dtype=np.uint8
    )


def _stones_along(path: Trajectory) -> list[StoneOnIce]:
    """Return a stone in every frame of its path, with its velocity and the colour of its number."""
    velocity = np.zeros((1, 2))
    if len(path) > 1:
        velocity = np.asarray(np.gradient(path.xy, path.t, axis=0))
    return [
        StoneOnIce(
            x=float(x),
            y=float(y),
            theta=float(theta),
            vx=vx,
            vy=vy,
            colour=HANDLE_COLOURS[path.stone % len(HANDLE_COLOURS)],
        )
        for (x, y), theta, (vx, vy) in zip(path.xy, path.theta, velocity.tolist(), strict=True)
    ]


def _to_steps(picture: NDArray[np.float32]) -> NDArray[np.int16]:
    return np.rint(np.clip(picture, 0.0, 255.0) * STEPS_PER_GREY_LEVEL).astype(np.int16)


def _around(boxes: Sequence[PixelBox]) -> PixelBox:
    whole = boxes[0]
    for box in boxes[1:]:
        whole = whole.joined(box)
    return whole


def _touching(boxes: Sequence[PixelBox]) -> list[list[int]]:
    """Return indices of boxes in groups whose common boxes do not overlap; empty boxes are
    excluded.
    """
    groups: list[list[int]] = [[k] for k, box in enumerate(boxes) if not box.empty]
    merged = True
    while merged:
        merged = False
        for i in range(len(groups)):
            for j in range(i + 1, len(groups)):
                one = _around([boxes[k] for k in groups[i]])
                if one.meets(_around([boxes[k] for k in groups[j]])):
                    groups[i] += groups.pop(j)
                    merged = True
                    break
            if merged:
                break
    return groups
