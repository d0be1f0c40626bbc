"""Written films play in browsers and players."""

from __future__ import annotations

import resource

import av
import numpy as np
import pytest

from curling_env.errors import OutputError
from curling_env.infrastructure import FILM_SUFFIXES, check_writable, kind_of
from friction_estimation.film import film_writer

SIZE = (96, 64)


def bands(count, size=SIZE):
    """Pictures in which a bright band moves down."""
    for k in range(count):
        picture = np.full((size[1], size[0], 3), (90, 60, 30), dtype=np.uint8)
        picture[4 * k : 4 * k + 8] = (20, 200, 240)
        yield picture


def written(path, count=12, size=SIZE, **options):
    with film_writer(path, size, 25.0, **options) as film:
        for picture in bands(count, size):
            film.write(picture)
    return path


def test_a_film_is_h264_that_begins_to_play_before_all_of_it_is_there(tmp_path):
    path = written(tmp_path / "a.mp4")
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")
        assert (stream.width, stream.height, stream.frames) == (*SIZE, 12)
        frames = [frame.to_ndarray(format="bgr24") for frame in film.decode(video=0)]
    for frame, true in zip(frames, bands(12), strict=True):
        assert np.abs(frame[:, 48].astype(float) - true[:, 48]).mean() < 12
    content = path.read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")


def test_frames_are_shown_when_they_were_taken(tmp_path):
    path = tmp_path / "uneven.mp4"
    times = [0.0, 0.04, 0.12, 0.12, 0.3]
    with film_writer(path, SIZE, 25.0) as film:
        for t, picture in zip(times, bands(5), strict=True):
            film.write(picture, t)
    with av.open(str(path)) as film:
        shown = [frame.time for frame in film.decode(video=0)]
    assert shown == pytest.approx(times, abs=2e-5)


def test_an_odd_size_loses_a_row_and_a_column(tmp_path):
    with av.open(str(written(tmp_path / "odd.mp4", size=(97, 65)))) as film:
        assert (film.streams.video[0].width, film.streams.video[0].height) == (96, 64)


@pytest.mark.parametrize("suffix", FILM_SUFFIXES)
def test_a_users_film_is_distinguished_from_a_made_one(tmp_path, suffix):
    made = written(tmp_path / f"made{suffix}")
    assert kind_of(made) == "made film"
    check_writable(made, kinds=("made film",))
    own = tmp_path / f"own{suffix}"
    shown = av.open(str(made))
    with shown, av.open(str(own), "w") as copy:
        stream = copy.add_stream_from_template(shown.streams.video[0])
        for packet in shown.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                copy.mux(packet)
    assert kind_of(own) == "film"
    with pytest.raises(OutputError, match="is a film of your own and is not replaced by a film"):
        check_writable(own, kinds=("made film",))


def test_an_avi_film_can_be_cut_anywhere(tmp_path):
    with av.open(str(written(tmp_path / "a.avi"))) as film:
        assert film.streams.video[0].codec_context.name == "mjpeg"
        assert all(frame.key_frame for frame in film.decode(video=0))


def test_a_full_disk_is_reported_and_leaves_nothing(tmp_path):
    """A limit on the size of files simulates the disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    noise = np.random.default_rng(0).integers(0, 256, (60, 240, 320, 3), dtype=np.uint8)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
    try:
        with (
            pytest.raises(OutputError, match="the film cannot be written"),
            film_writer(tmp_path / "a.mp4", (320, 240), 25.0) as film,
        ):
            for picture in noise:
                film.write(picture)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert list(tmp_path.iterdir()) == []


def test_a_browser_plays_it(tmp_path, page):
    written(tmp_path / "a.mp4", count=13)
    (tmp_path / "a.html").write_text("<video muted src=a.mp4></video>")
    page.goto((tmp_path / "a.html").as_uri())
    page.evaluate("document.querySelector('video').play()")
    page.wait_for_function("document.querySelector('video').ended", timeout=120_000)
    seen = page.evaluate(
        "(film => [film.videoWidth, film.videoHeight, film.duration, film.error])"
        "(document.querySelector('video'))"
    )
    assert seen == [*SIZE, pytest.approx(13 / 25, abs=0.05), None]
