"""Difficult films: what can be corrected is corrected, and the rest is refused in one line.

The spoilt films are made from a clean one of six frames a second, to measure the cost of a fault.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from curling_env.ice import Ice
from curling_env.physics import slide
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory
from friction_estimation import Scene
from friction_estimation.camera import camera_from_scene
from friction_estimation.film import film_writer, stabiliser_for
from friction_estimation.synthetic import FilmRenderer, FilmSpec, on_film, scene_of, write_film
from friction_estimation.tracking import track_film
from tests.friction_estimation.home_half import home_half

FPS = 6.0
WHOLE = (800, 450)
"""Size of pictures of the whole sheet."""


@dataclass(frozen=True, kw_only=True)
class CleanFilm:
    """Frames of a throw on slow ice, the true path, and the scene.

    Parameters
    ----------
    error : of the track of the film without a fault, root mean square [m]
    """

    frames: list[np.ndarray]
    truth: Trajectory
    scene: Scene
    error: float = 0.0


def filmed(folder, **camera):
    """The film of the throw through a camera, which is tracked as it is."""
    ice = Ice.uniform(0.03)
    path = slide(ice, Throw(speed=1.5, angle=0.02, spin=1.2).release(), fps=120).trajectory
    assert path is not None
    spec = FilmSpec(**camera, people=False, fps=FPS, tail=0.5)
    renderer = FilmRenderer(spec)
    frames, scene = list(renderer.frames(path, seed=1)), scene_of(renderer.camera)
    film = CleanFilm(frames=frames, truth=on_film(path, spec), scene=scene)
    rms, share = error(film, frames, folder / "film.mp4")
    assert rms < 0.015
    assert share > 0.97
    return replace(film, error=rms)


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """The throw seen from above its half of the sheet."""
    return filmed(tmp_path_factory.mktemp("half"), camera=home_half(WHOLE))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The same with the whole sheet, whose corners are enough to notice that a camera moves."""
    return filmed(tmp_path_factory.mktemp("whole"), camera="gantry", size=WHOLE)


def shifted(frame, right, down, scale=1.0, turn=0.0):
    size = frame.shape[1::-1]
    matrix = cv2.getRotationMatrix2D((size[0] / 2, size[1] / 2), np.degrees(turn), scale)
    matrix[:, 2] += (right, down)
    return cv2.warpAffine(
        frame, matrix, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )


def error(film, frames, path, write=write_film):
    """Return the track's root mean square error [m], and the share of frames that have a row.

    Whatever is wrong with a film, the errors that its track states must hold.
    """
    truth = film.truth
    write(path, frames, FPS)
    track = track_film(path, film.scene).trajectory
    there = np.column_stack([np.interp(track.t, truth.t, truth.xy[:, i]) for i in (0, 1)])
    off = np.abs(track.xy - there)
    assert np.mean(off < 3 * track.sigma_xy[:, None]) > 0.9
    rms = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
    return rms, len(track) / len(frames)


def swaying(frames):
    t = np.arange(len(frames)) / FPS
    by = np.column_stack(
        [3 * np.sin(2.2 * t), 2 * np.cos(1.5 * t) - 2, 1 + 0 * t, 5e-4 * np.sin(t)]
    )
    return [shifted(frame, *moved) for frame, moved in zip(frames, by, strict=True)]


def knocked(frames):
    return [shifted(f, 6, 4) if i > len(frames) // 2 else f for i, f in enumerate(frames)]


def bands_running_over_the_picture(frames):
    """Lamps that flicker while the camera reads its rows, slightly faster than the frame rate."""
    height = len(frames[0])
    rows = np.arange(height)[:, None, None] / height
    return [
        np.clip(f * (1 + 0.06 * np.sin(1.3 * i + 7.5 * rows)), 0, 255).astype(np.uint8)
        for i, f in enumerate(frames)
    ]


def half_the_lights_out(frames):
    return [
        (f * (0.7 if i > len(frames) // 2 else 1.0)).astype(np.uint8) for i, f in enumerate(frames)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("view", "fault"),
    [
        ("whole", swaying),
        ("whole", knocked),
        ("clean", bands_running_over_the_picture),
        ("clean", half_the_lights_out),
    ],
)
def test_faults_that_can_be_corrected_cost_a_few_millimetres(request, tmp_path, view, fault):
    film = request.getfixturevalue(view)
    rms, share = error(film, fault(film.frames), tmp_path / "film.mp4")
    assert rms < film.error + 0.004
    assert share > 0.97


def test_repeated_frames_do_not_pull_the_track_back(clean, tmp_path):
    """At 1.5 m/s a repeated frame shows the stone 150 mm behind where it is."""
    frames = [clean.frames[i - (i % 5 == 4)] for i in range(len(clean.frames))]
    rms, _ = error(clean, frames, tmp_path / "film.mp4")
    assert rms < clean.error + 0.006


def write_coarsely(path, frames, fps):
    with film_writer(path, frames[0].shape[1::-1], fps, quality=36, threads=1) as writer:
        for frame in frames:
            writer.write(frame)


def test_a_coarse_copy_costs_a_centimetre(clean, tmp_path):
    """Strong compression shows a slow stone behind its place, and σ covers that error."""
    rms, share = error(clean, clean.frames, tmp_path / "copy.mp4", write=write_coarsely)
    assert rms < clean.error + 0.01
    assert share > 0.9


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda f, i, n: shifted(f, min(i, 40) * 1.6, 0), "this camera moves: by"),
        (lambda f, i, n: shifted(f, 0, 0, 1.05 if i > n // 2 else 1.0), "zoomed by +5."),
    ],
)
def test_a_moving_camera_is_refused_with_the_time(whole, tmp_path, fault, words):
    frames, scene = whole.frames, whole.scene
    spoilt = [fault(frame, i, len(frames)) for i, frame in enumerate(frames)]
    write_film(tmp_path / "film.mp4", spoilt, FPS)
    with pytest.raises(InputError) as refused:
        track_film(tmp_path / "film.mp4", scene)
    assert words in str(refused.value)
    assert "film.mp4, at " in str(refused.value)


def test_another_view_is_distinguished_from_people_in_front_of_the_same_one():
    rng = np.random.default_rng(2)
    hall, other = (
        cv2.resize(rng.integers(0, 256, (34, 60, 3), dtype=np.uint8), (480, 272)) for _ in range(2)
    )
    crowded = hall.copy()
    crowded[:, 100:400] = other[:, 100:400]
    same = [(i / FPS, crowded if i > 4 else hall) for i in range(12)]
    assert stabiliser_for(same, "film.mp4") is None
    with pytest.raises(InputError, match="the view differs"):
        stabiliser_for([*same[:5], *((t, other) for t, _ in same[5:])], "film.mp4")


def test_people_who_walk_away_are_not_taken_for_a_moving_camera():
    """The strongest features of the first frame walk away; two thin lines stay or move."""
    rng = np.random.default_rng(3)

    def view(*, crowd, moved=0):
        frame = np.full((270, 480, 3), 225.0)
        frame[60 + moved : 64 + moved] -= 25
        frame[200 + moved : 204 + moved] -= 25
        frame += np.random.default_rng(crowd * 7 + moved).normal(0, 1.5, frame.shape)
        if crowd:
            for x in range(20, 460, 60):
                frame[100:160, x : x + 30] = 255 * rng.integers(0, 2, (60, 30, 1))
        return np.clip(frame, 0, 255).astype(np.uint8)

    later = [(i / FPS, view(crowd=False)) for i in range(1, 12)]
    assert stabiliser_for([(0.0, view(crowd=True)), *later], "film.mp4") is None
    moved = [(i / FPS, view(crowd=False, moved=20)) for i in range(1, 12)]
    with pytest.raises(InputError, match="the view differs"):
        stabiliser_for([(0.0, view(crowd=True)), *moved], "film.mp4")


def test_a_picture_with_hardly_any_detail_is_not_taken_for_a_moving_camera():
    """A bright block moves over a bare field."""
    frames = []
    for i in range(20):
        frame = np.full((270, 480, 3), 230, dtype=np.uint8)
        frame[100:140, 20 * i : 20 * i + 40] = 40
        frames.append((i / FPS, frame))
    assert stabiliser_for(frames, "film.mp4") is None


def test_a_film_with_a_corrupt_end_gives_the_rows_before_it(clean, tmp_path):
    frames, truth, scene = clean.frames, clean.truth, clean.scene
    write_film(tmp_path / "whole.mp4", frames, FPS)
    content = bytearray((tmp_path / "whole.mp4").read_bytes())
    noise = np.random.default_rng(0).integers(0, 256, len(content) // 4, dtype=np.uint8)
    at = int(0.65 * len(content))
    content[at : at + len(noise)] = noise.tobytes()
    (tmp_path / "film.mp4").write_bytes(content)
    track = track_film(tmp_path / "film.mp4", scene).trajectory
    assert 0.4 * len(frames) < len(track) < 0.9 * len(frames)
    sound = track.t < 0.5 * truth.t[-1]
    there = np.column_stack([np.interp(track.t, truth.t, truth.xy[:, i]) for i in (0, 1)])
    assert np.linalg.norm(track.xy - there, axis=1)[sound].max() < 0.02


def test_a_spot_on_the_ice_before_the_throw_is_not_the_stone(clean, tmp_path):
    """It has a stone's size and is a little darker than the ice; in the film's first second."""
    frames, truth, scene = clean.frames, clean.truth, clean.scene
    camera = camera_from_scene(scene, frames[0].shape[1::-1])
    lies = truth.xy[0] - [0.0, 1.5]
    u, v = camera.project(np.array([[*lies, 0.0]]))[0].astype(int)
    bare = np.median(frames[::4], axis=0)
    spotted = bare.copy()
    spotted[v - 2 : v + 4, u - 3 : u + 3] -= 30
    noise = np.random.default_rng(0).normal(0, 1.5, bare.shape)
    before = [(still + noise).clip(0, 255).astype(np.uint8) for still in [spotted] * 6 + [bare] * 3]
    write_film(tmp_path / "film.mp4", before + frames, FPS)
    track = track_film(tmp_path / "film.mp4", scene).trajectory
    assert track.t[0] > 1.4
    there = np.column_stack([np.interp(track.t - 1.5, truth.t, truth.xy[:, i]) for i in (0, 1)])
    assert np.sqrt(np.mean(np.sum((track.xy - there) ** 2, axis=1))) < 0.02


def test_grain_of_twenty_grey_levels_hides_no_stone(clean, tmp_path):
    """Noise nearly as strong as a stone's contrast with the ice, in every pixel's brightness."""
    rng = np.random.default_rng(0)
    frames = [
        np.clip(frame + rng.normal(0, 20, (*frame.shape[:2], 1)), 0, 255).astype(np.uint8)
        for frame in clean.frames
    ]
    rms, seen = error(clean, frames, tmp_path / "grain.mp4")
    assert seen > 0.9
    assert rms < 0.02
