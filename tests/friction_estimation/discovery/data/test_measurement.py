"""What the camera does to tracks is named as the camera's, not as the ice's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.errors import InputError
from friction_estimation.camera.pose import camera_from_scene
from friction_estimation.discovery.data.measurement import measurement_effects_through
from friction_estimation.discovery.data.references import (
    calibrate,
    calibrations_of,
    corrected,
    read_reference,
)
from friction_estimation.discovery.discover import discover
from friction_estimation.discovery.report import document
from friction_estimation.synthetic.cameras import named_camera, scene_of

from ..conftest import effect

SIZE = (1920, 1080)


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


@pytest.mark.parametrize("name", ["gantry", "side", "end"])
def test_a_wrong_lens_is_named_as_the_lens(make_session, rng, name):
    true = make_session(throws=16, sigma=0.0)
    tracks, scene, missing = seen_through_a_wrong_lens(true, name, rng)
    found = discover(tracks, scene=scene)
    assert [effect.label for effect in found.effects] == ["lens_distortion"]
    assert not found.unknown
    values = found.final.model.term("lens_distortion").values
    assert abs(values["lens_k1"] / missing[0] - 1) < 0.1
    assert found.gaps["after"].rest_error < 0.5 * found.gaps["before"].rest_error


def test_without_a_scene_a_gantrys_lens_is_still_the_lens(make_session, rng):
    tracks, _, _ = seen_through_a_wrong_lens(make_session(throws=16, sigma=0.0), "gantry", rng)
    found = discover(tracks)
    assert [effect.label for effect in found.effects] == ["lens_distortion"]


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


def test_scale_and_frame_rate_are_named_only_by_references(make_session):
    tracks = [replace(track, xy=1.03 * track.xy, t=1.2 * track.t) for track in make_session()]
    blind = document(discover(tracks))
    assert blind["effects"] == []
    assert blind["undecidable"]["names"] == ["scale_error", "frame_rate_error"]

    length = calibrate("scale_error", [read_reference("22.6,21.945", "scale_error")])
    clock = calibrate("frame_rate_error", [read_reference("24,20", "frame_rate_error")])
    found = discover(tracks, references=[length, clock])
    report = document(found)
    assert [e["name"] for e in report["effects"]] == ["scale_error", "frame_rate_error"]
    assert report["undecidable"]["names"] == []
    assert abs(report["effects"][1]["parameters"]["factor"]["value"] - 1.2) < 0.02
    assert abs(report["baseline"]["mu"] / 0.009 - 1) < 0.02
    # On its own output the tracks are corrected again, and nothing more is found.
    ice = found.improved_ice()
    assert {c.name for c in calibrations_of(ice)} == {"scale_error", "frame_rate_error"}
    again = document(discover(tracks, ice))
    assert again["effects"] == []
    assert abs(again["baseline"]["mu"] / 0.009 - 1) < 0.02


def test_a_reference_that_agrees_names_nothing(make_session):
    right = calibrate("scale_error", [read_reference("21.95,21.945", "scale_error")])
    assert not right.clearly_off
    report = document(discover(make_session(), references=[right]))
    assert report["effects"] == []
    assert report["undecidable"]["names"] == ["frame_rate_error"]


@pytest.mark.parametrize(
    "text", ["21.9", "a,b", "21.9,-3", "1,2,3,4", "21.9,nan", "2,21.945"], ids=repr
)
def test_a_reference_that_cannot_be_is_refused(text):
    with pytest.raises(InputError, match="--known-length"):
        read_reference(text, "scale_error")


def test_references_that_contradict_one_another():
    both = [read_reference(text, "frame_rate_error") for text in ("20,20", "24,20")]
    with pytest.raises(InputError, match="contradict"):
        calibrate("frame_rate_error", both)


def test_corrected_tracks_have_true_lengths_and_times(make_session):
    (track, *_) = make_session([effect("slope", x=1e-4, y=0.0)], throws=2)
    wrong = replace(track, xy=0.97 * track.xy, t=0.9 * track.t)
    known = [
        calibrate("scale_error", [read_reference("0.97,1,0.001", "scale_error")]),
        calibrate("frame_rate_error", [read_reference("9,10,0.01", "frame_rate_error")]),
    ]
    (right,) = corrected([wrong], known)
    assert np.allclose(right.xy, track.xy)
    assert np.allclose(right.t, track.t)
