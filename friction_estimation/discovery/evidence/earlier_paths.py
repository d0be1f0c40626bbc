"""Effect of errors in earlier stones' measured paths on the parameters of a fit.

Where wear follows the paths of stones, a throw is compared with what earlier ones left. Their paths
are measured, and their errors are common to all throws that came after: no noise of single throws
holds them. They are drawn some times as the noise of the tracks would make them, and the parameters
that fit best are found again each time, as in multiple imputation.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.outliers import slow_basis
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.data.wear_tracks import SMOOTHED_PERIODS, WearTracks
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.response import MEASURED

DRAWS = 8
"""Draws of the paths: they tell a standard deviation to a quarter."""


def with_earlier_paths(fitted: SessionFit, rng: np.random.Generator) -> SessionFit:
    """A fit that knows what errors of earlier paths do to its parameters.

    Parameters
    ----------
    fitted : fit, with wear along paths or without
    rng : source of the errors
    """
    model, session = fitted.model, fitted.session
    if not any(term.follows_paths for term in model.terms):
        return fitted
    at = fitted.states, fitted.ln_factors
    steps: list[Floats] = []
    for _ in range(DRAWS):
        moved = replace(session, wear_tracks=_moved(session, fitted.noise, rng))
        shift = predict(model, moved, *at) - predict(model, session, *at)
        linear = fitted.linear_in(model, fitted.columns, shift[:, MEASURED])
        linear = replace(linear, ln_factors=np.zeros(len(session)))
        total = linear.total(fitted.only_spread)
        total[:, -1] -= linear.prior[:, -1]  # nothing but the shift moves the parameters
        steps.append(minimum_of(total).step)
    return replace(fitted, by_paths=np.mean([np.outer(s, s) for s in steps], axis=0))


def _moved(session: Session, noise: SessionNoise, rng: np.random.Generator) -> WearTracks:
    """Return the paths of a session as its throws might have been measured on other days.

    Those of excluded throws stay: nothing is known of their noise.
    """
    tracks = session.wear_tracks
    throws = {order: i for i, order in enumerate(session.orders.tolist())}
    paths: list[Floats] = []
    for order, path in zip(tracks.orders.tolist(), tracks.paths, strict=True):
        if order in throws:
            rows = session.rows(throws[order])
            t, xy = session.times[rows], session.xy[rows]
            basis = slow_basis(t, SMOOTHED_PERIODS[0])
            errors = basis @ np.linalg.lstsq(basis, noise.drawn(t, rng))[0]
            nearest = [int(np.hypot(*(xy - point).T).argmin()) for point in path]
            path = path + errors[nearest]
        paths.append(path)
    return WearTracks(orders=tracks.orders, paths=tuple(paths))
