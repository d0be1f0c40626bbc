"""The paint lies below clear ice, which refracts: positions on the ice with and without its
thickness. Where paint is seen follows from Fermat's principle here, not from Snell's law.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from curling_env.sheet import PAPER_SHEET, TEE_Y
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import KNOWN_LENS
from friction_estimation.camera.markings import MarkingMeasurements, Markings, fitted_markings
from friction_estimation.camera.paint_fit import PaintFit
from friction_estimation.synthetic.cameras import scene_of

DEPTH = 0.006
CEILING = Camera.looking_at(
    position=(0.2, TEE_Y - 1, 5.5),
    target=(0.2, TEE_Y - 1, 0.0),
    up=(-1.0, 0.0, 0.0),
    focal_px=716.0,
    size=(1280, 720),
)
FAR = np.array([[0.3, 9.5], [0.3, 11.0], [-1.5, 13.0]])
"""Places that the camera sees at 30 to 52 degrees from the vertical [m]."""


def on_surface(camera: Camera, paint: np.ndarray, depth: float) -> np.ndarray:
    """Points of the ice's surface (n, 3) through which paint (n, 2) below it is seen."""
    foot, height = camera.position[:2], camera.position[2]
    found = []
    for point in paint:
        apart = np.hypot(*(point - foot))

        def duration(share: float, apart: float = apart) -> float:
            return np.hypot(height, share * apart) + 1.31 * np.hypot(depth, (1 - share) * apart)

        best = minimize_scalar(
            duration, bounds=(0.9, 1.0), method="bounded", options={"xatol": 1e-9}
        )
        found.append([*(foot + best.x * (point - foot)), 0.0])
    return np.array(found)


def camera_error(markings: Markings, sigma: float) -> tuple[np.ndarray, np.ndarray]:
    """Errors (3, 2) and standard errors (3,) at the far places of a camera fitted to paint below
    6 mm of ice, for markings that assume some depth.
    """
    there = CEILING.project(on_surface(CEILING, markings.xy, DEPTH))
    inside = ((there > 8) & (there < np.array(CEILING.size) - 8)).all(axis=1)
    inside &= ~markings.of("border")
    expected = CEILING.project(markings.seen_from(CEILING))
    step = np.column_stack([1e-3 * markings.normal, np.zeros(len(markings.xy))])
    across = CEILING.project(markings.seen_from(CEILING) + step) - expected
    normal = across / np.linalg.norm(across, axis=1, keepdims=True)
    index = np.flatnonzero(inside)
    measured = MarkingMeasurements(
        index=index,
        normal_px=normal[index],
        offset_px=np.sum((there - expected) * normal, axis=1)[index],
        expected=len(index),
    )
    fit = PaintFit(
        grey=np.empty((0, 0), np.float32),
        origin=(0, 0),
        markings=markings,
        sheet_points=np.empty((0, 2)),
        points_px=np.empty((0, 2)),
        lens=KNOWN_LENS,
        depth_sigma=sigma,
    )
    found = fit.fit(CEILING, measured, KNOWN_LENS, 1.0)
    stone = np.column_stack([FAR, np.zeros(len(FAR))])
    return found.camera.on_plane(CEILING.project(stone)) - FAR, found.place_sigma(FAR)


def test_a_known_thickness_of_the_ice_makes_places_right():
    off, _ = camera_error(fitted_markings(PAPER_SHEET, DEPTH), sigma=0.0)
    assert np.abs(off).max() < 2e-4


def test_an_unknown_thickness_moves_places_away_from_the_camera_within_their_errors():
    depth, spread = replace(scene_of(CEILING), paint_depth=None).ice_above_paint
    off, sigma = camera_error(fitted_markings(PAPER_SHEET, depth), spread)
    outward = FAR - CEILING.position[:2]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    away = np.sum(off * outward, axis=1)
    assert (away > [3e-3, 2e-3, 1e-3]).all()
    assert (away < 2.5 * sigma).all()


def test_a_drawn_scene_knows_that_nothing_covers_its_paint():
    depth, sigma = scene_of(CEILING).ice_above_paint
    assert depth == 0.0
    assert sigma < 1e-3
