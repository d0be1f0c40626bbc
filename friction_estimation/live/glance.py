"""First numbers of a throw while its stone slides, from the frames of a camera that films now.

The network that finds stones looks ten times a second where the stone should be. What it finds is a
track, measured as any track is; the film is tracked in full afterwards, and replaces these numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from curling_env.errors import TrackTooShortError
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.scene import Scene
from friction_estimation.tracking.detection.detector import DetectedPlace, StoneFinder
from friction_estimation.tracking.tuning import DECELERATION
from friction_estimation.tracks.throw_table import ThrowMeasures, measure_throw

INTERVAL = 0.09
"""Minimum time between two looks [s]."""
COMPARED_AFTER = 0.35
"""Motion is what has changed since this long before [s]."""
LEAST_CHANGE = 18
"""Of brightness, of 255, that counts as motion."""
SHRUNK = 4
"""Motion is looked for in pictures of this part of the size."""
FASTEST, SLOWEST = 4.5, 0.25
"""Speeds of a thrown stone that is found [m/s]."""
LEAST_SCORE = 0.5
"""Least mean score of the thrown stone; feet of people have less."""
ENOUGH = 6
"""Looks in a line that make a moving stone."""
GATE, SIGMAS = 0.3, 2.0
"""Largest distance from the expected place: this [m], and this multiple of its standard error."""
REACH = 0.15
"""The stone is looked for this much farther around its expected place [m]."""
LATEST = 25
"""Number of rows that a place is expected from."""
LONGEST_UNSEEN = 3.0
"""A stone unseen for longer is given up [s]."""
STILL_SECONDS, STILL_SPEED = (1.0, 2.0, 4.0), 0.08
"""A stone rests once its speed and the error of that are less, over one of these times [s, m/s]."""
LYING = 3.0
"""Time for which a stone that rests is taken to lie there [s]."""
MOST_FITTING = 3
"""Number of chains of detections that one more detection continues."""
LONGEST_HIDDEN = 1.0
"""Longest time that a stone is hidden before it is followed [s]."""

SHOWN = ("back_to_hog", "hog_to_hog", "line")
"""Numbers that are shown while a stone slides."""

Row = tuple[float, float, float, float, float]
"""Time [s], place and its standard error [m], and the detector's score of a stone."""


@dataclass(eq=False)
class Glance:
    """Follows the thrown stone from frame to frame.

    Parameters
    ----------
    camera, scene : of the frames that are added
    rests : whether the stone that was seen has come to rest
    seen : measurements of its throw; None while no stone slides
    """

    camera: Camera
    scene: Scene
    rests: bool = False
    seen: ThrowMeasures | None = None
    _finder: StoneFinder = field(init=False)
    _looks: list[tuple[float, Image]] = field(default_factory=list)
    _chains: list[list[Row]] = field(default_factory=list)
    _rows: list[Row] = field(default_factory=list)
    _last_look: float = -np.inf

    def __post_init__(self) -> None:
        model = StoneModel(radius=self.scene.stone_radius, height=self.scene.stone_height)
        self._finder = StoneFinder(self.camera, model, self.scene.sheet, quick=True)

    def wants(self, t: float) -> bool:
        """Return whether the frame of a time [s] is to be added."""
        return t - self._last_look >= INTERVAL

    def add(self, t: float, picture: Image) -> bool:
        """Look at a frame; return whether more is known of a throw than before.

        Parameters
        ----------
        t : time of the frame [s]
        picture : (rows, columns, 3) BGR
        """
        self._last_look = t
        moved = self._moved(t, picture)
        known, rested = _known(self.seen), self.rests
        if self._rows and not self.rests:
            self._follow(t, picture)
        elif len(moved):
            self._search(t, picture, moved)
        if rested and self.rests:
            return False
        self.seen = self._measured() if self._rows else None
        return (_known(self.seen), self.rests) != (known, rested)

    def _moved(self, t: float, picture: Image) -> Floats:
        """Parts of the picture (k, 2, 2) that have changed [px]."""
        height, width = picture.shape[:2]
        size = (width // SHRUNK, height // SHRUNK)
        small = cv2.cvtColor(
            cv2.resize(picture, size, interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2GRAY
        )
        self._looks = [one for one in self._looks if t - one[0] < 2 * COMPARED_AFTER]
        before = [look for when, look in self._looks if t - when >= COMPARED_AFTER]
        self._looks.append((t, np.asarray(small, dtype=np.uint8)))
        if not before:
            return np.empty((0, 2, 2))
        changed = (cv2.absdiff(small, before[-1]) >= LEAST_CHANGE).astype(np.uint8)
        _, _, found, _ = cv2.connectedComponentsWithStats(cv2.dilate(changed, np.ones((5, 5))))
        boxes = SHRUNK * found[1:, :4].astype(np.float64)
        return np.stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]], axis=1)

    def _search(self, t: float, picture: Image, moved: Floats) -> None:
        """Join detections to chains; one that slides along the sheet is the thrown stone."""
        longer: list[list[Row]] = []
        for one in self._finder.detect(picture, moved):
            here = _row(t, one)
            fitting = sorted((k for k in self._chains if _goes_on(k, here)), key=len)
            # It may also be the first of a chain: one that fits may be of another thing.
            longer += [[here], *([*chain, here] for chain in fitting[-MOST_FITTING:])]
        self._chains = [k for k in self._chains if t - k[-1][0] < LONGEST_HIDDEN] + longer
        likely = [k for k in longer if np.mean([row[4] for row in k]) >= LEAST_SCORE]
        best = max(likely, key=len, default=[])
        if len(best) >= ENOUGH and abs(best[-1][2] - best[0][2]) > SLOWEST * (t - best[0][0]):
            self._rows, self._chains, self.rests = best, [], False

    def _follow(self, t: float, picture: Image) -> None:
        """Look for the stone where it should be."""
        expected = _expected(self._rows, t)
        gate = GATE + SIGMAS * self._rows[-1][3]
        around = expected + (gate + REACH) * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
        px = self.camera.project(np.column_stack([around, np.zeros(4)]))
        box = np.array([[px.min(axis=0), px.max(axis=0)]])
        found: list[DetectedPlace] = []
        if np.isfinite(box).all():
            found = self._finder.detect(picture, box)
        near = [one for one in found if np.hypot(*(one.xy - expected)) < gate]
        if near:
            one = max(near, key=lambda place: place.score - np.hypot(*(place.xy - expected)))
            self._rows.append(_row(t, one))
        if t - self._rows[-1][0] > LONGEST_UNSEEN:
            self._rows = []
            return
        self.rests = _still(np.array(self._rows)) > 0

    def _measured(self) -> ThrowMeasures | None:
        rows = np.array(self._rows)
        if self.rests:
            lying = rows[-_still(rows) :]
            times = np.arange(lying[0, 0], lying[0, 0] + LYING, INTERVAL)
            place = np.tile(lying[len(lying) // 2 :, 1:].mean(axis=0), (len(times), 1))
            rows = np.vstack([rows[: -len(lying)], np.column_stack([times, place])])
        unknown = np.full(len(rows), np.nan)
        track = Trajectory(
            t=rows[:, 0] - rows[0, 0], xy=rows[:, 1:3], sigma_xy=rows[:, 3], theta=unknown
        )
        try:
            return measure_throw(track)
        except TrackTooShortError:
            return None


def _still(rows: Floats) -> int:
    """Return the number of the latest rows (n, 5) in which a stone lies still; 0 if it moves."""
    for seconds in STILL_SECONDS:
        late = rows[rows[:, 0] >= rows[-1, 0] - seconds]
        if len(late) < ENOUGH or rows[0, 0] > rows[-1, 0] - seconds:
            continue
        past = late[:, 0] - late[:, 0].mean()
        off = late[:, 1:3] - late[:, 1:3].mean(axis=0)
        velocity = past @ off / (past @ past)
        scatter = np.sqrt(np.square(off - np.outer(past, velocity)).sum() / (len(late) - 2))
        if np.hypot(*velocity) + scatter / np.sqrt(past @ past) < STILL_SPEED:
            return len(late)
    return 0


def _known(seen: ThrowMeasures | None) -> list[bool]:
    """Return which of the lines of the sheet a stone is known to have passed."""
    return [seen is not None, *(getattr(seen, name, None) is not None for name in SHOWN)]


def _row(t: float, one: DetectedPlace) -> Row:
    sigma = float(np.sqrt(np.trace(one.covariance) / 2))
    return t, float(one.xy[0]), float(one.xy[1]), sigma, float(one.score)


def _goes_on(chain: Sequence[Row], here: Row) -> bool:
    """Return whether a place may be the next one of a chain of places."""
    t, x, y, *_ = chain[-1]
    after = here[0] - t
    if after <= 0:
        return False
    if len(chain) == 1:
        return SLOWEST * after < np.hypot(here[1] - x, here[2] - y) < FASTEST * after
    return bool(np.hypot(*(np.array(here[1:3]) - _expected(chain, here[0]))) < GATE)


def _expected(rows: Sequence[Row], t: float) -> Floats:
    """Return the place at a time, from the latest rows and the usual deceleration."""
    late = np.array(rows[-LATEST:])
    past, xy = late[:, 0] - late[-1, 0], late[:, 1:3]
    way = xy[-1] - xy[0]
    change = DECELERATION * way / max(float(np.hypot(*way)), REACH)
    fit = np.polynomial.polynomial.polyfit(past, xy + np.outer(past**2 / 2, change), 1)
    u = min(t - late[-1, 0], float(np.hypot(*fit[1])) / DECELERATION)
    return fit[0] + u * fit[1] - u**2 / 2 * change
