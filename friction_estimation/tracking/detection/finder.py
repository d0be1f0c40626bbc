"""Detections of the network in parts of a picture, as log odds for the association."""

from __future__ import annotations

import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking.detection.detector import SURE, Detector, OnIce

ODDS_SLOPE, ODDS_AT_HALF = 0.8, 1.0
"""Log odds of a stone from the network's score: slope and offset of its log odds."""
HIGHEST_SCORE = 0.999


def log_odds(score: Floats | float) -> Floats:
    """Log odds of a stone from the network's score."""
    return ODDS_SLOPE * np.log(np.divide(score, 1 - np.asarray(score))) + ODDS_AT_HALF


SURELY_A_STONE = float(log_odds(SURE))
"""Minimum log odds of a stone on unchanged ice."""


class NetworkFinder:
    """Finder of stones in a picture, or in parts of one.

    Parameters
    ----------
    camera, sheet, model : camera of the pictures, the ice, and the shape of a stone
    quick : whether no picture is shown to it with its mirror image; else whole ones are, and boxes,
        which are many, are not
    """

    def __init__(
        self, camera: Camera, sheet: Sheet, model: StoneModel, *, quick: bool = False
    ) -> None:
        self._on_ice = OnIce(Detector(), camera, model, sheet)
        self._quick = quick

    def __call__(self, picture: Image, boxes: Floats | None = None, /) -> tuple[Floats, Floats]:
        """Find stones in a picture, or in boxes (k, 2, 2) of it [px].

        Returns
        -------
        (n, 2) places on the ice [m] and (n,) log odds of a stone
        """
        found = self._on_ice.detect(picture, boxes, mirrored=boxes is None and not self._quick)
        score = np.array([min(one.score, HIGHEST_SCORE) for one in found])
        places = np.array([one.xy for one in found]).reshape(-1, 2)
        return places, log_odds(score)
