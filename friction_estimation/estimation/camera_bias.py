"""Bias of a session's camera along the sheet, in words and numbers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.evidence.intervals import mixture
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.search.ripple import RippleSearch
from friction_estimation.discovery.tuning import LEAST_THROWS


@dataclass(frozen=True, kw_only=True)
class CameraBias:
    """Bias of a camera along the sheet, and the search for it.

    Parameters
    ----------
    search : the search
    nodes : (n,) positions along the sheet [m]; none where no bias was found
    values, sigma : (n,) displacement towards positive y, and its standard error [m]
    """

    search: RippleSearch
    nodes: Floats = field(default_factory=lambda: np.empty(0))
    values: Floats = field(default_factory=lambda: np.empty(0))
    sigma: Floats = field(default_factory=lambda: np.empty(0))

    @property
    def found(self) -> bool:
        """True if the camera has a bias, of which the ice was freed."""
        return bool(len(self.nodes))

    @property
    def size(self) -> float:
        """Root mean square [m], each node weighted by how well it is known."""
        if not self.found:
            return 0.0
        weights = 1.0 / np.maximum(self.sigma, 1e-5) ** 2
        return float(np.sqrt(weights @ self.values**2 / weights.sum()))

    @property
    def words(self) -> str:
        """The result in one line of plain words."""
        search = self.search
        if search.outcome == "found":
            return f"camera bias of about {1000 * self.size:.1f} mm found and corrected"
        if search.outcome == "none":
            return f"no camera bias found; one of {1000 * search.seen_from:.1f} mm would be"
        return (
            "a camera bias cannot be distinguished from the ice: expected "
            f"{LEAST_THROWS} throws or more, both ways or at speeds further apart"
        )

    def summary(self) -> dict[str, Any]:
        """Return the result in numbers, for JSON."""
        search = self.search
        document: dict[str, Any] = {"outcome": search.outcome, "variety": search.variety}
        if np.isfinite(search.seen_from):
            document["seen_from_m"] = search.seen_from
        if search.outcome != "inseparable":
            document |= {"gain": search.gain, "likeness_of_halves": search.likeness}
        if self.found:
            document |= {
                "size_m": self.size,
                "y": self.nodes.tolist(),
                "displacement_m": self.values.tolist(),
                "sigma_m": self.sigma.tolist(),
            }
        return document


def camera_bias_of(search: RippleSearch, fitted: SessionFit) -> CameraBias:
    """Return the bias of the camera in a fit.

    Parameters
    ----------
    search : the search for it
    fitted : fit with the ripple that was found, if one was
    """
    ripple, own = fitted.model.ripple, fitted.model.ripple_slice
    if ripple is None:
        return CameraBias(search=search)
    covariance = mixture(fitted).covariance[own, own]
    variance = np.einsum("ni,ij,nj->n", ripple.root, covariance, ripple.root)
    return CameraBias(
        search=search,
        nodes=ripple.nodes,
        values=ripple.root @ ripple.values,
        sigma=np.sqrt(np.maximum(variance, 0.0)),
    )
