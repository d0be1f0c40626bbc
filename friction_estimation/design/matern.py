"""Matérn correlation of a smooth field at two places."""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats


def matern(distance: Floats, length: float, smoothness: float) -> Floats:
    """Matérn correlation at distances.

    Parameters
    ----------
    distance : distances between two places [m]
    length : correlation length [m]
    smoothness : order of the correlation: 1.5, 2.5 or infinity (Gaussian)
    """
    if smoothness == np.inf:
        return np.exp(-0.5 * (distance / length) ** 2)
    r = np.sqrt(2.0 * smoothness) * distance / length
    return (1.0 + r + (r**2 / 3.0 if smoothness == 2.5 else 0.0)) * np.exp(-r)
