"""A stone that a broom touches, and a head that goes with it, in frames drawn here."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from curling_env.sheet import Sheet
from friction_estimation.appearance import StoneModel
from friction_estimation.camera import Camera
from friction_estimation.film import CutFrame
from friction_estimation.tracking.detection.background import find_background, sheet_region
from friction_estimation.tracking.detection.expected_motion import ExpectedMotion
from friction_estimation.tracking.detection.known_look import find_by_look, was_hit
from friction_estimation.tracking.detection.people import people_near
from friction_estimation.tracking.detection.thrown_stone import (
    RoughPath,
    Sighting,
    find_thrown_stone,
)

CAMERA = Camera.looking_at(
    position=(0.3, 0.0, 9.0), target=(0.0, 0.1, 0.0), focal_px=420.0, size=(560, 300),
    up=(-1.0, 0.0, 0.0),
)  # fmt: skip
SHEET = Sheet()
MODEL = StoneModel(radius=0.145, height=0.114)
STEP = 0.2
SWEEPING = 1.6
"""From when on the broom touches the stone [s]."""


def place(t):
    """A stone that slows down and curls a little."""
    return np.array([0.1 - 0.004 * t**2, -4.0 + 1.5 * t - 0.05 * t**2])


def disc(picture, x, y, z, radius, colour):
    px = CAMERA.project(np.array([[x, y, z], [x + radius, y, z]]))
    centre = np.round(16 * px[0]).astype(int).tolist()
    size = round(16 * float(np.linalg.norm(px[1] - px[0])))
    cv2.circle(picture, centre, size, colour, -1, cv2.LINE_AA, 4)


def frame_at(t, ice, people, alone=(0.0, SWEEPING)):
    picture = ice.copy()
    x, y = place(t)
    for z, radius, colour in ((0.0, 0.11, 70), (0.05, 0.145, 90), (0.114, 0.12, 125)):
        disc(picture, x, y, z, radius, (colour, colour, colour))
    if people:
        ahead = 0.6 if alone[0] <= t <= alone[1] else 0.2
        broom = x + 0.09 * np.sin(15 * t), y + ahead
        for side in (-0.08, 0.0, 0.08):
            disc(picture, broom[0] + side, broom[1], 0.02, 0.04, (40, 40, 40))
        ends = CAMERA.project(np.array([[*broom, 0.05], [x + 0.7, y + 0.4, 1.0]])).round()
        cv2.line(picture, *(tuple(map(int, end)) for end in ends), (40, 160, 200), 2, cv2.LINE_AA)
        disc(picture, x + 0.8, y + 0.4, 0.9, 0.24, (40, 60, 150))
        disc(picture, x + 0.7, y + 0.6, 1.2, 0.11, (60, 80, 110))
    noise = np.random.default_rng(round(1000 * t)).normal(0, 1.5, picture.shape)
    blurred = cv2.GaussianBlur(picture, (0, 0), 0.6)
    return np.clip(blurred + noise, 0, 255).astype(np.uint8)


def throw(people, until=5.0, **alone):
    """Frames of a throw, and the empty ice in them."""
    ice = np.full((300, 560, 3), 225, dtype=np.uint8)
    cv2.line(ice, (0, 150), (559, 150), (120, 120, 120), 1)
    frames = [(t, frame_at(t, ice, people, **alone)) for t in np.arange(0.0, until, STEP)]
    background = find_background([f for _, f in frames[::2]], sheet_region(CAMERA, SHEET))
    return frames, background


def test_a_stone_beside_a_broom_is_followed_by_its_look():
    frames, background = throw(people=True)
    found = find_by_look(frames, background, CAMERA, MODEL, SHEET)
    assert found is not None
    seen = found.path.sightings
    assert len(seen) >= len(frames) - 1
    assert max(np.linalg.norm(s.xy - place(s.t)) for s in seen) < 0.03  # a pixel is 21 mm
    clear = [s for s in seen if s.likeness > 0]
    assert [found.pictures[s.frame][0] for s in clear] == [s.t for s in clear]


def test_a_stone_that_is_alone_for_three_frames_only_is_followed_through_all_of_them():
    """Its look is first learnt with the broom that touches it, and then corrected."""
    frames, background = throw(people=True, until=2.9, alone=(1.5, 2.1))
    found = find_by_look(frames, background, CAMERA, MODEL, SHEET)
    assert found is not None
    seen = found.path.sightings
    assert len(seen) >= len(frames) - 1
    assert max(np.linalg.norm(s.xy - place(s.t)) for s in seen) < 0.03


def test_what_sets_out_in_the_far_house_was_hit():
    whole = Camera.looking_at(
        position=(0.0, -30.0, 8.0), target=(0.0, -5.0, 0.0), focal_px=500.0, size=(640, 480)
    )
    house = Camera.looking_at(
        position=(0.0, 12.0, 6.0), target=(0.0, 16.0, 0.0), focal_px=500.0, size=(640, 480)
    )
    pictures = [(0.2 * k, None) for k in range(60)]
    far = {k: np.array([0.1, 14.0 + 0.1 * (k - 40), 0.0]) for k in range(40, 60)}
    thrown = {k: np.array([0.1, -9.0 + 0.4 * k, 0.0]) for k in range(3, 60)}
    towards_home = {k: -pose for k, pose in thrown.items()}
    assert was_hit(pictures, far, whole)
    assert not was_hit(pictures, thrown, whole)
    assert not was_hit(pictures, towards_home, whole)
    # Over the house nothing shows where it was released, and a film may begin in mid-throw.
    assert not was_hit(pictures, far, house)
    assert not was_hit(pictures, {k - 38: pose for k, pose in far.items()}, whole)


@pytest.mark.parametrize("people", [True, False])
def test_people_are_noticed_where_there_are_some(people):
    frames, background = throw(people=people)
    found = find_thrown_stone(frames, background, CAMERA, MODEL, SHEET, lambda *_: [])
    path = None if found is None else found.path
    assert people_near(frames, path, background, CAMERA, MODEL) == people


def test_people_without_a_stone_are_no_stone(monkeypatch):
    monkeypatch.setattr("friction_estimation.tracking.tuning.SLIDES_TRIED", 2)
    ice = np.full((300, 560, 3), 225, dtype=np.uint8)
    frames = []
    for t in np.arange(0.0, 2.4, STEP):
        picture = ice.copy()
        for part, radius in ((0.0, 0.24), (0.2, 0.11), (-0.3, 0.12)):
            disc(picture, 0.5, -3 + 1.2 * t + part, 0.5, radius, (60, 60 + 200 * part, 150))
        frames.append((t, picture))
    background = find_background([f for _, f in frames[::2]], sheet_region(CAMERA, SHEET))
    assert find_by_look(frames, background, CAMERA, MODEL, SHEET) is None


def test_a_stone_is_expected_where_it_slides_on_to_its_rest():
    motion, sigma = ExpectedMotion(), np.array([0.003, 0.003])
    assert motion.at(0.0) is None
    for t in np.arange(0.0, 2.0, STEP):
        motion.add(t, np.array([0.1, 1.0 * t - 0.05 * t**2, 1.5 * t]), sigma)
    ahead = motion.at(2.8)
    assert ahead[:2] == pytest.approx([0.1, 1.0 * 2.8 - 0.05 * 2.8**2], abs=0.02)
    # After 10 s it rests at 5 m; it does not slide back.
    assert 4.0 < motion.at(14.0)[1] < 6.0
    assert motion.at(14.0)[1] == motion.at(30.0)[1]
    assert motion.doubt(3.8) > motion.doubt(2.0) > 0


def test_a_part_of_a_frame_is_looked_at_as_the_whole():
    whole = np.arange(20 * 30 * 3, dtype=np.uint16).astype(np.uint8).reshape(20, 30, 3)
    part = CutFrame(whole, (slice(4, 18), slice(6, 28)))
    assert part.shape == whole.shape
    window = slice(5, 9), slice(10, 20)
    assert np.array_equal(part[window], whole[window])


def test_a_path_that_was_measured_leads_to_its_end():
    sightings = [Sighting(frame=k, t=float(k), xy=np.zeros(2), likeness=1.0) for k in range(3)]
    assert RoughPath(sightings=tuple(sightings), measured=True).leads(2.0)
    assert not RoughPath(sightings=tuple(sightings), measured=True).leads(2.1)
    assert not RoughPath(sightings=tuple(sightings)).leads(1.0)


def test_paths_agree_where_one_goes_as_the_other_was_seen():
    def path(t, y):
        seen = zip(t, y, strict=True)
        return RoughPath(
            sightings=tuple(
                Sighting(frame=k, t=u, xy=np.array([0.1, v]), likeness=1.0)
                for k, (u, v) in enumerate(seen)
            )
        )

    t = np.arange(0, 20, 0.2)
    slide = path(t, 2.0 * t - 0.05 * t**2)
    few = path(t[::3], 2.0 * t[::3] - 0.05 * t[::3] ** 2 + 0.05)
    assert few.agrees_with(slide)
    lost = path(t[:40:3], 2.0 * t[:40:3] - 0.05 * t[:40:3] ** 2)
    assert not lost.agrees_with(slide)
    gone_over = path(t[::3], 2.0 * t[::3] - np.where(t[::3] < 16, 0.05, 0.03) * t[::3] ** 2)
    assert not gone_over.agrees_with(slide)
