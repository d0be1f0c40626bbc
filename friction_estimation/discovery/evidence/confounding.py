"""Effects that the data cannot tell apart, and throws that would."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from curling_env.physics.state import State
from curling_env.sheet import HOG_LINE_Y, Direction
from curling_env.typing import Floats
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.trial_throws import TrialThrow, lay_out
from friction_estimation.discovery.model.candidates import candidates, effect_of
from friction_estimation.discovery.model.fit import SessionFit, fit
from friction_estimation.discovery.model.model import predict
from friction_estimation.discovery.search.score_test import score_candidates, throw_deviances
from friction_estimation.discovery.search.selection import refit, try_term
from friction_estimation.discovery.tuning import RIVAL_GAIN, RULED_OUT

TRIAL_SPEEDS = (1.3, 1.8, 2.4, 3.1)
TRIAL_SPINS = (-2.2, -0.8, 0.8, 2.2)
"""Speeds [m/s] and spins [rad/s] of the throws among which the separating one is searched."""
FURTHEST_LINE = 1.2
"""How far from the middle of the sheet these begin at most [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Alternative:
    """A candidate that the data cannot rule out in place of a named effect.

    Parameters
    ----------
    name : effect of the candidate
    throw : throw that would separate the two, in words
    strength : difference of −2 ln likelihood that this throw would bring
    """

    name: str
    throw: str
    strength: float


def alternatives(fitted: SessionFit, label: str) -> list[Alternative]:
    """Candidates that serve as well as a named effect.

    Parameters
    ----------
    fitted : fit with the effect
    label : label of its term
    """
    without = refit(fitted, fitted.model.without(label))
    gain = without.deviance - fitted.deviance
    rivals = [
        score
        for score in score_candidates(without, candidates(fitted.session, without.model.terms))
        if effect_of(score.term.label) != effect_of(label)
        and score.gain > min(RIVAL_GAIN * gain, gain - RULED_OUT)
    ]
    found: list[Alternative] = []
    for rival in rivals[:3]:
        trial = try_term(without, rival.term)
        worse = gain - trial.gain
        if worse < RULED_OUT and trial.gain > trial.needed:
            throw, strength = separating_throw(fitted, trial.fit)
            found.append(
                Alternative(name=effect_of(rival.term.label), throw=throw, strength=strength)
            )
    return found


def separating_throw(one: SessionFit, other: SessionFit) -> tuple[str, float]:
    """The throw of a grid on whose path two models disagree most.

    Release and friction of a throw are never known beforehand. Differences that another release or
    another friction would remove do not count.

    Returns
    -------
    the throw in words, and the difference of −2 ln likelihood that it would bring
    """
    session, states = _trial_throws(one)
    ideal = predict(one.model, session, states, np.zeros(len(session)))
    seen = replace(session, xy=ideal[:, :2], theta=ideal[:, State.THETA])
    adapted = fit(other.model, seen, other.noise, states=states, shared=False)
    scores = throw_deviances(adapted)
    k = int(np.argmax(scores))
    direction = "towards the away end" if states[k, State.VY] > 0 else "towards the home end"
    side = "counter-clockwise" if states[k, State.OMEGA] > 0 else "clockwise"
    swept = "swept" if session.swept[session.rows(k)].any() else "unswept"
    words = (
        f"{np.hypot(states[k, 2], states[k, 3]):.1f} m/s {direction}, "
        f"{abs(states[k, State.OMEGA]):.1f} rad/s {side}, from x = {states[k, State.X]:+.1f} m, "
        f"stone {session.stones[k]}, {swept}"
    )
    wait = session.clocks[k] - one.session.clocks.max()
    if wait > 600:
        words += f", {wait / 60:.0f} minutes after the last throw"
    return words, float(scores[k])


def _lines(fitted: SessionFit) -> tuple[float, float]:
    """Where stones ran most and where they ran least, across the sheet [m]."""
    sheet = fitted.model.wear_sheet
    passes = fitted.session.wear_tracks.passes(sheet)[-1]
    x, between = sheet.x_centres, np.abs(sheet.y_centres) < HOG_LINE_Y
    reach = np.abs(x) <= FURTHEST_LINE
    often = passes[between].sum(axis=0)[reach]
    return float(x[reach][np.argmax(often)]), float(x[reach][np.argmin(often)])


def _trial_throws(fitted: SessionFit) -> tuple[Session, Floats]:
    """Throws that could be played next, and their releases."""
    stones = np.unique(fitted.session.stones).tolist()
    swept_too = (False, True) if fitted.session.swept.any() else (False,)
    grid = product(
        (Direction.AWAY, Direction.HOME),
        TRIAL_SPEEDS,
        TRIAL_SPINS,
        swept_too,
        (60.0, 3600.0),
        _lines(fitted),
    )
    throws = [
        TrialThrow(
            direction=direction,
            speed=speed,
            spin=spin,
            line=line,
            stone=stones[k % len(stones)],
            swept=swept,
            wait=wait,
        )
        for k, (direction, speed, spin, swept, wait, line) in enumerate(grid)
    ]
    return lay_out(fitted.session, throws, np.arange(0.0, 25.0, 1.0 / 15.0))
