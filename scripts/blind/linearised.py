"""Generator's own law, linearised about true paths.

Accelerations by differences along each path, and the response of the path by integrating the linear
equations of motion; then the response of the camera's measurements, with whitened noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from blind import law
from blind.camera import seen
from blind.law import STEP, rates
from blind.sessions import Release
from curling_env.sheet import PAPER_SHEET
from curling_env.typing import Floats

EDGES = (law.PATCH_X0, law.PATCH_X1, law.PATCH_Y0, law.PATCH_Y1)
FREE = {
    "speed_dependent_friction": {law.EXPONENT: 1.0},
    "curl": {law.CURL: 0.05, law.CURL_V: 1.0, law.CURL_W: 1.0},
    "slope": {law.SLOPE_X: 0.005, law.SLOPE_Y: 0.005},
    "pebble_wear": {law.WEAR: 0.1},
    "pebble_wear:along paths": {law.WEAR_ALONG: 0.5},
    "stone_bias": {law.STONE_FACTOR: 1.0},
    "stone_bias:curl": {law.STONE_CURL: 1.0},
    "sweeping": {law.SWEEP: 1.0},
    "friction_patch": {law.PATCH_FACTOR: 1.0, **dict.fromkeys(EDGES, 5.0)},
    "time_drift": {law.DRIFT: 1e-3},
    "spin_drag": {law.SPIN_RATE: 0.1, law.SPIN_POWER: 2.0},
    "air_drag": {law.AIR: 0.01},
}
"""Places of the parameters of each effect that acts on the stone, and their prior standard
deviations: wide, so that the throws alone decide.
"""
WIDE = {place: width for places in FREE.values() for place, width in places.items()}
"""These standard deviations by place."""
NUDGE = 1e-4
"""Step of differences by a parameter, over its prior width."""
EDGE_NUDGE = 0.1
"""Step of differences by an edge of a patch [m]: about the slide of a stone in one step."""
EVERY = 10
"""Number of steps of the generator in one of the linear equations of motion: 20 ms."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Response:
    """Response of one throw's path to the unknowns, along the path every 20 ms.

    Parameters
    ----------
    t : (n,) times since the release [s]
    states : (n, 6) states of the true path
    release : (n, 6, 6) response to its release
    parameters : (n, 6, p) response to ln of the friction and of the coupling, and to the effects
    field : (n, 6, m) response to the coefficients of the field
    """

    t: Floats
    states: Floats
    release: Floats
    parameters: Floats
    field: Floats


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
    """Return accelerations of x, y and the heading at states along a path, (n, 3)."""
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
    places : places of the effects' parameters
    basis : (89, 9, m) basis of the field
    """
    states = path[::EVERY]
    t: Floats = STEP * np.arange(0.0, len(path), EVERY)
    own = q.copy()
    own[law.MU] = release.mu

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
    friction = own[law.MU] * by_number(law.MU, 1e-4 * own[law.MU])
    pushes = [friction, own[law.COUPLING] * by_number(law.COUPLING, 1e-4 * own[law.COUPLING])]
    for place in places:
        step = EDGE_NUDGE if place in EDGES else NUDGE * WIDE[place]
        pushes.append(by_number(place, step))
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
        t=t,
        states=states,
        release=answers[:, :, :6],
        parameters=answers[:, :, 6:first],
        field=answers[:, :, first:],
    )


def along(basis: Floats, states: Floats) -> Floats:
    """Return the basis at the places of a path, (n, m): bilinear between the centres of cells."""
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
    """Return the response of the measured x, y and heading in each frame, (frames, 3, 6 + p + lens
    + m).
    """

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
    """Return rows over their noise, without the part predicted by the row before."""
    if memory == 0.0:
        return columns / sigma
    keep = np.exp(-np.diff(t) / memory)[:, None]
    out = columns / sigma
    out[1:] = (columns[1:] - keep * columns[:-1]) / (sigma * np.sqrt(1.0 - keep**2))
    return out
