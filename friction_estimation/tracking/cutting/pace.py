"""At which pace things go: who walks keeps one, a stone slows down, what lies still has none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from curling_env.errors import NoThrowError
from curling_env.sheet import HOG_LINE_Y
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Indices
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning as tracking
from friction_estimation.tracking.cutting import tuning
from friction_estimation.tracking.detection.steady_slides import resolution
from friction_estimation.tracking.detection.thrown_stone import RoughPath, Sighting


def is_thrown(path: RoughPath) -> bool:
    """Whether something moves as a stone does that slides along the ice.

    It goes some way, and it slows down; who carries a stone walks at one pace.
    """
    if abs(path.sightings[-1].xy[1] - path.sightings[0].xy[1]) < tuning.MIN_PATH:
        return False
    t, along = _way_of(path)
    if len(t) < 4:  # too few to tell
        return bool(along[-1] - along[0] > tuning.WALKING_SPEED * (t[-1] - t[0]))
    slowing, sigma = slowing_of(t, along)
    lasted = t[-1] - t[0]
    speed = (along[-1] - along[0]) / lasted
    share = (slowing + 2 * sigma) * lasted / speed
    return bool(speed > tuning.WALKING_SPEED or share > tuning.MIN_SLOWING)


def is_beside_a_stone(path: RoughPath) -> bool:
    """Whether people go along the sheet and slow down as a stone does: then they sweep one."""
    t, along = _way_of(path)
    if along[-1] < tuning.MIN_SWEPT or t[-1] - t[0] < tuning.MIN_SWEPT_SECONDS or len(t) < 4:
        return False
    slowing, sigma = slowing_of(t, along)
    return slowing - 2 * sigma > tuning.LEAST_SLOWING


def _way_of(path: RoughPath) -> tuple[Floats, Floats]:
    """Times (n,) [s], and how far along the sheet it had come (n,) [m], until it hardly moves."""
    t = np.array([s.t for s in path.sightings])
    along = np.abs(np.array([s.xy[1] for s in path.sightings]) - path.sightings[0].xy[1])
    moving = np.flatnonzero(along >= tuning.MOVING_SHARE * along[-1])[0] + 1
    return t[:moving], along[:moving]


def slides_freely(track: Trajectory) -> bool:
    """The same of a measured track."""
    every = max(1, len(track) // tuning.JUDGED_ROWS)
    rows = zip(track.t[::every], track.xy[::every], strict=True)
    sightings = (Sighting(frame=k, t=t, xy=xy, likeness=1.0) for k, (t, xy) in enumerate(rows))
    return is_thrown(RoughPath(sightings=tuple(sightings)))


def stops_before_its_hog_line(track: Trajectory) -> bool:
    """Whether something comes to rest before the hog line of the end that it comes from.

    Then it was not thrown: somebody walks there, or a stone is moved.
    """
    y = track.xy[:, 1]
    late = track.xy[track.t >= track.t[-1] - tuning.RESTED_SECONDS]
    rests = np.linalg.norm(late[0] - late[-1]) < 2 * tuning.REST_DISTANCE
    return bool(rests and np.sign(y[-1] - y[0]) * y[-1] < -HOG_LINE_Y)


def moved(seen: Trajectory | RoughPath) -> str:
    """Why what a track or a path shows was not thrown, in words; empty if it was."""
    if isinstance(seen, RoughPath):
        if not seen.measured:
            return ""
        t, xy = (np.array([getattr(s, name) for s in seen.sightings]) for name in ("t", "xy"))
        seen = Trajectory(t=t, xy=xy)
    if not slides_freely(seen):
        return "what moves there keeps its pace, as a stone does that is carried or pushed"
    if stops_before_its_hog_line(seen):
        return "what moves there stops before the hog line of its own end, as no thrown stone does"
    return ""


def judged_of(film: Path) -> Callable[[RoughPath], None]:
    """A function that refuses the path of what was moved in a film.

    Raises
    ------
    NoThrowError : by the function, for a stone that is carried, pushed or moved aside
    """

    def judged(path: RoughPath) -> None:
        if why := moved(path):
            raise NoThrowError(why, source=film)

    return judged


def slides_until(path: RoughPath, far: float, latest: float = tuning.LAST_PACE_SECONDS) -> float:
    """How long a stone may slide on from where it was last seen [s].

    Parameters
    ----------
    far : where the ice ends, from the middle of the sheet [m]
    latest : how fast it was at last is taken from sightings so far back [s]
    """
    t = np.array([s.t for s in path.sightings])
    y = np.array([s.xy[1] for s in path.sightings])
    recent = t >= t[-1] - latest
    if len(t) < 4 or np.count_nonzero(recent) < 2:
        return float(t[-1])
    pace = float(np.polyfit(t[recent], np.abs(y[recent] - y[0]), 1)[0])
    if pace < tuning.CREEPING:
        return float(t[-1])
    found, sigma = slowing_of(t, np.abs(y - y[0]))
    slowing = float(np.clip(found - 2 * sigma, *tuning.SLOWING))  # pushed, it was faster at first
    left = max(far - y[-1] * np.sign(y[-1] - y[0]), 0.0)
    # It stops, or leaves the ice before.
    at_end = max(pace**2 - 2 * slowing * left, 0.0)
    return float(t[-1] + (pace - np.sqrt(at_end)) / slowing)


def without_resting(sightings: Sequence[Sighting], looked: Floats | None = None) -> list[Sighting]:
    """The sightings without those of stones, or of anything else, that lie still.

    Parameters
    ----------
    looked : (n,) times of all looks, also of those that show nothing [s]; those of the sightings
        if None
    """
    if not sightings:
        return []
    t = np.array([s.t for s in sightings])
    xy = np.array([s.xy for s in sightings])
    looked = np.unique(t) if looked is None else looked
    still = np.zeros(len(t), dtype=bool)
    for k, place in enumerate(xy):
        there = np.unique(t[np.linalg.norm(xy - place, axis=1) < tuning.REST_DISTANCE])
        for low, high in ((t[k] - tuning.REST_SECONDS, t[k]), (t[k], t[k] + tuning.REST_SECONDS)):
            looks_then = np.count_nonzero((looked >= low) & (looked <= high))
            seen = np.count_nonzero((there >= low) & (there <= high))
            whole = low >= looked[0] and high <= looked[-1]
            still[k] |= whole and seen >= tuning.REST_SHARE * looks_then
    return [s for s, lies in zip(sightings, still, strict=True) if not lies]


def without_walkers(sightings: Sequence[Sighting], camera: Camera) -> list[Sighting]:
    """The sightings without those of people who walk at one pace, and of what is near them.

    Heads, feet and a carried stone are seen at places that differ, but each of them goes straight
    on at a pace of its own. A stone slows down so much in that time that its way is no line.
    """
    ordered = sorted(sightings, key=lambda s: s.t)
    if len(ordered) < 4:
        return ordered
    t = np.array([s.t for s in ordered])
    xy = np.array([s.xy for s in ordered])
    reach = tuning.WALK_JITTER + resolution(camera, xy)
    _, look = np.unique(t, return_inverse=True)
    walks = np.zeros(len(t), dtype=bool)
    for i in range(len(t)):
        own = _longest_walk(i, t, xy, reach, look)
        if own is None or not _keeps_pace(t[own], xy[own, 1]):
            continue
        line = np.polynomial.polynomial.polyfit(t[own] - t[i], xy[own], 1)
        around = t[i] - tuning.WALK_MARGIN, t[own[-1]] + tuning.WALK_MARGIN
        then = slice(*np.searchsorted(t, around).tolist())
        way = line[0] + (t[then] - t[i])[:, None] * line[1]
        walks[then] |= np.linalg.norm(xy[then] - way, axis=1) < tracking.PEOPLE_NEAR
    return [s for s, one in zip(ordered, walks, strict=True) if not one]


def _longest_walk(i: int, t: Floats, xy: Floats, reach: Floats, look: Indices) -> Indices | None:
    """Indices of the sightings on the line of one pace from the i-th that has most of them."""
    least, most = tuning.WALK_SECONDS
    first, end = np.searchsorted(t, (t[i] + least, t[i] + most)).tolist()
    velocity = (xy[first:end] - xy[i]) / (t[first:end] - t[i])[:, None]
    pace = np.abs(velocity[:, 1])
    last = np.arange(first, end)[(pace > tuning.STROLLING) & (pace < tuning.WALKING_SPEED)]
    if len(last) == 0:
        return None
    velocity = velocity[last - first]
    way = (t[i:end] - t[i])[None, :, None] * velocity[:, None]
    near = (np.abs(xy[i] + way - xy[None, i:end]) < reach[None, i:end]).all(axis=2)
    near &= look[None, i:end] <= look[last][:, None]
    k = int(np.argmax(near.sum(axis=1)))
    own = i + np.flatnonzero(near[k])
    seen, looks = len(np.unique(look[own])), look[last[k]] - look[i] + 1
    return own if seen >= max(tuning.WALK_SHARE * looks, tuning.WALK_LOOKS) else None


def _keeps_pace(t: Floats, y: Floats) -> bool:
    """Whether something surely slows down less than any stone."""
    slowing, sigma = slowing_of(t, np.abs(y - y[0]))
    return slowing + 2 * sigma < tuning.WALK_SLOWING


def slowing_of(t: Floats, along: Floats) -> tuple[float, float]:
    """How fast something slows down by its way (n,) at four or more times [m/s²]; its error."""
    design = np.column_stack([np.ones_like(t), t - t[0], -0.5 * (t - t[0]) ** 2])
    fit, *_ = np.linalg.lstsq(design, along, rcond=None)
    rest = along - design @ fit
    variance = float(rest @ rest) / max(len(t) - 3, 1)
    return float(fit[2]), float(np.sqrt(variance * np.linalg.inv(design.T @ design)[2, 2]))
