"""A throw linearised about its motion: how its rows respond to friction, effects and the camera.

The start and speed of a throw are its own and say nothing about the ice, so they are projected out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curling_env.typing import Floats, Indices
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.throw.camera_bias import NO_BIAS, CameraBias
from friction_estimation.inversion.throw.fitted import FittedThrow
from friction_estimation.inversion.throw.forward import LawOnMap, PathMotion, sensitivities
from friction_estimation.inversion.throw.free_effects import PARAMETER_STEP, FreeEffects


@dataclass(frozen=True, kw_only=True)
class LinearThrow:
    """A throw linearised about its motion and whitened; q other unknowns beside the friction.

    Parameters
    ----------
    crossed : (m,) flat indices of the cells that change its path
    friction, effects : (rows, m) and (rows, q) columns of the cells and of the other unknowns,
        start and speed projected out
    residual : (rows,) residuals, start and speed projected out
    release_root : (2, 2) triangular factor of the columns of start and speed
    release_residual, release_friction, release_effects : (2,), (2, m) and (2, q) parts of residual
        and columns that start and speed can imitate
    log_volume : 2·ln of the volume over which noise and release spread the density of the rows
    """

    crossed: Indices
    friction: Floats
    residual: Floats
    effects: Floats
    release_root: Floats
    release_residual: Floats
    release_friction: Floats
    release_effects: Floats
    log_volume: float

    def release_step(self, change: Floats, effects: Floats | None = None) -> Floats:
        """Change of start and speed that goes with a change of everything else, (2,).

        Parameters
        ----------
        change : (m,) change of ln μ in the crossed cells
        effects : (q,) change of the other unknowns, if there are any
        """
        goal = self.release_residual - self.release_friction @ change
        if effects is not None:
            goal = goal - self.release_effects @ effects
        return np.asarray(np.linalg.solve(self.release_root, goal), dtype=np.float64)


def linearise(
    throw: FittedThrow,
    motion: PathMotion,
    law: LawOnMap,
    noise: Noise,
    free: FreeEffects | None = None,
    bias: CameraBias = NO_BIAS,
) -> LinearThrow:
    """Linearise a throw about its motion.

    Parameters
    ----------
    throw : throw with its present residuals
    motion : its motion under the law
    noise : noise by which the rows are whitened
    free : free parameters of effects: the first of the other unknowns
    bias : bias of the camera, whose nodes are the last of them
    """
    cells, weights = law.cell_weights(throw.inputs.path.at(motion.distance))
    shares = weights * law.mu.ravel()[cells]
    shares /= shares.sum(axis=1, keepdims=True)
    crossed, release, friction = sensitivities(motion, cells, shares)
    columns = motion.columns_at(np.hstack([release, friction]), throw.t)
    by_effect = (
        np.empty((len(throw.t), 0)) if free is None else _effect_columns(throw, motion, law, free)
    )
    # Taken where the fitted stone was: a column that followed a row's own noise would find that
    # noise in the residual.
    by_bias = bias.along_path(throw.inputs.path, motion.distance_at(throw.t))
    columns = np.column_stack([throw.residual, columns, by_effect, by_bias])
    white = noise.whiten(throw.t, columns, throw.scale, throw.keep)
    q, root = np.linalg.qr(white[:, 1:3])
    clear = white - q @ (q.T @ white)
    cut = 3 + len(crossed)
    return LinearThrow(
        crossed=crossed,
        friction=clear[:, 3:cut],
        residual=clear[:, 0],
        effects=clear[:, cut:],
        release_root=root,
        release_residual=q.T @ white[:, 0],
        release_friction=q.T @ white[:, 3:cut],
        release_effects=q.T @ white[:, cut:],
        log_volume=noise.log_volume(throw.t, throw.scale, throw.keep)
        + 2.0 * float(np.log(np.abs(np.diag(root))).sum()),
    )


def _effect_columns(
    throw: FittedThrow, motion: PathMotion, law: LawOnMap, free: FreeEffects
) -> Floats:
    """How the distance of each row responds to the free parameters, (k, p)."""
    columns = np.empty((len(throw.t), len(free)))
    here = motion.distance_at(throw.t)
    for k in range(len(free)):
        other = law.with_effects(free.perturbed(k))
        moved = other.integrate(throw.inputs, throw.start, throw.speed, throw.offset)
        columns[:, k] = (moved.distance_at(throw.t) - here) / PARAMETER_STEP
    return columns
