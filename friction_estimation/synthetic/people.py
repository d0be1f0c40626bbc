"""People in a film: the thrower, two sweepers ahead of the stone, and walkers beside the sheet.

They disturb tracking as real players do: they move, cast shadows and hide the stone. Their bodies
are made of rods drawn in perspective.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import Sheet
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera
from friction_estimation.synthetic.stone_drawing import PixelBox, box_around
from friction_estimation.synthetic.tuning import (
    BROOM,
    BRUSH,
    HAIR,
    JACKETS,
    LARGE_PERSON_PIXELS,
    PERSON_SAMPLES,
    SHOES,
    SKIN,
    STRIDE_LENGTH,
    SWEEP_RATE,
    THROWER_DECELERATION,
    TROUSERS,
)

Colour = tuple[int, int, int]


class Rod(NamedTuple):
    """Rod with round ends: a limb, a trunk, a head, a broom.

    Parameters
    ----------
    start, stop : ends of its axis, sheet frame [m]
    radius : its radius, at both ends [m]
    colour : blue-green-red
    """

    start: Floats
    stop: Floats
    radius: float
    colour: Colour


@dataclass(frozen=True)
class Person:
    """Person at one moment.

    Parameters
    ----------
    role : thrower, sweeper or walker
    position : (2,) place on the ice, sheet frame [m]
    rods : the parts of the body, and the broom
    """

    role: str
    position: Floats
    rods: tuple[Rod, ...]

    def box(self, camera: Camera) -> PixelBox:
        """Return the box of pixels that the person and the shadow may touch."""
        ends = np.array([end for rod in self.rods for end in (rod.start, rod.stop)])
        spread = np.array([[0.3, 0.3, 0.0], [-0.3, 0.3, 0.0], [0.3, -0.3, 0.0], [-0.3, -0.3, 0.0]])
        ground = np.array([*self.position, 0.0])
        around = (ends[:, None, :] + spread * 0.6).reshape(-1, 3)
        # Heads and shoes extend beyond the ends of their rods.
        above = ends + np.array([0.0, 0.0, 0.15])
        return box_around(camera, np.concatenate([around, above, ground + 1.6 * spread]), 3.0)


class Cast:
    """People on and beside the sheet during one film.

    Parameters
    ----------
    path : the thrown stone in every frame, with `swept`
    released_at : time of the release in the film [s]
    sheet : the ice
    rng : generator for places, speeds and clothes
    """

    def __init__(
        self, path: Trajectory, released_at: float, sheet: Sheet, rng: np.random.Generator
    ) -> None:
        self._path = path
        self._sheet = sheet
        self._released = released_at
        self._ahead = _directions(path)
        self._travelled = path.path_length
        self._sweeping = _smooth(path.swept, path.t, 0.35)
        self._team: Colour = JACKETS[int(rng.integers(3))]
        self._phases = rng.uniform(0.0, 2.0 * np.pi, 3)
        self._hand = float(rng.choice([-1.0, 1.0]))
        self._walkers = [_Walker(sheet, side, rng) for side in (-1.0, 1.0)]
        self._slide = self._thrower_slide()

    def at(self, frame: int) -> list[Person]:
        """Return all people in a frame."""
        walkers = [walker.at(float(self._path.t[frame])) for walker in self._walkers]
        return [*walkers, self._sweeper(frame, 0), self._sweeper(frame, 1), self._thrower(frame)]

    def _frame_of_reference(self, frame: int) -> tuple[Floats, Floats, Floats]:
        """Return the place of the stone, its direction of travel, and the direction to its left."""
        ahead = self._ahead[frame]
        return self._path.xy[frame], ahead, np.array([-ahead[1], ahead[0]])

    def _sweeper(self, frame: int, which: int) -> Person:
        stone, ahead, left = self._frame_of_reference(frame)
        t = float(self._path.t[frame])
        side = 1.0 if which == 0 else -1.0
        at_work = self._sweeping[frame]
        lead = (1.0, 1.45)[which] * at_work + (1.7, 2.3)[which] * (1.0 - at_work)
        aside = 0.62 * at_work + 0.85 * (1.0 - at_work)
        position = self._on_sheet(stone + lead * ahead + side * aside * left)
        moved = float(self._travelled[frame])
        phase = 2.0 * np.pi * moved / STRIDE_LENGTH + self._phases[which]
        stroke = 0.11 * np.sin(2.0 * np.pi * SWEEP_RATE * t + self._phases[which]) * at_work
        brush = stone + (0.36 + 0.22 * which) * ahead + stroke * left
        carried = position + 0.35 * ahead - side * 0.25 * left
        head = at_work * brush + (1.0 - at_work) * carried
        facing = ahead - 0.9 * side * at_work * left
        rods = _standing(position, facing, phase, 0.25 + 0.55 * at_work, self._team)
        hands = np.array([*(position + 0.42 * _unit(facing)), 1.0])
        across = 0.09 * left
        rods += (
            Rod(hands, np.array([*head, 0.06]), 0.014, BROOM),
            Rod(
                np.array([*(head - across), 0.03]), np.array([*(head + across), 0.03]), 0.035, BRUSH
            ),
        )
        return Person("sweeper", position, rods)

    def _on_sheet(self, position: Floats) -> Floats:
        limit = np.array([self._sheet.width, self._sheet.length]) / 2 - 0.2
        return np.clip(position, -limit, limit)

    def _thrower_slide(self) -> Floats:
        """Return the distance of the thrower's slide since the release, in every frame, (n,)
        [m].
        """
        start = int(np.searchsorted(self._path.t, self._released))
        start = min(start, len(self._path) - 2)
        speed = float(np.linalg.norm(np.diff(self._path.xy[start : start + 2], axis=0)))
        speed /= float(self._path.t[start + 1] - self._path.t[start])
        since = np.clip(self._path.t - self._released, 0.0, speed / THROWER_DECELERATION)
        self._let_go = start
        return speed * since - 0.5 * THROWER_DECELERATION * since**2

    def _thrower(self, frame: int) -> Person:
        held = min(frame, self._let_go)
        stone, ahead, left = self._frame_of_reference(held)
        slide = self._slide[frame] * ahead
        # The body is beside the line of delivery, so that the thrower can look along it.
        body = stone + slide - 0.75 * ahead + self._hand * 0.36 * left
        grip = np.array([*(stone + slide - 0.04 * ahead), 0.19])
        return Person("thrower", body, _lunging(body, ahead, grip, self._team, self._hand))


class _Walker:
    """Person who walks up and down beside the sheet."""

    def __init__(self, sheet: Sheet, side: float, rng: np.random.Generator) -> None:
        self._x = side * (sheet.width / 2 + rng.uniform(0.6, 1.2))
        self._span = sheet.length / 2 - 2.0
        self._start = rng.uniform(-self._span, self._span)
        self._speed = rng.uniform(0.3, 1.3) * rng.choice([-1.0, 1.0])
        self._jacket = JACKETS[int(rng.integers(len(JACKETS)))]

    def at(self, t: float) -> Person:
        # A triangle wave: the walker turns round at the ends of the sheet.
        way = self._start + self._speed * t + self._span
        lap = way % (4.0 * self._span)
        back = lap > 2.0 * self._span
        y = (4.0 * self._span - lap if back else lap) - self._span
        facing = np.array([0.0, -np.sign(self._speed) if back else np.sign(self._speed)])
        position = np.array([self._x, y])
        phase = 2.0 * np.pi * self._speed * t / STRIDE_LENGTH
        return Person("walker", position, _standing(position, facing, phase, 0.05, self._jacket))


def _unit(vector: Floats) -> Floats:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)


def _directions(path: Trajectory) -> Floats:
    """Return the direction of travel in every frame, (n, 2); at rest it keeps its last value."""
    chord = _unit(path.xy[-1] - path.xy[0])
    steps = np.gradient(path.xy, axis=0)
    length = np.linalg.norm(steps, axis=1)
    moving = length > 1e-3
    known = np.maximum.accumulate(np.where(moving, np.arange(len(path)), -1))
    lines = np.where(moving[:, None], steps / np.maximum(length, 1e-9)[:, None], chord)
    return np.where(known[:, None] >= 0, lines[np.maximum(known, 0)], chord)


def _smooth(values: Floats, t: Floats, width: float) -> Floats:
    """Return a moving mean over about `width` seconds on either side, so that players do not
    jump.
    """
    if len(t) < 2:
        return values
    half = max(1, round(width / float(t[1] - t[0])))
    kernel = np.hanning(2 * half + 3)
    smooth = np.convolve(np.pad(values, half + 1, mode="edge"), kernel / kernel.sum(), "valid")
    return np.asarray(smooth, dtype=np.float64)


# --- bodies ------------------------------------------------------------------------------------


def _body_frame(position: Floats, facing: Floats):
    """Return a function that maps (forward, left, up) of a body to the sheet frame."""
    forward = _unit(facing)
    left = np.array([-forward[1], forward[0]])

    def place(f: float, s: float, up: float) -> Floats:
        return np.array([*(position + f * forward + s * left), up])

    return place


def _standing(
    position: Floats, facing: Floats, phase: float, lean: float, jacket: Colour
) -> tuple[Rod, ...]:
    """Return a standing or walking person at a phase of the stride, leaning forward by `lean`
    [rad].
    """
    place = _body_frame(position, facing)
    swing = 0.24 * np.sin(phase)
    dip, reach = np.cos(lean), np.sin(lean)
    hip = 0.93 - 0.08 * lean
    shoulder_f, shoulder_up = 0.50 * reach, hip + 0.50 * dip
    rods: list[Rod] = []
    for side in (-1.0, 1.0):
        foot = place(side * swing, side * 0.10, 0.05)
        knee = place(0.5 * side * swing + 0.06, side * 0.10, 0.5)
        top = place(-0.1 * reach, side * 0.09, hip)
        toe = place(side * swing + 0.14, side * 0.11, 0.04)
        rods += [
            Rod(foot, toe, 0.05, SHOES),
            Rod(foot, knee, 0.065, TROUSERS),
            Rod(knee, top, 0.085, TROUSERS),
        ]
    chest = place(shoulder_f - 0.04, 0.0, shoulder_up - 0.08)
    rods.append(Rod(place(-0.1 * reach, 0.0, hip + 0.03), chest, 0.16, jacket))
    for side in (-1.0, 1.0):
        shoulder = place(shoulder_f, side * 0.20, shoulder_up)
        busy = min(1.0, 2.0 * lean)
        hand = place(
            busy * 0.42 - (1.0 - busy) * side * swing,
            side * (0.26 - 0.2 * busy),
            0.92 + 0.08 * busy,
        )
        rods += [
            Rod(shoulder, hand, 0.055, jacket),
            Rod(hand, hand, 0.05, SKIN),
        ]
    face = place(shoulder_f + 0.10 + 0.08 * reach, 0.0, shoulder_up + 0.21)
    crown = place(shoulder_f + 0.07 + 0.08 * reach, 0.0, shoulder_up + 0.26)
    rods += [
        Rod(face, face, 0.10, SKIN),
        Rod(crown, crown, 0.105, HAIR),
    ]
    return tuple(rods)


def _lunging(
    position: Floats, ahead: Floats, grip: Floats, jacket: Colour, hand: float
) -> tuple[Rod, ...]:
    """Return the thrower: low over the front foot, one leg trailing, an arm stretched to the
    stone.
    """
    place = _body_frame(position, ahead)
    hips, chest = place(-0.12, 0.0, 0.36), place(0.28, 0.0, 0.56)
    foot, knee = place(0.10, 0.02, 0.05), place(0.26, 0.06 * hand, 0.42)
    trail_knee, trail_foot = place(-0.62, -0.04 * hand, 0.14), place(-1.10, -0.10 * hand, 0.06)
    near_shoulder = place(0.32, -0.19 * hand, 0.56)
    far_shoulder, far_hand = place(0.30, 0.19 * hand, 0.56), place(0.34, 0.42 * hand, 0.22)
    face, crown = place(0.44, 0.0, 0.78), place(0.41, 0.0, 0.83)
    return (
        Rod(trail_foot, trail_knee, 0.06, TROUSERS),
        Rod(trail_knee, hips, 0.085, TROUSERS),
        Rod(foot, place(0.24, 0.02, 0.04), 0.05, SHOES),
        Rod(foot, knee, 0.065, TROUSERS),
        Rod(knee, hips, 0.085, TROUSERS),
        Rod(hips, chest, 0.16, jacket),
        Rod(far_shoulder, far_hand, 0.05, jacket),
        Rod(near_shoulder, grip, 0.045, jacket),
        Rod(grip, grip, 0.045, SKIN),
        Rod(face, face, 0.10, SKIN),
        Rod(crown, crown, 0.105, HAIR),
    )


# --- drawing -----------------------------------------------------------------------------------

_ANGLES = np.linspace(0, 2 * np.pi, 14, False)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)


def draw_person(
    picture: NDArray[np.float32], camera: Camera, box: PixelBox, person: Person, shadow: float
) -> None:
    """Draw a person into a box of pixels of a picture, in place.

    Parameters
    ----------
    picture : (box height, box width, 3) the box without the person, 0 to 255; drawn into
    camera : the film's camera
    box : place of `picture` in the image
    person : the person to draw
    shadow : darkness of the ice below the person, 0 to 1
    """
    height, width = picture.shape[:2]
    corner = np.array([box.left, box.top])
    ground = np.column_stack([person.position + 0.34 * _CIRCLE, np.zeros(len(_CIRCLE))])
    shade = np.zeros((height, width), dtype=np.uint8)
    cv2.fillConvexPoly(shade, np.round(camera.project(ground) - corner).astype(np.int32), 255)
    width_px = 3 + 2 * int(0.03 * np.hypot(height, width))
    soft = cv2.blur(cv2.blur(shade, (width_px, width_px)), (width_px, width_px)).astype(np.float32)
    picture *= (1.0 - (0.8 * shadow / 255.0) * soft)[..., None]

    fine = PERSON_SAMPLES if height * width < LARGE_PERSON_PIXELS else 1
    position = camera.position
    rods = sorted(
        person.rods,
        key=lambda rod: -float(np.linalg.norm(0.5 * (rod.start + rod.stop) - position)),
    )
    ends = np.array([[rod.start, rod.stop] for rod in rods]).reshape(-1, 3)
    px = (camera.project(ends) - corner + 0.5) * fine
    depth = ends @ camera.rotation[2] + camera.translation[2]
    scale = fine * camera.lens.focal_px / depth
    colour = np.zeros((height * fine, width * fine, 3), dtype=np.uint8)
    mask = np.zeros(colour.shape[:2], dtype=np.uint8)
    for k, rod in enumerate(rods):
        radii = rod.radius * scale[2 * k : 2 * k + 2]
        middle = px[2 * k : 2 * k + 2]
        # Light comes from above: each rod has a narrower, brighter one inside, moved up a little.
        for share, bright in ((1.0, 0.82), (0.55, 1.08)):
            lift = np.stack([np.zeros(2), (1.0 - share) * 0.6 * radii], axis=1)
            rim = (middle - lift)[:, None, :] + (share * radii)[:, None, None] * _CIRCLE
            hull = cv2.convexHull(np.round(rim.reshape(-1, 2) * 16).astype(np.int32))
            tone = tuple(float(min(255.0, bright * c)) for c in rod.colour)
            cv2.fillConvexPoly(colour, hull, tone, cv2.LINE_8, 4)
            if share == 1.0:
                cv2.fillConvexPoly(mask, hull, 255.0, cv2.LINE_8, 4)
    small = cv2.resize(colour, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
    cover = cv2.resize(mask, (width, height), interpolation=cv2.INTER_AREA) / np.float32(255.0)
    # The canvas is black outside the rods, so its mean is already weighted by the cover.
    picture *= (1.0 - cover)[..., None]
    picture += small
