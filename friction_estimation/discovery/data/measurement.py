"""What a camera may do to a path: the effects of the measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from curling_env.errors import InputError
from curling_env.physics.effects import Parameter
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import TERMS
from friction_estimation.camera.pose import camera_from_scene, pose_from_points
from friction_estimation.camera.scene import Scene
from friction_estimation.discovery.data.form import Form

LENS_RADIUS = 20.0
"""Distance from the image's centre at which `lens_distortion` quotes its strength [m]."""


def _offset(xy: Floats, theta: Floats, values: Mapping[str, float]) -> Floats:
    cosine, sine = np.cos(theta), np.sin(theta)
    a, b = values["forward"], values["left"]
    return np.column_stack([a * cosine - b * sine, a * sine + b * cosine])


def _radial(xy: Floats, theta: Floats, values: Mapping[str, float]) -> Floats:
    from_centre = xy - np.array([values["centre_x"], values["centre_y"]])
    ratio = (from_centre**2).sum(axis=1, keepdims=True) / LENS_RADIUS**2
    return from_centre * (values["k1"] * ratio + values["k2"] * ratio**2)


def _number(name: str, unit: str, meaning: str, reach: float, **others: Any) -> Parameter:
    return Parameter(name=name, unit=unit, meaning=meaning, low=-reach, high=reach, **others)


TRACKING_OFFSET = Form(
    name="tracking_offset",
    kind="measurement",
    parameters=(
        _number("forward", "m", "ahead of the centre, along the heading", 0.2, neutral=0.0),
        _number("left", "m", "to the left of the heading", 0.2, neutral=0.0),
    ),
    sign="the path winds at the rate of the spin",
    displacement=_offset,
)

LENS_SIGN = "paths bend with the place in the image, with v², whatever the friction"

LENS_DISTORTION = Form(
    name="lens_distortion",
    kind="measurement",
    parameters=(
        _number("k1", "1", f"radial displacement over radius at {LENS_RADIUS:g} m", 0.3, neutral=0),
        _number("k2", "1", "the same, of fifth order", 0.3, default=0.0, neutral=0.0),
        _number("centre_x", "m", "where the optical axis meets the ice", 10.0, default=0.0),
        _number("centre_y", "m", "where the optical axis meets the ice", 25.0, default=0.0),
    ),
    sign=LENS_SIGN,
    displacement=_radial,
)

MEASUREMENTS = (TRACKING_OFFSET, LENS_DISTORTION)

LENS_TERMS = TERMS[:4]
"""The terms of the distortion that tracks may show to be wrong."""


def measurements_through(scene: Scene) -> tuple[Form, ...]:
    """The effects of a measurement whose camera is known.

    The lens may differ from what the scene says of it. Its pose was solved from the marked points
    with the scene's lens, so that a wrong lens is partly made good by a wrong pose; what is left
    is what tracks show.

    Parameters
    ----------
    scene : the one the tracks were made with

    Raises
    ------
    InputError : a scene that says neither how large its image is nor where its centre lies
    """
    size = scene.image_size
    if size is None and scene.camera_matrix is not None:
        size = (round(2 * scene.camera_matrix[0, 2]), round(2 * scene.camera_matrix[1, 2]))
    if size is None:
        raise InputError(
            "discovery sees no film: give the image's width and height, or a camera matrix",
            source=scene.source,
            where="image_size",
        )
    believed = camera_from_scene(scene, size)

    @lru_cache(maxsize=64)
    def camera_with(*terms: float) -> Camera:
        lens = believed.lens.with_terms_added(dict(zip(LENS_TERMS, terms, strict=True)))
        pose = pose_from_points(scene.sheet_points, scene.points_px, lens)
        camera = replace(believed, lens=lens)
        return camera if pose is None else camera.with_pose(pose.rotation, pose.translation)

    def displacement(xy: Floats, theta: Floats, values: Mapping[str, float]) -> Floats:
        true = camera_with(*(values[f"lens_{term}"] for term in LENS_TERMS))
        reported = believed.on_plane(true.project(np.column_stack([xy, np.zeros(len(xy))])))
        return np.where(np.isfinite(reported), reported - xy, 0.0)

    lens = Form(
        name="lens_distortion",
        kind="measurement",
        parameters=(
            *(
                _number(
                    f"lens_{term}",
                    "1",
                    f"the lens's own {term} less the one it was given",
                    0.5 if term[0] == "k" else 0.05,
                    default=0.0,
                    neutral=0.0,
                )
                for term in LENS_TERMS
            ),
        ),
        sign=LENS_SIGN,
        displacement=displacement,
    )
    return (TRACKING_OFFSET, lens)
