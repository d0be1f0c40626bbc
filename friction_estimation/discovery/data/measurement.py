"""Effects of the measurement that a session may show, through its own camera."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from curling_env.errors import InputError
from curling_env.physics.effects import EffectCard, Parameter, Search, catalogue
from curling_env.physics.effects.card import Values
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import TERMS
from friction_estimation.camera.pose import best_camera, camera_from_scene
from friction_estimation.camera.scene import Scene

LENS = "lens_distortion"
"""Name of the effect that is searched for in the image if the scene is known."""
LENS_TERMS = TERMS[:4]
"""Terms of the distortion whose errors tracks may show."""


def measurement_effects() -> tuple[EffectCard, ...]:
    """Return the effects that displace reported positions, for any camera."""
    return tuple(card for card in catalogue().values() if card.displacement is not None)


def measurement_effects_through(scene: Scene) -> tuple[EffectCard, ...]:
    """Return the effects of the measurement for tracks of a known camera.

    The lens may differ from that of the scene. The pose was solved from the marked points with the
    scene's lens, so it compensates for a part of the lens error; the tracks show the rest.

    Parameters
    ----------
    scene : scene with which the tracks were made

    Raises
    ------
    InputError : a scene that says neither how large its image is nor where its centre lies
    """
    size = scene.picture_size or scene.image_size
    if size is None and scene.camera_matrix is not None:
        size = (round(2 * scene.camera_matrix[0, 2]), round(2 * scene.camera_matrix[1, 2]))
    if size is None:
        raise InputError(
            "missing; expected the picture's width and height, or a camera_matrix",
            source=scene.source,
            where="image_size",
        )
    assumed = camera_from_scene(scene, size)

    @lru_cache(maxsize=64)
    def camera_with(*terms: float) -> Camera:
        lens = assumed.lens.with_terms_added(dict(zip(LENS_TERMS, terms, strict=True)))
        found = best_camera(scene.sheet_points, scene.points_px, [lens])
        return replace(assumed, lens=lens) if found is None else found[1]

    def displacement(xy: Floats, _theta: Floats, values: Values) -> Floats:
        true = camera_with(*(values[f"lens_{term}"] for term in LENS_TERMS))
        reported = assumed.on_plane(true.project(np.column_stack([xy, np.zeros(len(xy))])))
        return np.where(np.isfinite(reported), reported - xy, 0.0)

    def lens_of_scene(card: EffectCard) -> EffectCard:
        return replace(
            card,
            parameters=tuple(_lens_parameter(term) for term in LENS_TERMS),
            displacement=displacement,
            search=Search(
                first=("lens_k1", "lens_k2"),
                shape=(),
                finer=lambda _: ({"lens_p1": 0.0, "lens_p2": 0.0},),
            ),
        )

    return tuple(
        lens_of_scene(card) if card.name == LENS else card for card in measurement_effects()
    )


def _lens_parameter(term: str) -> Parameter:
    furthest = 0.5 if term[0] == "k" else 0.05
    return Parameter(
        name=f"lens_{term}",
        unit="1",
        meaning=f"{term} of the lens less the {term} of the scene",
        low=-furthest,
        high=furthest,
        default=0.0,
        neutral=0.0,
    )
