"""Whether the throws of a session show a bias of their camera along the sheet.

A bias that was always fitted would now and then take up what noise or an unknown effect left. So
it is declined unless the evidence for it is clear beside the map and beside effects that bend
throws in a similar way, and unless each half of the throws, fitted on its own, finds the same one.
Where throws cannot tell a bias from the ice, the result says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.linalg import eigvalsh, solve_triangular

from curling_env.typing import Floats
from friction_estimation.inversion.friction.posterior import Hyperparameters, NormalEquations
from friction_estimation.inversion.throw.camera_bias import NO_BIAS, CameraBias, bias_root
from friction_estimation.inversion.tuning import (
    MIN_CAMERA_BIAS_GAIN,
    MIN_THROWS_FOR_CAMERA_BIAS,
    USUAL_CAMERA_BIAS_LENGTH,
)

BiasVerdict = Literal["found", "none", "inseparable"]


@dataclass(frozen=True, kw_only=True)
class CameraBiasSearch:
    """The result of a search for a bias of the camera.

    Parameters
    ----------
    outcome : ``found`` and fitted with the map, ``none``, or ``inseparable`` from the ice
    variety : variety of the signed v² at which throws passed the same places; see `variety`
    seen_from : amplitude from which a bias of usual length would be clear [m]; infinite where none
        would
    gain : gain in 2·ln evidence that the best bias brings
    likeness : correlation of the biases that two halves of the throws find; 0 where not computed
    bias : the bias; zero where none was fitted
    """

    outcome: BiasVerdict
    variety: float
    seen_from: float = np.inf
    gain: float = 0.0
    likeness: float = 0.0
    bias: CameraBias = NO_BIAS

    @property
    def words(self) -> str:
        """The result in one line of plain words."""
        if self.outcome == "found":
            return f"camera bias of about {1000 * self.bias.size:.1f} mm found and taken off"
        if self.outcome == "none":
            return f"no bias of the camera; one of {1000 * self.seen_from:.1f} mm would show"
        return (
            "a bias of the camera cannot be told from the ice: that needs "
            f"{MIN_THROWS_FOR_CAMERA_BIAS} throws or more, both ways or at speeds further apart"
        )

    def summary(self) -> dict[str, Any]:
        """The result in numbers, for JSON."""
        found: dict[str, Any] = {"outcome": self.outcome, "variety": self.variety}
        if np.isfinite(self.seen_from):
            found["seen_from_m"] = self.seen_from
        if self.outcome != "inseparable":
            found |= {"gain": self.gain, "likeness_of_halves": self.likeness}
        if len(self.bias):
            found |= {
                "size_m": self.bias.size,
                "y": self.bias.nodes.tolist(),
                "displacement_m": self.bias.values.tolist(),
                "sigma_m": self.bias.sigma.tolist(),
            }
        return found


def seen_from(equations: NormalEquations, hyper: Hyperparameters) -> float:
    """Amplitude from which a bias is expected to bring a clear gain of evidence [m].

    Parameters
    ----------
    equations : normal equations of all throws, with the nodes of a bias
    hyper : hyperparameters of the map
    """
    response = _beside_map(equations, hyper) @ bias_root(equations.nodes, USUAL_CAMERA_BIAS_LENGTH)
    information = np.maximum(eigvalsh(response.T @ response), 0.0)
    amplitudes = np.geomspace(1e-5, 1.0, 121)
    signal = information[None] * amplitudes[:, None] ** 2
    gain = (signal - np.log1p(signal)).sum(axis=1)
    clear = np.flatnonzero(gain >= MIN_CAMERA_BIAS_GAIN)
    return float(amplitudes[clear[0]]) if len(clear) else np.inf


def likeness(
    equations: NormalEquations, halves: Sequence[NormalEquations], hyper: Hyperparameters
) -> float:
    """Correlation of the biases that two halves of the throws find on their own.

    The two are compared by what they would do to all throws beside a map that is known only by its
    prior, so that what no throw can see has no weight.

    Parameters
    ----------
    equations : normal equations of all throws
    halves : normal equations of two halves of them
    hyper : hyperparameters, with amplitude and length of the bias
    """
    response = _beside_map(equations, hyper)
    one, other = (response @ _fitted_bias(half, hyper) for half in halves)
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0.0 else 0.0


def _beside_map(equations: NormalEquations, hyper: Hyperparameters) -> Floats:
    """What a displacement of each node does to the data, whitened beside the map, (r, n)."""
    root = np.linalg.cholesky(equations.covariance(replace(hyper, bias_sd=0.0)))
    return np.asarray(solve_triangular(root, equations.bias_rows, lower=True))


def _fitted_bias(equations: NormalEquations, hyper: Hyperparameters) -> Floats:
    root = hyper.bias_sd * bias_root(equations.nodes, hyper.bias_length)
    weights = np.linalg.solve(equations.covariance(hyper), equations.data)
    return root @ ((equations.bias_rows @ root).T @ weights)


def variety(places: Sequence[Floats], squares: Sequence[Floats]) -> float:
    """How differently the throws passed the same places: spread of their signed v² over its size.

    Parameters
    ----------
    places : for each throw, increasing positions along the sheet [m]
    squares : for each throw, v² there, negative for throws towards negative y [m²/s²]

    Returns
    -------
    0 where all throws pass each place alike, 1 where half of them come the other way
    """
    low, high = min(y[0] for y in places), max(y[-1] for y in places)
    here = np.arange(low, high, 0.5)
    seen = np.array(
        [
            np.interp(here, y, v, left=np.nan, right=np.nan)
            for y, v in zip(places, squares, strict=True)
        ]
    )
    seen = seen[:, np.isfinite(seen).sum(axis=0) >= 2]
    if seen.size == 0:
        return 0.0
    return float(np.sqrt(np.nanmean(np.nanvar(seen, axis=0)) / np.nanmean(seen**2)))


def split_throws(speeds: Floats, directions: Floats) -> tuple[list[int], list[int]]:
    """Two halves of the throws that are alike in direction and speed.

    Parameters
    ----------
    speeds : (throws,) speeds at the start [m/s]
    directions : (throws,) sign of the travel along the sheet

    Returns
    -------
    numbers of the throws in each half
    """
    order = np.lexsort((speeds, directions)).tolist()
    # Dealt 0 1 1 0 ..., so that neither half gets the faster throw of every pair.
    first = [k for place, k in enumerate(order) if place % 4 in (0, 3)]
    return first, [k for place, k in enumerate(order) if place % 4 in (1, 2)]
