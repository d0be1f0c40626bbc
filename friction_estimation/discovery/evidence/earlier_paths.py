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
from friction_estimation.discovery.evidence.mixture import gaussian
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrix,
)
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.quadratic import prior_gram
from friction_estimation.discovery.model.response import MEASURED
from friction_estimation.discovery.model.sensitivity import sensitivities_by_throw

DRAWS = 8
"""Draws of the paths: they tell a standard deviation to a quarter."""


def with_earlier_paths(fitted: SessionFit, rng: np.random.Generator) -> SessionFit:
    """A fit that knows what errors of earlier paths do to its parameters.

    Parameters
    ----------
    fitted : fit, with wear along paths or without
    rng : source of the errors
    """
    model = fitted.model
    if not any(term.follows_paths for term in model.terms):
        return fitted
    session, states, factors = fitted.session, fitted.states, fitted.ln_factors
    found = sensitivities_by_throw(model, session, states, factors)
    shifts: list[Floats] = []
    for _ in range(DRAWS):
        moved = replace(session, wear_tracks=_moved(session, fitted.noise, rng))
        shifts.append((predict(model, moved, states, factors) - found.predicted)[:, MEASURED])
    elsewhere = np.stack([*shifts, fitted.residuals], axis=2)
    own = 7 + len(model.vector)
    grams = np.array(
        [
            gram_matrix(
                session,
                fitted.noise,
                i,
                np.concatenate([found.of_throw(session.rows(i), i), elsewhere[session.rows(i)]], 2),
            )
            for i in range(len(session))
        ]
    )
    prior = prior_gram(model, own - 6)
    prior[:, -1], prior[-1] = 0.0, 0.0
    spread = model.spread if fitted.only_spread is None else fitted.only_spread
    steps: list[Floats] = []
    for k in range(DRAWS):
        at = np.append(np.arange(own), own + k)
        reduced = eliminate_states(grams[:, at[:, None], at])
        bands, _ = eliminate_factor(reduced, np.zeros(len(session)), spread)
        steps.append(gaussian(bands.sum(axis=0) + prior).step)
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
