"""The ice without what moves on it, and the moving blobs in front of it."""

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
from friction_estimation.camera.camera import Camera

PEOPLE_HEIGHT = 2.0
"""What lies around the sheet is kept up to this height [m], so that people are seen whole."""
MIN_CONTRAST = 14.0
"""Least difference of brightness (of 255) that counts as something in front of the ice."""
CORE_SHARE = 0.5
"""Of a blob's strongest contrast, what its solid core has; shadow and mirror image have less."""
STRIP_ROWS = 16
"""Medians are taken strip by strip, which stay in the processor's cache."""
LARGEST_CORE_PX = 40_000
"""Blobs whose box is larger than this are no stones, and keep their outline as it is."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Background:
    """The film's region around the sheet, free of what moved.

    Parameters
    ----------
    origin_px : column and row of the region's upper left pixel
    image : (rows, columns, 3) BGR, finer than whole grey levels
    noise : standard deviation of a pixel that nothing covers
    """

    origin_px: tuple[int, int]
    image: NDArray[np.float32]
    noise: float

    @cached_property
    def flat(self) -> Image:
        """The image in whole grey levels."""
        return self.image.astype(np.uint8)

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns of the region in a frame."""
        (u, v), (rows, columns) = self.origin_px, self.image.shape[:2]
        return slice(v, v + rows), slice(u, u + columns)


@dataclass(frozen=True, kw_only=True, eq=False)
class Blob:
    """Connected pixels that differ from the background.

    Parameters
    ----------
    low_px, high_px : (2,) bounding box of its solid core, inclusive [px]
    area_px : number of the core's pixels
    whole_px : (2,) width and height of all of it, with shadow and whatever touches it [px]
    darker : whether it is darker than the background in some colour, as all are but the empty
        places of things that lay there through most of the film
    """

    low_px: Floats
    high_px: Floats
    area_px: float
    whole_px: Floats
    darker: bool = True


def sheet_region(camera: Camera, sheet: Sheet, margin_px: int = 12) -> tuple[slice, slice]:
    """Rows and columns of the image that hold the visible ice and the people on it."""
    x = np.linspace(-sheet.width / 2, sheet.width / 2, 9)
    y = np.linspace(-sheet.length / 2, sheet.length / 2, 61)
    ground = np.array([(a, b) for a in x for b in y])
    points = np.concatenate(
        [np.column_stack([ground, np.full(len(ground), z)]) for z in (0.0, PEOPLE_HEIGHT)]
    )
    # Only points within the frame count: a lens polynomial means nothing far outside it.
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
    """The median of frames, refined by the mean of what agrees with it.

    Parameters
    ----------
    frames : whole BGR frames, spread over the film
    """
    parts = np.stack([frame[region] for frame in frames])
    middle = median_picture(parts)
    thinned = [cv2.absdiff(part[::3, ::3], middle[::3, ::3]) for part in parts]
    spread = [float(np.median(_strongest(difference))) for difference in thinned]
    noise = max(1.0, 1.4826 * float(np.median(spread)))
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
    return Background(origin_px=(region[1].start, region[0].start), image=total, noise=noise)


def _strongest(difference: Image) -> Image:
    """The largest of the three channels of every pixel."""
    blue, green, red = cv2.split(difference)
    return cv2.max(cv2.max(blue, green), red)


def median_picture(parts: NDArray[np.uint8]) -> Image:
    """Pixel by pixel the median of pictures (n, rows, columns, 3); the upper one of two."""
    middle = np.empty(parts.shape[1:], dtype=np.uint8)
    for row in range(0, parts.shape[1], STRIP_ROWS):
        middle[row : row + STRIP_ROWS] = _middle(list(parts[:, row : row + STRIP_ROWS].copy()))
    return middle


def _middle(parts: list[Image]) -> Image:
    """The median of pictures, which are overwritten.

    Of just over half of them, the least and the greatest cannot be it; the next takes their place.
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
        for i in range(len(pool) // 2):  # the lesser half goes first, the greater half last
            sort(i, last - i)
        for i in range(1, (last + 2) // 2):
            sort(0, i)
        for i in range((last + 1) // 2, last):
            sort(i, last)
        pool = pool[1:-1] + rest[:1]
        rest = rest[1:]
    return pool[0]


def moving_blobs(frame: Image, background: Background, min_area_px: float = 6.0) -> list[Blob]:
    """What differs from the background in a frame, labelled before anything is masked.

    A person is thus one blob, on the ice and beside it; masking the sheet first would cut a foot
    off that passes for a stone.
    """
    cut = np.ascontiguousarray(frame[background.slices])
    flat = background.flat
    difference = _strongest(cv2.absdiff(cut, flat))
    limit = max(MIN_CONTRAST, 5 * background.noise)
    mask = (cv2.blur(difference, (3, 3)) > limit).view(np.uint8)
    left, top, width, height = cv2.boundingRect(mask)
    if width == 0:
        return []
    part = slice(top, top + height), slice(left, left + width)
    cut, flat, difference = cut[part], flat[part], difference[part]
    _, labels, stats, _ = cv2.connectedComponentsWithStats(
        np.ascontiguousarray(mask[part]), connectivity=8
    )
    origin = np.add(background.origin_px, (left, top), dtype=np.float64)
    return [
        _blob(k, stat, labels, difference, cut, flat, origin)
        for k, stat in enumerate(stats[1:], start=1)
        if stat[4] >= min_area_px
    ]


def _blob(
    label: int,
    stat: NDArray[np.int32],
    labels: NDArray[np.int32],
    difference: Image,
    frame: Image,
    flat: Image,
    origin: Floats,
) -> Blob:
    """One blob, cut down to its solid core: what a soft shadow beside it adds is left out."""
    left, top, width, height, _ = (int(value) for value in stat)
    box = slice(top, top + height), slice(left, left + width)
    own = labels[box] == label
    if width * height <= LARGEST_CORE_PX:
        contrast = difference[box]
        strong = own & (contrast >= CORE_SHARE * np.quantile(contrast[own], 0.95))
        _, parts, part_stats, _ = cv2.connectedComponentsWithStats(
            strong.astype(np.uint8), connectivity=8
        )
        if len(part_stats) > 1:
            own = parts == 1 + int(np.argmax(part_stats[1:, 4]))
    rows, columns = np.nonzero(own)
    px = np.column_stack([columns, rows]) + np.array([left, top]) + origin
    return Blob(
        low_px=px.min(axis=0),
        high_px=px.max(axis=0),
        area_px=float(len(rows)),
        whole_px=np.array([width, height], dtype=np.float64),
        darker=bool((frame[box][own].mean(axis=0) < flat[box][own].mean(axis=0)).any()),
    )
