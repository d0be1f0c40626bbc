"""Camera effects on tracks are attributed to the camera, not to the ice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from friction_estimation import discover
from friction_estimation.camera import camera_from_scene
from friction_estimation.discovery import measurement_effects_through, remarks
from friction_estimation.synthetic import named_camera, scene_of

SIZE = (1920, 1080)
NO_SCENE = "The lens was tested without the camera's scene"


def seen_through_a_wrong_lens(tracks, name, rng):
    """Tracks as a tracker reports them that believes half of the lens's distortion."""
    camera = named_camera(name, SIZE)
    scene = replace(scene_of(camera), distortion=0.5 * camera.lens.distortion)
    believed = camera_from_scene(scene, SIZE)
    out = []
    for track in tracks:
        px = camera.project(np.column_stack([track.xy, np.zeros(len(track))]))
        noise = rng.normal(0, 0.004, track.xy.shape)
        out.append(replace(track, xy=believed.on_plane(px) + noise))
    return out, scene, 0.5 * camera.lens.distortion


@pytest.mark.parametrize("name", ["gantry", "end"])
def test_a_wrong_lens_is_named_as_the_lens(make_session, rng, name):
    true = make_session(throws=10, sigma=0.0, fps=8)
    tracks, scene, missing = seen_through_a_wrong_lens(true, name, rng)
    found = discover(tracks, scene=scene)
    assert [effect.label for effect in found.effects] == ["lens_distortion"]
    assert not found.unknown
    values = found.final.model.term("lens_distortion").values
    assert abs(values["lens_k1"] / missing[0] - 1) < 0.1
    assert found.gaps["after"].rest_error < 0.5 * found.gaps["before"].rest_error


def test_without_a_scene_a_gantrys_lens_is_still_the_lens(make_session, rng):
    tracks, _, _ = seen_through_a_wrong_lens(
        make_session(throws=10, sigma=0.0, fps=8), "gantry", rng
    )
    found = discover(tracks)
    assert [effect.label for effect in found.effects] == ["lens_distortion"]
    assert any(
        NO_SCENE in remark for remark in remarks(found)
    )  # every length may be off by some per cent


def test_the_displacement_is_what_the_wrong_camera_reports():
    camera = named_camera("end", SIZE)
    scene = replace(scene_of(camera), distortion=0.5 * camera.lens.distortion)
    cards = {card.name: card for card in measurement_effects_through(scene)}
    displacement = cards["lens_distortion"].displacement
    assert displacement is not None
    xy = np.array([[0.3, -8.0], [-1.0, 3.0], [1.2, 12.0]])
    half = dict(zip(("k1", "k2", "p1", "p2"), 0.5 * camera.lens.distortion[:4], strict=True))
    shift = displacement(xy, np.zeros(3), {f"lens_{k}": v for k, v in half.items()})
    px = camera.project(np.column_stack([xy, np.zeros(3)]))
    assert np.abs(xy + shift - camera_from_scene(scene, SIZE).on_plane(px)).max() < 1e-4
    none = displacement(xy, np.zeros(3), {f"lens_{k}": 0.0 for k in half})
    assert np.abs(none).max() < 1e-6


def test_a_scene_that_does_not_say_how_large_its_image_is():
    scene = replace(scene_of(named_camera("gantry", SIZE)), camera_matrix=None)
    with pytest.raises(InputError, match="width and height"):
        measurement_effects_through(scene)
