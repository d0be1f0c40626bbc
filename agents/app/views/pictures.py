"""Small pictures that a page draws itself: intervals, and the scatter of a hand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from agents.coaching import ErrorSummary
from curling_env.typing import Floats

WIDTH, HEIGHT = 360, 288
"""Size of a picture of a hand; the page scales it."""
MARGIN = 34
"""Around it, for the names of its axes."""


def interval_bar(value: float, low: float, high: float, reach: float) -> dict[str, float]:
    """A number with its interval on a bar from -reach to reach, as parts of a hundred."""

    def at(one: float) -> float:
        return round(50 + 47 * float(np.clip(one / reach, -1, 1)), 2)

    return {"value": at(value), "low": at(low), "high": at(high)}


def reach_of(hands: Sequence[tuple[Floats, ErrorSummary]]) -> tuple[float, float]:
    """Half the width [m] and height [m/s] of pictures that show several hands on one scale."""
    line, speed = [0.1], [0.01]
    for errors, overall in hands:
        seen = errors[np.isfinite(errors[:, :2]).all(axis=1)]
        ellipse = _half(seen, overall)
        line += [*np.abs(ellipse[:, 0]), *np.abs(seen[:, 1])]
        speed += [*np.abs(ellipse[:, 1]), *np.abs(seen[:, 0])]
    return 1.1 * float(max(line)), 1.1 * float(max(speed))


def hand_picture(
    errors: Floats, overall: ErrorSummary, reach: tuple[float, float]
) -> dict[str, Any]:
    """Errors of throws, and the ellipse that holds half of them, in places of a picture.

    Parameters
    ----------
    errors : (n, 3) of speed [m/s], line [m] and spin [rad/s]; NaN where one was not measured
    overall : their summary
    reach : see `reach_of`

    Returns
    -------
    points to draw: right of the broom to the right, faster upwards, and the ends of both axes
    """
    seen = errors[np.isfinite(errors[:, :2]).all(axis=1)]

    def placed(pairs: Floats) -> list[list[float]]:
        x = WIDTH / 2 + pairs[:, 0] / reach[0] * (WIDTH / 2 - MARGIN)
        y = HEIGHT / 2 - pairs[:, 1] / reach[1] * (HEIGHT / 2 - MARGIN)
        return np.column_stack([x, y]).round(1).tolist()

    return {
        "width": WIDTH,
        "height": HEIGHT,
        "margin": MARGIN,
        "dots": placed(seen[:, [1, 0]]),
        "half": " ".join(f"{x},{y}" for x, y in placed(_half(seen, overall))),
        "line": f"{100 * reach[0]:.0f} cm",
        "speed": reach[1],
    }


def _half(seen: Floats, overall: ErrorSummary) -> Floats:
    """The ellipse of a hand's spread, of the size that holds half of the throws seen, (m, 2)."""
    ellipse = overall.ellipse()
    centre = ellipse.mean(axis=0)
    shape = np.linalg.inv(2 * np.cov((ellipse - centre).T, bias=True))
    off = seen[:, [1, 0]] - centre
    size = float(np.sqrt(np.median(np.einsum("ni,ij,nj->n", off, shape, off)))) if len(seen) else 1
    return centre + size * (ellipse - centre)


def furthest(ends: Sequence[float], least: float) -> float:
    """The reach of bars that hold all these ends."""
    return max([least, *(abs(one) for one in ends)])
