"""Parts of one throw's miss: the mean of each cause over all orders (Shapley's value)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import factorial

import numpy as np

from agents.coaching.misses.causes import Cause, HandError, Part, ThrowCauses, part_of
from agents.coaching.misses.ices import Parts
from agents.coaching.misses.intended import Habits, intend
from agents.coaching.misses.seen_throws import SeenThrow
from agents.coaching.runs import ANGLE, SPEED, SPIN, X, hog_times, outcomes
from agents.coaching.throw_sheet import spin_sign
from agents.coaching.tuning import DRAWS
from curling_env.errors import TrackTooShortError
from curling_env.ice import Ice
from curling_env.sheet import HOG_TO_FAR_TEE
from curling_env.throw import Throw
from curling_env.typing import Flags, Floats
from friction_estimation.tracks.measured import Measured


class ThrowParts:
    """Causes of one throw's miss."""

    def __init__(
        self, read: SeenThrow, believed: Ice | None, habits: Habits, rng: np.random.Generator
    ) -> None:
        assert read.sheet.call is not None  # checked by _why_not
        self._read, self._call, self._rng = read, read.sheet.call, rng
        self._is_believed = believed is not None
        self._believed = read.ices.ice if believed is None else believed
        self._place, made = read.released.place, read.released.throw
        handle = self._call.handle
        sign = float(np.sign(made[SPIN])) or 1.0
        sign = sign if handle is None else spin_sign(handle, read.sheet.hand)
        usual = habits.spin(read.sheet.athlete)
        self._spin_sigma = 0.0 if usual is None else usual.sigma or 0.0
        self._sign = sign
        speed = habits.speed(read.sheet.athlete, self._call)
        self._speed = float(made[SPEED]) if speed is None else speed.value
        self._speed_meant = (
            self._call.rests or speed is not None or self._call.hog_to_hog is not None
        )
        self._spin_meant = usual is not None or self._call.turns is not None
        self._meant = intend(
            self._call,
            self._believed,
            self._place,
            spin=sign * (abs(float(made[SPIN])) if usual is None else usual.value),
            x=float(made[X]),
            speed=self._speed,
        )
        self._line = None if self._call.rests else float(np.array(self._call.target)[1])
        swept = read.released.sweep[1] > read.released.sweep[0]
        self._swept = swept and read.ices.ice.effect("sweeping") is not None
        self._names: list[Cause] = ["weight", "line", "rotation", "ice"]
        if self._swept:
            self._names.append("sweeping")

    def parts(self) -> Parts:
        """Return the contribution of each cause to the miss, and the unexplained rest.

        Raises
        ------
        TrackTooShortError : a similar throw does not reach the target
        """
        read, target = self._read, np.array(self._call.target)
        made, meant = read.released.throw, self._meant.throw
        value = self._parts(made[None], meant[None], [read.ices.ice])[0]
        value = np.vstack([value, read.ended - target - value.sum(axis=0)])
        if not np.isfinite(value).all():
            raise TrackTooShortError("a similar throw does not reach the target on these ices")
        draws = self._draws()
        return Parts(value=value, draws=np.where(np.isfinite(draws), draws, value))

    def result(self, parts: Parts) -> ThrowCauses:
        """Return the complete result from the parts."""
        read, target = self._read, np.array(self._call.target)
        miss = read.ended - target
        names: list[Cause] = [*self._names, "neither"]
        found: dict[Cause, Part] = {
            name: part_of(parts.value[k], parts.draws[:, k], miss) for k, name in enumerate(names)
        }
        return ThrowCauses(
            sheet=read.sheet,
            target=target,
            rest=read.ended,
            miss=miss,
            parts=found,
            errors=self._errors(),
            intended=_throw(self._meant.throw),
            released=_throw(read.released.throw),
            draws=parts.draws,
        )

    def _draws(self) -> Floats:
        """Return the parts under sampled errors of the release, the rest, the ice and the
        intention.
        """
        read, n = self._read, DRAWS
        made = _paired(self._rng, read.released.covariance, n)
        others = list(read.ices.others)
        chosen = [others[k % len(others)] for k in range(n)]
        # The intention follows from where the stone crossed the line, and from the usual turn.
        wander = np.column_stack(
            [self._sign * self._spin_sigma * self._rng.standard_normal(n), made[:, X]]
        )
        meant = self._meant.throw + wander @ self._meant.slopes.T
        value = self._parts(read.released.throw + made, meant, chosen)
        ended = read.ended + read.sigma * self._rng.standard_normal((n, 2))
        target = np.array(self._call.target)
        neither = ended - target - value.sum(axis=1)
        return np.concatenate([value, neither[:, None]], axis=1)

    def _parts(self, made: Floats, meant: Floats, ices: Sequence[Ice]) -> Floats:
        """Return the contributions of each cause, (n, causes, 2), for n actual and intended throws
        (n, 4).

        Parameters
        ----------
        ices : n ices of the session
        """
        n, causes = len(made), len(self._names)
        chosen = _subsets(causes)
        weights = _shapley(causes)
        throws = np.repeat(meant[:, None], len(chosen), axis=1)
        for k, column in enumerate((SPEED, ANGLE, SPIN)):
            throws[:, chosen[:, k], column] = made[:, None, column]
        throws[:, :, X] = made[:, None, X]
        kinds = list(dict.fromkeys(map(id, ices)))
        by_id = {id(ice): ice for ice in ices}
        surfaces = [self._believed, *(by_id[kind] for kind in kinds)]
        index = np.array([1 + kinds.index(id(ice)) for ice in ices])
        # Without another ice the team is assumed to know the session's, whichever that is.
        on_session = chosen[None, :, 3] | (not self._is_believed)
        which = np.where(on_session, index[:, None], 0)
        sweeps = np.zeros((n, len(chosen), 2))
        if self._swept:
            sweeps[:, chosen[:, 4]] = self._read.released.sweep
        ends = outcomes(
            surfaces,
            throws.reshape(-1, 4),
            self._place,
            self._line,
            which=which.ravel(),
            sweeps=sweeps.reshape(-1, 2),
        ).reshape(n, len(chosen), 2)
        parts = np.einsum("cs,nsk->nck", weights, ends)
        off = ends[:, 0] - np.array(self._call.target)
        # A broom or a time that does not reach the call on the believed ice was misread too.
        line, weight = 3, 3
        if not self._is_believed:
            # Otherwise another throw would have been intended on another ice: the hand is compared
            # with that.
            line = 3 if self._call.broom is not None else 1
            weight = 3 if self._call.hog_to_hog is not None else 0
        parts[:, line, 0] += off[:, 0]
        parts[:, weight, 1] += off[:, 1]
        return parts

    def _errors(self) -> HandError:
        read, made, meant = self._read, self._read.released.throw, self._meant
        # Speed, line and spin of the actual throw minus those of the intended one, by the actual
        # throw.
        cos = np.cos(made[ANGLE])
        of_made = np.zeros((3, 4))
        of_made[0, SPEED], of_made[2, SPIN] = 1.0, self._sign
        of_made[1, ANGLE] = -HOG_TO_FAR_TEE / cos**2
        of_meant = of_made.copy()
        by_x = of_meant @ meant.slopes[:, 1]
        slopes = of_made.copy()
        slopes[:, X] -= by_x
        covariance = slopes @ read.released.covariance @ slopes.T
        by_spin = of_meant @ meant.slopes[:, 0] * self._spin_sigma
        covariance = covariance + np.outer(by_spin, by_spin)
        apart = made - meant.throw
        value = np.array(
            [
                apart[SPEED],
                -HOG_TO_FAR_TEE * (np.tan(made[ANGLE]) - np.tan(meant.throw[ANGLE])),
                self._sign * apart[SPIN],
            ]
        )
        sigma = np.sqrt(np.diag(covariance))
        measured = [Measured(float(v), float(s)) for v, s in zip(value, sigma, strict=True)]
        seconds = None
        if self._speed_meant:
            both = np.vstack([made, made])
            both[1, SPEED] = meant.throw[SPEED]
            took = hog_times(read.ices.ice, both, self._place)
            if np.isfinite(took).all() and abs(apart[SPEED]) > 1e-6:
                change = float(took[0] - took[1])
                per_speed = change / float(apart[SPEED])
                seconds = Measured(change, abs(per_speed) * float(sigma[0]))
        return HandError(
            speed=measured[0] if self._speed_meant else None,
            seconds=seconds,
            line=measured[1],
            spin=measured[2] if self._spin_meant and read.released.spin_seen else None,
            covariance=np.asarray(covariance, dtype=np.float64),
        )


def _paired(rng: np.random.Generator, covariance: Floats, n: int) -> Floats:
    """Draw errors (n, 4) of this covariance; the second half is the first with opposite sign."""
    values, vectors = np.linalg.eigh(covariance)
    half = rng.standard_normal((n // 2, 4)) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
    return np.concatenate([half, -half])


@lru_cache(maxsize=4)
def _subsets(count: int) -> Flags:
    """Return all subsets of `count` causes, (2^count, count); the first is empty."""
    return (np.arange(2**count)[:, None] >> np.arange(count)) % 2 == 1


@lru_cache(maxsize=4)
def _shapley(count: int) -> Floats:
    """Return weights (count, 2^count) that map the outcomes of all subsets to each cause's part."""
    chosen = _subsets(count)
    weights = np.zeros((count, len(chosen)))
    for row, others in enumerate(chosen):
        for cause in np.flatnonzero(~others):
            size = int(others.sum())
            share = factorial(size) * factorial(count - size - 1) / factorial(count)
            weights[cause, row] -= share
            weights[cause, row | (1 << int(cause))] += share
    return weights


def _throw(row: Floats) -> Throw:
    return Throw(
        speed=float(row[SPEED]), angle=float(row[ANGLE]), spin=float(row[SPIN]), x=float(row[X])
    )
