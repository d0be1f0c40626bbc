"""An address as a QR code, in the terminal or on a page, for the camera of a phone or tablet."""

from __future__ import annotations

import cv2
import numpy as np

from curling_env.typing import Flags

QUIET = 2
"""Width of the empty border [modules]."""


def qr_code(text: str) -> str:
    """Return a QR code in half blocks, dark on light for any colours of the terminal.

    Parameters
    ----------
    text : content, such as an address
    """
    dark = _modules(text)
    if len(dark) % 2:
        dark = np.pad(dark, ((0, 1), (0, 0)))
    blocks = {(False, False): "█", (False, True): "▀", (True, False): "▄", (True, True): " "}
    rows = (
        "".join(blocks[bool(a), bool(b)] for a, b in zip(upper, lower, strict=True))
        for upper, lower in zip(dark[::2], dark[1::2], strict=True)
    )
    return "\n".join(f"\033[97;40m{row}\033[0m" for row in rows)


def qr_outline(text: str) -> tuple[int, str]:
    """Return a QR code as an SVG path of unit squares.

    Returns
    -------
    the width and height of the whole code, and the path's data
    """
    dark = _modules(text)
    squares = (f"M{x} {y}h1v1h-1z" for y, x in np.argwhere(dark).tolist())
    return len(dark), "".join(squares)


def _modules(text: str) -> Flags:
    """Return one pixel per module, with an empty border."""
    return np.pad(np.asarray(cv2.QRCodeEncoder.create().encode(text)) < 128, QUIET)
