"""Rows of light gates, and the errors of their times and places."""

from __future__ import annotations

import numpy as np
import pytest

from curling_env.errors import InputError, TrackTooShortError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from friction_estimation.discovery import open_session
from friction_estimation.discovery.data.gates import gate_errors, gate_slides, row_noise


def timed(y: list[float], *, throw: int = 0, claims: float | None = None) -> Trajectory:
    """A stone of even 2 m/s at some places, with times to 3 ms."""
    places = np.array(y)
    sigma = np.empty(0) if claims is None else np.full(len(y), claims)
    return Trajectory(
        t=np.abs(places - places[0]) / 2.0,
        xy=np.column_stack([0 * places, places]),
        sigma_t=np.full(len(y), 0.003),
        sigma_xy=sigma,
        throw=throw,
    )


def test_the_error_of_a_row_is_that_of_its_time_by_the_speed():
    assert row_noise(timed([-9.0, -8.9, 4.0, 4.2])) == pytest.approx(np.full(4, 0.006))
    exact = timed([-9.0, 4.0, 8.0])
    exact.sigma_t[:] = 0.0
    assert (row_noise(exact) == 1e-4).all()


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_times_count_from_the_near_hog_line_on(way):
    """A stone's front is there while its centre is still before the line."""
    places = [way * y for y in (-17.4, -HOG_LINE_Y - 0.21, -HOG_LINE_Y - 0.19, 0.0, HOG_LINE_Y)]
    (slide,), reasons = gate_slides([timed(places)])
    assert slide.rows.tolist() == [2, 3, 4]
    assert slide.noise == pytest.approx(0.006)
    assert (slide.stretch, slide.rests, slide.wild) == ((0, 5), False, 0)
    assert reasons == []


def test_a_throw_of_two_times_is_left_out_and_such_throws_alone_are_refused():
    few, enough = timed([0.0, HOG_LINE_Y], throw=7), timed([-9.0, 0.0, 9.0], throw=8)
    slides, reasons = gate_slides([few, enough])
    assert [slide.track.throw for slide in slides] == [8]
    assert reasons == ["throw 7 has 2 gate times from the near hog line on, needs 3"]
    with pytest.raises(TrackTooShortError, match="no throw can be used: throw 7 has 2 gate"):
        gate_slides([few])


def test_edges_of_a_stone_at_one_gate_are_places_of_their_own():
    """Those within two centimetres are of one gate, timed by several throws."""
    first = timed([-9.0, -8.74, 4.0, 4.26], claims=0.008)
    second = timed([-8.99, -8.75, 4.015, 4.27], claims=0.012)
    slides, _ = gate_slides([first, second])
    errors = gate_errors(slides)
    assert errors.places == pytest.approx([-8.995, -8.745, 4.0075, 4.265])
    assert errors.noise == pytest.approx(0.006, rel=0.01)
    assert errors.place_sigma == pytest.approx(0.010)
    unknown, _ = gate_slides([timed([-9.0, 0.0, 9.0])])
    assert gate_errors(unknown).place_sigma == 1e-4


def test_a_session_of_gates_weighs_rows_by_their_speed_and_sees_no_camera():
    """The second stone is twice as fast, so that the same error of a time is twice as far."""
    first, second = timed([-9.0, 0.0, 9.0], throw=4), timed([-9.0, 0.0, 9.0], throw=6)
    second.t[:] /= 2.0
    few = timed([0.0, 9.0], throw=5)
    session = open_session([first, few, second])
    assert session.gates is not None
    assert session.throws.tolist() == [4, 6]
    assert session.orders.tolist() == [0, 2]
    noise = np.repeat([0.006, 0.012], 3)
    assert session.sigma[:, 0] == pytest.approx(noise / np.sqrt(np.mean(noise**2)))
    assert (session.sigma[:, 1] == 1.0).all()
    assert np.isnan(session.theta).all()
    assert session.measurements == ()
    assert len(session.left_out) == 1
    seen = Trajectory(t=np.arange(3.0), xy=np.zeros((3, 2)), throw=9)
    with pytest.raises(InputError, match="throw 9 was seen by a camera"):
        open_session([first, second, seen])
