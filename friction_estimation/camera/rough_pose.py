"""A camera from two rough marks and the picture: a global search over pose and lens.

The tee and the middle of the hog line are marked to a third of a metre. Each candidate projects
both near their marks; the one whose rings and hog line agree with the edges in the picture is found
by differential evolution, independent of colours and of the size of the picture.
"""

# OpenCV's stubs widen the element type of every array that they return.
# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false
# pyright: reportAssignmentType=false

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import differential_evolution

from curling_env.sheet import HOG_LINE_WIDTH, HOG_LINE_Y, RING_RADII, TEE_Y
from curling_env.typing import Floats, Singles
from friction_estimation.camera.camera import Camera
from friction_estimation.camera.lens import Lens, distort

MARK_REACH = 0.35
"""Largest distance of a mark from its place [m]."""
BOUNDS = np.array(
    [
        *[(-MARK_REACH, MARK_REACH)] * 4,
        (-1.0, 1.0),
        (-0.6, 0.6),
        (np.log(0.3), np.log(2.5)),
        (-0.35, 0.05),
        (-0.2, 0.2),
    ]
)
"""Range of the candidates: shifts of both marks [m]; log ratio of the depths of hog line and tee;
turn of the ice about the line through them [rad]; log focal length in longer sides; distortion as
in `Lens.bent`; log stretch."""
EDGE_BLUR = 0.025
"""Blur of the picture before its edges are compared [m]."""
RIM = 0.05
"""Width of the picture's ignored rim [m]."""
FAINT = 2.0
"""Gradient below which an edge has less weight [grey levels per pixel]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TwoMarks:
    """The two marks, and optional others.

    Parameters
    ----------
    end : -1 for the home end, 1 for the away end
    tee, hog : (2,) pixels of the tee and of the middle of the hog line
    """

    end: float
    tee: Floats
    hog: Floats

    @property
    def px_per_metre(self) -> float:
        """Mean scale between both marks [px/m]."""
        length = TEE_Y - HOG_LINE_Y - HOG_LINE_WIDTH / 2
        return float(np.linalg.norm(self.hog - self.tee)) / length


class RoughSearch:
    """Candidates for the camera of a picture, compared with its edges.

    Parameters
    ----------
    grey : grey levels of the picture
    marked : the marks
    height : the camera's height above the ice [m], if it was measured
    """

    def __init__(self, grey: Singles, marked: TwoMarks, height: float | None = None) -> None:
        self._marked, self._height = marked, height
        self._size = (grey.shape[1], grey.shape[0])
        soft = cv2.GaussianBlur(grey, (0, 0), max(0.8, EDGE_BLUR * marked.px_per_metre))
        du, dv = (cv2.Sobel(soft, cv2.CV_32F, *k, scale=1 / 8) for k in ((1, 0), (0, 1)))
        steep = np.hypot(du, dv) + FAINT * min(1.0, 60 / marked.px_per_metre)
        # The rim of a cropped picture is not paint.
        rim = int(np.ceil(RIM * marked.px_per_metre))
        steep[:rim], steep[-rim:], steep[:, :rim], steep[:, -rim:] = (np.inf,) * 4
        self._slopes = du / steep, dv / steep
        around = np.linspace(0, 2 * np.pi, 73)
        circle = np.column_stack([np.cos(around), np.sin(around)])
        across = np.column_stack([np.linspace(-1.5, 1.5, 37), np.full(37, HOG_LINE_Y)])
        curves = [r * circle + np.array([0.0, TEE_Y]) for r in RING_RADII[:3]]
        curves += [across + np.array([0.0, HOG_LINE_WIDTH]), across]
        along = np.column_stack([np.zeros(41), np.linspace(HOG_LINE_Y + 0.2, TEE_Y - 2.0, 41)])
        curves += [along + np.array([s * EDGE_BLUR, 0.0]) for s in (-1, 1)]
        lengths = [len(c) for c in curves]
        self._ice = marked.end * np.concatenate(curves)
        # Curves are projected together; between two of them there is no edge.
        owner = np.repeat(np.arange(len(curves)), lengths)
        self._edges = np.flatnonzero(owner[1:] == owner[:-1])
        self._ends = np.cumsum(np.subtract(lengths, 1))[:-1]

    def best(self, seed: int) -> Camera:
        """Return the best candidate of one search."""
        found = differential_evolution(
            self._misfit,
            BOUNDS.tolist(),
            rng=seed,
            popsize=12,
            maxiter=160,
            tol=1e-4,
            polish=False,
            vectorized=True,
            updating="deferred",
        )
        lens, rotation, translation = self._poses(found.x[:, None])
        focal, bend, stretch = (float(v[0]) for v in lens)
        bent = Lens.centred(focal, self._size).bent(bend, further=True)
        taller = replace(bent, matrix=bent.matrix * [[1.0], [np.exp(stretch)], [1.0]])
        taller.matrix[:2, 2] = bent.matrix[:2, 2]
        return Camera(lens=taller, rotation=rotation[0], translation=translation[0])

    def _poses(self, x: Floats) -> tuple[tuple[Floats, Floats, Floats], Floats, Floats]:
        """Focal length, bend and stretch, rotation and translation of candidates (9, n)."""
        scale, end = self._marked.px_per_metre, self._marked.end
        focal = max(self._size) * np.exp(x[6])
        lens = focal, x[7], x[8]
        tee = self._rays(self._marked.tee[:, None] + scale * x[0:2], lens)
        hog = self._rays(self._marked.hog[:, None] + scale * x[2:4], lens)
        hog *= np.exp(x[4])
        apart = np.linalg.norm(tee - hog, axis=0)
        size = (TEE_Y - HOG_LINE_Y - HOG_LINE_WIDTH / 2) / apart
        tee, hog = tee * size, hog * size
        ahead = end * (tee - hog) / np.linalg.norm(tee - hog, axis=0)
        middle = -(tee + hog)
        up = middle - np.sum(middle * ahead, axis=0) * ahead
        up /= np.linalg.norm(up, axis=0)
        up = np.cos(x[5]) * up + np.sin(x[5]) * np.cross(ahead, up, axis=0)
        rotation = np.stack([np.cross(ahead, up, axis=0), ahead, up], axis=1).transpose(2, 0, 1)
        translation = (tee - end * TEE_Y * ahead).T
        return lens, rotation, translation

    def _rays(self, px: Floats, lens: tuple[Floats, Floats, Floats]) -> Floats:
        """Directions (3, n) through pixels (2, n), with depth 1."""
        focal, bend, stretch = lens
        middle = np.array(self._size)[:, None] / 2
        seen = (px - middle) / np.stack([focal, focal * np.exp(stretch)])
        bend = bend * (2 * focal / max(self._size)) ** 2
        far = np.linalg.norm(seen, axis=0)
        near = far.copy()
        for _ in range(12):
            bent = bend * near**2
            near -= (near * (1 + bent + bent**2) - far) / (1 + 3 * bent + 5 * bent**2)
        seen *= near / np.maximum(far, 1e-12)
        return np.concatenate([seen, np.ones((1, seen.shape[1]))])

    def _misfit(self, x: Floats) -> Floats:
        """Negative agreement of candidates (9, n) with the edges, (n,)."""
        (focal, bend, stretch), rotation, translation = self._poses(x)
        local = self._ice @ rotation[:, :, :2].transpose(0, 2, 1) + translation[:, None]
        first = (bend * (2 * focal / max(self._size)) ** 2)[:, None]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            depth = np.where(local[..., 2] > 0, local[..., 2], np.nan)
            u, v = distort(local[..., 0] / depth, local[..., 1] / depth, (first, first**2, 0, 0, 0))
        u = u * focal[:, None] + self._size[0] / 2
        v = v * (focal * np.exp(stretch))[:, None] + self._size[1] / 2
        *rings, hog_above, hog_below, centre_left, centre_right = (
            change.mean(axis=1) for change in np.split(self._changes(u, v), self._ends, axis=1)
        )
        total = np.abs(rings).sum(axis=0)
        # Lines are darker than the ice.
        total += np.maximum(hog_below - hog_above, 0) + np.maximum(centre_right - centre_left, 0)
        total -= 0.1 * (x[8] / 0.1) ** 2 + 0.02 * (x[6] / 0.5) ** 2
        if self._height is not None:
            height = -np.einsum("nk,nk->n", rotation[:, :, 2], translation)
            total -= (np.log(np.maximum(height, 1e-3) / self._height) / 0.1) ** 2
        return -total

    def _changes(self, u: Floats, v: Floats) -> Floats:
        """Gradients of the picture to the right of all edges, (n, edges), -1 to 1 each.

        Parameters
        ----------
        u, v : (n, points) pixels of the points of all curves
        """
        along_u, along_v = (np.take(np.diff(k, axis=1), self._edges, axis=1) for k in (u, v))
        middle_u, middle_v = (
            np.take((k[:, 1:] + k[:, :-1]) / 2, self._edges, axis=1).astype(np.float32)
            for k in (u, v)
        )
        # The picture is flat beyond its rim.
        du, dv = (cv2.remap(k, middle_u, middle_v, cv2.INTER_LINEAR) for k in self._slopes)
        with np.errstate(divide="ignore", invalid="ignore"):
            length = np.sqrt(along_u * along_u + along_v * along_v)
            change = (du * -along_v + dv * along_u) / length
        return np.nan_to_num(change)
