"""The paint on the ice, seen in the image: edges and lines measured to a fraction of a pixel.

A mark is a curve of the sheet with its normal. Around where a camera puts it, the image is read
along the normal, and the mark's own filter (a step, or a stripe of its width) tells how far off it
truly is. Neighbours are read together first, so that a mark is found many pixels away from where
it was expected, and then each for itself.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import (
    BACK_LINE_Y,
    HACK_Y,
    HOG_LINE_WIDTH,
    HOG_LINE_Y,
    HOUSE_RADIUS,
    LINE_WIDTH,
    RING_RADII,
    TEE_Y,
    Sheet,
)
from curling_env.typing import Floats
from friction_estimation.camera.camera import Camera

STEP_BLUR_PX = 1.0
"""Edges are looked for at this scale, about that of a film's own blur."""
MIN_STRIPE_PX = 1.6
"""A line narrower than this looks this wide."""
MAX_STRIPE_PX = 24.0
CLEAR_PX = 4.5
"""Nothing else may be painted so near to a mark that is measured."""
MIN_RESPONSE = 4.0
"""Least contrast, in grey levels, of a mark that counts."""
OWN_SEARCH_PX = 2.5
"""How far a single reading may lie from what its neighbours say together."""
SAMPLE_PX = 0.5
"""Step of the readings along a normal."""
GROUP = 12
"""MarkingMeasurements that are first made together."""
RINGS = ("12-foot ring", "8-foot ring", "4-foot ring", "button")
CURVES = ("border", "hog line", "centre line", *RINGS)
"""What is painted, by name."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Markings:
    """Points on the painted curves of a sheet.

    Parameters
    ----------
    xy : (n, 2) sheet frame [m]
    normal : (n, 2) unit vectors across the curve
    width : (n,) of a stripe, 0 for the border of an area [m]
    clear : (n,) distance along the normal to the next thing that is painted [m]
    group : (n,) neighbours that are read together
    strong : (n,) whether the curve is told from all others at a glance: hog lines and the border
    curve : (n,) index of its name in `CURVES`
    """

    xy: Floats
    normal: Floats
    width: Floats
    clear: Floats
    group: NDArray[np.int64]
    strong: NDArray[np.bool_]
    curve: NDArray[np.int64]

    def __getitem__(self, chosen: NDArray[np.bool_]) -> Markings:
        """The marks of which a flag (n,) is set."""
        return Markings(**{item.name: getattr(self, item.name)[chosen] for item in fields(self)})

    def of(self, *names: str) -> NDArray[np.bool_]:
        """Whether each mark lies on one of the curves of these names, (n,)."""
        return np.isin(self.curve, [CURVES.index(name) for name in names])


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkingMeasurements:
    """Where marks were seen.

    Parameters
    ----------
    index : (n,) of the mark
    normal_px : (n, 2) unit vector across the mark in the image
    offset_px : (n,) from where the camera puts the mark to where it is seen, along the normal
    expected : number of marks that the camera should see
    """

    index: NDArray[np.int64]
    normal_px: Floats
    offset_px: Floats
    expected: int


def keypoints_of(sheet: Sheet) -> dict[str, tuple[float, float]]:
    """Every place that can be marked, by name, in the sheet frame [m].

    The four corners come first, under their names in a scene file. Left and right are those of
    someone looking from the home end to the away end. On a hog line its middle is meant, on a
    ring the outer edge of the twelve-foot.
    """
    side = sheet.width / 2
    places = dict(sheet.corners)
    for end, s in (("home", -1.0), ("away", 1.0)):
        hog = s * (HOG_LINE_Y + HOG_LINE_WIDTH / 2)
        places |= {
            f"{end}_hog_left": (-side, hog),
            f"{end}_hog_centre": (0.0, hog),
            f"{end}_hog_right": (side, hog),
            f"{end}_tee": (0.0, s * TEE_Y),
            f"{end}_ring_left": (-HOUSE_RADIUS, s * TEE_Y),
            f"{end}_ring_right": (HOUSE_RADIUS, s * TEE_Y),
            f"{end}_ring_top": (0.0, s * (TEE_Y - HOUSE_RADIUS)),
            f"{end}_back_centre": (0.0, s * BACK_LINE_Y),
        }
    return places


@lru_cache(maxsize=4)
def markings_of(sheet: Sheet) -> Markings:
    """All marks of a sheet whose place the rule book fixes, as points every few centimetres.

    Tee and back lines are left out: whether their middle or an edge is meant differs by club.

    Source
    ------
    World Curling, rule book, R1.
    """
    rows: list[tuple[Floats, Floats, float, float, str]] = []
    side, end = sheet.width / 2, sheet.length / 2
    along, across = np.array([0.0, 1.0]), np.array([1.0, 0.0])

    def line(
        start: Floats,
        stop: Floats,
        normal: Floats,
        count: int,
        width: float,
        clear: float,
        curve: str,
    ) -> None:
        share = (np.arange(count) + 0.5)[:, None] / count
        points = start + share * (stop - start)
        rows.append((points, np.tile(normal, (count, 1)), width, clear, curve))

    for s in (-1.0, 1.0):
        line(
            s * side * across - end * along,
            s * side * across + end * along,
            s * across,
            216,
            0.0,
            side - RING_RADII[0],
            "border",
        )
        line(
            -side * across + s * end * along,
            side * across + s * end * along,
            s * along,
            48,
            0.0,
            end - HACK_Y - 0.21,
            "border",
        )
        hog = s * (HOG_LINE_Y + HOG_LINE_WIDTH / 2)
        line(
            -side * across + hog * along,
            side * across + hog * along,
            s * along,
            60,
            HOG_LINE_WIDTH,
            1.0,
            "hog line",
        )
        line(
            s * (TEE_Y - RING_RADII[0] - 0.1) * along,
            0.0 * along,
            across,
            96,
            LINE_WIDTH,
            1.0,
            "centre line",
        )
        around = (np.arange(96) + 0.5) * 2 * np.pi / 96
        normal = np.column_stack([np.cos(around), np.sin(around)])
        for k, (name, radius) in enumerate(zip(RINGS, RING_RADII, strict=True)):
            gaps = np.abs(
                np.array([*RING_RADII[:k], *RING_RADII[k + 1 :], 2 * side - RING_RADII[0]]) - radius
            )
            clear = min(float(gaps.min()), radius)
            rows.append((radius * normal + s * TEE_Y * along, normal, 0.0, clear, name))
    xy = np.concatenate([row[0] for row in rows])
    groups, first = [], 0
    for row in rows:
        groups.append(first + np.arange(len(row[0])) // GROUP)
        first = groups[-1][-1] + 1
    curve = np.concatenate([np.full(len(row[0]), CURVES.index(row[4])) for row in rows])
    marks = Markings(
        xy=xy,
        normal=np.concatenate([row[1] for row in rows]),
        width=np.concatenate([np.full(len(row[0]), row[2]) for row in rows]),
        clear=np.concatenate([np.full(len(row[0]), row[3]) for row in rows]),
        group=np.concatenate(groups),
        strong=np.isin(curve, [CURVES.index(name) for name in ("border", "hog line")]),
        curve=curve,
    )
    return _without_crossings(marks)


def _without_crossings(marks: Markings) -> Markings:
    """Leave out the points at which another line crosses or touches."""
    x, y = marks.xy.T
    depth = np.abs(y)
    upright = np.abs(marks.normal[:, 0]) > 0.5
    ring = (marks.width == 0) & (np.abs(np.hypot(x, depth - TEE_Y)) < RING_RADII[0] + 0.01)
    bad = ring & ((np.abs(x) < 0.06) | (np.abs(depth - TEE_Y) < 0.06))
    bad |= ring & (np.abs(depth - BACK_LINE_Y) < 0.12)
    bad |= ~ring & upright & (np.abs(depth - HOG_LINE_Y - 0.05) < 0.25)
    bad |= (
        ~ring
        & upright
        & (np.abs(x) > 1)
        & ((np.abs(depth - TEE_Y) < 0.1) | (np.abs(depth - BACK_LINE_Y) < 0.1))
    )
    bad |= ~ring & ~upright & (np.abs(x) < 0.3)
    return marks[~bad]


def brightness(image: NDArray[np.uint8] | NDArray[np.float32]) -> NDArray[np.float32]:
    """Grey levels of a BGR image, which films store sharper than colour."""
    colours = np.asarray(image, dtype=np.float32)
    return np.asarray(cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY), dtype=np.float32)


def measure_markings(
    grey: NDArray[np.float32],
    origin_px: tuple[int, int],
    camera: Camera,
    marks: Markings,
    search_px: float,
    *,
    only_strong: bool = False,
) -> MarkingMeasurements:
    """Where the marks are in an image, near where a camera puts them.

    Parameters
    ----------
    grey : part of the image, best without what moves
    origin_px : its upper left pixel's column and row in the image
    search_px : how far the marks may be from where they are expected
    only_strong : look for hog lines and the border only
    """
    there, normal_px, scale = _seen(camera, marks)
    width_px = np.clip(marks.width * scale, MIN_STRIPE_PX, MAX_STRIPE_PX)
    rows, columns = grey.shape
    margin = 4.0
    with np.errstate(invalid="ignore"):
        # A search may run out of the image: there is no edge out there to be misled by.
        inside = (
            (there >= np.array(origin_px) + margin)
            & (there <= np.add(origin_px, (columns - 1 - margin, rows - 1 - margin)))
        ).all(axis=1)
        usable = inside & (marks.clear * scale > CLEAR_PX)
        usable &= (marks.width == 0) | (marks.width * scale < MAX_STRIPE_PX)
    if only_strong:
        usable &= marks.strong
    index = np.flatnonzero(usable)
    if len(index) == 0:
        return MarkingMeasurements(
            index=index, normal_px=np.empty((0, 2)), offset_px=np.empty(0), expected=0
        )
    half = int(np.ceil((search_px + OWN_SEARCH_PX) / SAMPLE_PX))
    widest = int(np.ceil(max(3 * STEP_BLUR_PX, float(width_px[index].max())) / SAMPLE_PX)) + 1
    steps = np.arange(-half - widest, half + widest + 1) * SAMPLE_PX
    maps = (
        there[index, None] + steps[None, :, None] * normal_px[index, None] - np.array(origin_px)
    ).astype(np.float32)
    looked_up = cv2.remap(
        grey, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    profile = np.asarray(looked_up, dtype=np.float32)
    response = np.empty((len(index), 2 * half + 1))
    stripes = marks.width[index] > 0
    response[~stripes] = _filtered(profile[~stripes], _step_filter(), half)
    # Widths of half a pixel's steps are enough: the filter is symmetric whatever its width.
    rounded = np.round(width_px[index] / SAMPLE_PX) * SAMPLE_PX
    for width in np.unique(rounded[stripes]):
        own = stripes & (rounded == width)
        response[own] = _filtered(profile[own], _stripe_filter(float(width)), half)
    offset, strength = _peaks(response, marks.group[index], search_px, half)
    found = np.isfinite(offset) & (strength > MIN_RESPONSE)
    return MarkingMeasurements(
        index=index[found],
        normal_px=normal_px[index][found],
        offset_px=offset[found],
        expected=len(index),
    )


def _seen(camera: Camera, marks: Markings) -> tuple[Floats, Floats, Floats]:
    """Place of every mark in the image, its normal there, and pixels per metre across it."""
    step = 2e-3

    def at(xy: Floats) -> Floats:
        return camera.project(np.column_stack([xy, np.zeros(len(xy))]))

    there = at(marks.xy)
    tangent = np.column_stack([-marks.normal[:, 1], marks.normal[:, 0]])
    with np.errstate(invalid="ignore", divide="ignore"):
        along = at(marks.xy + step * tangent) - there
        across = (at(marks.xy + step * marks.normal) - there) / step
        length = np.linalg.norm(along, axis=1)
        normal_px = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
        scale = np.sum(normal_px * across, axis=1)
        normal_px *= np.sign(scale)[:, None]
        lost = ~(camera.sees(np.column_stack([marks.xy, np.zeros(len(marks.xy))])))
        there[lost] = np.nan
    return there, normal_px, np.abs(scale)


def _step_filter() -> Floats:
    s = np.arange(-6, 7) * SAMPLE_PX
    bell = s * np.exp(-0.5 * (s / STEP_BLUR_PX) ** 2)
    return bell / np.abs(bell).sum() * 2


def _stripe_filter(width_px: float) -> Floats:
    n = int(np.ceil(width_px / SAMPLE_PX)) + 1
    s = np.arange(-n, n + 1) * SAMPLE_PX
    # Shares of a sample's reach inside the stripe and beside it, so that the width need not divide.
    inside = np.clip((width_px / 2 - np.abs(s)) / SAMPLE_PX + 0.5, 0, 1)
    beside = np.clip((width_px - np.abs(s)) / SAMPLE_PX + 0.5, 0, 1) - inside
    return inside / inside.sum() - beside / beside.sum()


def _filtered(profile: NDArray[np.float32], taps: Floats, half: int) -> Floats:
    if len(profile) == 0:
        return np.empty((0, 2 * half + 1))
    out = cv2.filter2D(
        profile, cv2.CV_32F, taps[None].astype(np.float32), borderType=cv2.BORDER_REPLICATE
    )
    middle = profile.shape[1] // 2
    return out[:, middle - half : middle + half + 1].astype(np.float64)


def _peaks(
    response: Floats, group: NDArray[np.int64], search_px: float, half: int
) -> tuple[Floats, Floats]:
    """Offset and strength of the strongest response of each reading, near its group's."""
    _, member = np.unique(group, return_inverse=True)
    count = np.bincount(member)
    total = np.zeros((len(count), response.shape[1]))
    np.add.at(total, member, response)
    total /= count[:, None]
    s = (np.arange(response.shape[1]) - half) * SAMPLE_PX
    together = np.where(np.abs(s) <= search_px, np.abs(total), -1.0)
    at = together.argmax(axis=1)
    sign = np.sign(total[np.arange(len(total)), at])
    signed = response * sign[member][:, None]
    near = np.abs(s[None] - s[at][member][:, None]) <= OWN_SEARCH_PX
    signed = np.where(near, signed, -np.inf)
    own = signed.argmax(axis=1)
    rows = np.arange(len(response))
    offset = np.full(len(response), np.nan)
    inner = (own > 0) & (own < response.shape[1] - 1)
    r, k = rows[inner], own[inner]
    before, peak, after = signed[r, k - 1], signed[r, k], signed[r, k + 1]
    good = np.isfinite(before) & np.isfinite(after) & (before + after < 2 * peak)
    with np.errstate(invalid="ignore", divide="ignore"):
        shift = 0.5 * (before - after) / (before - 2 * peak + after)
    offset[r[good]] = (s[k] + SAMPLE_PX * shift)[good]
    strength = np.where(np.isfinite(offset), signed[rows, own], 0.0)
    return offset, strength
