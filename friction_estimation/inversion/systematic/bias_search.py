"""Whether the throws of a session show that their camera errs by a ripple along the sheet.

A field that is always there would now and then take up what noise or an unknown effect left. So a
ripple (camera_bias.py) is declined unless the evidence for it is clear beside the map and beside
effects that bend throws in a like way, and unless each half of the throws, fitted on its own, finds
the same one. And where throws could not tell a ripple from the ice, that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.linalg import eigvalsh, solve_triangular

from curling_env.typing import Floats
from friction_estimation.inversion.prior import Belief, Evidence
from friction_estimation.inversion.throw.camera_bias import (
    NO_BIAS,
    USUAL_RIPPLE_LENGTH,
    CameraBias,
    ripple_root,
)

CLEAR_GAIN = 30.0
"""Gain in 2·ln evidence that a ripple must bring. Ripples of 2 mm and more bring hundreds; waves of
1 mm in smoothed tracks from the end of the sheet brought up to 20 and made their maps worse."""
CLEAR_LIKENESS = 0.6
"""Correlation that the ripples of two halves of the throws must have."""
LEAST_RIPPLE = 3e-4
"""Amplitude below which a ripple is not looked at further [m]: it bends μ by a per cent at most."""
LEAST_THROWS = 6
"""Fewer make no two halves that could agree."""
LEAST_VARIETY = 0.2
"""Least variety of v², signed by direction, for a ripple to be told from the ice. At 0.03 (twelve
equal draws one way) a ripple of 5 mm was taken for thirty, and the ice for 26 % off; at 0.35 (one
way, 1.3 to 2.4 m/s) map errors fell from 1.0–4.6 % to 0.4–1.0 %; throws both ways have 1."""

Outcome = Literal["found", "none", "inseparable"]


@dataclass(frozen=True, kw_only=True)
class BiasSearch:
    """What came of looking for a ripple of the camera.

    Parameters
    ----------
    outcome : ``found`` and fitted with the map, ``none``, or ``inseparable`` from the ice
    variety : of the squared speeds, signed by direction, at which throws passed the same places
    seen_from : amplitude from which a ripple of usual length would be clear [m]; infinite where
        none would
    gain : in 2·ln evidence that the best ripple brings
    likeness : correlation of the ripples that two halves of the throws find; 0 where not asked
    bias : the ripple; zero where none was fitted
    """

    outcome: Outcome
    variety: float
    seen_from: float = np.inf
    gain: float = 0.0
    likeness: float = 0.0
    bias: CameraBias = NO_BIAS

    @property
    def words(self) -> str:
        """For people, in one line."""
        if self.outcome == "found":
            return f"camera ripple of about {1000 * self.bias.size:.1f} mm found and taken off"
        if self.outcome == "none":
            return f"no ripple of the camera; one of {1000 * self.seen_from:.1f} mm would show"
        return (
            "a ripple of the camera cannot be told from the ice: "
            f"that needs {LEAST_THROWS} throws or more, both ways or at speeds further apart"
        )

    def summary(self) -> dict[str, Any]:
        """The same in numbers, for JSON."""
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


def seen_from(evidence: Evidence, belief: Belief) -> float:
    """Amplitude from which a ripple is expected to bring a clear gain of evidence [m].

    Parameters
    ----------
    evidence : of all throws, with nodes of a ripple
    belief : of the map
    """
    done = _beside(evidence, belief) @ ripple_root(evidence.nodes, USUAL_RIPPLE_LENGTH)
    told = np.maximum(eigvalsh(done.T @ done), 0.0)
    amplitudes = np.geomspace(1e-5, 1.0, 121)
    signal = told[None] * amplitudes[:, None] ** 2
    gain = (signal - np.log1p(signal)).sum(axis=1)
    clear = np.flatnonzero(gain >= CLEAR_GAIN)
    return float(amplitudes[clear[0]]) if len(clear) else np.inf


def likeness(evidence: Evidence, halves: Sequence[Evidence], belief: Belief) -> float:
    """Correlation of the ripples that two halves of the throws find on their own.

    They are compared by what they would do to all throws beside a map of which no more is known
    than its belief: what no throw tells has no weight.

    Parameters
    ----------
    evidence : of all throws
    halves : of two halves of them
    belief : with the ripple's amplitude and length
    """
    done = _beside(evidence, belief)
    one, other = (done @ _ripple(half, belief) for half in halves)
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0.0 else 0.0


def _beside(evidence: Evidence, belief: Belief) -> Floats:
    """What a displacement of each node does to the data, whitened beside the map, (r, n)."""
    beside = np.linalg.cholesky(evidence.covariance(replace(belief, ripple=0.0)))
    return np.asarray(solve_triangular(beside, evidence.ripple, lower=True))


def _ripple(evidence: Evidence, belief: Belief) -> Floats:
    root = belief.ripple * ripple_root(evidence.nodes, belief.ripple_length)
    weights = np.linalg.solve(evidence.covariance(belief), evidence.data)
    return root @ ((evidence.ripple @ root).T @ weights)


def variety(places: Sequence[Floats], squares: Sequence[Floats]) -> float:
    """How unlike the throws passed the same places: spread of their signed v² over its size.

    Parameters
    ----------
    places : for each throw, increasing places along the sheet [m]
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
    speeds : (throws,) at which they begin [m/s]
    directions : (throws,) sign of their travel along the sheet
    """
    order = np.lexsort((speeds, directions)).tolist()
    # By twos in turn (0 1 1 0 ...), so that neither half has the faster of every pair.
    first = [k for place, k in enumerate(order) if place % 4 in (0, 3)]
    return first, [k for place, k in enumerate(order) if place % 4 in (1, 2)]
