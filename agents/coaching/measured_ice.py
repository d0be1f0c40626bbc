"""The ice as a session's draws showed it: the curl of each lane, and the change of the weight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from curling_env.sheet import HOG_LINE_Y, HOG_TO_FAR_TEE, Direction, Sheet
from friction_estimation.reports.keen_and_heavy import SIGMAS
from friction_estimation.tracks.throw_table import ThrowMeasures

LEAST_DRAWS = 8
"""Minimum number of draws from which a change during the evening is reported."""
LANES = 3
"""Number of lanes, from side line to side line."""
NEAR_TEE = 4.0
"""Draws that rest farther from the tee than this have another weight [m]."""
LEAST = 2
"""Minimum number of draws of a lane."""
ERROR = 0.1
"""Standard deviation of the curl of like draws, where too few show it [m]."""


def curl_map(sheet: Sheet, throws: Sequence[ThrowMeasures | None]) -> dict[str, Any] | None:
    """Map the curl of draws on each lane, and the falls of the ice.

    Parameters
    ----------
    throws : measured throws of a session

    Returns
    -------
    by cell, (rows, columns), ``relative``: the curl of each lane less the mean [m], positive
    where stones curl less, and ``fall``: how far stones of both handles came to rest to the right,
    looking to the away end [m]; None with fewer than two lanes of draws
    """
    draws = [_draw(one, sheet) for one in throws if one is not None]
    seen = np.array([draw for draw in draws if draw is not None]).reshape(-1, 5)
    end, lane, spin, curl, right = seen.T
    lanes = {
        (direction, k): rows
        for direction in Direction
        for k in range(LANES)
        if (rows := (end == direction) & (lane == k)).sum() >= LEAST
    }
    if len(lanes) < 2:
        return None
    rows, columns = sheet.shape
    relative, sigma, fall = (np.full((rows, columns), np.nan) for _ in range(3))
    usual = float(np.mean([curl[one].mean() for one in lanes.values()]))
    middle_y, middle_x = sheet.y_centres, sheet.x_centres
    of_cell = np.clip(((middle_x / sheet.width + 0.5) * LANES).astype(int), 0, LANES - 1)
    for (direction, k), one in lanes.items():
        cells = np.ix_(middle_y * direction >= 0, of_cell == k)
        relative[cells] = usual - curl[one].mean()
        sigma[cells] = max(float(curl[one].std()), ERROR) / np.sqrt(one.sum())
        if {*np.sign(spin[one])} == {-1.0, 1.0}:
            fall[cells] = np.mean([right[one & (np.sign(spin) == s)].mean() for s in (-1, 1)])
    return {
        "size": sheet.cell_size,
        "relative": relative,
        "sigma": sigma,
        "fall": fall,
        "usual": round(usual, 3),
    }


def change_of_weight(throws: Sequence[ThrowMeasures | None]) -> dict[str, Any] | None:
    """Return the change of draw weight during a session.

    Parameters
    ----------
    throws : measured throws in order of play

    Returns
    -------
    ``words``, and ``seconds``: the time from hog line to hog line of a draw to the tee, as each
    draw showed it [s]; None with too few draws
    """
    seconds = np.array([found for one in throws if (found := _seconds_to_tee(one)) is not None])
    if len(seconds) < LEAST_DRAWS:
        return None
    order = np.linspace(-0.5, 0.5, len(seconds))
    change = float(order @ seconds / (order @ order))
    off = seconds - seconds.mean() - change * order
    error = SIGMAS * float(np.sqrt(off @ off / (len(seconds) - 2) / (order @ order)))
    words = f"no clear change: {abs(change):.1f} ± {error:.1f} s hog to hog"
    if abs(change) > error:
        way = "keener" if change > 0 else "heavier"
        words = f"{way} by {abs(change):.1f} ± {error:.1f} s hog to hog at the end of the session"
    return {"words": words, "seconds": seconds.round(2).tolist()}


def _seconds_to_tee(one: ThrowMeasures | None) -> float | None:
    """Time from hog line to hog line of a draw [s], if it had come to rest on the tee line."""
    if one is None or one.touched or one.hog_to_hog is None:
        return None
    if one.past is None or one.from_tee is None or one.from_tee.value > NEAR_TEE:
        return None

    def per_root(far: float) -> float:
        """Time between the hog lines of a stone that slides this far, at an even deceleration."""
        return float(np.sqrt(far) - np.sqrt(far - 2 * HOG_LINE_Y))

    far = HOG_TO_FAR_TEE + one.past.value
    return one.hog_to_hog.value * per_root(HOG_TO_FAR_TEE) / per_root(far)


def _draw(one: ThrowMeasures, sheet: Sheet) -> tuple[float, ...] | None:
    """End, lane, spin, curl towards the turn and drift to the right of a draw, sheet frame."""
    if one.curl is None or one.spin is None or one.line is None or one.touched:
        return None
    if one.right is None or one.from_tee is None or one.from_tee.value > NEAR_TEE:
        return None
    sign = float(one.direction)
    x = sign * (one.line.value + one.right.value) / 2
    lane = int(np.clip((x / sheet.width + 0.5) * LANES, 0, LANES - 1))
    toward = float(np.sign(one.spin.value)) * one.curl.value
    return sign, lane, one.spin.value, toward, -sign * one.curl.value
