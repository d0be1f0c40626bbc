"""Search for the camera of a picture, from the painted lines.

One search serves films and photos: from each of several initial cameras the paint is measured with
decreasing search radii, until two of them lead to cameras that agree with all of the paint. Clicked
points, known parts of a lens and rough marks differ only in the initial cameras.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from curling_env.typing import Floats, Image, Singles
from friction_estimation.camera.agreement import disagreeing, seen_curves
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS, FreeLens
from friction_estimation.camera.markings import (
    Markings,
    fitted_markings,
    grey_levels,
    markings_of,
)
from friction_estimation.camera.paint_fit import PaintFit
from friction_estimation.camera.pose import (
    likely_cameras,
    trial_lenses,
)
from friction_estimation.camera.refined import (
    RefinedCamera,
    height_prior,
    prior_residuals,
    unrefined,
)
from friction_estimation.camera.scene import Scene
from friction_estimation.camera.tuning import (
    AGREEING_SHARE,
    DISPLACED_SEARCH_PX,
    MAX_MISFIT,
    MAX_STARTS,
    MIN_MARKINGS,
    NARROW_SEARCHES_PX,
    SEARCHED_SIDE,
    WIDE_SEARCHES_PX,
    WORKING_SIDE,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedCamera:
    """Camera from one start, and its agreement with the paint.

    Parameters
    ----------
    refined : the camera
    share : part of the paint in view that is seen where it puts it, 0 to 1
    wrong : names of the curves that disagree with it, or are needed and not seen
    """

    refined: RefinedCamera
    share: float
    wrong: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class PaintSolver:
    """A picture of the sheet, perhaps reduced, and the search for its camera.

    Parameters
    ----------
    fit : of a camera to the paint in this picture
    judged : markings that must agree
    needed : names of curves that must be seen
    unit_px : pixels in which the paint is laid exactly
    scale, size : (2,) the picture's size over that of the whole one, and its width and height
    """

    fit: PaintFit
    judged: Markings
    needed: tuple[str, ...] = ()
    unit_px: float = 1.0
    scale: Floats
    size: tuple[int, int]

    def most_likely(self, starts: Iterable[tuple[Camera, Sequence[float]]]) -> SolvedCamera | None:
        """Return the most likely camera from all starts; None if no camera agrees with the paint.

        Inaccurate marks may favour wrong starts. More starts are therefore followed than the camera
        has unknown parameters, unless one leads to a camera that agrees with most of the paint, and
        others until a camera agrees with it.

        Parameters
        ----------
        starts : cameras to begin with, each with the search radii of the first rounds [px]
        """
        found: list[SolvedCamera] = []
        for k, (start, searches) in enumerate(starts, 1):
            solved = self.followed(start, searches)
            found += [] if solved is None else [solved]
            agreeing = [one for one in found if not one.wrong]
            unknown = 6 + self.fit.lens.count
            if agreeing and (k > unknown or agreeing[-1].share > AGREEING_SHARE):
                break
        return min(found, key=lambda k: (len(k.wrong), k.refined.misfit), default=None)

    def followed(self, camera: Camera, searches: Sequence[float] = ()) -> SolvedCamera | None:
        """Follow a rough camera; None if it finds no paint.

        Parameters
        ----------
        searches : search radius of each round before the camera is nearly right [px]
        """
        fit, leading = self.fit, replace(self.fit.lens, minor=False, axis=False)
        narrow = [self.unit_px * radius for radius in NARROW_SEARCHES_PX]
        near = fit.approach(camera, searches, leading)
        end = None if near is None else fit.approach(near, narrow, fit.lens)
        if end is None:
            return None
        measured = fit.measure(end, narrow[-1])
        if len(measured.index) < MIN_MARKINGS:
            return None
        refined = fit.fit(end, measured, fit.lens, 0.5 * self.unit_px)
        seen = seen_curves(refined.camera, fit.grey, fit.origin, self.judged)
        met = {curve.name: curve.miss_px for curve in seen if curve.agrees}
        missing = [name for name in self.needed if name not in met]
        wrong = tuple(dict.fromkeys([*disagreeing(seen), *missing]))
        share = refined.measured / measured.expected
        return SolvedCamera(refined=replace(refined, misses_px=met), share=share, wrong=wrong)

    def reduced_camera(self, camera: Camera) -> Camera:
        """Convert a camera of the whole picture to this one."""
        return camera.resized(self.scale, self.size)

    def whole(self, refined: RefinedCamera, size: tuple[int, int]) -> RefinedCamera:
        """Convert a camera of this picture to the whole one, of a width and height [px]."""
        return refined.resized(1 / self.scale, size)


def refine(
    camera: Camera, scene: Scene, image: Image | Singles, origin_px: tuple[int, int] = (0, 0)
) -> RefinedCamera:
    """Refine a camera on the painted lines of an image.

    Parameters
    ----------
    camera : found from the scene's points alone
    scene : tells which part of the lens is known
    image : (rows, columns, 3) BGR, best without what moves; may be a part of the frame
    origin_px : column and row of the image's upper left pixel in the frame

    Returns
    -------
    The camera as it was, where the picture does not show the paint, or disagrees
    """
    no_matrix, no_terms = scene.camera_matrix is None, scene.distortion is None
    lens = FreeLens(focal=no_matrix, bends=no_terms, minor=no_terms, axis=no_matrix)
    solver = _solver(scene, camera.size, image, origin_px, lens)
    small = solver.reduced_camera(camera)
    share = min(1.0, max(small.size) / SEARCHED_SIDE)
    starts = _starts(small, solver.fit)
    searches = [share * radius for radius in WIDE_SEARCHES_PX]
    found = solver.most_likely((start, searches) for start in starts)
    return _agreeing(camera, solver, found)


def refine_again(
    refined: RefinedCamera, scene: Scene, image: Image | Singles, origin_px: tuple[int, int]
) -> RefinedCamera:
    """Refine the same camera on another picture of the same paint.

    Parameters
    ----------
    refined : the camera; its free parts of the lens stay free
    scene, image, origin_px : as in `refine`

    Returns
    -------
    The camera as it was, where the picture does not show the paint
    """
    solver = _solver(scene, refined.camera.size, image, origin_px, refined.lens)
    near = solver.followed(solver.reduced_camera(refined.camera))
    found = _agreeing(refined.camera, solver, near)
    return found if found.measured else refined


def displacement(
    refined: RefinedCamera, scene: Scene, image: Image | Singles, origin_px: tuple[int, int]
) -> float:
    """Distance of the paint in a picture from its projection by a camera [px].

    Infinite if less than half of the fitted paint is found.

    Parameters
    ----------
    refined : the camera
    scene, image, origin_px : as in `refine`
    """
    solver = _solver(scene, refined.camera.size, image, origin_px, KNOWN_LENS)
    measured = solver.fit.measure(solver.reduced_camera(refined.camera), DISPLACED_SEARCH_PX)
    if len(measured.index) < max(MIN_MARKINGS, 0.5 * refined.measured):
        return float(np.inf)
    # A movement along a line is not visible across it; most movements are.
    off_px = np.sqrt(2 * np.median(measured.offset_px**2))
    return float(off_px / np.mean(solver.scale))


def refine_at_focal(
    refined: RefinedCamera,
    scene: Scene,
    image: Image | Singles,
    origin_px: tuple[int, int],
    log_change: float,
) -> RefinedCamera | None:
    """Return the camera with another focal length that still agrees with the painted lines.

    Parameters
    ----------
    refined : a camera whose focal length the paint does not fix
    scene, image, origin_px : as in `refine`
    log_change : change of the natural logarithm of the focal length

    Returns
    -------
    None where the paint contradicts it
    """
    drift = refined.covariance[:, 6] / refined.covariance[6, 6]
    fixed, size = replace(refined.lens, focal=False), refined.camera.size
    solver = _solver(scene, size, image, origin_px, fixed)
    camera = solver.reduced_camera(refined.camera)
    steps = max(1, int(np.ceil(abs(log_change) / 0.1)))
    for _ in range(steps):  # in small steps, because the other parameters follow along a curve
        camera = camera.moved(drift * log_change / steps, refined.lens)
    found = solver.fit.approach(camera, NARROW_SEARCHES_PX, fixed)
    if found is None:
        return None
    fitted = solver.fit.fit(found, solver.fit.measure(found, 2.0), fixed, 0.5)
    return solver.whole(fitted, size)


def reduced(
    grey: Singles, origin_px: tuple[int, int], factor: float
) -> tuple[Singles, tuple[int, int], Floats]:
    """Return a picture, or a part of one, reduced in size.

    Parameters
    ----------
    grey : grey levels
    origin_px : column and row of its upper left pixel in the whole picture
    factor : how much smaller; a whole number where the origin is not (0, 0)

    Returns
    -------
    the smaller picture, its origin, and the scale along both sides (2,)
    """
    if factor <= 1:
        return grey, origin_px, np.ones(2)
    if any(origin_px):
        step = int(factor)
        left, top = (-start % step for start in origin_px)
        rows, columns = ((n // step) * step for n in (grey.shape[0] - top, grey.shape[1] - left))
        grey = grey[top : top + rows, left : left + columns]
        origin_px = (origin_px[0] + left) // step, (origin_px[1] + top) // step
    rows, columns = grey.shape
    size = round(columns / factor), round(rows / factor)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float32), origin_px, np.divide(size, (columns, rows))


def _solver(
    scene: Scene,
    size: tuple[int, int],
    image: Image | Singles,
    origin_px: tuple[int, int],
    lens: FreeLens,
) -> PaintSolver:
    """Return the search in a picture of a scene; see `refine`.

    Parameters
    ----------
    size : width and height of the whole picture [px]
    lens : the unknown parts of the lens
    """
    factor = max(1, int(np.ceil(max(size) / WORKING_SIDE)))
    grey, origin, scale = reduced(grey_levels(image), origin_px, factor)
    depth, depth_sigma = scene.ice_above_paint
    fit = PaintFit(
        grey=grey,
        origin=origin,
        markings=fitted_markings(scene.sheet, depth),
        sheet_points=scene.sheet_points,
        points_px=(scene.for_size(size).points_px + 0.5) * scale - 0.5,
        lens=lens,
        height=height_prior(scene.camera_height),
        depth_sigma=depth_sigma,
    )
    small = size[0] // factor, size[1] // factor
    return PaintSolver(fit=fit, judged=markings_of(scene.sheet, depth), scale=scale, size=small)


def _agreeing(before: Camera, solver: PaintSolver, found: SolvedCamera | None) -> RefinedCamera:
    """Return a camera of the whole picture that agrees with the paint; else the previous one."""
    if found is None or found.wrong:
        return unrefined(before, () if found is None else found.wrong)
    return solver.whole(found.refined, before.size)


def _starts(camera: Camera, fit: PaintFit) -> list[Camera]:
    """Return the initial cameras: the most likely ones from their points."""
    lenses = trial_lenses(camera.lens, focal=fit.lens.focal, bends=fit.lens.bends)
    starts = [
        one
        for one in likely_cameras(fit.sheet_points, fit.points_px, lenses)
        if one[0] < MAX_MISFIT * max(camera.size)
    ]

    def unlikelihood(start: tuple[float, Camera]) -> float:
        misfit = len(fit.points_px) * (start[0] / fit.click_sigma_px) ** 2
        return misfit + float(np.sum(prior_residuals(start[1], fit.height) ** 2))

    return [found for _, found in sorted(starts, key=unlikelihood)[:MAX_STARTS]]
