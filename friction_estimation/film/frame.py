"""Frame of a film with colours converted only where they are read."""

from __future__ import annotations

from functools import cache

import numpy as np
from av.video.frame import VideoFrame

from curling_env.physics.compiled import compiled
from curling_env.typing import Image

USUAL_FORMAT = "yuv420p"
"""Format of nearly all films: brightness in every pixel, colour in every second row and column."""
BRIGHTNESS_FIRST = frozenset(
    {USUAL_FORMAT, "yuvj420p", "yuv422p", "yuvj422p", "yuv444p", "yuvj444p", "nv12", "gray"}
)
"""Formats whose first plane is the brightness, one byte per pixel."""
FULL_RANGE = 2
"""FFmpeg's number for brightness from 0 to 255; other films use 16 to 235."""


class LazyFrame:
    """Frame of a film, converted to BGR only where it is read: ``frame[rows, columns]``.

    Most of a frame is never read during tracking, and converting all of it takes as long as
    decoding.

    Parameters
    ----------
    stored : the frame from the decoder
    """

    def __init__(self, stored: VideoFrame) -> None:
        self._stored = stored
        self._turns = stored.rotation // 90 % 4
        lazy = (
            self._turns == 0
            and stored.color_range != FULL_RANGE
            and stored.format.name == USUAL_FORMAT
            and _rounded_alike()
        )
        self._whole = None if lazy else self.whole()
        self.shape = (stored.height, stored.width, 3) if self._whole is None else self._whole.shape

    def __getitem__(self, part: tuple[slice, slice]) -> Image:
        if self._whole is not None:
            return self._whole[part]
        (top, bottom, _), (left, right, _) = (
            side.indices(length) for side, length in zip(part, self.shape[:2], strict=True)
        )
        picture = np.empty((max(bottom - top, 0), max(right - left, 0), 3), dtype=np.uint8)
        _colour(*_planes(self._stored), top, left, picture)
        return picture

    def whole(self) -> Image:
        """Return all of it, (height, width, 3) BGR."""
        picture = np.asarray(self._stored.to_ndarray(format="bgr24"), dtype=np.uint8)
        return np.ascontiguousarray(np.rot90(picture, self._turns))


class CutFrame:
    """Part of a frame that can be read like the whole frame.

    Parameters
    ----------
    frame : the frame, which is not kept
    part : rows and columns; only pixels inside can be read
    """

    def __init__(self, frame: Image | LazyFrame, part: tuple[slice, slice]) -> None:
        self._part = frame[part].copy()
        self._top, self._left = part[0].start, part[1].start
        self.shape = frame.shape

    def __getitem__(self, part: tuple[slice, slice]) -> Image:
        (top, bottom, _), (left, right, _) = (
            side.indices(length) for side, length in zip(part, self.shape[:2], strict=True)
        )
        rows = slice(top - self._top, bottom - self._top)
        return self._part[rows, left - self._left : right - self._left]


Frame = Image | LazyFrame | CutFrame
"""Frame that can be read in parts, BGR."""


def brightness_of(stored: VideoFrame) -> Image:
    """Return the brightness of a frame, (height, width); not copied if stored as such."""
    if stored.format.name not in BRIGHTNESS_FIRST:
        return np.asarray(stored.to_ndarray(format="gray"), dtype=np.uint8)
    plane = stored.planes[0]
    rows = np.frombuffer(memoryview(plane), dtype=np.uint8).reshape(-1, plane.line_size)
    return rows[: stored.height, : stored.width]


def keep_one_field(stored: VideoFrame) -> None:
    """Keep every second line of an interlaced frame, in place; fill in those between.

    The lines of such a frame were taken alternately at two moments.
    """
    stored.make_writable()
    kind = np.uint16 if stored.format.components[0].bits > 8 else np.uint8
    for plane in stored.planes:
        rows = np.frombuffer(memoryview(plane), dtype=kind).reshape(plane.height, -1)
        kept = rows[::2].astype(np.uint32)
        between = rows[1::2]
        below = kept[1:] if len(between) < len(kept) else np.vstack([kept[1:], kept[-1:]])
        between[:] = (kept[: len(between)] + below + 1) // 2


def _planes(stored: VideoFrame) -> tuple[Image, Image, Image]:
    """Return the planes of a frame: brightness and the two colour differences."""
    light, blue, red = (
        np.frombuffer(memoryview(plane), dtype=np.uint8).reshape(-1, plane.line_size)
        for plane in stored.planes
    )
    return light, blue, red


@cache
def _rounded_alike() -> bool:
    """Return whether FFmpeg rounds like `_colour`, which depends on the processor."""
    noise = np.random.default_rng(0).integers(0, 256, (96, 64), dtype=np.uint8)
    frame = VideoFrame.from_ndarray(noise, format=USUAL_FORMAT)
    picture = np.empty((64, 64, 3), dtype=np.uint8)
    _colour(*_planes(frame), 0, 0, picture)
    return bool(np.array_equal(picture, frame.to_ndarray(format="bgr24")))


@compiled
def _colour(light, blue, red, top, left, picture):
    """Fill in the colours of a part of a frame, rounded as in FFmpeg's own conversion.

    Parameters
    ----------
    light, blue, red : (rows, columns) brightness, and the two colour differences (ITU-R BT.601) at
        half the resolution
    top, left : row and column in the frame of the part's upper left pixel
    picture : (rows, columns, 3) BGR
    """
    for i in range(picture.shape[0]):
        row = top + i
        for j in range(picture.shape[1]):
            column = left + j
            y = (8 * np.int32(light[row, column]) - 128) * 9539 >> 16
            u = 8 * np.int32(blue[row >> 1, column >> 1]) - 1024
            v = 8 * np.int32(red[row >> 1, column >> 1]) - 1024
            picture[i, j, 0] = min(max(y + (u * 16525 >> 16), 0), 255)
            picture[i, j, 1] = min(max(y + (u * -3209 >> 16) + (v * -6660 >> 16), 0), 255)
            picture[i, j, 2] = min(max(y + (v * 13075 >> 16), 0), 255)
