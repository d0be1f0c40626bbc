"""Single pictures: read with a clear message, written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from curling_env.errors import InputError
from curling_env.infrastructure.storage import atomic_path
from curling_env.typing import Image

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Endings of files that are read as one picture instead of a film."""


def read_picture(path: str | Path, *, grey: bool = False) -> Image:
    """A picture, (height, width, 3) BGR or (height, width) grey.

    Raises
    ------
    InputError : missing, or not a picture
    """
    if not Path(path).exists():
        raise InputError("no such picture", source=path)
    try:
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR)
    except cv2.error:
        picture = None
    if picture is None:
        raise InputError("not a picture that can be read", source=path)
    return np.asarray(picture, dtype=np.uint8)


def write_picture(path: str | Path, picture: Image) -> None:
    """Write a picture as PNG, complete or not at all."""
    with atomic_path(path) as draft:
        draft.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
