"""Detector of stones in a picture of the ice: a small network that ships with the package.

The network maps a picture in which a stone is `STONE_PX` wide to two maps of half its size: the
probabilities of the centre of a stone's foot and of a person. It was trained on drawn pictures
alone, by `scripts/train_detector.py`. Cameras see near stones large and far ones small, so the
picture is resampled once for each range of distances (`_scales`), by the known camera.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from curling_env.sheet import BACK_LINE_Y, TEE_Y, Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera

NETWORK_FILE = Path(__file__).with_name("stones.onnx")
STONE_PX = 16.0
"""Width of a stone in the pictures that the network sees [px]."""
STRIDE = 8
"""The network reduces a picture by powers of two to this part of its size."""
SURE, DOUBTFUL = 0.45, 0.2
"""Minimum scores of a stone, and of a doubtful one: in held-out drawn pictures 97 % of the
detections above the first were stones, and 31 % of those between both."""
BUTTON_ODDS = 0.44
"""Odds of a stone at a tee over those that its picture alone gives: if stones are small, the button
looks like one."""
ODDS_SLOPE, ODDS_AT_HALF = 0.8, 1.0
"""Log odds of a stone from the network's score: slope and offset of its log odds."""
HIGHEST_SCORE = 0.999
"""Scores above this one count as this one."""
ERROR_PX = 0.9
"""Standard error of a place in each direction, in the pictures that the network sees [px]."""
SCALE_STEP = 0.1
"""Maximum logarithm of the ratio of stone sizes in one resampled picture."""
ONE_STONE = 0.35
"""Maximum distance between detections of one stone, or of a stone at a tee from it, as a share of a
stone's width."""
MIN_STONE_PX = 3.0
"""Minimum width of detected stones [px]."""
GRID = 0.25
"""Distance between places on the ice at which the size of stones is computed [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Detection:
    """Detection of a stone in a picture.

    Parameters
    ----------
    px : (2,) centre of its foot [px]
    score : 0 to 1, higher for clearer stones; from `SURE` on it is one
    person : 0 to 1, how likely a person is seen there
    """

    px: Floats
    score: float
    person: float


@dataclass(frozen=True, kw_only=True, eq=False)
class DetectedPlace:
    """Detected stone, or candidate, on the ice.

    Parameters
    ----------
    xy : (2,) its place [m]
    covariance : (2, 2) of the place, without the camera's errors [m²]
    px : (2,) centre of its foot in the picture [px]
    score, person : as in `Detection`; a stone on the button needs a clearer picture
    in_play : False beyond the back lines, where stones are parked
    """

    xy: Floats
    covariance: Floats
    px: Floats
    score: float
    person: float
    in_play: bool

    @property
    def is_sure(self) -> bool:
        """False for a doubtful candidate."""
        return self.score >= SURE

    @property
    def log_odds(self) -> float:
        """Log odds of a stone."""
        score = min(self.score, HIGHEST_SCORE)
        return ODDS_SLOPE * math.log(score / (1 - score)) + ODDS_AT_HALF


class DetectorNetwork:
    """The network, ready to run.

    Parameters
    ----------
    file : its ONNX file
    """

    def __init__(self, file: Path = NETWORK_FILE) -> None:
        # OpenCV's older engine runs this network in 60 % of the time of its new one.
        self._network = cv2.dnn.readNetFromONNX(str(file), cv2.dnn.ENGINE_CLASSIC)

    def detect(self, picture: Image, *, mirrored: bool = True) -> list[Detection]:
        """Find stones in a picture in which they are about `STONE_PX` wide, highest scores first.

        Parameters
        ----------
        picture : (rows, columns, 3) BGR
        mirrored : whether the network is shown the mirror image as well
        """
        stones, people = self._maps(picture, mirrored=mirrored)
        highest = cv2.dilate(stones, np.ones((5, 5)))
        found: list[Detection] = []
        for y, x in zip(*np.nonzero((stones == highest) & (stones >= DOUBTFUL)), strict=True):
            top, left = max(y - 2, 0), max(x - 2, 0)
            around = stones[top : y + 3, left : x + 3]
            down, right = np.mgrid[: around.shape[0], : around.shape[1]]
            middle = np.array([(around * right).sum(), (around * down).sum()]) / around.sum()
            found.append(
                Detection(
                    px=2 * (middle + np.array([left, top])) + 0.5,
                    score=float(stones[y, x]),
                    person=float(people[y, x]),
                )
            )
        return sorted(found, key=lambda one: -one.score)

    def _maps(self, picture: Image, *, mirrored: bool) -> Floats:
        """(2, rows / 2, columns / 2) probabilities of a stone's centre and of a person.

        Means of the logits of the picture and of its mirror image: a quarter fewer false stones
        for twice the time.
        """
        rows, columns = picture.shape[:2]
        # Of an even number of columns, halves of the mirror image lie on those of the picture.
        even = cv2.copyMakeBorder(picture, 0, rows % 2, 0, columns % 2, cv2.BORDER_REPLICATE)
        logits = self._logits(np.asarray(even, dtype=np.uint8))
        if mirrored:
            other = self._logits(np.ascontiguousarray(even[:, ::-1], dtype=np.uint8))
            logits = (logits + other[..., ::-1]) / 2
        return 1 / (1 + np.exp(-logits))

    def _logits(self, picture: Image) -> Floats:
        """(2, rows / 2, columns / 2) of a picture with even numbers of rows and columns."""
        rows, columns = picture.shape[:2]
        padded = cv2.copyMakeBorder(
            picture, 0, -rows % STRIDE, 0, -columns % STRIDE, cv2.BORDER_REPLICATE
        )
        grey, size = (127.5, 127.5, 127.5), (padded.shape[1], padded.shape[0])
        self._network.setInput(cv2.dnn.blobFromImage(padded, 1 / 255, size, grey, swapRB=True))
        logits = np.asarray(self._network.forward(), dtype=np.float64)[0]
        return logits[:, : rows // 2, : columns // 2]


class StoneFinder:
    """Finder of stones on the ice in the pictures of one camera.

    Parameters
    ----------
    camera : whose pictures are searched
    model : a stone; its size counts
    sheet : outside of it nothing is looked for
    quick : whether the network never sees a picture's mirror image as well; else it sees that of
        whole pictures, but not of parts, which are many
    """

    def __init__(
        self, camera: Camera, model: StoneModel, sheet: Sheet, *, quick: bool = False
    ) -> None:
        self._network, self._quick = DetectorNetwork(), quick
        self.camera, self._model, self._sheet = camera, model, sheet
        self._scales = list(_scales(camera, model, sheet))

    @property
    def sees_stones(self) -> bool:
        """False where all stones are narrower than `MIN_STONE_PX`, or out of view."""
        return bool(self._scales)

    def detect(self, picture: Image, boxes: Floats | None = None) -> list[DetectedPlace]:
        """Find the stones on the sheet in a picture, highest scores first.

        Parameters
        ----------
        picture : (rows, columns, 3) BGR, of the camera's size
        boxes : (k, 2, 2) parts to search, each by its upper left and lower right corner [px];
            None: all of the picture

        Returns
        -------
        stones and what may be one, whose foot is in the picture and on the sheet
        """
        mirrored = boxes is None and not self._quick
        found = [
            one
            for box, factor in self._scales
            for part in ([box] if boxes is None else _parts(box, boxes, 1.5 * STONE_PX / factor))
            for one in self._within(picture, part, factor, mirrored=mirrored)
            if abs(np.log(self._width_px(one.xy) * factor / STONE_PX)) <= 0.75 * SCALE_STEP
        ]
        found.sort(key=lambda place: -place.score)
        apart: list[DetectedPlace] = []
        for place in found:
            reach = ONE_STONE * self._width_px(place.xy)
            if all(np.linalg.norm(place.px - other.px) > reach for other in apart):
                apart.append(place)
        return apart

    def _within(
        self,
        picture: Image,
        box: tuple[int, int, int, int],
        factor: float,
        *,
        mirrored: bool,
    ) -> list[DetectedPlace]:
        left, top, right, below = box
        part = picture[top:below, left:right]
        if min(part.shape[:2]) * factor <= 0.5:  # nothing is left of it
            return []
        kind = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
        resized = np.asarray(
            cv2.resize(part, None, fx=factor, fy=factor, interpolation=kind), dtype=np.uint8
        )
        # The rounded sizes are used, because positions are accurate to a tenth of a pixel.
        exact = np.array([resized.shape[1] / part.shape[1], resized.shape[0] / part.shape[0]])
        places: list[DetectedPlace] = []
        for one in self._network.detect(resized, mirrored=mirrored):
            px = (one.px + 0.5) / exact - 0.5 + [left, top]
            (xy,) = self.camera.on_plane(px[None])
            if _is_on(self._sheet, xy, self._model.radius):
                places.append(
                    DetectedPlace(
                        xy=xy,
                        covariance=_covariance(self.camera, xy, factor),
                        px=px,
                        score=_score_at(xy, one.score, self._model),
                        person=one.person,
                        in_play=bool(abs(xy[1]) < BACK_LINE_Y + self._model.radius),
                    )
                )
        return places

    def _width_px(self, xy: Floats) -> float:
        return float(stone_width_px(self.camera, xy[None], self._model)[0])


def _score_at(xy: Floats, score: float, model: StoneModel) -> float:
    """Score of a stone at a place on the ice, from that of its picture."""
    if np.hypot(xy[0], abs(xy[1]) - TEE_Y) > ONE_STONE * 2 * model.radius:
        return score
    return BUTTON_ODDS * score / (BUTTON_ODDS * score + 1 - score)


def stone_width_px(camera: Camera, xy: Floats, model: StoneModel) -> Floats:
    """Width of a stone in the picture at places (n, 2) on the ice, (n,) [px]."""
    return 2 * model.radius * camera.scale(xy, model.height / 2)


def _parts(
    whole: tuple[int, int, int, int], boxes: Floats, margin: float
) -> list[tuple[int, int, int, int]]:
    """Parts (left, top, right, below) of a part of the picture that cover boxes with a margin.

    Boxes that are near each other are covered together.
    """
    left, top, right, below = whole
    cells = np.zeros((-(-(below - top) // STRIDE), -(-(right - left) // STRIDE)), np.uint8)
    for low, high in boxes:
        first = np.maximum(np.floor((low - margin - [left, top]) / STRIDE), 0).astype(int)
        last = np.ceil((high + margin - [left, top]) / STRIDE).astype(int)
        cells[first[1] : max(last[1], 0), first[0] : max(last[0], 0)] = 1
    _, _, found, _ = cv2.connectedComponentsWithStats(cells)
    parts: list[tuple[int, int, int, int]] = []
    for x, y, columns, rows, _ in (STRIDE * found[1:]).tolist():
        begin = left + x, top + y
        end = min(begin[0] + columns, right), min(begin[1] + rows, below)
        parts.append((*begin, *end))
    return parts


def _covariance(camera: Camera, xy: Floats, factor: float) -> Floats:
    """(2, 2) covariance of a detected place on the ice [m²]; NaN if it is not on the ice."""
    if not np.isfinite(xy).all():
        return np.full((2, 2), np.nan)
    back = np.linalg.inv(camera.px_per_metre(xy))
    return (ERROR_PX / factor) ** 2 * back @ back.T


def _scales(
    camera: Camera, model: StoneModel, sheet: Sheet
) -> Iterator[tuple[tuple[int, int, int, int], float]]:
    """Parts of the picture (left, top, right, below) and the factors by which to resample them."""
    half = np.array([sheet.width, sheet.length]) / 2
    x, y = (np.linspace(-side, side, round(2 * side / GRID) + 1) for side in half)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    px = camera.project(np.column_stack([places, np.zeros(len(places))]))
    with np.errstate(invalid="ignore"):
        seen = ((px > -0.5) & (px < np.array(camera.size) - 0.5)).all(axis=1)
        # Far outside the view, the formula of a lens may fold back into the picture.
        seen &= np.linalg.norm(camera.on_plane(px) - places, axis=1) < GRID
    places, px = places[seen], px[seen]
    width = stone_width_px(camera, places, model)
    wide_enough = width >= MIN_STONE_PX
    if not wide_enough.any():
        return
    size, px = np.log(width[wide_enough]), px[wide_enough]
    count = max(1, int(np.ceil(np.ptp(size) / SCALE_STEP)))
    edges = np.linspace(size.min(), size.max(), count + 1)
    for low, high in pairwise(edges):
        here = px[(size >= low) & (size <= high)]
        if len(here) == 0:
            continue
        margin = 1.5 * np.exp(high)  # stones are higher than the ice, and need surroundings
        first = np.maximum(np.floor(here.min(axis=0) - margin), 0).astype(int)
        last = np.minimum(np.ceil(here.max(axis=0) + margin) + 1, camera.size).astype(int)
        yield (first[0], first[1], last[0], last[1]), float(STONE_PX / np.exp((low + high) / 2))


def _is_on(sheet: Sheet, xy: Floats, radius: float) -> bool:
    """Return whether a stone's centre is on the sheet, as near to its border as a stone may lie."""
    room = np.array([sheet.width, sheet.length]) / 2 - np.abs(xy)
    return bool((room > radius / 2).all())
