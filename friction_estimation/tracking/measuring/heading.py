"""One heading curve for the whole track, from all pictures of the handle together.

Far from the camera a handle is one or two pixels wide: a single picture hardly shows its heading,
and its two ends look alike. But a stone rotates steadily, and more and more slowly as it slows
down. Pictures a fraction of a second apart therefore give the misfit of each heading, and the
rotation that fits all of them best is found: first with a spin that falls as a power of the speed,
then with a slow drift from it. If another heading fits a stretch of the film better, no heading is
given. If headings measured frame by frame have strayed from the curve, those of single pictures
replace them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from curling_env.typing import Flags, Floats
from friction_estimation.tracking import tuning

_ANGLES = np.linspace(-np.pi, np.pi, 48, endpoint=False)
"""Compared deviations from a heading [rad]; the first is the opposite heading."""


@dataclass(eq=False)
class HeadingViews:
    """Misfits of each heading to single pictures of a stone.

    Parameters
    ----------
    t : (n,) times of the pictures [s]
    cost : (n, k) misfits at k headings evenly spaced from -π, in squared standard errors
    """

    t: list[float] = field(default_factory=list)
    cost: list[Floats] = field(default_factory=list)

    def add(self, t: float, cost: Floats) -> None:
        """Add a picture: its time [s] and its misfit at each heading, (k,)."""
        self.t.append(t)
        self.cost.append(cost - cost.min())

    def between(self, low: float, high: float) -> HeadingViews:
        """Return the pictures from one time to before another [s]."""
        kept = [k for k, t in enumerate(self.t) if low <= t < high]
        return HeadingViews(t=[self.t[k] for k in kept], cost=[self.cost[k] for k in kept])


@dataclass(frozen=True, kw_only=True)
class KnownHeading:
    """Heading and spin of a stone at the beginning of a stretch.

    A contact does not change the heading at once, and changes the spin little.

    Parameters
    ----------
    t : when [s]; no later than the first picture of the stretch
    theta : heading [rad]
    spin : how fast it turned [rad/s]
    """

    t: float
    theta: float
    spin: float = 0.0

    def waves(self) -> NDArray[np.complex128]:
        """Return the Fourier coefficients of the cost of each heading at that time."""
        waves = np.zeros(tuning.HEADING_WAVES + 1, dtype=complex)
        cost = 1 / tuning.KNOWN_HEADING_SIGMA**2
        waves[:2] = cost, -cost * np.exp(-1j * self.theta)
        return waves


@dataclass(frozen=True, kw_only=True, eq=False)
class SeenHeadings:
    """Headings of single pictures near a curve.

    Parameters
    ----------
    t : (n,) times of the pictures [s]
    theta, sigma : (n,) unwrapped headings and their standard errors [rad]; NaN where none is shown
    """

    t: Floats
    theta: Floats
    sigma: Floats


class HeadingCurve:
    """Heading of a stone through a throw.

    Parameters
    ----------
    times : (n,) increasing [s]
    headings : (n,) unwrapped [rad]
    trusted : (n,) whether the pictures around a time agree with the curve; None: they always do
    seen : what single pictures show near it; None where that is not known
    """

    def __init__(
        self,
        times: Sequence[float] | Floats,
        headings: Sequence[float] | Floats,
        trusted: Flags | None = None,
        seen: SeenHeadings | None = None,
    ) -> None:
        self._t, self._theta = np.asarray(times), np.asarray(headings)
        self.seen = seen
        self._trusted = np.ones(len(self._t), dtype=bool) if trusted is None else trusted
        self._cubics = PchipInterpolator(self._t, self._theta).c

    def at(self, t: Floats | float) -> Floats:
        """Return the heading at times [s]; before the first and after the last one the spin is
        constant.
        """
        t = np.asarray(t, dtype=np.float64)
        inside = np.clip(t, self._t[0], self._t[-1])
        piece = np.clip(np.searchsorted(self._t, inside, side="right") - 1, 0, len(self._t) - 2)
        cubic, square, slope, start = self._cubics[:, piece]
        since = inside - self._t[piece]
        rate = slope + since * (2 * square + since * 3 * cubic)
        return start + since * (slope + since * (square + since * cubic)) + rate * (t - inside)

    def trusted(self, t: Floats) -> Flags:
        """Return whether the curve is trusted at times [s], (n,)."""
        after = np.clip(np.searchsorted(self._t, t), 1, len(self._t) - 1)
        nearest = np.where(t - self._t[after - 1] < self._t[after] - t, after - 1, after)
        return self._trusted[nearest] & (np.abs(t - self._t[nearest]) <= tuning.LONG)


def headings_near(
    curve: HeadingCurve, t: Floats, theta: Floats, sigma: Floats
) -> tuple[Floats, Floats]:
    """Measured headings near a curve, unwrapped, and their standard errors, each (n,).

    A fit that starts at a wrong heading finds another wrong one, and so does the next: if most
    frames around one have strayed from the curve, single pictures are used. NaN if nothing is near
    the curve, or if it is not trusted.

    Parameters
    ----------
    t, theta, sigma : (n,) times [s], measured headings modulo 2π and their standard errors [rad];
        NaN where unknown
    """
    expected = curve.at(t)
    miss = np.angle(np.exp(1j * (theta - expected)))
    near = np.abs(miss) < tuning.HEADING_MATCH
    around = (np.abs(t[:, None] - t) <= tuning.HEADING_NEIGHBOURS).astype(np.float64)
    measured = np.isfinite(theta)
    near &= around @ near >= tuning.LEAST_NEAR * (around @ measured)
    found, error = np.where(near, expected + miss, np.nan), np.where(near, sigma, np.nan)
    if curve.seen is not None:
        at = np.searchsorted(t, curve.seen.t)
        own = np.flatnonzero((at < len(t)) & np.isfinite(curve.seen.theta))
        own = own[np.isclose(t[at[own]], curve.seen.t[own]) & ~near[at[own]]]
        found[at[own]], error[at[own]] = curve.seen.theta[own], curve.seen.sigma[own]
    trusted = np.isfinite(found) & curve.trusted(t)
    if not trusted.any():
        return np.full(len(t), np.nan), np.full(len(t), np.nan)
    kept = _longest_stretch(t, trusted)
    return np.where(kept, found, np.nan), np.where(kept, error, np.nan)


def unseen_turn(curve: HeadingCurve, t: Floats, speed: Floats, age: Floats) -> Floats:
    """Return the turn of a stone since its pixels last changed, (n,) [rad].

    Parameters
    ----------
    t, speed : (n,) times [s], and the speed then [m/s]
    age : (n,) how long ago the pixels last changed [s]
    """
    then = t - age
    spin = (curve.at(then) - curve.at(then - tuning.HEADING_VIEW_INTERVAL)) / (
        tuning.HEADING_VIEW_INTERVAL
    )
    until_rest = np.interp(then, t, speed) / tuning.DECELERATION
    return np.abs(spin) * np.minimum(age, until_rest)


def _longest_stretch(t: Floats, trusted: Flags) -> Flags:
    """Return the longest stretch of trusted frames without a long gap."""
    at = np.flatnonzero(trusted)
    stretches = np.split(at, np.flatnonzero(np.diff(t[at]) > 2 * tuning.LONG) + 1)
    kept = np.zeros(len(t), dtype=bool)
    kept[max(stretches, key=len)] = True
    return kept


def fit_heading_curve(
    views: HeadingViews, t: Floats, speed: Floats, known: KnownHeading | None = None
) -> HeadingCurve | None:
    """Fit the heading curve to all pictures.

    Parameters
    ----------
    t, speed : (m,) times [s] and the speed of the stone then [m/s]
    known : the heading at the beginning, where it is known; it tells front from rear

    Returns
    -------
    None where the pictures show no heading, or do not tell the front of the handle from its rear.
    """
    times = np.array(views.t)
    if len(times) + (known is not None) < tuning.MIN_FITS:
        return None
    counts = _counts(times, t, speed)
    waves = _waves_of(views, counts)
    if known is not None:
        times = np.append(min(known.t, times[0] - 1e-3), times)
        waves = np.vstack([known.waves(), waves])
        counts = np.append(1.0, counts)
    theta = _steady_rotation(times, waves, t, speed, known)
    theta = theta + _drift(times, waves, theta)
    # Additional cost of a deviation from the curve at each time: (n, angles)
    excess = _cost_at(waves, theta[:, None] + _ANGLES) - _cost_at(waves, theta)[:, None]
    rotation = float(np.abs(np.diff(theta)).sum()) / tuning.INDEPENDENT_VIEW
    independent = tuning.MIN_INDEPENDENT_VIEWS + min(np.ptp(times), rotation)
    own = slice(0 if known is None else 1, None)
    seen = excess[own]
    if len(seen) >= 2 * tuning.MIN_FITS:
        by_others = _predicted_headings(times, waves, t, speed, known)
        seen = _cost_at(waves, by_others[:, None] + _ANGLES) - _cost_at(waves, by_others)[:, None]
        seen = seen[own]
    others = [seen.mean(axis=1)]  # any heading
    if known is None:
        others.append(seen[:, 0])  # reversed
    if not all(_is_clear(other, counts[own], independent) for other in others):
        return None
    near = np.abs(times[:, None] - times) <= tuning.HEADING_NEIGHBOURS
    excess_nearby = near @ excess
    trusted = excess_nearby[:, np.abs(_ANGLES) > tuning.HEADING_MATCH].min(axis=1) > 0
    if not trusted.any():
        return None
    return HeadingCurve(times, theta, trusted, _seen_near(times[own], waves[own], theta[own]))


def _is_clear(excess: Floats, counts: Floats, independent: float) -> bool:
    """Return whether one heading costs clearly more than another.

    Parameters
    ----------
    excess, counts : (n,) excess cost of each picture and its weight
    independent : number of pictures that count as independent
    """
    costs = excess / counts
    mean = np.average(costs, weights=counts)
    spread = np.sqrt(np.average((costs - mean) ** 2, weights=counts))
    return bool(mean >= tuning.CLEAR_HEADING * spread / np.sqrt(independent))


def _predicted_headings(
    times: Floats,
    waves: NDArray[np.complex128],
    t: Floats,
    speed: Floats,
    known: KnownHeading | None,
) -> Floats:
    """Predict the heading at each picture from the others, (n,) [rad].

    A curve through uninformative pictures fits them, but does not predict excluded ones.
    """
    found = np.empty(len(times))
    for first in (0, 1):
        own = np.arange(len(times)) % 2 == first
        if known is not None:
            own[0] = True
        theta = _steady_rotation(times[own], waves[own], t, speed, known)
        theta = theta + _drift(times[own], waves[own], theta)
        found[~own] = HeadingCurve(times[own], theta).at(times[~own])
        if known is not None:
            found[0] = theta[0]
    return found


def _counts(times: Floats, t: Floats, speed: Floats) -> Floats:
    """Return the weight of each picture, (n,).

    All pictures of a stone that hardly moves have common errors, and together count as one.
    """
    way = np.concatenate([[0.0], np.cumsum(np.diff(t) * (speed[1:] + speed[:-1]) / 2)])
    place = np.floor(np.interp(times, t, way) / tuning.REPEATED_WAY)
    return 1 / np.count_nonzero(place[:, None] == place, axis=1)


def _waves_of(views: HeadingViews, counts: Floats) -> NDArray[np.complex128]:
    """Return the Fourier coefficients of the cost of each heading, (n, waves)."""
    cost = np.array(views.cost) * counts[:, None]
    waves = np.fft.rfft(cost, axis=1)[:, : tuning.HEADING_WAVES + 1] / cost.shape[1]
    waves[:, 1:] *= 2
    # the first heading is -π
    return waves * np.exp(1j * np.pi * np.arange(tuning.HEADING_WAVES + 1))


def _seen_near(times: Floats, waves: NDArray[np.complex128], theta: Floats) -> SeenHeadings:
    """Return the best heading of each picture near a curve."""
    off = np.linspace(-tuning.HEADING_MATCH, tuning.HEADING_MATCH, 29)
    cost = _cost_at(waves, theta[:, None] + off)
    at = np.argmin(cost, axis=1)
    inside = np.clip(at, 1, len(off) - 2)
    left, middle, right = (cost[np.arange(len(cost)), inside + k] for k in (-1, 0, 1))
    bend = np.maximum(left - 2 * middle + right, 1e-9)
    step = off[1] - off[0]
    best = theta + off[inside] + step * np.clip((left - right) / (2 * bend), -1, 1)
    shown = at == inside
    return SeenHeadings(
        t=times,
        theta=np.where(shown, best, np.nan),
        sigma=np.where(shown, step * np.sqrt(2 / bend), np.nan),
    )


def _cost_at(waves: NDArray[np.complex128], theta: Floats) -> Floats:
    """Misfit of each picture at one heading (n,) or several (n, k)."""
    flat = theta.reshape(len(waves), -1)
    turned = np.exp(1j * flat[..., None] * np.arange(tuning.HEADING_WAVES + 1))
    return np.einsum("nw,nkw->nk", waves, turned).real.reshape(theta.shape)


def _steady_rotation(
    times: Floats,
    waves: NDArray[np.complex128],
    t: Floats,
    speed: Floats,
    known: KnownHeading | None,
) -> Floats:
    """Return the headings, (n,), with the most likely spin that falls as a power of the speed."""
    share = np.clip(speed / max(float(np.nanmax(speed)), 1e-6), 0.0, 1.0)
    fronts = np.exp(1j * np.outer(np.arange(tuning.HEADING_WAVES + 1), _ANGLES))
    best, least = np.zeros(len(times)), np.inf
    for power in tuning.SPIN_DECAY_POWERS:
        rate = np.where(share > 0.02, share**power, 0.0)
        swept = np.concatenate([[0.0], np.cumsum(np.diff(t) * (rate[1:] + rate[:-1]) / 2)])
        way = np.interp(times, t, swept)
        # A few at a time, so that their data stay in the fastest memory.
        for spins in np.array_split(tuning.SPINS_TRIED, len(tuning.SPINS_TRIED) // 2):
            turned = np.exp(1j * spins[:, None] * way)
            total = np.empty((len(spins), tuning.HEADING_WAVES + 1), dtype=complex)
            power_of = np.ones_like(turned)
            for wave in range(tuning.HEADING_WAVES + 1):
                total[:, wave] = power_of @ waves[:, wave]
                power_of *= turned
            costs = np.real(total @ fronts)
            if known is not None:
                costs += (((spins - known.spin) / tuning.SPIN_CHANGE_AT_CONTACT) ** 2)[:, None]
            i, k = np.unravel_index(int(np.argmin(costs)), costs.shape)
            if costs[i, k] < least:
                least, best = float(costs[i, k]), _ANGLES[k] + spins[i] * way
    return best


def _drift(times: Floats, waves: NDArray[np.complex128], theta: Floats) -> Floats:
    """Return the slow drift of the heading from a steady rotation, (n,) [rad].

    It is the most likely random walk, by dynamic programming.
    """
    own = _cost_at(waves, theta[:, None] + _ANGLES)
    step = np.angle(np.exp(1j * (_ANGLES[:, None] - _ANGLES)))  # [now, before]
    value = own[0]
    came_from: list[NDArray[np.intp]] = []
    for k in range(1, len(times)):
        options = value + step**2 / (tuning.HEADING_WANDER**2 * (times[k] - times[k - 1]))
        came_from.append(np.argmin(options, axis=1))
        value = own[k] + options.min(axis=1)
    at = int(np.argmin(value))
    chosen = [at]
    for back in came_from[::-1]:
        at = int(back[at])
        chosen.append(at)
    drift = np.unwrap(_ANGLES[chosen[::-1]])
    # An average over neighbours smooths the steps of the grid of angles.
    return _bell_mean(times, drift)


def _bell_mean(t: Floats, values: Floats) -> Floats:
    """Return the mean of values (n,) around each time, the nearest of which count most."""
    bell = np.exp(-0.5 * ((t[:, None] - t) / (tuning.HEADING_NEIGHBOURS / 4)) ** 2)
    return bell @ values / bell.sum(axis=1)
