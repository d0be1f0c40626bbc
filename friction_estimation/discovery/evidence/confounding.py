"""What the data cannot tell apart, and the throw that would."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curling_env.sheet import HOG_LINE_Y
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import USUAL_SPIN, Session
from friction_estimation.discovery.model.candidates import candidates, without_stone
from friction_estimation.discovery.model.fit import Fit, fit
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.search.score_test import left_out_scores, screen
from friction_estimation.discovery.search.selection import RULED_OUT, refit, try_term

NEARLY = 0.8
"""Part of an effect's gain from which a candidate is fitted in its place."""
SPEEDS = (1.3, 1.8, 2.4, 3.1)
SPINS = (-2.2, -0.8, 0.8, 2.2)
FURTHEST_LINE = 1.2
"""How far from the middle of the sheet a throw begins at most [m]."""
TIME = 25.0
"""How long a throw is watched [s]."""
FRAMES = 15.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Alternative:
    """A candidate that the data cannot rule out in place of a named effect.

    Parameters
    ----------
    name : of the candidate
    worse : by how much −2 ln likelihood is worse with it
    throw : the throw that would separate the two, in words
    strength : difference of −2 ln likelihood that this throw would bring
    """

    name: str
    worse: float
    throw: str
    strength: float


def alternatives(fitted: Fit, label: str) -> list[Alternative]:
    """Candidates that serve as well as a named effect."""
    without = refit(fitted, fitted.model.without(label))
    gain = without.deviance - fitted.deviance
    own = without_stone(label)
    looks = [
        look
        for look in screen(without, candidates(fitted.session, without.model.terms))
        if without_stone(look.term.label) != own
        and look.gain > min(NEARLY * gain, gain - RULED_OUT)
    ]
    found: list[Alternative] = []
    for look in looks[:3]:
        trial = try_term(without, look.term)
        worse = gain - trial.gain
        if worse < RULED_OUT and trial.gain > trial.needed:
            throw, strength = separating_throw(fitted, trial.fit)
            found.append(
                Alternative(
                    name=without_stone(look.term.label), worse=worse, throw=throw, strength=strength
                )
            )
    return found


def separating_throw(one: Fit, other: Fit) -> tuple[str, float]:
    """The throw, of a grid of them, whose path two models disagree on most.

    The release is not known beforehand, and the throw's own friction is not either: what they can
    mend does not count.
    """
    session, states = _trial_throws(one)
    ideal = predict(one.model, session, states, np.zeros(len(session)))
    seen = replace(session, xy=ideal[:, :2], theta=ideal[:, 4])
    mended = fit(other.model, seen, other.noise, states=states, shared=False)
    scores = left_out_scores(mended, shared=False)
    k = int(np.argmax(scores))
    way = "towards the away end" if states[k, 3] > 0 else "towards the home end"
    side = "counter-clockwise" if states[k, 5] > 0 else "clockwise"
    swept = "swept" if session.swept[session.rows(k)].any() else "unswept"
    words = (
        f"{np.hypot(states[k, 2], states[k, 3]):.1f} m/s {way}, {abs(states[k, 5]):.1f} rad/s "
        f"{side}, from x = {states[k, 0]:+.1f} m, stone {session.stones[k]}, {swept}"
    )
    wait = session.clocks[k] - one.session.clocks.max()
    if wait > 600:
        words += f", {wait / 60:.0f} minutes after the last throw"
    return words, float(scores[k])


def _lines(fitted: Fit) -> tuple[float, float]:
    """Where stones ran most and least so far, across the sheet between its hog lines [m]."""
    sheet, lanes = fitted.model.wear_sheet, fitted.session.lanes
    passes = lanes.passes(sheet)[-1]
    x, between = sheet.x_centres, np.abs(sheet.y_centres) < HOG_LINE_Y
    reach = np.abs(x) <= FURTHEST_LINE
    often = passes[between].sum(axis=0)[reach]
    return float(x[reach][np.argmax(often)]), float(x[reach][np.argmin(often)])


def _trial_throws(fitted: Fit) -> tuple[Session, Floats]:
    """Throws that could be played next, and their releases."""
    session = fitted.session
    t = np.arange(0.0, TIME, 1.0 / FRAMES)
    stones = np.unique(session.stones)
    swept_too = (False, True) if session.swept.any() else (False,)
    grid = [
        (way, speed, spin, swept, wait, line)
        for way in (1.0, -1.0)
        for speed in SPEEDS
        for spin in SPINS
        for swept in swept_too
        for wait in (60.0, 3600.0)
        for line in _lines(fitted)
    ]
    n = len(grid)
    states = np.array(
        [
            [line, -way * HOG_LINE_Y, 0.0, way * speed, 0.0, spin]
            for way, speed, spin, _, _, line in grid
        ]
    )
    swept = np.concatenate(
        [((t > 2.0) & (t < 8.0)).astype(np.float64) * entry[3] for entry in grid]
    )
    return Session(
        throws=np.arange(n),
        orders=np.full(n, int(session.orders.max()) + 1),
        stones=stones[np.arange(n) % len(stones)],
        clocks=np.array([session.clocks.max() + entry[4] for entry in grid]),
        rests=np.zeros(n, dtype=bool),
        usual_spins=np.full(n, USUAL_SPIN),
        times=np.tile(t, n),
        xy=np.zeros((n * len(t), 2)),
        theta=np.zeros(n * len(t)),
        swept=swept,
        sigma=np.ones((n * len(t), 2)),
        starts=np.arange(n + 1) * len(t),
        lanes=session.lanes,
    ), states
