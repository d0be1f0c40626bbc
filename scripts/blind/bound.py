"""How well a friction map can be known from a session at best: the joint Bayesian bound.

The generator's own law is linearised about the true paths: its accelerations by differences along
each path, and the response of the path by integrating the linear equations of motion. Unknown are
the field (its prior is the true one: a Gaussian correlation of the true size and length), the
parameters of all hidden effects, the level of friction, the coupling of the spin, each throw's
release, and its own friction, which scatters as it truly does. The noise is the true one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from blind.camera import HEADING, seen
from blind.hidden import STRENGTH_PLACES
from blind.law import (
    AIR,
    COUPLING,
    CURL,
    CURL_V,
    CURL_W,
    DRIFT,
    EXPONENT,
    MAP_LENGTH,
    MAP_SD,
    MU,
    PATCH_FACTOR,
    PATCH_X0,
    PATCH_X1,
    PATCH_Y0,
    PATCH_Y1,
    SLOPE_X,
    SLOPE_Y,
    SPIN_POWER,
    SPIN_RATE,
    SQUARES,
    STEP,
    STONE_CURL,
    STONE_FACTOR,
    SWEEP,
    WEAR,
    WEAR_ALONG,
    rates,
    run_over,
)
from blind.sessions import Release, release_of
from curling_env.sheet import PAPER_SHEET
from curling_env.trajectory import Trajectory
from curling_env.typing import Flags, Floats

FREE = {
    "speed_dependent_friction": (EXPONENT,),
    "curl": (CURL, CURL_V, CURL_W),
    "slope": (SLOPE_X, SLOPE_Y),
    "pebble_wear": (WEAR,),
    "pebble_wear:along paths": (WEAR_ALONG,),
    "stone_bias": (STONE_FACTOR,),
    "stone_bias:curl": (STONE_CURL,),
    "sweeping": (SWEEP,),
    "friction_patch": (PATCH_FACTOR, PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1),
    "time_drift": (DRIFT,),
    "spin_drag": (SPIN_RATE, SPIN_POWER),
    "air_drag": (AIR,),
}
"""Places of the parameters of each effect that acts on the stone."""
WIDE = {
    EXPONENT: 1.0,
    CURL: 0.05,
    CURL_V: 1.0,
    CURL_W: 1.0,
    SLOPE_X: 0.005,
    SLOPE_Y: 0.005,
    WEAR: 0.1,
    WEAR_ALONG: 0.5,
    STONE_FACTOR: 1.0,
    STONE_CURL: 1.0,
    SWEEP: 1.0,
    PATCH_FACTOR: 1.0,
    **dict.fromkeys((PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1), 5.0),
    DRIFT: 1e-3,
    SPIN_RATE: 0.1,
    SPIN_POWER: 2.0,
    AIR: 0.01,
}
"""Standard deviations of parameters before the throws: wide, so that the throws alone decide."""
NUDGE = 1e-4
"""Step of differences by a parameter, over its width before the throws."""
EDGE_NUDGE = 0.1
"""Step of differences by an edge of a patch [m]: about as far as a stone slides in a step."""
EVERY = 10
"""Steps of the generator to one of the linear equations of motion: 20 ms."""
LEFT_OUT = 1e-6
"""Part of the field's variance that its coarse basis may miss."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Response:
    """How one throw's path answers to what is unknown, along the path every 20 ms.

    Parameters
    ----------
    t : (n,) since the release [s]
    states : (n, 6) of the true path
    release : (n, 6, 6) to its release
    parameters : (n, 6, p) to ln of the friction and of the coupling, and to the effects
    field : (n, 6, m) to the coefficients of the field
    """

    t: Floats
    states: Floats
    release: Floats
    parameters: Floats
    field: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Bound:
    """The best that can be known of a map.

    Parameters
    ----------
    crossed : (89, 9) whether a stone's centre crossed the cell
    covariance : (k, k) of ln μ in the crossed cells, its mean over them taken out
    """

    crossed: Flags
    covariance: Floats

    @property
    def rmse(self) -> float:
        """Root of the mean variance over the crossed cells."""
        return float(np.sqrt(np.trace(self.covariance) / len(self.covariance)))


def crossed_cells(sealed: dict[str, Any], throws: int) -> Flags:
    """Cells that the centre of a stone crossed, (89, 9).

    Parameters
    ----------
    throws : of the session; the sealed ones after it do not count
    """
    return _crossed_by([path for _, path in paths_of(sealed, throws)])


def _crossed_by(paths: list[Floats]) -> Flags:
    crossed = np.zeros(PAPER_SHEET.shape, dtype=bool)
    for path in paths:
        crossed[PAPER_SHEET.cell_of(path[PAPER_SHEET.contains(path[:, :2]), :2])] = True
    return crossed


def paths_of(sealed: dict[str, Any], throws: int) -> list[tuple[Floats, Floats]]:
    """Passes of earlier stones, and the true path (n, 6), of each throw of the session."""
    q, pattern = np.array(sealed["numbers"]), np.array(sealed["pattern"]).reshape(-1, 3)
    passes = np.zeros(SQUARES)
    out: list[tuple[Floats, Floats]] = []
    for document in sealed["throws"][:throws]:
        path = release_of(document).path(q, pattern, passes)
        out.append((passes.copy() if q[WEAR_ALONG] else passes, path))
        if q[WEAR_ALONG]:
            run_over(passes, path)
    return out


def bound_of(sealed: dict[str, Any], tracks: list[Trajectory]) -> Bound:
    """The joint Bayesian bound of a session's friction map.

    Parameters
    ----------
    sealed : the truth, with a map that is a Gaussian field
    tracks : of the session, of which only the times of the frames are read
    """
    q, pattern = np.array(sealed["numbers"]), np.array(sealed["pattern"]).reshape(-1, 3)
    basis = field_basis(q[MAP_SD], q[MAP_LENGTH])
    modes = basis.shape[-1]
    places = free_places(sealed)
    errors = {k: np.array(v) if k == "offset" else v for k, v in sealed["camera"].items()}
    lens = camera_steps(errors)
    prior = np.concatenate(
        [[1.0, 1.0], [WIDE[p] for p in places], [w for _, _, w in lens], np.ones(modes)]
    )
    information = np.diag(prior**-2.0)
    paths = paths_of(sealed, len(tracks))
    for track, document, (passes, path) in zip(tracks, sealed["throws"], paths, strict=False):
        release = release_of(document)
        response = respond(release, path, q, pattern, passes, places, basis)
        columns = measured(response, track.t, errors, lens)
        columns = np.concatenate(
            [
                whitened(columns[:, j], track.t, sigma, memory)
                for j, (sigma, memory) in enumerate(
                    [(sealed["sigma"], sealed["memory"])] * 2 + [(HEADING, 0.0)]
                )
            ]
        )
        # The release, and the throw's own friction beside that of the session, are its own.
        own, shared = columns[:, :7], columns[:, 6:]
        inner = own.T @ own
        inner[6, 6] += sealed["scatter"] ** -2.0
        size = np.diag(inner) ** -0.5
        cross = size[:, None] * (own.T @ shared)
        information += shared.T @ shared - cross.T @ np.linalg.solve(
            inner * np.outer(size, size), cross
        )
    covariance = np.linalg.inv(information * np.outer(prior, prior)) * np.outer(prior, prior)
    crossed = _crossed_by([path for _, path in paths])
    cells = basis[crossed]
    cells = cells - cells.mean(axis=0)
    return Bound(crossed=crossed, covariance=cells @ covariance[-modes:, -modes:] @ cells.T)


def field_basis(sd: float, length: float) -> Floats:
    """A coarse basis of the field in the cells, (89, 9, m), with standard normal coefficients."""
    x, y = np.meshgrid(PAPER_SHEET.x_centres, PAPER_SHEET.y_centres)
    squared = (x.ravel()[:, None] - x.ravel()) ** 2 + (y.ravel()[:, None] - y.ravel()) ** 2
    values, vectors = np.linalg.eigh(sd**2 * np.exp(-squared / (2.0 * length**2)))
    values, vectors = values[::-1], vectors[:, ::-1]
    kept = 1 + int(np.argmax(np.cumsum(values) > (1.0 - LEFT_OUT) * values.sum()))
    return (vectors[:, :kept] * np.sqrt(values[:kept])).reshape(*PAPER_SHEET.shape, kept)


def free_places(sealed: dict[str, Any]) -> list[int]:
    """Places of all parameters that act on the stone, and that nobody was told."""
    names = {name.partition(":")[0] if name not in FREE else name for name in sealed["effects"]}
    names |= set(STRENGTH_PLACES) if "strengths" in sealed else set()
    return sorted({place for name in names for place in FREE.get(name, ())})


def camera_steps(errors: dict[str, Any]) -> list[tuple[dict[str, Any], float, float]]:
    """For each unknown of the camera: the errors after a small step, the step, and its width."""
    out: list[tuple[dict[str, Any], float, float]] = []
    if "offset" in errors:
        out += [
            ({**errors, "offset": errors["offset"] + step}, 1e-4, 0.2) for step in 1e-4 * np.eye(2)
        ]
    if "k1" in errors:
        out += [({**errors, "k1": errors["k1"] + 1e-5}, 1e-5, 0.1)]
        out += [({**errors, "centre": errors["centre"] + 1e-3}, 1e-3, 20.0)]
    return out


@numba.njit(cache=True)
def accelerations(
    q: Any,
    pattern: Any,
    passes: Any,
    t: Any,
    states: Any,
    clock: float,
    order: float,
    stone: float,
    sweep: Any,
) -> Any:
    """Accelerations of x, y and the heading at states along a path, (n, 3)."""
    out = np.empty((len(t), 3))
    for i in range(len(t)):
        swept = 1.0 if sweep[0] <= t[i] < sweep[1] else 0.0
        out[i] = rates(q, pattern, passes, states[i], t[i], clock + t[i], order, stone, swept)
    return out


def respond(
    release: Release,
    path: Floats,
    q: Floats,
    pattern: Floats,
    passes: Floats,
    places: list[int],
    basis: Floats,
) -> Response:
    """Integrate the linear equations of motion along a true path.

    Parameters
    ----------
    path : (n, 6) states every `STEP`
    places : of the effects' parameters
    basis : (89, 9, m) of the field
    """
    states, t = path[::EVERY], np.arange(len(path))[::EVERY] * STEP
    own = q.copy()
    own[MU] = release.mu

    def rate(numbers: Floats, at: Floats) -> Floats:
        return accelerations(
            numbers,
            pattern,
            passes,
            t,
            at,
            release.clock,
            float(release.order),
            float(release.stone),
            release.sweep,
        )

    def by_number(place: int, step: float) -> Floats:
        more, less = own.copy(), own.copy()
        more[place] += step
        less[place] -= step
        return (rate(more, states) - rate(less, states)) / (2.0 * step)

    n = len(t)
    dynamics = np.zeros((n, 6, 6))
    dynamics[:, 0, 2] = dynamics[:, 1, 3] = dynamics[:, 4, 5] = 1.0
    for j, step in enumerate((1e-2, 1e-2, 1e-5, 1e-5, 1e-4, 1e-5)):
        nudge = np.eye(6)[j] * step
        difference = rate(own, states + nudge) - rate(own, states - nudge)
        dynamics[:, [2, 3, 5], j] = difference / (2.0 * step)
    friction = own[MU] * by_number(MU, 1e-4 * own[MU])
    pushes = [friction, own[COUPLING] * by_number(COUPLING, 1e-4 * own[COUPLING])]
    for place in places:
        is_edge = place in (PATCH_X0, PATCH_X1, PATCH_Y0, PATCH_Y1)
        pushes.append(by_number(place, EDGE_NUDGE if is_edge else NUDGE * WIDE[place]))
    drive = np.zeros((n, 6, len(pushes) + basis.shape[-1]))
    drive[:, [2, 3, 5], : len(pushes)] = np.stack(pushes, axis=2)
    drive[:, [2, 3, 5], len(pushes) :] = friction[:, :, None] * along(basis, states)[:, None, :]
    answers = np.zeros((n, 6, 6 + drive.shape[2]))
    answers[0, :, :6] = np.eye(6)
    drive = np.concatenate([np.zeros((n, 6, 6)), drive], axis=2)
    half = 0.5 * np.diff(t)
    for i in range(n - 1):  # the trapezoidal rule, which stays stable as the stone stops
        known = answers[i] + half[i] * (dynamics[i] @ answers[i] + drive[i] + drive[i + 1])
        answers[i + 1] = np.linalg.solve(np.eye(6) - half[i] * dynamics[i + 1], known)
    first = 6 + len(pushes)
    return Response(
        t=np.asarray(t, dtype=np.float64),
        states=states,
        release=answers[:, :, :6],
        parameters=answers[:, :, 6:first],
        field=answers[:, :, first:],
    )


def along(basis: Floats, states: Floats) -> Floats:
    """The basis at the places of a path, (n, m): bilinear between the centres of cells."""
    (i, i1), (j, j1), u, v = PAPER_SHEET.cells_around(states[:, :2])
    u, v = u[:, None], v[:, None]
    return (1 - u) * ((1 - v) * basis[i, j] + v * basis[i, j1]) + u * (
        (1 - v) * basis[i1, j] + v * basis[i1, j1]
    )


def measured(
    response: Response,
    frames: Floats,
    errors: dict[str, Any],
    lens: list[tuple[dict[str, Any], float, float]],
) -> Floats:
    """Response of the measured x, y and heading in each frame, (frames, 3, 6 + p + lens + m)."""

    def at(values: Floats) -> Floats:
        flat = values.reshape(len(values), -1)
        k = np.clip(np.searchsorted(response.t, frames, side="right") - 1, 0, len(flat) - 2)
        part = (frames - response.t[k]) / (response.t[k + 1] - response.t[k])
        mixed = flat[k] + part[:, None] * (flat[k + 1] - flat[k])
        return mixed.reshape(len(frames), *values.shape[1:])

    pose = at(response.states[:, [0, 1, 4]])
    xy, theta = pose[:, :2], pose[:, 2]
    plain = seen(xy, theta, errors)
    turned = np.zeros((len(frames), 3, 3))
    turned[:, 2, 2] = 1.0
    for j, step in enumerate(1e-4 * np.eye(3)):
        turned[:, :2, j] = (seen(xy + step[:2], theta + step[2], errors) - plain) / 1e-4
    moved = np.zeros((len(frames), 3, len(lens)))
    for j, (nudged, step, _) in enumerate(lens):
        moved[:, :2, j] = (seen(xy, theta, nudged) - plain) / step
    return np.concatenate(
        [
            turned @ at(response.release[:, [0, 1, 4]]),
            turned @ at(response.parameters[:, [0, 1, 4]]),
            moved,
            turned @ at(response.field[:, [0, 1, 4]]),
        ],
        axis=2,
    )


def whitened(columns: Floats, t: Floats, sigma: float, memory: float) -> Floats:
    """Rows over their noise, each without what the row before tells of its noise."""
    if memory == 0.0:
        return columns / sigma
    keep = np.exp(-np.diff(t) / memory)[:, None]
    out = columns / sigma
    out[1:] = (columns[1:] - keep * columns[:-1]) / (sigma * np.sqrt(1.0 - keep**2))
    return out


def log_error(estimate: Floats, truth: Floats, crossed: Flags) -> Floats:
    """Errors of ln μ in the crossed cells, (k,), their mean taken out."""
    error = (estimate - truth)[crossed]
    return error - (error.mean() if len(error) else math.nan)
