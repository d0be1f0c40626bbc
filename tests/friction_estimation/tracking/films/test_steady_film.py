"""Frames looked at before a stone is followed."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest

from curling_env.errors import InputError
from friction_estimation.film import Film
from friction_estimation.film.writer import film_writer
from friction_estimation.tracking.films.steady_film import SteadyFilm, sample_size


@pytest.mark.parametrize(
    ("size", "count"),
    [
        ((1280, 720), 40),
        ((1920, 1080), 40),
        ((3840, 2160), 15),
        ((5312, 2988), 7),
        ((9, 10**6), 13),
    ],
)
def test_large_frames_are_fewer(size, count):
    assert sample_size(size) == count
    # A median needs several, and memory has an end.
    assert count * 3 * size[0] * size[1] < 450e6


def test_a_film_of_which_no_frame_is_whole_is_refused(tmp_path):
    with film_writer(tmp_path / "f.mp4", (64, 48), 10.0) as writer:
        for _ in range(5):
            writer.write(np.zeros((48, 64, 3), np.uint8))
    film = Film.open(tmp_path / "f.mp4")
    assert SteadyFilm(film).sample
    with pytest.raises(InputError, match=r"f\.mp4.*no frame can be decoded without damage"):
        SteadyFilm(replace(film, size=(64, 50)))  # frames of another size count as damaged


def test_pictures_of_another_size_are_ignored_and_reported(tmp_path):
    rng = np.random.default_rng(4)
    path, rate = tmp_path / "changes.avi", Fraction(10)
    with av.open(str(path), "w", format="avi") as film:
        stream = film.add_stream("mjpeg", rate=rate)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj420p"
        for k in range(40):
            size = (48, 64, 3) if k < 30 else (24, 32, 3)
            picture = cv2.GaussianBlur(rng.integers(0, 255, size, dtype=np.uint8), (0, 0), 3)
            packet = av.Packet(cv2.imencode(".jpg", picture)[1].tobytes())
            packet.stream, packet.time_base, packet.is_keyframe = stream, 1 / rate, True
            packet.pts = packet.dts = k
            film.mux(packet)
    steady = SteadyFilm(Film.open(path))
    assert [frame.shape for _, frame in steady.frames()] == [(48, 64, 3)] * 30
    assert steady.remarks == (
        "frame 30 (3.0 s) has 32 × 24 pixels, where the film has 64 × 48: 10 such frames ignored",
    )
