"""Association of detections to stones, and the modes of these."""

from __future__ import annotations

import numpy as np
import pytest

from friction_estimation.synthetic import FilmSpec
from friction_estimation.tracking.association.finding import found_again, thrown_paths
from friction_estimation.tracking.association.linking import RestingPlace, link
from friction_estimation.tracking.association.paths import RESTING, SLIDING, most_likely_paths
from friction_estimation.tracking.association.recording import (
    is_throw,
    slides_of,
    throws_among,
    without_returns,
)
from friction_estimation.tracking.detection.detections import Detections

AREA = 200.0
RADIUS = 0.145


def slide(t, start, velocity, deceleration=0.1):
    """Places (n, 2) of a stone that slides on ice until it rests."""
    speed = np.hypot(*velocity)
    going = np.clip(t, 0.0, speed / deceleration)
    way = speed * going - 0.5 * deceleration * going**2
    return np.asarray(start) + way[:, None] * np.asarray(velocity) / speed


def detections(times, paths, clutter=4, seed=0):
    """Detections of stones at places (n, 2), NaN where one is not seen, among others."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(len(times)):
        rows += [
            (k, *(path[k] + rng.normal(0.0, 0.02, 2)), 1.0)
            for path in paths
            if np.isfinite(path[k]).all()
        ]
        rows += [(k, *rng.uniform((-2.4, -20.0), (2.4, 20.0)), -0.5) for _ in range(clutter)]
    frame, x, y, score = np.array(rows).T
    nothing = np.zeros(len(rows), dtype=bool)
    return Detections(
        frame=frame.astype(np.int64),
        t=times[frame.astype(int)],
        xy=np.column_stack([x, y]),
        sigma=np.full((len(rows), 2), 0.03),
        score=score,
        likeness=np.exp(score - 1),
        still=nothing,
        alone=nothing,
        times=times,
    )


def test_a_throw_is_found_among_other_things_and_in_gaps():
    times = np.arange(0.0, 24.0, 0.6)
    true = slide(times, (0.0, -11.0), (0.03, 2.0))
    true[[7, 8, 9, 20]] = np.nan
    seen = detections(times, [true])
    path = most_likely_paths(seen, AREA)[0]
    k = seen.frame[path.at]
    assert np.hypot(*(seen.xy[path.at] - true[k]).T).max() < 0.15
    assert len(path.at) >= 33
    assert path.mode[-1] == RESTING
    assert path.mode[0] == SLIDING
    assert is_throw(path, seen)


@pytest.mark.parametrize("step", [0.5, 0.12])
@pytest.mark.parametrize("seed", range(3))
def test_a_stone_at_rest_stays_at_rest(step, seed):
    times = np.arange(0.0, 34.0, step)
    true = slide(times, (0.0, -11.0), (0.03, 1.9))
    seen = detections(times, [true], clutter=1, seed=seed)
    path, *others = most_likely_paths(seen, AREA)
    assert not others
    t = seen.t[path.at]
    assert (path.mode[t > 19.8] == RESTING).all()
    assert 16.0 < t[path.mode == RESTING].min() < 20.0
    assert len(path.at) > 0.95 * len(times)


def test_nothing_is_found_among_what_is_no_stone():
    seen = detections(np.arange(0.0, 24.0, 0.6), [], clutter=5)
    assert not any(is_throw(path, seen) for path in most_likely_paths(seen, AREA))


@pytest.mark.parametrize("speed", [0.8, 1.4])
def test_a_walker_is_no_throw(speed):
    times = np.arange(0.0, 20.0, 0.5)
    way = speed * times + 0.05 * np.sin(12 * times)
    seen = detections(times, [np.column_stack([0.5 + 0 * times, -12 + way])])
    assert not any(is_throw(path, seen) for path in most_likely_paths(seen, AREA))


def test_a_stone_that_is_pushed_back_is_another_part_of_its_path():
    times = np.arange(0.0, 40.0, 0.5)
    thrown = slide(times, (0.0, -11.0), (0.0, 2.2))
    back = np.where(times > 26.0, 1.2 * (times - 26.0), 0.0)
    seen = detections(times, [thrown - np.column_stack([0 * back, back])], clutter=2)
    parts = [part for path in most_likely_paths(seen, AREA) for part in slides_of(path, seen)]
    throws = [part for part in parts if is_throw(part, seen)]
    assert len(throws) == 1
    assert 20.0 < seen.t[throws[0].at[-1]] < 27.5


def test_the_throw_ends_where_its_stone_rests_before_it_is_moved_again():
    times = np.arange(0.0, 40.0, 0.5)
    thrown = slide(times, (0.0, -11.0), (0.0, 2.2))
    away = np.where(times > 30.0, 0.8 * (times - 30.0), 0.0)
    seen = detections(times, [thrown + np.column_stack([away, 0 * away])], clutter=1)
    path = thrown_paths(most_likely_paths(seen, AREA), seen, 2 * RADIUS)[0]
    assert path.mode[-1] == RESTING
    assert 26.0 < seen.t[path.at[-1]] < 31.5


def test_a_stone_that_nothing_hit_did_not_start_from_rest():
    """One rests where the thrown stone passes, and is taken away just before."""
    times = np.arange(0.0, 30.0, 0.5)
    thrown = slide(times - 4.0, (0.0, -11.0), (0.0, 2.2))
    thrown[times < 4.0] = (0.0, -10.9)
    seen = detections(times, [thrown], clutter=1)
    path = thrown_paths(most_likely_paths(seen, AREA), seen, 2 * RADIUS)[0]
    assert path.mode[0] != RESTING
    assert seen.t[path.at[0]] < 5.5
    assert np.ptp(seen.xy[path.at, 1]) > 20.0


def test_a_path_is_found_again_in_more_frames_but_not_as_a_sweepers():
    times = np.arange(0.0, 20.0, 0.5)
    more = np.arange(0.0, 20.0, 0.125)
    seen = detections(times, [slide(times, (0.0, -11.0), (0.0, 2.2))])
    thrown = thrown_paths(most_likely_paths(seen, AREA), seen, 2 * RADIUS)[0]
    stone, sweeper = (slide(more, (x, -11.0), (0.0, 2.2)) for x in (0.0, 0.9))
    for shown, known in (([stone, sweeper], True), ([sweeper], False)):
        denser = detections(more, shown, seed=1)
        others = most_likely_paths(denser, AREA)
        again = found_again(thrown, seen, others, denser, 2 * RADIUS)
        assert len(others) == len(shown)
        assert (again is not None) == known
        if again is not None:
            assert np.abs(denser.xy[again.at, 0]).max() < 0.3


def test_stones_that_touch_go_on_as_two_equal_weights_do():
    times = np.arange(0.0, 14.0, 0.12)
    hit = 5.0
    rests = np.array([0.0, 0.0])
    aim = np.array([0.1, 2 * RADIUS * np.cos(np.arcsin(0.1 / (2 * RADIUS)))])
    before = slide(times, (0.0, 0.0), (0.0, 2.4))
    offset = rests - aim - before[np.searchsorted(times, hit)]
    speed = 2.4 - 0.1 * hit
    normal = aim / np.hypot(*aim)
    given = 0.95 * speed * normal[1] * normal
    kept = np.array([0.0, speed]) - given
    later = times >= hit
    thrown = np.where(later[:, None], slide(times - hit, rests - aim, kept), before + offset)
    struck = slide(np.maximum(times - hit, 0.0), rests, given)
    seen = detections(times, [thrown, struck], clutter=1)
    path = next(p for p in most_likely_paths(seen, AREA) if p.mode[0] != RESTING)
    lies = np.hypot(*(seen.xy - rests).T) < 0.1
    place = RestingPlace(xy=rests, until=hit - 0.05, at=np.flatnonzero(lies & (seen.t < hit)))
    movers = link(path, [place], seen, 2 * RADIUS)
    assert len(movers) == 2
    for mover, true in zip(movers, (thrown, struck), strict=True):
        at = np.array(mover.at)
        off = np.hypot(*(seen.xy[at] - true[seen.frame[at]]).T)
        assert np.mean(off < 0.12) > 0.9
        assert seen.t[at[-1]] > 12.0


@pytest.fixture(scope="module")
def camera():
    """A camera that sees all of the sheet."""
    return FilmSpec(camera="gantry", size=(960, 540)).resolved()


def test_a_stone_that_is_lost_for_a_while_is_one_throw(camera):
    times = np.arange(0.0, 30.0, 0.4)
    true = slide(times, (0.0, -11.0), (0.03, 2.2))
    true[(times > 8.0) & (times < 14.0)] = np.nan
    seen = detections(times, [true], clutter=0)
    paths = most_likely_paths(seen, AREA)
    ends = [seen.t[path.at[[0, -1]]] for path in paths]
    assert not any(first < 8.0 and last > 14.0 for first, last in ends)
    (one,) = throws_among(paths, seen, camera, AREA)
    assert one.first < 1.0
    assert 20.0 < one.last < 23.0
    assert one.rests


def test_what_moves_between_throws_is_no_throw(camera):
    """A person walks and stops; a stone is slid back; and the next one is thrown past its place."""
    times = np.arange(0.0, 90.0, 0.4)
    thrown = slide(times, (0.0, -11.0), (0.0, 2.2))
    since = np.maximum(times - 30.0, 0.0)
    pushed = 0.55 * np.minimum(since, 2.0) ** 2 + 2.2 * np.maximum(since - 2.0, 0.0)
    back = pushed - 0.05 * np.maximum(since - 2.0, 0.0) ** 2
    first = thrown - np.column_stack([0.0 * times, np.minimum(back, 24.0)])
    first[times > 48.0] = np.nan
    walked = np.minimum(1.4 * np.maximum(times - 50.0, 0.0), 9.0)
    person = np.column_stack([1.5 + 0.0 * times, 15.0 - walked])
    person[times < 50.0] = np.nan
    second = slide(np.maximum(times - 64.0, 0.0), (0.3, -11.0), (0.0, 2.3))
    second[times < 64.0] = np.nan
    seen = detections(times, [first, person, second], clutter=1)
    moves = throws_among(most_likely_paths(seen, AREA), seen, camera, AREA)
    slid_back = []
    found = list(without_returns(moves, lambda begin, end: slid_back.append((begin, end))))
    assert [one.first for one in found] == pytest.approx([0.0, 64.0], abs=1.0)
    assert len(slid_back) == 1
    assert 29.0 < slid_back[0][0] < 34.0
