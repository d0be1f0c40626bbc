"""What all frames of a camera err by together: its pose, its lens, the outline of the stone.

A tracker states in `sigma_xy` how far a place may be off. What of that the residuals do not show as
noise is common to all frames and all throws: it bends every path alike, is taken for friction, and
no number of throws averages it away. It is carried into the standard errors of the estimate as a
displacement along the sheet that varies smoothly with the place. The estimate itself stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats
from friction_estimation.inversion.information import Knowledge
from friction_estimation.inversion.level_fit import OneFriction
from friction_estimation.inversion.map_fit import FittedMap, Sought
from friction_estimation.inversion.matern import matern
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.throw.camera_bias import NO_BIAS, CameraBias
from friction_estimation.inversion.throw.fitted import Ridden
from friction_estimation.inversion.throw.forward import Ride, Track
from friction_estimation.inversion.throw.linearised import linearise

SPACING = 2.0
"""Between nodes along the sheet [m]."""
LENGTH = 5.0
"""Over which the errors of pose, lens and outline are alike [m]. On 44 sessions of two and five
throws that `friction_estimation.synthetic` filmed from the end, a gantry and the side, corners
marked 3 px off, the intervals of all sessions and of 102 of the 103 throws hold μ; of 11 maps from
such films 91 to 100 % of the cells. Of 8 m, at which that of one map was 83 %, σ of one friction
is 0 to 15 % less."""


@dataclass(frozen=True, kw_only=True)
class SharedError:
    """A displacement along the sheet, common to all throws, of which only the size is known.

    Parameters
    ----------
    nodes : (n,) along the sheet [m]
    root : (n, n) R of its covariance R Rᵀ at the nodes [m]
    """

    nodes: Floats
    root: Floats

    @property
    def basis(self) -> CameraBias:
        """By which a throw sees the nodes."""
        nothing = np.zeros(len(self.nodes))
        return CameraBias(nodes=self.nodes, values=nothing, sigma=nothing)


def nodes_of(sheet: Sheet) -> Floats:
    """Places along the sheet where the displacement is counted, (n,) [m]."""
    count = int(np.ceil(sheet.length / SPACING)) + 1
    return np.linspace(-sheet.length / 2, sheet.length / 2, count)


def shared_error(
    sheet: Sheet, places: Sequence[Floats], sigmas: Sequence[Floats], noise: float
) -> SharedError | None:
    """What tracks say of themselves and their noise does not show; None where there is nothing.

    Parameters
    ----------
    sheet : on which stones were measured
    places : for each throw, along the sheet [m]
    sigmas : for each throw, stated standard errors of its rows [m]; empty where nobody stated any
    noise : standard deviation of a row about its path [m]
    """
    nodes = nodes_of(sheet)
    variances: list[Floats] = []
    for y, sigma in zip(places, sigmas, strict=True):
        if len(sigma) != len(y):
            continue
        order = np.argsort(y)
        order = order[np.isfinite(sigma[order])]
        if len(order):
            variances.append(np.interp(nodes, y[order], sigma[order] ** 2))
    if not variances:
        return None
    left = np.maximum(np.mean(variances, axis=0) - noise**2, 0.0)
    if not left.any():
        return None
    alike = matern(np.abs(nodes[:, None] - nodes[None]), LENGTH, 2.5)
    lower = np.linalg.cholesky(alike + 1e-9 * np.eye(len(nodes)))
    return SharedError(nodes=nodes, root=np.sqrt(left)[:, None] * lower)


def shared_by_level(one: OneFriction, track: Track, before: Knowledge | None) -> Floats | None:
    """Pull of what all throws err by together on each throw's ln μ, (throws, n) for n units."""
    error = _stated(one.throws, track.ice.sheet, one.noise)
    told = None if before is None else before.shared
    if told is None and error is None and all(throw.turn_seen for throw in one.throws):
        return None
    rows: list[Floats] = []
    for throw in one.throws:
        ride = track.ride(throw.passenger, throw.start, throw.speed, throw.offset)
        own = linearise(throw, ride, track, one.noise).friction.sum(axis=1)
        rows.append(own @ _seen_together(throw, ride, track, one.noise, error))
    shared = np.array(rows)
    if before is None:
        return shared
    return np.vstack([np.zeros((before.throws, shared.shape[1])) if told is None else told, shared])


def shared_by_map(found: FittedMap, sought: Sought) -> Floats | None:
    """Pull of what all throws err by together on everything fitted, (size, n) for n units."""
    evidence, state, noise = found.evidence, found.state, found.noise
    throws, track = state.throws, state.track
    told = None if sought.before is None else sought.before.shared
    error = _stated(throws, track.ice.sheet, noise)
    if told is None and error is None and all(throw.turn_seen for throw in throws):
        return None
    shared = np.zeros((len(evidence.pull), len(nodes_of(track.ice.sheet)) + 1))
    if sought.before is not None and told is not None:
        cells = np.searchsorted(evidence.cells, sought.before.cells)
        shared[np.append(cells, evidence.m + np.arange(sought.played))] = told
    last = evidence.m + evidence.throws
    for k, throw in enumerate(throws):
        ride = track.ride(throw.passenger, throw.start, throw.speed, throw.offset)
        part = linearise(throw, ride, track, noise, state.free, state.bias)
        seen = _seen_together(throw, ride, track, noise, error)
        cells = np.searchsorted(evidence.cells, part.crossed)
        places = np.concatenate(
            [cells, [evidence.m + sought.played + k], np.arange(last, len(shared))]
        )
        columns = np.column_stack([part.friction, part.friction.sum(axis=1), part.effects])
        shared[places] += columns.T @ seen
    return shared


def _stated(throws: Sequence[Ridden], sheet: Sheet, noise: Noise) -> SharedError | None:
    """What the tracks say to err by together."""
    stated = [k.slide.track.sigma_xy for k in throws]
    return shared_error(
        sheet,
        [k.passenger.course.at(k.measured)[:, 1] for k in throws],
        [
            sigma[k.slide.rows] if sigma.size else sigma
            for k, sigma in zip(throws, stated, strict=True)
        ],
        noise.total,
    )


def _seen_together(
    throw: Ridden, ride: Ride, track: Track, noise: Noise, error: SharedError | None
) -> Floats:
    """How a throw's whitened rows respond to what all throws err by together, (rows, n + 1).

    The last column is the turn of a stone whose heading was not seen: it is taken to be the usual
    one, and as likely as not to be none.
    """
    nodes = nodes_of(track.ice.sheet)
    bent = np.zeros(len(throw.t))
    if not throw.turn_seen:
        still = replace(throw.passenger, spin=0.0)
        other = track.ride(still, throw.start, throw.speed, throw.offset)
        bent = other.distance_at(throw.t) - ride.distance_at(throw.t)
    basis = NO_BIAS if error is None else error.basis
    part = linearise(replace(throw, left=bent), ride, track, noise, None, basis)
    if error is None:
        return np.column_stack([np.zeros((len(part.left), len(nodes))), part.left])
    return np.column_stack([part.effects @ error.root, part.left])
