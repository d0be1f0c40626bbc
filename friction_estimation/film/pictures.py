"""Single pictures: read with a clear message, written completely or not at all."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np

from curling_env.errors import InputError, OutputError
from curling_env.infrastructure.files import limits
from curling_env.infrastructure.files.reading import ordinary_file, read_bytes
from curling_env.infrastructure.files.writing import atomic_path
from curling_env.typing import Image

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Suffixes of files that are read as one picture instead of a film."""


def read_picture(path: str | Path, *, grey: bool = False) -> Image:
    """Read a picture, (height, width, 3) BGR or (height, width) grey.

    Raises
    ------
    InputError : missing, not a picture (PNG, JPEG, BMP or TIFF), or one of too many pixels
    """
    ordinary_file(path, "picture")
    content = read_bytes(path, most=limits.MAX_PICTURE_BYTES)
    size = size_of_picture(content)
    if size is None or min(size) < 1:
        raise InputError("cannot be read; expected a picture", source=path)
    if size[0] * size[1] > limits.MAX_PICTURE_PIXELS:
        raise InputError(
            f"has {size[0]} × {size[1]} pixels; expected at most "
            f"{limits.MAX_PICTURE_PIXELS // 10**6} million",
            source=path,
        )
    try:
        picture = cv2.imdecode(
            np.frombuffer(content, dtype=np.uint8),
            cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR,
        )
    except (cv2.error, MemoryError):
        picture = None
    if picture is None:
        raise InputError("cannot be read; expected a picture", source=path)
    return np.asarray(picture, dtype=np.uint8)


def write_picture(path: str | Path, picture: Image) -> None:
    """Write a picture as PNG, completely or not at all.

    Raises
    ------
    OutputError : see `atomic_path`, or a picture without pixels
    """
    if not picture.size:
        raise OutputError(f"{path}: a picture without pixels cannot be written")
    with atomic_path(path) as draft:
        draft.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


# --- size of a picture from its header ----------------------------------------------------------


def size_of_picture(content: bytes) -> tuple[int, int] | None:
    """Return width and height from the header of a PNG, JPEG, BMP or TIFF; None for another file.

    The size is checked before the picture is decoded, because a few bytes can claim any size.
    """
    try:
        if content[:8] == b"\x89PNG\r\n\x1a\n":
            width, height = struct.unpack(">II", content[16:24])
        elif content[:2] == b"\xff\xd8":
            return _jpeg_size(content)
        elif content[:2] == b"BM":
            width, height = struct.unpack("<ii", content[18:26])
        elif content[:4] in (b"II*\x00", b"MM\x00*"):
            return _tiff_size(content)
        else:
            return None
    except struct.error:
        return None
    return abs(width), abs(height)


def _jpeg_size(content: bytes) -> tuple[int, int] | None:
    at = 2
    while at + 9 < len(content):
        if content[at] != 0xFF:
            return None
        kind = content[at + 1]
        if kind == 0xFF or kind == 0x01 or 0xD0 <= kind <= 0xD8:  # padding, or without a length
            at += 1 if kind == 0xFF else 2
            continue
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", content[at + 5 : at + 9])
            return width, height
        at += 2 + struct.unpack(">H", content[at + 2 : at + 4])[0]
    return None


def _tiff_size(content: bytes) -> tuple[int, int] | None:
    order = "<" if content[:2] == b"II" else ">"
    start = struct.unpack(f"{order}I", content[4:8])[0]
    count = struct.unpack(f"{order}H", content[start : start + 2])[0]
    sides: dict[int, int] = {}
    for k in range(count):
        entry = content[start + 2 + 12 * k : start + 14 + 12 * k]
        tag, kind = struct.unpack(f"{order}HH", entry[:4])
        if tag in (256, 257):
            short = kind == 3
            sides[tag] = struct.unpack(
                f"{order}{'H' if short else 'I'}", entry[8 : 10 if short else 12]
            )[0]
    return (sides[256], sides[257]) if len(sides) == 2 else None
