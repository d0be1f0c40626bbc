"""Ice of a session before each of its throws, and its correction by all throws.

An ice file has standard errors, and all throws of a session run on one ice: an error of its file
moves all of them alike. The unexplained part should be zero on average; if it is not, the ice is
off, within its standard errors. The parts of every throw are corrected for that, by the regression
of each part on that average over the sampled ices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agents.coaching.tuning import DRAWS, MIN_THROWS_TO_CORRECT_ICE
from curling_env.analysis.ice_uncertainty import plausible_ices
from curling_env.ice import Ice
from curling_env.physics.wear import passes_over, wear_along_path, wear_under_contacts, worn
from curling_env.typing import Floats
from curling_env.units import length
from curling_env.worn_tracks import WornTracks


@dataclass(frozen=True, kw_only=True)
class IceBefore:
    """Ice before a throw.

    Parameters
    ----------
    ice : the estimate
    others : samples within its standard errors; the ice alone if it has none
    """

    ice: Ice
    others: Sequence[Ice]


class SessionIce:
    """Ice of a session, worn by its stones if it has that effect.

    Parameters
    ----------
    ice : ice before the first throw
    rng : source of the sampled errors
    draws : number of sampled ices
    """

    def __init__(self, ice: Ice, rng: np.random.Generator, draws: int = DRAWS) -> None:
        self._now = IceBefore(ice=ice, others=plausible_ices(ice, draws, rng))
        self._first = self._now
        self._wears = wear_along_path(ice) != 0.0 or wear_under_contacts(ice) != 0.0
        self._passes = np.zeros(ice.sheet.shape)
        self._tracks = WornTracks.none(ice.sheet)

    @property
    def now(self) -> IceBefore:
        """Return the ice before the next throw."""
        return self._now

    def ran(self, xy: Floats) -> None:
        """Register that a stone ran along a path (n, 2), sheet frame [m]."""
        if not self._wears:
            return
        self._passes += passes_over(self._first.ice.sheet, [xy])
        self._tracks = self._tracks.after([xy])

        def after(ice: Ice) -> Ice:
            now = worn(ice, wear_along_path(ice) * self._passes)
            return replace(now, tracks=self._tracks)

        self._now = IceBefore(
            ice=after(self._first.ice), others=[after(ice) for ice in self._first.others]
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Parts:
    """Parts of one throw.

    Parameters
    ----------
    value : (causes, 2) right and past; the last is the unexplained part [m]
    draws : (k, causes, 2) the same on k sampled ices and releases; draw i of all throws has one ice
    """

    value: Floats
    draws: Floats


@dataclass(frozen=True, kw_only=True, eq=False)
class Together:
    """Parts that are consistent with all throws.

    Parameters
    ----------
    parts : parts of each throw
    left : (2,) mean unexplained part, right and past [m]
    allowed : (2,) standard deviation expected from the ice's errors and the scatter [m]
    """

    parts: list[Parts]
    left: Floats
    allowed: Floats

    @property
    def remark(self) -> str | None:
        """Return a remark if the ice differs from its file by more than the expected error."""
        if not (np.abs(self.left) > 3 * self.allowed + 0.1).any():
            return None
        along = "past" if self.left[1] > 0 else "short of"
        far = length(float(self.left[1]))
        return (
            f"on average stones came to rest {far} {along} the prediction of this ice file: it is "
            "not the ice of these throws, or its errors are too small"
        )


def agree(parts: Sequence[Parts], rng: np.random.Generator) -> Together:
    """Correct the parts of throws by the common error of the ice.

    Parameters
    ----------
    parts : parts of each throw of a session, with equal numbers of draws
    rng : source of the scatter of an average
    """
    count = len(parts)
    if count < MIN_THROWS_TO_CORRECT_ICE or len({len(one.draws) for one in parts}) > 1:
        return Together(parts=list(parts), left=np.zeros(2), allowed=np.full(2, np.inf))
    unexplained = np.array([one.value[-1] for one in parts])
    # A hair on one stone should not move the ice of all.
    left = np.median(unexplained, axis=0)
    scatter = 1.4826 * np.median(np.abs(unexplained - left), axis=0) + 1e-3
    error = 1.25 * scatter / count**0.5
    average = np.mean([one.draws[:, -1] for one in parts], axis=0)
    swing = average - average.mean(axis=0)
    inverse = np.linalg.inv(swing.T @ swing / len(swing) + np.diag(error**2))
    noise = error * rng.standard_normal(swing.shape)
    agreed: list[Parts] = []
    for one in parts:
        off = one.draws - one.draws.mean(axis=0)
        gain = np.einsum("kci,kj->cij", off, swing) / len(swing) @ inverse
        gain[-1] = -gain[:-1].sum(axis=0)  # the miss was measured: parts still add up to it
        agreed.append(
            Parts(
                value=one.value - gain @ left,
                draws=one.draws - np.einsum("cij,kj->kci", gain, left + swing + noise),
            )
        )
    return Together(parts=agreed, left=left, allowed=np.hypot(swing.std(axis=0), error))
