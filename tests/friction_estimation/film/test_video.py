"""Films in and out."""

from __future__ import annotations

from fractions import Fraction

import av
import numpy as np
import pytest

from curling_env.errors import InputError, OutputError
from friction_estimation.film import Film, film_writer, films_in, video


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


def test_frames_after_the_end_of_a_table_of_times_go_on_at_the_films_rate(tmp_path):
    path = film_of(tmp_path / "a.mp4", range(20, 120, 20))
    (tmp_path / "a.mp4.times.csv").write_text("t\n5.0\n5.1\n")
    times = [t for t, _ in Film.open(path).frames()]
    assert times == pytest.approx([0.0, 0.1, 0.14, 0.18, 0.22])


def test_a_film_with_the_longest_name_that_a_disk_takes_is_read(tmp_path):
    path = tmp_path / ("é" * 125 + ".mp4")
    film_of(path, [20, 60, 100])
    assert len(list(Film.open(path).frames())) == 3


def test_samples_spread_over_the_film(tmp_path):
    film = Film.open(film_of(tmp_path / "a.mp4", range(10, 250, 10)))
    levels = [frame.mean() for _, frame in film.sample(4)]
    assert levels == pytest.approx([10, 90, 160, 240], abs=12)


@pytest.mark.parametrize("span", [(0.0, 7.96), (1.5, 6.7)])
def test_a_sample_is_taken_near_key_frames_where_these_are_few(tmp_path, monkeypatch, span):
    film = Film.open(stored(tmp_path / "a.mp4", speckled(200), every=20)).part(*span)
    frames, decoded, whole = list(film.frames()), [], video.decoded

    def counted(*arguments):
        for found in whole(*arguments):
            decoded.append(found)
            yield found

    monkeypatch.setattr(video, "decoded", counted)
    sample = film.sample(14)
    times = np.array([t for t, _ in sample])
    step = (film.frame_count - 1) / 13 / 25
    assert len(sample) == 14
    assert np.abs(times - np.linspace(0, 13 * step, 14)).max() < step / 4 + 0.03
    for t, picture in sample:
        assert np.array_equal(picture, frames[round(25 * t)][1])
    assert len(decoded) < 0.7 * film.frame_count


@pytest.mark.parametrize("content", [None, b"", b"this is no film" * 100])
def test_an_invalid_film_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "film.mp4"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"film\.mp4: (no such film|cannot be decoded)"):
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


def stored(path, pictures, moments=None, codec="libx264", pixels="yuv420p", turned=0, every=12):
    """Make a film like those of other programs: at any times [ms], in any format."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.gop_size = pixels, every
        stream.codec_context.time_base = Fraction(1, 1000)
        if turned:
            stream.set_display_rotation(turned)
        for i, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="bgr24")
            frame.pts = 40 * i if moments is None else int(moments[i])
            frame.time_base = Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def speckled(count, size=(64, 48)):
    """Pictures of which each is brighter than the one before, with coarse colours."""
    rng = np.random.default_rng(3)
    coarse = rng.integers(0, 60, (size[1] // 8, size[0] // 8, 3)).repeat(8, 0).repeat(8, 1)
    return [np.clip(coarse + 150 * i / count, 0, 255).astype(np.uint8) for i in range(count)]


def test_frames_at_uneven_times_keep_them_and_their_numbers(tmp_path):
    moments = np.cumsum(np.random.default_rng(5).integers(15, 70, 150))
    film = Film.open(stored(tmp_path / "a.mp4", speckled(150), moments))
    frames = list(film.frames())
    assert [t for t, _ in frames] == pytest.approx((moments - moments[0]) / 1000, abs=1e-6)
    wanted = [0, 3, 70, 75, 149, 200]
    for (t, frame), number in zip(film.pick(wanted), wanted[:-1], strict=True):
        assert t == pytest.approx(frames[number][0], abs=1e-6)
        assert np.array_equal(frame, frames[number][1])


def test_a_film_of_uneven_rate_lasts_until_its_last_frame(tmp_path):
    """A phone's film may have a fifth fewer frames than its nominal rate says."""
    moments = np.sort(np.random.default_rng(6).choice(250, 150, replace=False)) * 40
    film = Film.open(stored(tmp_path / "a.mp4", speckled(150), moments))
    times = (moments - moments[0]) / 1000
    assert film.duration == pytest.approx(times[-1], abs=0.1)
    part = film.part(times[80], times[140])
    assert (part.first, part.frame_count) == (80, 61)
    assert part.duration == pytest.approx(times[140] - times[80], abs=0.1)
    for asked in film, part:
        shown = np.array([t for t, _ in asked.between(1.0, 4.0, 0.04)])
        assert shown[0] <= 1.1
        assert shown[-1] >= 3.9


@pytest.mark.parametrize("pixels", ["yuv420p", "yuv422p10le"])
def test_an_interlaced_frame_shows_one_moment_only(tmp_path, pixels):
    """Camcorders take the odd lines of a frame later than the even ones."""
    frames = np.full((8, 64, 96, 3), 40, dtype=np.uint8)
    for k in range(8):
        frames[k, 20:44:2, 6 * k + 10 : 6 * k + 26] = 200
        frames[k, 21:44:2, 6 * k + 13 : 6 * k + 29] = 200  # half a frame's time later
    path = tmp_path / "a.mts"
    with av.open(str(path), "w", format="mpegts") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 96, 64, pixels
        stream.options = {"flags": "+ildct+ilme", "crf": "4"}
        for picture in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))
        container.mux(stream.encode())
    shown = [frame[24:40, :, 1] for _, frame in Film.open(path).frames()]
    assert len(shown) == 8
    for k, square in enumerate(shown):
        columns = [np.flatnonzero(row > 120).mean() for row in square]
        assert columns == pytest.approx([6 * k + 17.5] * 16, abs=0.6)


@pytest.mark.parametrize(("codec", "pixels"), [("libx264", "yuv420p"), ("mjpeg", "yuvj422p")])
@pytest.mark.parametrize("turned", [0, 90])
def test_a_part_of_a_frame_is_that_part_of_all_of_it(tmp_path, codec, pixels, turned):
    path = stored(tmp_path / "a.mkv", speckled(3), codec=codec, pixels=pixels)
    if turned:
        path = stored(tmp_path / "a.mp4", speckled(3), turned=turned)
    film = Film.open(path)
    for (_, raw), (_, frame) in zip(film.lazy_frames(), film.frames(), strict=True):
        assert raw.shape == frame.shape == (*film.size[::-1], 3)
        assert film.size == ((48, 64) if turned else (64, 48))
        for part in np.s_[3:20, 7:31], np.s_[40:90, 50:99], np.s_[10:10, 4:8]:
            assert np.array_equal(raw[part], frame[part])


def test_a_camera_held_upright_gives_upright_pictures(tmp_path):
    lying = np.zeros((48, 64, 3), dtype=np.uint8)
    lying[:, :16] = 200
    film = Film.open(stored(tmp_path / "a.mp4", [lying] * 3, turned=90))
    _, frame = next(film.frames())
    assert frame[50:].mean() > 150
    assert frame[:40].mean() < 40


def test_a_damaged_part_costs_only_its_own_frames(tmp_path):
    path = stored(tmp_path / "a.mp4", speckled(120, (320, 240)))
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + len(content) // 10] = bytes(len(content) // 10)
    path.write_bytes(content)
    times = [t for t, _ in Film.open(path).frames()]
    assert times[-1] == pytest.approx(119 / 25, abs=0.05)
    assert 60 < len(times) <= 120


def test_no_frame_shows_a_stale_picture_after_a_damaged_part(tmp_path):
    """Changes to a lost picture do not show the camera's view."""
    still = np.random.default_rng(2).integers(90, 130, (240, 320, 3), dtype=np.uint8)
    frames = []
    for k in range(90):
        frames.append(still.copy())
        frames[-1][100:130, 3 * k : 3 * k + 30] = 240
    path = stored(tmp_path / "a.mp4", frames)
    content = bytearray(path.read_bytes())
    middle = int(0.4 * len(content))
    content[middle : middle + 400] = bytes(400)
    path.write_bytes(content)
    film = Film.open(path)
    seen, picked = list(film.frames()), film.pick(range(90))
    assert 40 < len(seen) == len(picked) < 90
    for t, frame in [*seen, *picked]:
        bright = np.flatnonzero(frame[105:125, :, 1].mean(axis=0) > 200)
        assert bright.mean() == pytest.approx(3 * round(25 * t) + 14.5, abs=3)


def test_a_single_picture_is_a_film_of_one_frame(tmp_path):
    film = Film.open(stored(tmp_path / "a.mp4", speckled(1)))
    assert [t for t, _ in film.sample(10)] == [0.0]


@pytest.mark.parametrize(("codec", "suffix"), [("libx264", ".mp4"), ("mjpeg", ".avi")])
def test_a_part_of_a_film_is_a_film_of_the_same_pictures(tmp_path, codec, suffix):
    pixels = "yuv420p" if codec == "libx264" else "yuvj422p"
    every = 100 if suffix == ".ts" else 12  # where a stream is sought, it goes somewhere near
    path = stored(tmp_path / f"a{suffix}", speckled(150), codec=codec, pixels=pixels, every=every)
    film = Film.open(path)
    whole = list(film.frames())
    part = film.part(2.03, 4.0)
    first = round(25 * 2.03)
    assert part.frame_count == 100 - first + 1
    assert film.begin_of(part) == pytest.approx(whole[first][0], abs=1e-6)
    frames = list(part.frames())
    assert [t for t, _ in frames] == pytest.approx(np.arange(100 - first + 1) / 25, abs=1e-6)
    for (_, frame), (_, same) in zip(frames, whole[first:], strict=False):
        assert np.array_equal(frame, same)
    inner = part.part(1.0, 1.2)
    assert film.begin_of(inner) == pytest.approx(whole[first + 25][0], abs=1e-6)
    assert np.array_equal(next(inner.frames())[1], whole[first + 25][1])
    for t, frame in (*part.sample(5), *part.pick([0, 45, 49])):
        assert np.array_equal(frame, whole[first + round(25 * t)][1])


def test_a_part_of_a_stream_is_found_at_any_distance_from_its_key_frame(tmp_path):
    """A transport stream has no index of its pictures: a seek is approximate."""
    film = Film.open(stored(tmp_path / "a.ts", speckled(150), every=150))
    whole, part = list(film.frames()), film.part(4.6, 5.8)
    frames = list(part.frames())
    assert len(frames) == part.frame_count == 31
    for (_, frame), (_, true) in zip(frames, whole[115:146], strict=True):
        assert np.array_equal(frame, true)


def test_slow_motion_that_the_camera_noted_is_played_at_the_speed_of_life(tmp_path):
    path = tmp_path / "slow.mp4"
    options = {"movflags": "use_metadata_tags"}
    with av.open(str(path), "w", options=options) as container:
        container.metadata["com.android.capture.fps"] = "100.000000"
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for picture in speckled(50):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="bgr24")))
        container.mux(stream.encode())
    film = Film.open(path)
    assert (film.slow, film.fps) == (4.0, 100.0)
    assert [t for t, _ in film.frames()] == pytest.approx(np.arange(50) / 100, abs=1e-6)
    assert [t for t, _ in film.pick([10])] == pytest.approx([0.1], abs=1e-6)
    assert Film.open(path, slow=1.0).fps == 25.0
    assert Film.open(path, slow=2.0).part(0.2, 0.4).frame_count == 11


def test_films_of_a_folder_come_in_the_order_of_their_numbers(tmp_path):
    evening = tmp_path / "evening"
    evening.mkdir()
    for name in ("throw 10.MP4", "throw 9.mov", "._throw 9.mov", "notes.txt", "throw 9.scene.json"):
        (evening / name).touch()
    first = tmp_path / "first.mp4"
    found = films_in([first, str(evening)])
    assert found == [first, evening / "throw 9.mov", evening / "throw 10.MP4"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"empty: contains no films \(\.mp4, "):
        films_in([tmp_path / "empty"])
