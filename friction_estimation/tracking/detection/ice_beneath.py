"""The ice beneath stones that lie on it, which the film may never show.

Where a stone comes or goes, another picture shows it. Elsewhere the sheet's other side does: its
paint is the same on the left and on the right of the centre line, before and behind the tee, and
all around it but for two thin lines.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from curling_env.sheet import HOG_LINE_Y, HOUSE_RADIUS, TEE_Y, Sheet
from curling_env.typing import Floats, Image
from friction_estimation.appearance import StoneModel
from friction_estimation.camera.camera import Camera
from friction_estimation.tracking import tuning
from friction_estimation.tracking.background import Background
from friction_estimation.tracking.connected import connected_parts

Mask = NDArray[np.uint8]
Part = tuple[slice, slice]
GRID_PX = 8
"""Between pixels so far apart it is interpolated where their mirror images lie."""
TURNS = np.radians([90.0, -90.0, 45.0, -45.0, 135.0, -135.0])
"""So far the rings are turned about the tee, to see what a stone beside it hides [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Mirror:
    """Where a part of a picture is seen on the sheet's other side.

    Parameters
    ----------
    part : rows and columns of the part
    u, v : (rows, columns) column and row of the mirror image of its pixels in the picture [px]
    valid : (rows, columns) 1 where that is on the ice and in the picture
    """

    part: Part
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    valid: Mask

    def of(self, picture: Image) -> Image:
        """The mirrored part of a picture; what has no mirror image stays as it is."""
        seen = cv2.remap(picture, self.u, self.v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        none = (self.valid == 0).view(np.uint8)
        return cv2.copyTo(np.ascontiguousarray(picture[self.part]), none, seen)

    def of_mask(self, mask: Mask) -> Mask:
        """1 where a mask (rows, columns) is mirrored to, or where there is no mirror image."""
        seen = cv2.remap(mask, self.u, self.v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return ((seen > 0) | (self.valid == 0)).view(np.uint8)


@dataclass(frozen=True, kw_only=True, eq=False)
class Reflection:
    """Where nodes of a grid over the background are seen on the sheet's other side.

    Parameters
    ----------
    shape : rows and columns of the background
    u, v : (n, m) column and row of the mirror images of nodes `GRID_PX` apart [px]
    inside : (n, m) 1 where they are on the ice and in the picture
    """

    shape: tuple[int, int]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    inside: NDArray[np.float32]

    def reaches(self, part: Part) -> bool:
        """Whether anything in a part of the background may have a mirror image."""
        nodes = tuple(slice(side.start // GRID_PX, side.stop // GRID_PX + 2) for side in part)
        return bool(self.inside[nodes].any())

    def within(self, part: Part) -> Mirror:
        """The mirror of a part of the background."""
        rows, columns = (
            np.arange(*side.indices(length), dtype=np.float32) / GRID_PX
            for side, length in zip(part, self.shape, strict=True)
        )
        at = np.meshgrid(columns, rows)
        u, v, inside = (
            cv2.remap(nodes, *at, cv2.INTER_LINEAR) for nodes in (self.u, self.v, self.inside)
        )
        return Mirror(part=part, u=u, v=v, valid=(inside > 0.999).view(np.uint8))


def mirrors(
    shape: tuple[int, ...], origin: tuple[int, int], camera: Camera, sheet: Sheet
) -> Iterator[Reflection]:
    """The mirrors at the centre line, at the tee line and at both, then turns about the tee.

    Parameters
    ----------
    shape : rows and columns of the background's part of a picture
    origin : column and row of its upper left pixel in a frame
    """
    rows, columns = shape[:2]
    v, u = np.mgrid[0 : rows + GRID_PX : GRID_PX, 0 : columns + GRID_PX : GRID_PX]
    px = np.column_stack([u.ravel() + origin[0], v.ravel() + origin[1]]).astype(np.float64)
    ice = camera.on_plane(px)
    x, y = ice.T
    tee = np.copysign(TEE_Y, y)
    on_ice = (np.abs(x) < sheet.width / 2) & (np.abs(y) < sheet.length / 2)
    house = on_ice & (np.abs(y) > HOG_LINE_Y)
    rings = np.hypot(x, y - tee) < HOUSE_RADIUS + tuning.SAME_PLACE
    places = [(np.column_stack([-x, y]), on_ice)]
    places += [(np.column_stack([side * x, 2 * tee - y]), house) for side in (1, -1)]
    for turn in TURNS:
        cos, sin = np.cos(turn), np.sin(turn)
        away = y - tee
        turned = np.column_stack([cos * x - sin * away, tee + sin * x + cos * away])
        places.append((turned, rings))
    for there, allowed in places:
        with np.errstate(invalid="ignore"):
            on_sheet = (np.abs(there) < np.array([sheet.width, sheet.length]) / 2).all(axis=1)
        inside = np.flatnonzero(allowed & on_sheet)
        at = camera.project(np.column_stack([there[inside], np.zeros(len(inside))]))
        at -= np.array(origin)
        seen = (at >= 0).all(axis=1) & (at <= np.array([columns - 1, rows - 1])).all(axis=1)
        nodes = np.zeros((3, *u.shape), dtype=np.float32)
        nodes.reshape(3, -1)[:, inside[seen]] = np.column_stack([at[seen], np.ones(seen.sum())]).T
        yield Reflection(shape=(rows, columns), u=nodes[0], v=nodes[1], inside=nodes[2])


def footprint(
    shape: tuple[int, ...],
    origin: tuple[int, int],
    camera: Camera,
    model: StoneModel,
    xy: Floats,
) -> Mask:
    """Mask of the pixels that a stone, its handle, its shadow or its reflection may change.

    Parameters
    ----------
    shape : rows and columns of the mask
    origin : column and row of its upper left pixel in a frame
    """
    around = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    circle = np.column_stack([np.cos(around), np.sin(around)])
    rings = [
        np.column_stack([xy + radius * circle, np.full(36, z)])
        for z, radius in (
            (-0.7 * model.height, model.radius),
            (0.0, model.radius + tuning.SHADOW_WIDTH),
            (model.height + model.handle_rise + 0.02, model.radius),
        )
    ]
    px = camera.project(np.concatenate(rings)) - np.array(origin)
    mask = np.zeros(shape[:2], dtype=np.uint8)
    if np.isfinite(px).all():
        hull = cv2.convexHull(px.astype(np.float32))
        cv2.fillConvexPoly(mask, np.round(hull).astype(np.int32), 1)
        cv2.dilate(mask, np.ones((3, 3), np.uint8), dst=mask)
    return mask


def fill_from_mirrors(
    picture: Image, missing: Mask, covered: Mask, reflected: Iterable[Reflection]
) -> tuple[NDArray[np.float32], Mask]:
    """A picture with what is missing taken from where the sheet is painted alike.

    Parameters
    ----------
    picture : (rows, columns, 3)
    missing : (rows, columns) 1 where the ice is wanted
    covered : (rows, columns) 1 where no ice is seen; it includes what is missing

    Returns
    -------
    the picture; (rows, columns) 1 where nothing is painted alike, and the ice is guessed from
    what is around it
    """
    full, guessed = picture.astype(np.float32), np.zeros_like(missing)
    labels, boxes = connected_parts(missing)
    every = list(reflected) if len(boxes) else []
    for k, (left, top, width, height, _) in enumerate(boxes.tolist(), start=1):
        part = (
            slice(max(top - tuning.AROUND_PX, 0), top + height + tuning.AROUND_PX),
            slice(max(left - tuning.AROUND_PX, 0), left + width + tuning.AROUND_PX),
        )
        own = labels[part] == k
        there = (one.within(part) for one in every if one.reaches(part))
        pairs = [(mirror.of(picture), mirror.of_mask(covered)) for mirror in there]
        guessed[part] |= _fill_part(full[part], own, covered[part] > 0, pairs)
    return full, guessed


def _fill_part(
    full: NDArray[np.float32],
    own: NDArray[np.bool_],
    covered: NDArray[np.bool_],
    sources: Sequence[tuple[Image, Mask]],
) -> NDArray[np.bool_]:
    """Fill a part of a picture in place, from those sources that continue what is around it.

    Returns
    -------
    where none of them does
    """
    picture = full.copy()
    ranked: list[tuple[float, NDArray[np.float32], NDArray[np.bool_]]] = []
    for seen, unseen in sources:
        shared = ~covered & (unseen == 0)
        if shared.sum() < tuning.LEAST_AROUND:
            continue
        around = picture[shared]
        apart = around - seen[shared]
        step = np.median(apart, axis=0)
        left = float(np.abs(apart - step).mean())
        plain = float(np.abs(around - np.median(around, axis=0)).mean())
        if left < max(tuning.MIRROR_DIFFERENCE, plain / 2):
            ranked.append((left, seen + step, unseen == 0))
    still = own.copy()
    for _, seen, free in sorted(ranked, key=lambda one: one[0]):
        use = still & free
        full[use] = seen[use]
        still &= ~free
    if still.any():
        known = np.clip(np.rint(full), 0, 255).astype(np.uint8)
        # What hides other ice is no guide to this.
        hidden = (still | (covered & ~own)).astype(np.uint8)
        full[still] = cv2.inpaint(known, hidden, 3.0, cv2.INPAINT_TELEA)[still]
    return still


def ice_without_stones(
    pictures: Sequence[Image],
    places: Sequence[Sequence[Floats]],
    background: Background,
    camera: Camera,
    model: StoneModel,
    sheet: Sheet,
) -> NDArray[np.float32]:
    """The ice beneath the stones in pictures of one sheet, (rows, columns, 3).

    Parameters
    ----------
    pictures : the background's part of a frame at the film's beginning, in its middle, at its end
    places : for each picture the places of the stones in it, each (2,) [m]
    """
    origin, shape = background.origin_px, background.image.shape
    masks = [[footprint(shape, origin, camera, model, xy) for xy in there] for there in places]
    covered = [np.maximum.reduce([np.zeros(shape[:2], dtype=np.uint8), *own]) for own in masks]
    missing = np.maximum.reduce(covered)
    empty = background.image.astype(np.float32)
    for k, j in ((k, j) for k in range(len(pictures)) for j in (2, 0, 1) if j != k):
        free = (covered[k] & missing & (1 - covered[j])) > 0
        empty[free] = pictures[j][free]
        missing[free] = 0
    if not missing.any():
        return empty
    seen = np.clip(np.rint(empty), 0, 255).astype(np.uint8)
    whole, _ = fill_from_mirrors(seen, missing, missing, mirrors(shape, origin, camera, sheet))
    return np.where(missing[..., None] > 0, whole, empty)
