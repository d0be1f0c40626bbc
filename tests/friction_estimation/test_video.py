"""Films in and out."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError, OutputError
from friction_estimation.video import Film, film_writer


def film_of(path, grey_levels, fps=25.0):
    with film_writer(path, (64, 48), fps) as writer:
        for level in grey_levels:
            writer.write(np.full((48, 64, 3), level, dtype=np.uint8))
    return path


def test_frames_come_in_order_with_their_times(tmp_path):
    film = Film.open(film_of(tmp_path / "a.mp4", range(20, 220, 20)))
    frames = list(film.frames())
    assert (film.size, film.fps, film.frame_count) == ((64, 48), 25.0, 10)
    assert [t for t, _ in frames] == pytest.approx(np.arange(10) / 25, abs=1e-6)
    assert np.all(np.diff([frame.mean() for _, frame in frames]) > 10)


def test_a_given_rate_replaces_the_films_own(tmp_path):
    film = Film.open(film_of(tmp_path / "a.mp4", range(20, 120, 20)), fps=50.0)
    assert [t for t, _ in film.frames()] == pytest.approx(np.arange(5) / 50)


def test_samples_spread_over_the_film(tmp_path):
    film = Film.open(film_of(tmp_path / "a.mp4", range(10, 250, 10)))
    levels = [frame.mean() for _, frame in film.sample(4)]
    assert levels == pytest.approx([10, 90, 160, 240], abs=12)


@pytest.mark.parametrize("content", [None, b"", b"this is no film" * 100])
def test_what_is_no_film_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "film.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"film\.mp4: (no such film|not a film)"):
        Film.open(path)


def test_a_film_that_fails_halfway_is_not_there(tmp_path):
    path = tmp_path / "a.mp4"

    def fail():
        with film_writer(path, (64, 48), 25.0) as writer:
            writer.write(np.zeros((48, 64, 3), dtype=np.uint8))
            raise RuntimeError("light went out")

    with pytest.raises(RuntimeError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_a_suffix_that_is_no_film_is_refused(tmp_path):
    with (
        pytest.raises(OutputError, match=r"\.mp4 or \.avi"),
        film_writer(tmp_path / "a.xyz", (64, 48), 25.0),
    ):
        pass
