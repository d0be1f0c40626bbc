"""The paint on the ice, measured in an image to a fraction of a pixel.

The markings are points on the painted curves, each with its normal. The image is sampled along the
normal around the projected point, and a filter of the curve's own shape (a step, or a line of its
width) gives the offset. Neighbours are searched for together first, so that a curve is found many
pixels away from its expected place, and then each point separately.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import ArrayLike

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
from curling_env.typing import Flags, Floats, Image, Integers, Singles
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.tuning import (
    EDGE_BLUR_PX,
    EXPECTED_ERROR_PX,
    GROUP_SIZE,
    MIN_CONTRAST,
    MIN_LINE_WIDTH_PX,
    MIN_RADIUS_PX,
    NARROW_SEARCHES_PX,
    POINT_SEARCH_PX,
    PROFILE_STEP_PX,
)

RINGS = ("12-foot ring", "8-foot ring", "4-foot ring", "button")
CURVES = ("border", "hog line", "centre line", *RINGS, "tee line", "back line")
"""Names of the painted curves."""
FITTED_CURVES = CURVES[:-2]
"""Curves to which films are fitted. Clubs differ in whether the middle or an edge of a tee or back
line is meant."""


ICE_REFRACTION = 1.31
"""Index of refraction of ice."""
CURVE_STEP = 0.25
"""Distance between the points of a drawn line [m]; small enough that distortion looks smooth."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Markings:
    """Points on the painted curves of a sheet, a few centimetres apart.

    Parameters
    ----------
    xy : (n, 2) sheet frame [m]
    normal : (n, 2) unit vectors across the curve
    width : (n,) width of a line, 0 for the edge of an area [m]
    clear : (n,) distance along the normal to the next thing that is painted [m]
    bend : (n,) how much the curve bends, away from its normal: 1 / radius [1/m]
    group : (n,) number of the group of neighbours that are searched for together
    curve : (n,) index of the curve's name in `CURVES`
    depth : (n,) thickness of the clear ice above it [m]
    """

    xy: Floats
    normal: Floats
    width: Floats
    clear: Floats
    bend: Floats
    group: Integers
    curve: Integers
    depth: Floats

    def __getitem__(self, chosen: Flags) -> Markings:
        """Return the points for which a flag (n,) is set."""
        return Markings(**{item.name: getattr(self, item.name)[chosen] for item in fields(self)})

    def seen_from(self, camera: Camera) -> Floats:
        """Return the apparent places of the points, (n, 3) [m]; refraction raises them."""
        tangent = np.linalg.norm(self.xy - camera.position[:2], axis=1) / camera.position[2]
        return np.column_stack([self.xy, -self.depth * apparent_depth(tangent)])

    def of(self, *names: str) -> Flags:
        """Return whether each point lies on a curve of one of these names, (n,)."""
        return np.isin(self.curve, [CURVES.index(name) for name in names])


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkingMeasurements:
    """Measured places of markings in an image.

    Parameters
    ----------
    index : (n,) index of each point among the markings
    normal_px : (n, 2) unit vector across the curve in the image
    offset_px : (n,) from where the camera puts the point to where it is seen, along the normal
    expected : number of points that the camera should see
    """

    index: Integers
    normal_px: Floats
    offset_px: Floats
    expected: int


def keypoints_of(sheet: Sheet) -> dict[str, tuple[float, float]]:
    """Return the places on the ice that can be marked by hand, by name, sheet frame [m].

    At each, two lines or edges meet. The four corners come first, under their names in a scene
    file. Left and right are those of someone looking from the home end to the away end. A hog line
    means its middle, a ring the outer edge of the twelve-foot ring.
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


def apparent_depth(tangent: Floats) -> Floats:
    """Return the depth at which something below clear ice seems to lie, over its true depth.

    Parameters
    ----------
    tangent : tangent of the angle between line of sight and vertical

    Source
    ------
    Snell's law.
    """
    index = ICE_REFRACTION**2
    return 1 / np.sqrt(index + (index - 1) * tangent**2)


@lru_cache(maxsize=4)
def markings_of(sheet: Sheet, depth: float = 0.0) -> Markings:
    """Return the markings of a sheet whose place the rule book fixes, except where curves cross.

    Parameters
    ----------
    sheet : the ice
    depth : thickness of the clear ice above the paint [m]; the border is at its surface

    Source
    ------
    World Curling, rule book, R1.
    """
    painted = [one for one in painted_curves(sheet) if one.count]
    number = np.repeat(np.arange(len(painted)), [one.count for one in painted])
    points = [one.along((np.arange(one.count) + 0.5) / one.count) for one in painted]
    # Each curve has its own groups.
    group = np.concatenate([1000 * k + np.arange(one.count) // GROUP_SIZE
                            for k, one in enumerate(painted)])  # fmt: skip
    markings = Markings(
        xy=np.concatenate([xy for xy, _ in points]),
        normal=np.concatenate([normal for _, normal in points]),
        width=np.array([one.width for one in painted])[number],
        clear=np.array([one.clear for one in painted])[number],
        bend=np.array([1 / one.radius if one.radius else 0.0 for one in painted])[number],
        group=group,
        curve=np.array([CURVES.index(one.name) for one in painted])[number],
        depth=np.array([depth * (one.name != "border") for one in painted])[number],
    )
    return _without_crossings(markings)


def _without_crossings(markings: Markings) -> Markings:
    """Drop the points at which another line crosses or touches, including its blur."""
    x, y = markings.xy.T
    depth = np.abs(y)
    upright = np.abs(markings.normal[:, 0]) > 0.5
    ring = (markings.width == 0) & (np.abs(np.hypot(x, depth - TEE_Y)) < HOUSE_RADIUS + 0.01)
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
    bad |= (markings.curve == CURVES.index("back line")) & (np.abs(x) < 0.8)
    from_ring = np.abs(np.abs(x)[:, None] - np.array(RING_RADII)).min(axis=1)
    bad |= (markings.curve == CURVES.index("tee line")) & (from_ring < 0.1)
    return markings[~bad]


def fitted_markings(sheet: Sheet, depth: float = 0.0) -> Markings:
    """Return the markings to which films are fitted, see `FITTED_CURVES` and `markings_of`."""
    markings = markings_of(sheet, depth)
    return markings[markings.of(*FITTED_CURVES)]


def curves_of(sheet: Sheet) -> list[tuple[str, Floats]]:
    """Names and polylines (n, 2) of the painted curves and the border, sheet frame [m]."""
    found: list[tuple[str, Floats]] = []
    for one in painted_curves(sheet):
        steps = 72 if one.radius else int(np.ceil(np.hypot(*(one.stop - one.start)) / CURVE_STEP))
        found.append((one.name, one.along(np.linspace(0, 1, steps + 1))[0]))
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class PaintedCurve:
    """A straight line or a ring that is painted on the ice, or its border.

    Parameters
    ----------
    name : see `CURVES`
    start, stop : (2,) ends of a line, sheet frame [m]; a ring's centre
    radius : of a ring [m]; 0 for a line
    width : of a line, 0 for the edge of an area [m]
    clear : distance across it to the next thing that is painted [m]
    count : number of its points that are measured
    """

    name: str
    start: Floats
    stop: Floats
    radius: float = 0.0
    width: float = 0.0
    clear: float
    count: int

    def along(self, share: Floats) -> tuple[Floats, Floats]:
        """Points at shares (n,) of its length, and the normals there, (n, 2) each."""
        if self.radius:
            normal = np.column_stack([np.cos(2 * np.pi * share), np.sin(2 * np.pi * share)])
            return self.start + self.radius * normal, normal
        way = self.stop - self.start
        normal = np.array([way[1], -way[0]]) / np.hypot(*way)
        return self.start + share[:, None] * way, np.tile(normal, (len(share), 1))


def painted_curves(sheet: Sheet) -> list[PaintedCurve]:
    """Return everything that is painted on a sheet, and its border."""
    side, back = sheet.width / 2, sheet.length / 2
    found: list[PaintedCurve] = []

    def line(
        name: str, x: tuple[float, float], y: tuple[float, float], count: int, *across: float
    ) -> None:
        start, stop = (np.array([a, end * b]) for a, b in zip(x, y, strict=True))
        width, clear = across
        found.append(
            PaintedCurve(name=name, start=start, stop=stop, width=width, clear=clear, count=count)
        )

    for end in (-1.0, 1.0):
        house, hog = TEE_Y - HOUSE_RADIUS - 0.1, HOG_LINE_Y + HOG_LINE_WIDTH / 2
        line("border", (end * side, end * side), (-back, back), 216, 0.0, side - HOUSE_RADIUS)
        line("border", (-side, side), (back, back), 48, 0.0, back - HACK_Y - 0.21)
        line("hog line", (-side, side), (hog, hog), 60, HOG_LINE_WIDTH, 1.0)
        line("centre line", (0.0, 0.0), (house, 0.0), 96, LINE_WIDTH, 1.0)
        line("centre line", (0.0, 0.0), (BACK_LINE_Y, house), 0, LINE_WIDTH, 0.0)
        line("tee line", (-side, side), (TEE_Y, TEE_Y), 60, LINE_WIDTH, 0.3)
        line("back line", (-side, side), (BACK_LINE_Y, BACK_LINE_Y), 60, LINE_WIDTH, 0.2)
        tee = np.array([0.0, end * TEE_Y])
        for k, (name, radius) in enumerate(zip(RINGS, RING_RADII, strict=True)):
            others = [*RING_RADII[:k], *RING_RADII[k + 1 :], sheet.width - HOUSE_RADIUS, 0.0]
            clear = min(abs(radius - other) for other in others)
            found.append(
                PaintedCurve(name=name, start=tee, stop=tee, radius=radius, clear=clear, count=96)
            )
    return found


def grey_levels(image: Image | Singles) -> Singles:
    """Grey levels of a BGR image; films store them sharper than colour."""
    colours = np.asarray(image, dtype=np.float32)
    return np.asarray(cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY), dtype=np.float32)


@dataclass(frozen=True, kw_only=True, eq=False)
class Responses:
    """The strength of a curve's own shape along the normals of its points.

    Parameters
    ----------
    index : (n,) index of each point among the markings
    normal_px : (n, 2) unit vector across the curve in the image
    px_per_metre : (n,) scale across the curve [px/m]
    along_px : (k,) distances from where the camera puts a point, along its normal
    strength : (n, k) answer of the curve's filter there [grey levels], signed
    """

    index: Integers
    normal_px: Floats
    px_per_metre: Floats
    along_px: Floats
    strength: Floats


def responses_of(
    grey: Singles,
    origin_px: tuple[int, int],
    camera: Camera,
    markings: Markings,
    search_px: float,
    *,
    flanks: tuple[float, float] = (1.0, 1.0),
) -> Responses:
    """Compute the responses of the image around the markings to their shapes.

    Parameters
    ----------
    grey, origin_px, camera, markings, search_px : as in `measure_markings`
    flanks : weights of the ice on either side of a line, with which the line is compared
    """
    rows, columns = grey.shape
    there, normal_px, scale, usable = _measurable(
        camera, markings, origin_px, np.add(origin_px, (columns - 1, rows - 1))
    )
    width_px = np.maximum(markings.width * scale, MIN_LINE_WIDTH_PX)
    index = np.flatnonzero(usable)
    half = int(np.ceil(search_px / PROFILE_STEP_PX))
    along: Floats = np.arange(-half, half + 1, dtype=np.float64) * PROFILE_STEP_PX
    strength = np.empty((len(index), len(along)))
    found = Responses(
        index=index,
        normal_px=normal_px[index],
        px_per_metre=scale[index],
        along_px=along,
        strength=strength,
    )
    if len(index) == 0:
        return found
    widest = int(np.ceil((3 * EDGE_BLUR_PX + float(width_px[index].max())) / PROFILE_STEP_PX)) + 1
    steps = np.arange(-half - widest, half + widest + 1) * PROFILE_STEP_PX
    at = there[index, None] + steps[None, :, None] * normal_px[index, None] - np.array(origin_px)
    maps = at.astype(np.float32)
    profile = cv2.remap(
        grey, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    ).astype(np.float32, copy=False)
    lines = markings.width[index] > 0
    strength[~lines] = _filtered(profile[~lines], _step_filter(), half)
    # Widths in steps of half a pixel are enough: the filter is symmetric for any width.
    rounded = np.round(width_px[index] / PROFILE_STEP_PX) * PROFILE_STEP_PX
    for width in np.unique(rounded[lines]):
        own = lines & (rounded == width)
        strength[own] = _filtered(profile[own], _line_filter(float(width), flanks), half)
        # A line is compared with its surroundings, which the image must show.
        reach = int(np.ceil(width / PROFILE_STEP_PX))
        shown: Flags = np.all((at[own] >= 0) & (at[own] <= (columns - 1, rows - 1)), axis=2)
        middle = shown.shape[1] // 2
        both = shown[:, middle - half - reach : middle + half - reach + 1]
        both = both & shown[:, middle - half + reach : middle + half + reach + 1]
        strength[own] *= both
    return found


def measure_markings(
    grey: Singles,
    origin_px: tuple[int, int],
    camera: Camera,
    markings: Markings,
    search_px: float,
) -> MarkingMeasurements:
    """Measure the places of markings in an image, near their projections by a camera.

    Parameters
    ----------
    grey : grey levels of the image or of a part of it, best without what moves
    origin_px : column and row of its upper left pixel in the image
    camera : puts the markings where they are expected
    markings : what to look for
    search_px : how far from there they may be
    """
    found = responses_of(grey, origin_px, camera, markings, search_px + POINT_SEARCH_PX)
    lines = markings.width[found.index] > 0
    offset, strength = _peaks(found, markings.group[found.index], lines, search_px)
    good = np.isfinite(offset) & (strength > MIN_CONTRAST)
    return MarkingMeasurements(
        index=found.index[good],
        normal_px=found.normal_px[good],
        offset_px=offset[good],
        expected=len(found.index),
    )


def expected_measurements(
    camera: Camera, markings: Markings, paint: float, rng: np.random.Generator
) -> MarkingMeasurements:
    """Return the expected measurements of the markings by a planned camera on bare ice.

    Parameters
    ----------
    camera, markings : as in `measure_markings`
    paint : standard error with which a whole ring or line is painted [m]
    rng : generator for that error, and for those of points (`EXPECTED_ERROR_PX`)
    """
    _, normal_px, scale, usable = _measurable(camera, markings, (0, 0), np.subtract(camera.size, 1))
    index = np.flatnonzero(usable)
    curves, own = np.unique(
        np.column_stack([markings.curve, np.sign(markings.xy)])[index], axis=0, return_inverse=True
    )
    laid = rng.normal(0.0, paint, len(curves))[own.ravel()]
    return MarkingMeasurements(
        index=index,
        normal_px=normal_px[index],
        offset_px=laid * scale[index] + rng.normal(0.0, EXPECTED_ERROR_PX, len(index)),
        expected=len(index),
    )


def _measurable(
    camera: Camera, markings: Markings, low: ArrayLike, high: ArrayLike
) -> tuple[Floats, Floats, Floats, Flags]:
    """Return the projection of every point, and whether it can be measured in a picture.

    Parameters
    ----------
    low, high : (2,) first and last column and row of the picture

    Returns
    -------
    its place (n, 2) [px], the normal there (n, 2), pixels per metre across the curve (n,), and the
    flags (n,)
    """
    step, margin = 2e-3, 4.0
    normal, tangent = markings.normal, markings.normal[:, ::-1] * [-1.0, 1.0]
    sagged = markings.xy - 0.5 * step**2 * markings.bend[:, None] * normal

    height = markings.seen_from(camera)[:, 2]

    def at(xy: Floats) -> Floats:
        return camera.project(np.column_stack([xy, height]))

    there = at(markings.xy)
    with np.errstate(invalid="ignore", divide="ignore"):
        after, before = at(sagged + step * tangent), at(sagged - step * tangent)
        along, bent = (after - before) / (2 * step), (after - 2 * there + before) / step**2
        across = (at(markings.xy + step * normal) - there) / step
        length = np.linalg.norm(along, axis=1)
        normal_px = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
        scale = np.sum(normal_px * across, axis=1)
        radius_px = length**2 / np.abs(np.sum(normal_px * bent, axis=1))
        normal_px *= np.sign(scale)[:, None]
        scale = np.abs(scale)
        # A search may run out of the image, where there is no edge to be mistaken for the paint.
        usable = np.all(
            (there >= np.add(low, margin)) & (there <= np.subtract(high, margin)), axis=1
        )
        usable &= camera.sees(markings.seen_from(camera))
        # Other paint must be out of reach of the last search.
        usable &= markings.clear * scale > NARROW_SEARCHES_PX[-1] + POINT_SEARCH_PX
        # Blur moves a curved edge towards its inner side.
        usable &= radius_px > MIN_RADIUS_PX
    return there, normal_px, scale, usable


def _step_filter() -> Floats:
    s = np.arange(-6, 7) * PROFILE_STEP_PX
    bell = s * np.exp(-0.5 * (s / EDGE_BLUR_PX) ** 2)
    return bell / np.abs(bell).sum() * 2


def _line_filter(width_px: float, flanks: tuple[float, float] = (1.0, 1.0)) -> Floats:
    """Filter of a line and its surroundings, with the camera's blur.

    Without the blur a line that is thinner than a pixel is attracted to the nearest row of pixels.
    """
    n = int(np.ceil(width_px / PROFILE_STEP_PX)) + 1
    s = np.arange(-n, n + 1) * PROFILE_STEP_PX
    # Shares of a sample inside the line and beside it, so that any width is possible.
    inside = np.clip((width_px / 2 - np.abs(s)) / PROFILE_STEP_PX + 0.5, 0, 1)
    beside = np.clip((width_px - np.abs(s)) / PROFILE_STEP_PX + 0.5, 0, 1) - inside
    beside *= np.where(s < 0, *flanks)
    line = inside / inside.sum() - beside / beside.sum()
    bell = np.exp(-0.5 * (np.arange(-6, 7) * PROFILE_STEP_PX / EDGE_BLUR_PX) ** 2)
    return np.convolve(line, bell / bell.sum())


def _filtered(profile: Singles, taps: Floats, half: int) -> Floats:
    if len(profile) == 0:
        return np.empty((0, 2 * half + 1))
    out = cv2.filter2D(
        profile, cv2.CV_32F, taps[None].astype(np.float32), borderType=cv2.BORDER_REPLICATE
    )
    middle = profile.shape[1] // 2
    return out[:, middle - half : middle + half + 1].astype(np.float64)


def _peaks(
    found: Responses, group: Integers, lines: Flags, search_px: float
) -> tuple[Floats, Floats]:
    """Offset and strength of each point's strongest response, near that of its group.

    Lines are darker than the ice.
    """
    response, s = found.strength, found.along_px
    _, member = np.unique(group, return_inverse=True)
    total = group_means(response, member)
    dark = np.zeros(len(total), dtype=bool)
    dark[member[lines]] = True
    together = np.where(dark[:, None], -total, np.abs(total))
    at = np.where(np.abs(s) <= search_px, together, -np.inf).argmax(axis=1)
    sign = np.where(dark, -1.0, np.sign(total[np.arange(len(total)), at]))
    signed = response * sign[member][:, None]
    near = np.abs(s[None] - s[at][member][:, None]) <= POINT_SEARCH_PX
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
    offset[r[good]] = (s[k] + PROFILE_STEP_PX * shift)[good]
    strength = np.where(np.isfinite(offset), signed[rows, own], 0.0)
    return offset, strength


def group_means(values: Floats, member: Integers) -> Floats:
    """Means of rows (n, k) by the number of their group (n,)."""
    total = np.zeros((int(member.max(initial=-1)) + 1, values.shape[1]))
    np.add.at(total, member, values)
    return total / np.bincount(member)[:, None]
