"""The empty ice without moving objects, and the blobs that move in front of it."""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import PictureChannels
from friction_estimation.camera.camera import Camera
from friction_estimation.film.frame import Frame
from friction_estimation.tracking import tuning

_STEP = 0.05
"""Distance along the sheet between the points that are projected to find its picture [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Background:
    """Part of the picture around the sheet, without objects that moved in the film.

    Parameters
    ----------
    origin_px : column and row of the part's upper left pixel in a frame
    image : (rows, columns, 3) BGR, finer than whole grey levels where it is the mean of frames
    noise : standard deviation of an uncovered pixel in its noisiest colour, of 255 grey levels
    grain : the same of its brightness
    """

    origin_px: tuple[int, int]
    image: NDArray[np.float32] | Image
    noise: float
    grain: float = 0.0

    @cached_property
    def flat(self) -> Image:
        """The image in whole grey levels."""
        return self.image.astype(np.uint8, copy=False)

    @cached_property
    def channels(self) -> PictureChannels:
        """The image in the channels in which stones are fitted, (rows, columns, 3)."""
        return PictureChannels(self.image)

    @property
    def strong_grain(self) -> float:
        """Grain that hides much of a stone [grey levels]; 0 for weaker grain."""
        return self.grain if self.noise > tuning.PLAIN_NOISE else 0.0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns of the part in a frame."""
        (u, v), (rows, columns) = self.origin_px, self.image.shape[:2]
        return slice(v, v + rows), slice(u, u + columns)


@dataclass(frozen=True, kw_only=True, eq=False)
class Blob:
    """Connected pixels that differ from the background.

    Parameters
    ----------
    low_px, high_px : (2,) bounding box of its solid core, inclusive [px]
    area_px : number of pixels in the core
    whole_px : (2,) width and height of all of it, with its shadow and anything that touches it [px]
    darker : whether it is darker than the background in some colour. Only the empty place of
        something that lay there through most of the film is not.
    """

    low_px: Floats
    high_px: Floats
    area_px: float
    whole_px: Floats
    darker: bool = True


def sheet_region(
    camera: Camera, sheet: Sheet, margin_px: int = tuning.KNOWN_LENS_MARGIN_PX
) -> tuple[slice, slice]:
    """Rows and columns of the picture that show the ice and the people on it.

    Parameters
    ----------
    margin_px : pixels that are kept around
    """
    x = np.linspace(-sheet.width / 2, sheet.width / 2, 9)
    y = np.linspace(-sheet.length / 2, sheet.length / 2, round(sheet.length / _STEP) + 1)
    ice = np.array([(a, b) for a in x for b in y])
    points = np.concatenate(
        [np.column_stack([ice, np.full(len(ice), z)]) for z in (0.0, tuning.PEOPLE_HEIGHT)]
    )
    # Only points within the frame count: far outside it a lens polynomial is meaningless.
    seen = points[camera.sees(points)]
    px = camera.project(seen) if len(seen) else np.array([[0.0, 0.0], camera.size])
    low = np.floor(px.min(axis=0) - margin_px).astype(int)
    high = np.ceil(px.max(axis=0) + margin_px).astype(int) + 1
    width, height = camera.size
    return (
        slice(max(int(low[1]), 0), min(int(high[1]), height)),
        slice(max(int(low[0]), 0), min(int(high[0]), width)),
    )


def find_background(frames: Sequence[Image], region: tuple[slice, slice]) -> Background:
    """Compute the empty ice: the median of frames, refined by the mean of all pixels that agree
    with it.

    Parameters
    ----------
    frames : whole BGR frames, spread over the film
    region : rows and columns of the part that is kept
    """
    parts = [frame[region] for frame in frames]
    middle = median_picture(parts)
    few = middle[::3, ::3]
    spread = [float(np.median(_strongest(cv2.absdiff(part[::3, ::3], few)))) for part in parts]
    noise = max(1.0, 1.4826 * float(np.median(spread)))
    grains = [float(np.median(cv2.absdiff(grey(part[::3, ::3]), grey(few)))) for part in parts]
    limit = max(4.0, 3 * noise)
    total = np.zeros(middle.shape, dtype=np.float32)
    count = np.zeros(middle.shape[:2], dtype=np.uint8)
    for part in parts:
        still = (_strongest(cv2.absdiff(part, middle)) <= limit).view(np.uint8)
        cv2.accumulate(part, total, mask=still)
        count += still
    np.divide(total, count[..., None], out=total, where=count[..., None] > 0)
    nowhere = count == 0
    total[nowhere] = middle[nowhere]
    return Background(
        origin_px=(region[1].start, region[0].start),
        image=total,
        noise=noise,
        grain=1.4826 * float(np.median(grains)),
    )


def grey(picture: Image) -> Image:
    return cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)


def _strongest(difference: Image) -> Image:
    """Return the largest of the three channels of every pixel."""
    blue, green, red = colours(difference)
    return cv2.max(cv2.max(blue, green), red)


def colours(picture: Image) -> list[Image]:
    """Return the three channels of a picture; OpenCV's `split` takes five times as long."""
    return [cv2.extractChannel(picture, k) for k in range(3)]


def median_picture(parts: Sequence[Image]) -> Image:
    """Return the upper median of pictures (rows, columns, 3) at every pixel."""
    middle = np.empty(parts[0].shape, dtype=np.uint8)
    rows = 16  # a strip that stays in the processor's cache
    for row in range(0, len(middle), rows):
        middle[row : row + rows] = _middle([part[row : row + rows].copy() for part in parts])
    return middle


def _middle(parts: list[Image]) -> Image:
    """Return the median of pictures, which are overwritten.

    The minimum and the maximum of half of the pictures plus two cannot be the median of all. They
    are dropped, and the next picture is added, until one is left.
    """
    if len(parts) % 2 == 0:
        parts.append(np.full_like(parts[0], 255))
    spare = np.empty_like(parts[0])

    def sort(i: int, j: int) -> None:
        nonlocal spare
        np.minimum(pool[i], pool[j], out=spare)
        np.maximum(pool[i], pool[j], out=pool[j])
        pool[i], spare = spare, pool[i]

    pool, rest = parts[: len(parts) // 2 + 2], parts[len(parts) // 2 + 2 :]
    while len(pool) > 2:
        last = len(pool) - 1
        for i in range(len(pool) // 2):  # smaller values to the first half, larger ones to the last
            sort(i, last - i)
        for i in range(1, (last + 2) // 2):
            sort(0, i)
        for i in range((last + 1) // 2, last):
            sort(i, last)
        pool = pool[1:-1] + rest[:1]
        rest = rest[1:]
    return pool[0]


def moving_blobs(frame: Frame, background: Background, min_area_px: float = 6.0) -> list[Blob]:
    """Return the connected parts of a frame that differ from the background.

    They are found before the sheet is cut out, so that a person at its edge is one large blob, not
    a foot that could be mistaken for a stone.

    Parameters
    ----------
    min_area_px : smaller blobs are ignored
    """
    cut = np.ascontiguousarray(frame[background.slices])
    flat = background.flat
    noise = background.noise
    if noise > tuning.PLAIN_NOISE:  # else no stone stands out from the grain
        cut, noise = cv2.blur(cut, (3, 3)), noise * tuning.NOISE_AFTER_BLUR
    difference = _strongest(cv2.absdiff(cut, flat))
    limit = max(tuning.MIN_CONTRAST, tuning.NOISE_TIMES * noise)
    mask = (cv2.blur(difference, (3, 3)) > limit).view(np.uint8)
    left, top, width, height = cv2.boundingRect(mask)
    if width == 0:
        return []
    part = slice(top, top + height), slice(left, left + width)
    cut, flat, difference = cut[part], flat[part], difference[part]
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(np.ascontiguousarray(mask[part]))
    origin = np.add(background.origin_px, (left, top), dtype=np.float64)
    return [
        _blob(k, box, labels, difference, cut, flat, origin)
        for k, box in enumerate(boxes)
        if k and box[4] >= min_area_px
    ]


def _blob(
    label: int,
    box: NDArray[np.int32],
    labels: NDArray[np.int32],
    difference: Image,
    frame: Image,
    flat: Image,
    origin: Floats,
) -> Blob:
    """Return a blob with its solid core, without the soft shadow beside it."""
    left, top, width, height, _ = box.tolist()
    part = slice(top, top + height), slice(left, left + width)
    own = labels[part] == label
    if width * height <= tuning.MAX_CORE_BOX_PX:
        contrast = difference[part]
        strong = own & (contrast >= tuning.CORE_CONTRAST_SHARE * np.quantile(contrast[own], 0.95))
        _, cores, core_boxes, _ = cv2.connectedComponentsWithStats(strong.view(np.uint8))
        if len(core_boxes) > 1:
            own = cores == 1 + int(np.argmax(core_boxes[1:, 4]))
    # Only its sides: a blob may be as large as the picture.
    columns, rows = (np.flatnonzero(own.any(axis=axis)) for axis in (0, 1))
    low, high = ((left + columns[k], top + rows[k]) for k in (0, -1))
    return Blob(
        low_px=origin + np.array(low),
        high_px=origin + np.array(high),
        area_px=float(np.count_nonzero(own)),
        whole_px=np.array([width, height], dtype=np.float64),
        darker=bool((frame[part][own].mean(axis=0) < flat[part][own].mean(axis=0)).any()),
    )
