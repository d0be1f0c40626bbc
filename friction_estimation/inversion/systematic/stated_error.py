"""The systematic error that tracks state: pose, lens and outline, common to all frames.

A tracker states in `sigma_xy` how far a position may be off. The part of it that the residuals do
not show as noise is common to all frames and all throws: it bends every path alike, looks like
friction, and no number of throws averages it away. It enters the standard errors of the estimate
as a displacement along the sheet that varies smoothly with the place. The estimate itself stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from curling_env.sheet import Sheet
from curling_env.typing import Floats
from friction_estimation.inversion.friction.information import StoredInformation
from friction_estimation.inversion.friction.map_fit import FittedMap, MapProblem
from friction_estimation.inversion.friction.uniform_fit import UniformFit
from friction_estimation.inversion.matern import matern
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.throw.camera_bias import NO_BIAS, CameraBias
from friction_estimation.inversion.throw.fitted import FittedThrow
from friction_estimation.inversion.throw.forward import LawOnMap, PathMotion
from friction_estimation.inversion.throw.linearised import linearise
from friction_estimation.inversion.tuning import STATED_ERROR_LENGTH


@dataclass(frozen=True, kw_only=True)
class StatedError:
    """A displacement along the sheet, common to all throws, of which only the size is known.

    Parameters
    ----------
    nodes : (n,) positions along the sheet [m]
    root : (n, n) R of its covariance R Rᵀ at the nodes [m]
    """

    nodes: Floats
    root: Floats

    @property
    def basis(self) -> CameraBias:
        """Interpolation between the nodes."""
        zero = np.zeros(len(self.nodes))
        return CameraBias(nodes=self.nodes, values=zero, sigma=zero)


def _nodes_of(sheet: Sheet) -> Floats:
    """Positions along the sheet where the displacement is counted, at most 2 m apart, (n,) [m]."""
    count = int(np.ceil(sheet.length / 2.0)) + 1
    return np.linspace(-sheet.length / 2, sheet.length / 2, count)


def stated_error(
    sheet: Sheet, places: Sequence[Floats], sigmas: Sequence[Floats], noise: float
) -> StatedError | None:
    """The part of the stated errors that is not noise; None where there is none.

    Parameters
    ----------
    sheet : sheet on which stones were measured
    places : for each throw, positions along the sheet [m]
    sigmas : for each throw, stated standard errors of its rows [m]; empty where none are stated
    noise : standard deviation of a row about its path [m]
    """
    nodes = _nodes_of(sheet)
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
    beyond_noise = np.maximum(np.mean(variances, axis=0) - noise**2, 0.0)
    if not beyond_noise.any():
        return None
    alike = matern(np.abs(nodes[:, None] - nodes[None]), STATED_ERROR_LENGTH, 2.5)
    lower = np.linalg.cholesky(alike + 1e-9 * np.eye(len(nodes)))
    return StatedError(nodes=nodes, root=np.sqrt(beyond_noise)[:, None] * lower)


def error_of_level(one: UniformFit, earlier: StoredInformation | None) -> Floats | None:
    """Change of each throw's part of the vector by n unit errors that all share, (throws, n).

    None where nothing is stated.
    """
    law = one.law
    error = _error_of_tracks(one.throws, law.ice.sheet, one.noise)
    before = None if earlier is None else earlier.systematic
    if before is None and error is None and all(throw.heading_seen for throw in one.throws):
        return None
    rows: list[Floats] = []
    for throw in one.throws:
        motion = law.integrate(throw.inputs, throw.start, throw.speed, throw.offset)
        own = linearise(throw, motion, law, one.noise).friction.sum(axis=1)
        rows.append(own @ _response(throw, motion, law, one.noise, error))
    systematic = np.array(rows)
    if earlier is None:
        return systematic
    if before is None:
        before = np.zeros((earlier.throws, systematic.shape[1]))
    return np.vstack([before, systematic])


def error_of_map(found: FittedMap, problem: MapProblem) -> Floats | None:
    """Change of the vector of the normal equations by n unit errors that all share, (size, n).

    None where nothing is stated.
    """
    equations, state, noise = found.equations, found.state, found.noise
    throws, law = state.throws, state.law
    before = None if problem.earlier is None else problem.earlier.systematic
    error = _error_of_tracks(throws, law.ice.sheet, noise)
    if before is None and error is None and all(throw.heading_seen for throw in throws):
        return None
    systematic = np.zeros((len(equations.vector), len(_nodes_of(law.ice.sheet)) + 1))
    if problem.earlier is not None and before is not None:
        cells = np.searchsorted(equations.cells, problem.earlier.cells)
        offsets = equations.m + np.arange(problem.earlier_throws)
        systematic[np.append(cells, offsets)] = before
    last = equations.m + equations.throws
    for k, throw in enumerate(throws):
        motion = law.integrate(throw.inputs, throw.start, throw.speed, throw.offset)
        part = linearise(throw, motion, law, noise, state.free, state.bias)
        response = _response(throw, motion, law, noise, error)
        cells = np.searchsorted(equations.cells, part.crossed)
        offset = equations.m + problem.earlier_throws + k
        places = np.concatenate([cells, [offset], np.arange(last, len(systematic))])
        columns = np.column_stack([part.friction, part.friction.sum(axis=1), part.effects])
        systematic[places] += columns.T @ response
    return systematic


def _error_of_tracks(
    throws: Sequence[FittedThrow], sheet: Sheet, noise: Noise
) -> StatedError | None:
    """The systematic error that the tracks of throws state."""
    stated = [k.slide.track.sigma_xy for k in throws]
    return stated_error(
        sheet,
        [k.inputs.path.at(k.measured)[:, 1] for k in throws],
        [
            sigma[k.slide.rows] if sigma.size else sigma
            for k, sigma in zip(throws, stated, strict=True)
        ],
        noise.total,
    )


def _response(
    throw: FittedThrow,
    motion: PathMotion,
    law: LawOnMap,
    noise: Noise,
    error: StatedError | None,
) -> Floats:
    """How a throw's whitened rows respond to unit errors that all throws share, (rows, n + 1).

    The last column is the spin of a stone whose heading was not measured: it was taken to be the
    usual one, and may as well be none.
    """
    nodes = _nodes_of(law.ice.sheet)
    without_spin = np.zeros(len(throw.t))
    if not throw.heading_seen:
        inputs = replace(throw.inputs, spin=0.0)
        other = law.integrate(inputs, throw.start, throw.speed, throw.offset)
        without_spin = other.distance_at(throw.t) - motion.distance_at(throw.t)
    basis = NO_BIAS if error is None else error.basis
    part = linearise(replace(throw, residual=without_spin), motion, law, noise, None, basis)
    if error is None:
        return np.column_stack([np.zeros((len(part.residual), len(nodes))), part.residual])
    return np.column_stack([part.effects @ error.root, part.residual])
