"""The common way to find missing forces, to compare with: differentiate tracks, then regress.

Accelerations by local quadratics over two seconds are regressed on a library with one column per
effect of the ice; terms are added while BIC falls. With `method="sindy"` pysindy's sequentially
thresholded least squares chooses from the same library instead (`pip install pysindy`).
"""

from __future__ import annotations

import numpy as np

from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session, open_session
from friction_estimation.tracks.smoothing import local_fit

WINDOW = 2.0
"""Width of the local quadratics [s]."""
SLOWEST = 0.15
"""Speed below which accelerations are left out [m/s]."""
EVERY = 10
"""Rows from one acceleration to the next: a third of a second."""
THRESHOLD = 0.1
"""pysindy's threshold, for columns and accelerations of unit size: its default."""


def library(session: Session) -> tuple[list[str], Floats, Floats, Floats]:
    """Names of columns, the columns, accelerations, and the channel of every row.

    Returns
    -------
    names : of the effects; empty for friction, which is always in
    columns : (n, m)
    target : (n,) accelerations along the travel, to its left, and of the spin, over their noise
    channel : (n,) 0, 1, 2
    """
    stones = [int(s) for s in np.unique(session.stones)]
    names = ["", "speed_dependent_friction", "air_drag", "slope", "slope", "curl", "spin_drag"]
    names += ["pebble_wear", "time_drift", "sweeping", *["stone_bias"] * (len(stones) - 1)]
    rows: list[Floats] = []
    target: list[Floats] = []
    channel: list[Floats] = []
    for i in range(len(session)):
        part = session.rows(i)
        t, theta = session.times[part], session.theta[part]
        known = np.isfinite(theta)
        if len(t) < 40 or known.sum() < 20:
            continue
        heading = np.interp(t, t[known], theta[known])
        series = (session.xy[part][:, 0], session.xy[part][:, 1], heading)
        (_, vx, ax), (_, vy, ay), (_, w, aw) = (local_fit(t, s, WINDOW)[0] for s in series)
        speed = np.hypot(vx, vy)
        keep = (speed > SLOWEST) & (t > t[0] + WINDOW) & (t < t[-1] - WINDOW)
        keep &= np.arange(len(t)) % EVERY == 0
        v, ex, ey = speed[keep], (vx / speed)[keep], (vy / speed)[keep]
        side = np.sign(w[keep])
        zero, one = np.zeros(len(v)), np.ones(len(v))
        swept = session.swept[part][keep]
        along = [one, np.log(v), v**2, ex, ey, zero, zero]
        along += [one * session.orders[i], one * session.clocks[i] / 1e3, swept]
        along += [one * (session.stones[i] == s) for s in stones[1:]]
        rest = [zero] * (len(names) - 7)
        left = [zero, zero, zero, -ey, ex, side, zero, *rest]
        turn = [zero, zero, zero, zero, zero, zero, side, *rest]
        # The band's own friction turns the stone as well: it is taken out by its usual size.
        band = -0.37 * 0.009 * 9.80665 / 0.0625 * np.clip(0.5 * w[keep] * 0.0625 / v, -1, 1)
        accelerations = (
            ax[keep] * ex + ay[keep] * ey,
            ay[keep] * ex - ax[keep] * ey,
            aw[keep] - band,
        )
        for number, (columns, a) in enumerate(zip((along, left, turn), accelerations, strict=True)):
            rows.append(np.column_stack(columns))
            target.append(a)
            channel.append(np.full(len(v), float(number)))
    columns, values, which = np.concatenate(rows), np.concatenate(target), np.concatenate(channel)
    for number in range(3):
        own = which == number
        size = 1.4826 * np.median(np.abs(values[own] - np.median(values[own]))) + 1e-12
        columns[own] /= size
        values[own] /= size
    return names, columns, values, which


def names_found(tracks: list, *, method: str = "bic") -> list[str]:
    """Effects that a derivative regression finds in tracks."""
    names, columns, target, _ = library(open_session(tracks))
    columns = columns / np.maximum(np.sqrt((columns**2).mean(axis=0)), 1e-12)
    if method == "sindy":
        from pysindy import STLSQ  # pyright: ignore[reportMissingImports]

        fitted = STLSQ(threshold=THRESHOLD).fit(columns, target[:, None])
        chosen = np.flatnonzero(np.abs(np.ravel(fitted.coef_)) > 0).tolist()
        return sorted({names[k] for k in chosen if names[k]})
    groups = {name: [k for k, n in enumerate(names) if n == name] for name in names}
    chosen, best = groups.pop(""), np.inf
    best = _bic(columns[:, chosen], target)
    while groups:
        tried = {name: _bic(columns[:, chosen + own], target) for name, own in groups.items()}
        name = min(tried, key=lambda key: tried[key])
        if tried[name] >= best:
            break
        best = tried[name]
        chosen = chosen + groups.pop(name)
    return sorted({names[k] for k in chosen if names[k]})


def _bic(columns: Floats, target: Floats) -> float:
    solution = np.linalg.lstsq(columns, target, rcond=None)[0]
    left = target - columns @ solution
    n = len(target)
    return n * float(np.log((left**2).mean())) + columns.shape[1] * float(np.log(n))
