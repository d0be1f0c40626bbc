"""A throw linearised about its ride: how its rows respond to friction, effects and the camera.

Start and speed of a throw are its own and tell nothing of the ice: they are projected out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from curling_env.typing import Floats
from friction_estimation.inversion.noise import Noise
from friction_estimation.inversion.throw.camera_bias import NO_BIAS, CameraBias
from friction_estimation.inversion.throw.fitted import Ridden
from friction_estimation.inversion.throw.forward import Ride, Track, sensitivities
from friction_estimation.inversion.throw.free_effects import SMALL, FreeEffects


@dataclass(frozen=True, kw_only=True)
class LinearThrow:
    """A throw linearised about its ride, whitened, its start and speed projected out.

    `volume` is 2·ln of the density that noise and release spread out over.
    """

    crossed: NDArray[np.intp]
    friction: Floats
    left: Floats
    effects: Floats
    release_root: Floats
    release_left: Floats
    release_friction: Floats
    release_effects: Floats
    volume: float

    def release_step(self, change: Floats, effects: Floats | None = None) -> Floats:
        """Change of start and speed that goes with a change of ln μ in the crossed cells.

        `effects` is the change of the free parameters, if there are any.
        """
        goal = self.release_left - self.release_friction @ change
        if effects is not None:
            goal = goal - self.release_effects @ effects
        return np.asarray(np.linalg.solve(self.release_root, goal), dtype=np.float64)


def linearise(
    throw: Ridden,
    ride: Ride,
    track: Track,
    noise: Noise,
    free: FreeEffects | None = None,
    bias: CameraBias = NO_BIAS,
) -> LinearThrow:
    """`effects` of what comes back are the free parameters and the nodes of the camera's bias."""
    cells, weights = track.cell_weights(throw.passenger.course.at(ride.distance))
    shares = weights * track.mu.ravel()[cells]
    shares /= shares.sum(axis=1, keepdims=True)
    crossed, release, friction = sensitivities(ride, cells, shares)
    columns = ride.tangents_at(np.hstack([release, friction]), throw.t)
    bent = np.empty((len(throw.t), 0)) if free is None else _bent(throw, ride, track, free)
    # Where the stone was by its ride, not by a row: a column that follows the row's own noise would
    # find that noise in what is left.
    seen = bias.seen_along(throw.passenger.course, ride.distance_at(throw.t))
    columns = np.column_stack([throw.left, columns, bent, seen])
    white = noise.whiten(throw.t, columns, throw.scale, throw.keep)
    q, root = np.linalg.qr(white[:, 1:3])
    clear = white - q @ (q.T @ white)
    cut = 3 + len(crossed)
    return LinearThrow(
        crossed=crossed,
        friction=clear[:, 3:cut],
        left=clear[:, 0],
        effects=clear[:, cut:],
        release_root=root,
        release_left=q.T @ white[:, 0],
        release_friction=q.T @ white[:, 3:cut],
        release_effects=q.T @ white[:, cut:],
        volume=noise.volume(throw.t, throw.scale, throw.keep)
        + 2.0 * float(np.log(np.abs(np.diag(root))).sum()),
    )


def _bent(throw: Ridden, ride: Ride, track: Track, free: FreeEffects) -> Floats:
    """How the distance of each row responds to the free parameters, (k, p)."""
    columns = np.empty((len(throw.t), len(free)))
    here = ride.distance_at(throw.t)
    for k in range(len(free)):
        other = track.under(free.nudged(k))
        moved = other.ride(throw.passenger, throw.start, throw.speed, throw.offset)
        columns[:, k] = (moved.distance_at(throw.t) - here) / SMALL
    return columns
