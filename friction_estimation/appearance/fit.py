"""Measurement of a stone in one frame: its picture is fitted over the background to sub-pixel
accuracy.

The fit is a robust Gauss-Newton on position and heading: a pixel that neither the stone nor the
background explains (a sweeper's foot, a brush) loses its weight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.appearance.kernels.fit_kernels import pose_step
from friction_estimation.appearance.model import PixelWindow, StoneModel, window_at
from friction_estimation.appearance.painting import (
    Planes,
    blurred,
    coloured,
    painted,
    repaint_handle,
)
from friction_estimation.appearance.tuning import (
    HEADING_WEIGHT,
    LONGEST_STEP,
    LONGEST_TURN,
    MARGIN_PX,
    MAX_PAINTINGS,
    MAX_STEPS,
    NEGLIGIBLE_STEP,
    OUTLIER_AT,
    PIXEL_CORRELATION,
    REPAINT_PX,
    REPAINT_TURN,
    TURN_DIFFERENCE,
    TURN_REPAINT_PX,
)
from friction_estimation.camera.camera import Camera
from friction_estimation.film.channels import FROM_BGR
from friction_estimation.film.frame import Frame


@dataclass(frozen=True, kw_only=True, eq=False)
class ShapeUncertainty:
    """Displacement of a stone by an error of its appearance, the same in all frames.

    Parameters
    ----------
    places : (n, 2) where it was worked out [m]
    sigma : (n, 2) standard error of each coordinate there [m]
    shift : (n, 2) what is to be added to each coordinate there, on average over the looks that
        explain the pictures as well [m]
    """

    places: Floats
    sigma: Floats
    shift: Floats

    def at(self, xy: Floats) -> Floats:
        """Standard error of each coordinate at positions (n, 2) [m], interpolated along the
        sheet.
        """
        return self._along(self.sigma, xy)

    def shift_at(self, xy: Floats) -> Floats:
        """Return the correction to add to places (n, 2) [m]."""
        return self._along(self.shift, xy)

    def mixed_with(self, other: ShapeUncertainty, share: float) -> ShapeUncertainty:
        """Return the uncertainty if another appearance, fitted to the same crops, may be correct.

        Parameters
        ----------
        share : probability of the other look, 0 to 1
        """
        apart = other.places + other.shift - self.places - self.shift
        # It is noisy from crop to crop, but changes slowly along the path.
        along = self.places[:, 1] - self.places[:, 1].mean()
        bend = np.vander(along / max(float(np.ptp(along)), 1e-3), 3)
        apart = bend @ np.linalg.lstsq(bend, apart, rcond=1e-6)[0]
        variance = (1 - share) * self.sigma**2 + share * other.sigma**2
        return ShapeUncertainty(
            places=self.places,
            sigma=np.sqrt(variance + share * (1 - share) * apart**2),
            shift=self.shift + share * apart,
        )

    def _along(self, values: Floats, xy: Floats) -> Floats:
        order = np.argsort(self.places[:, 1], kind="stable")
        y = self.places[order, 1]
        return np.column_stack([np.interp(xy[:, 1], y, axis) for axis in values[order].T])


@dataclass(frozen=True, kw_only=True, eq=False)
class Appearance:
    """Appearance of a stone in one film.

    Parameters
    ----------
    model : shape and blur
    colours : (5, 3) brightness and two colour differences of foot, side, bevel, top and handle
    noise : (3,) standard deviation of a residual in each channel, as found on this film
    has_handle : whether a handle was found; without one there is no heading
    uncertainty : error of the stone's place by an unknown shape; None if the appearance was not
        learned from a film
    """

    model: StoneModel
    colours: Floats
    noise: Floats
    has_handle: bool
    uncertainty: ShapeUncertainty | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class StoneFit:
    """One frame's measurement.

    Parameters
    ----------
    xy : (2,) centre on the ice [m]
    theta : heading, modulo a turn [rad]; NaN without a handle
    covariance : (3, 3) covariance of x, y and theta
    visible : share of the stone's pixels that look like the stone, 0 to 1
    inside : share of the stone's outline that lies in the image, 0 to 1
    hidden : share of the stone's pixels that were ignored, because something else is there
    """

    xy: Floats
    theta: float
    covariance: Floats
    visible: float
    inside: float
    hidden: float = 0.0


def channels_of(image: NDArray[np.uint8] | NDArray[np.float32]) -> Floats:
    """Convert BGR pixels (rows, columns, 3) to brightness and two colour differences, as stored in
    films.
    """
    channels = cv2.transform(np.asarray(image, dtype=np.float64), FROM_BGR)
    return np.asarray(channels, dtype=np.float64)


class PictureChannels:
    """Channels of a picture, computed where they are read: ``channels[rows, columns]``.

    All of them at once would take eight times the memory of the picture.

    Parameters
    ----------
    image : (rows, columns, 3) BGR
    """

    def __init__(self, image: NDArray[np.uint8] | NDArray[np.float32]) -> None:
        self._image = image
        self.shape = image.shape

    def __getitem__(self, part: tuple[slice, slice]) -> Floats:
        return channels_of(self._image[part])


Channels = Floats | PictureChannels
"""Channels of a picture (rows, columns, 3) that can be read in parts."""


def fit_stone(
    picture: Floats,
    behind: Floats,
    window: PixelWindow,
    appearance: Appearance,
    start: Floats,
    expected: float | None = None,
) -> tuple[Floats, Floats, float, float]:
    """Fit position and heading to the pixels of a window.

    Parameters
    ----------
    picture, behind : (n, 3) channels of the frame and of the background in the window
    start : (3,) x, y [m] and theta [rad] to start from
    expected : heading that a stone that turns steadily has [rad], to within `HEADING_SPREAD`; None
        where it is not known

    Returns
    -------
    (3,) best place and heading; (3, 3) covariance; root mean square residual [standard
    deviations]; visible share: see `StoneFit`
    """
    model, shape = appearance.model, appearance.model.values
    metre = window.scale[0] + 0.5 * model.height * window.scale[1]
    px = np.linalg.inv(metre)
    (ux, uy), (vx, vy) = px.tolist()
    turns = appearance.has_handle
    size = 3 if turns else 2
    slow = np.zeros((5, 3, *window.shape), dtype=np.float32)
    step, inverse, totals = np.empty(3), np.empty((3, 3)), np.empty(5)
    pull = np.zeros(2)
    x, y, theta = np.asarray(start, dtype=np.float64).tolist()
    done = False
    for _ in range(MAX_PAINTINGS):
        # The stone is painted once and its picture shifted; after a large shift it is painted
        # again.
        x0, y0, theta0 = x, y, theta
        light, turning = _painted_light(window, appearance, x0, y0, theta0)
        slow_at = (np.inf, np.inf)
        far, turned = 0.0, 0.0
        for _ in range(MAX_STEPS):
            at = (ux * (x - x0) + uy * (y - y0), vx * (x - x0) + vy * (y - y0))
            seen = blurred(light, window, shape, at, sloped=True)
            if turning is not None and math.dist(at, slow_at) > TURN_REPAINT_PX:
                slow, slow_at = blurred(turning, window, shape, at), at
            if expected is not None:
                pull[:] = math.remainder(expected - theta, 2 * math.pi), HEADING_WEIGHT
            pose_step(
                picture,
                behind,
                seen,
                slow,
                theta - theta0,
                px,
                appearance.noise,
                OUTLIER_AT,
                size,
                pull,
                step,
                inverse,
                totals,
            )
            dx, dy, dtheta = step.tolist()
            shrink = min(1.0, LONGEST_STEP / (math.hypot(dx, dy) + 1e-12))
            shrink = min(shrink, LONGEST_TURN / (abs(dtheta) + 1e-12))
            x, y, theta = x + shrink * dx, y + shrink * dy, theta + shrink * dtheta
            done = totals[4] < NEGLIGIBLE_STEP**2 * size
            far = math.hypot(ux * (x - x0) + uy * (y - y0), vx * (x - x0) + vy * (y - y0))
            turned = abs(theta - theta0)
            if done or far > 2 * REPAINT_PX or turned > 2 * REPAINT_TURN:
                break
        if done and far < REPAINT_PX and turned < REPAINT_TURN:
            break
    squares, weights, stone_pixels, seen_pixels = totals[:4].tolist()
    spread = max(squares / max(weights, 1.0), 0.01)
    covariance = PIXEL_CORRELATION * spread * inverse
    if not turns:
        covariance[2, 2] = np.inf
    misfit = math.sqrt(squares / max(weights, 1e-9))
    return np.array([x, y, theta]), covariance, misfit, seen_pixels / max(stone_pixels, 1e-9)


def _painted_light(
    window: PixelWindow, appearance: Appearance, x: float, y: float, theta: float
) -> tuple[Planes, Planes | None]:
    """Return a stone's coloured planes, and their derivative by the heading if it has a handle."""
    shape, colours = appearance.model.values, appearance.colours
    planes = painted(window, shape, np.array([x, y, theta]), with_handle=appearance.has_handle)
    light = coloured(planes, colours)
    if not appearance.has_handle:
        return light, None
    repaint_handle(planes, window, shape, np.array([x, y, theta + TURN_DIFFERENCE]))
    return light, (coloured(planes, colours) - light) / np.float32(TURN_DIFFERENCE)


def cut_out(
    frame: Frame,
    background: Channels,
    background_origin: tuple[int, int],
    camera: Camera,
    appearance: Appearance,
    start: Floats,
) -> tuple[PixelWindow, Floats, Floats] | None:
    """Return the window in which a stone at `start` is fitted, its pixels and its background.

    Parameters
    ----------
    as of `measure_occluded`

    Returns
    -------
    window; (n, 3) channels of the frame; (n, 3) channels of the background. None where nothing of
    the stone is in the image
    """
    around = appearance.model.extent_px(camera, start[:2])
    if len(around) == 0:
        return None
    rows, columns = background.shape[:2]
    first = np.array(background_origin)
    last = first + np.array([columns - 1, rows - 1])
    around += np.array([[-MARGIN_PX], [MARGIN_PX]])
    window = window_at(camera, np.clip(around, first, last), 0.0)
    if window is None:
        return None
    return window, *pixels_in(window, frame, background, background_origin)


def pixels_in(
    window: PixelWindow, frame: Frame, background: Channels, origin: tuple[int, int]
) -> tuple[Floats, Floats]:
    """Channels (n, 3) of a frame and of its background in a window; see `measure_occluded`."""
    rows, columns = window.slices
    left, top = origin
    part = background[
        rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
    ]
    seen = channels_of(frame[window.slices]).reshape(-1, 3)
    return seen, np.ascontiguousarray(part.reshape(-1, 3))


def fit_window(
    picture: Floats,
    behind: Floats,
    window: PixelWindow,
    camera: Camera,
    appearance: Appearance,
    start: Floats,
) -> StoneFit:
    """Fit the stone to the pixels (n, 3) of a window; see `fit_stone`."""
    pose, covariance, _, visible = fit_stone(picture, behind, window, appearance, start)
    width, height = camera.size
    at_end = appearance.model.outline_px(camera, pose[:2])
    within = (at_end >= 0) & (at_end <= np.array([width - 1, height - 1]))
    inside = float(within.all(axis=1).mean()) if len(at_end) else 0.0
    return StoneFit(
        xy=pose[:2],
        theta=float(pose[2]) if appearance.has_handle else np.nan,
        covariance=covariance,
        visible=visible,
        inside=inside,
    )
