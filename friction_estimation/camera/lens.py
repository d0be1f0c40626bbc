"""What of a lens may be unknown, what lenses are like, and a camera changed by as much.

Two terms of the distortion bend what a rink camera shows; they and the focal length are what the
paint must tell. The rest is small: a third term, a lens that sits askew, an axis beside the middle
of the picture. Left out, it misplaces a track by a centimetre. So it is sought as well, drawn to
what lenses are like, and where the paint says nothing of it, it stays in the doubt of a place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera

BEND_SPREAD = (0.3, 0.3)
"""How far the two leading terms of distortion move the end of the image's longer side, as a share
of its half."""
MINOR_SPREAD = (0.001, 0.001, 0.001)
"""The same of the third term, and of the two of a lens that sits askew."""
AXIS_SPREAD = 0.015
"""How far the axis of a whole picture lies from its middle, in halves of its longer side."""
CUT_SPREAD = 0.2
"""The same where the picture was cut out of another."""
ASPECT_SPREAD = 0.06
"""How far such a picture may be stretched, in log."""
POWERS = np.array([2, 4, 6, 1, 1])
"""Of the half width over the focal length by which k1 k2 k3 p1 p2 become shares."""
IN_OPENCV = np.array([0, 1, 4, 2, 3])
"""Places of k1 k2 k3 p1 p2 in the distortion."""


@dataclass(frozen=True, kw_only=True)
class FreeLens:
    """What of a lens is not known.

    Parameters
    ----------
    focal : the focal length
    bends : the two leading terms of the distortion
    minor : the small ones: a third, and those of a lens that sits askew
    axis : where the axis meets the picture
    cut : the picture was cut out of another and perhaps stretched, as those of club cameras often
        are; the axis is free with it
    """

    focal: bool = False
    bends: bool = False
    minor: bool = False
    axis: bool = False
    cut: bool = False

    @property
    def count(self) -> int:
        """Number of free parameters of the lens."""
        return len(self._spreads)

    @property
    def _spreads(self) -> tuple[float, ...]:
        """How far lenses differ in each free parameter; infinite where nothing is presumed."""
        found: tuple[float, ...] = (np.inf,) * self.focal
        found += BEND_SPREAD * self.bends + MINOR_SPREAD * self.minor
        if self.cut:
            return (*found, CUT_SPREAD, CUT_SPREAD, ASPECT_SPREAD)
        return found + (AXIS_SPREAD, AXIS_SPREAD) * self.axis

    def changes(self, delta: Floats) -> tuple[float, Floats, Floats, float]:
        """What a step changes: log focal length, terms (5,), axis (2,) and log stretch."""
        rest = list(delta)

        def taken(count: int, free: bool) -> list[float]:
            found = [rest.pop(0) for _ in range(count)] if free and rest else [0.0] * count
            return found

        focal = taken(1, self.focal)[0]
        terms = taken(2, self.bends) + taken(3, self.minor)
        axis = taken(2, self.axis or self.cut)
        return focal, np.array(terms), np.array(axis), taken(1, self.cut)[0]

    def known(self, camera: Camera) -> Floats:
        """Where the lens stands in what lenses are like, (count,) [standard deviations]."""
        terms = terms_of(camera)
        values: list[float] = [0.0] * self.focal
        values += terms[:2].tolist() * self.bends + terms[2:].tolist() * self.minor
        if self.axis or self.cut:
            middle = np.array(camera.size) / 2
            values += ((camera.matrix[:2, 2] - middle) / half_of(camera)).tolist()
        if self.cut:
            values.append(float(np.log(camera.matrix[1, 1] / camera.matrix[0, 0])))
        return np.array(values) / np.array(self._spreads)


KNOWN_LENS = FreeLens()


def half_of(camera: Camera) -> float:
    """Half of the picture's longer side [px]: where distortion is told as a share."""
    return max(camera.size) / 2


def terms_of(camera: Camera) -> Floats:
    """By what share each term moves the longer side's end, (5,): k1 k2 k3 p1 p2."""
    return camera.distortion[IN_OPENCV] * (half_of(camera) / camera.matrix[0, 0]) ** POWERS


def moved(camera: Camera, delta: Floats, lens: FreeLens) -> Camera:
    """A camera with its free parameters changed.

    Parameters
    ----------
    delta : turn about the camera's axes [rad], shift in its frame [m], and what `lens` leaves free;
        a step of six moves the camera only
    """
    matrix, distortion, translation = camera.matrix, camera.distortion, camera.translation
    if len(delta) > 6:
        log_focal, terms, axis, log_stretch = lens.changes(delta[6:])
        matrix = matrix.copy()
        matrix[[0, 1], [0, 1]] *= np.exp(log_focal)
        matrix[1, 1] *= np.exp(log_stretch)
        matrix[:2, 2] += axis * half_of(camera)
        # What the image shows of the distortion stays as it is when the focal length changes.
        share = (terms_of(camera) + terms) / (half_of(camera) / matrix[0, 0]) ** POWERS
        distortion = np.empty(5)
        distortion[IN_OPENCV] = share
        # A longer lens further away shows nearly the same.
        translation = translation + (np.exp(log_focal) - 1) * np.array([0.0, 0.0, translation[2]])
    return replace(
        camera,
        matrix=matrix,
        distortion=distortion,
        rotation=cv2.Rodrigues(delta[:3])[0] @ camera.rotation,
        translation=translation + delta[3:6],
    )
