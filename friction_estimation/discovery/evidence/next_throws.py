"""The next throws that would teach most, chosen by the posterior of what is known already.

Of a grid of throws that a player can make, each is linearised on the ice as it was found. What it
would tell is known before it is made: its release and its own friction are projected out, as they
would be in the fit. Chosen is the throw that removes most of the variance of what is sought, the
next one given the first, and so on. The friction of the sheet, the friction map and every effect
count alike, each by the part of its variance that is removed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from curling_env.physics.state import State
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, TEE_Y, Direction, Sheet
from curling_env.typing import Floats, Indices
from friction_estimation.design.greedy import (
    Informative,
    covariance_after,
    variance_removed,
)
from friction_estimation.discovery.evidence.mixture import gaussian, mixture
from friction_estimation.discovery.evidence.predictive_density import broad_prior
from friction_estimation.discovery.evidence.trial_throws import TrialThrow, lay_out
from friction_estimation.discovery.model.elimination import (
    eliminate_factor,
    eliminate_states,
    gram_matrices,
)
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.model import Model, predict
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.quadratic import prior_gram
from friction_estimation.discovery.model.sensitivity import sensitivities

WEIGHTS = {
    "guard weight": 0.93,
    "draw weight": 1.0,
    "control weight": 1.12,
    "normal hit weight": 1.4,
    "peel weight": 1.75,
}
"""Speeds that are tried, over that of a draw to the tee."""
SPINS = (-2.2, -0.8, 0.8, 2.2)
"""Spins that are tried [rad/s]: a quick and a slow turn to either side."""
LINES = (-0.5, -0.25, 0.0, 0.25, 0.5)
"""Lines that are tried, from the centre line to the side lines."""
ROW_SPACING = 0.25
"""Time between the rows at which a throw is judged [s]; each counts as all frames around it."""
LONGEST = 32.0
"""Time for which a throw is followed [s]: slower ones have all but stopped."""
AT_REST = 0.02
"""Speed below which further rows say nothing new [m/s]."""
DRAW_SPEEDS = np.linspace(1.2, 3.4, 23)
"""Speeds among which that of a draw to the tee is sought [m/s]."""
AT_ONCE = 80
"""Throws that are linearised together: more would need a gigabyte beside a friction map."""


@dataclass(frozen=True, kw_only=True)
class NextThrow:
    """A throw worth making.

    Parameters
    ----------
    throw : the throw
    weight : its speed in the sport's words
    hog_to_hog : time from hog line to hog line that is expected [s]; None if it stops short
    words : the throw in words
    teaches : part of its variance that the throw removes from the friction of the sheet, the map
        and each effect, the most first
    """

    throw: TrialThrow
    weight: str
    hog_to_hog: float | None
    words: str
    teaches: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """The throw as it stands in a report."""
        time = self.hog_to_hog
        return {
            "words": self.words,
            "weight": self.weight,
            "hog_to_hog_s": None if time is None else round(time, 2),
            "speed": round(self.throw.speed, 3),
            "spin": self.throw.spin,
            "direction": "away" if self.throw.direction is Direction.AWAY else "home",
            "x": round(self.throw.line, 3),
            "stone": int(self.throw.stone),
            "swept": self.throw.swept,
            "teaches": {name: round(share, 4) for name, share in self.teaches.items()},
        }


class _Sought(NamedTuple):
    """What a throw may teach, with the shared parameters that say it."""

    name: str
    places: Indices


def next_throws(fitted: SessionFit, count: int = 3) -> list[NextThrow]:
    """The throws that would teach most of the ice of a fit, in the order in which to make them."""
    sought = _sought(fitted.model)
    posterior = mixture(fitted)
    spread = float(posterior.weights @ posterior.spreads)
    covariance = _covariance(fitted, spread)
    draws = draw_speeds(fitted)
    throws = trial_throws(fitted, draws)
    told, paths = _told_by(fitted, throws, spread)
    playable = [k for k, path in enumerate(paths) if _stays(path, fitted.model.ice.sheet)]
    if not playable:
        return []
    counted = np.concatenate([each.places for each in sought])
    members = np.concatenate([np.full(len(each.places), len(each.places)) for each in sought])
    weights = 1.0 / (members * np.diag(covariance)[counted])
    found: list[NextThrow] = []
    for _ in range(min(count, len(playable))):
        gains = [variance_removed(covariance, told[k], counted, weights) for k in playable]
        best = playable[int(np.argmax(gains))]
        after = covariance_after(covariance, told[best])
        share = 1.0 - np.diag(after) / np.diag(covariance)
        teaches = {each.name: float(share[each.places].mean()) for each in sought}
        teaches = dict(sorted(teaches.items(), key=lambda item: -item[1]))
        throw, path = throws[best], paths[best]
        over_draw = throw.speed / draws[throw.direction]
        weight = min(WEIGHTS, key=lambda name: abs(WEIGHTS[name] - over_draw))
        time = _hog_to_hog(path, throw.direction)
        words = _words(fitted, throw, weight, time)
        found.append(
            NextThrow(throw=throw, weight=weight, hog_to_hog=time, words=words, teaches=teaches)
        )
        covariance = after
        playable.remove(best)  # variety also guards against what no model has
    return found


def trial_throws(fitted: SessionFit, draws: Mapping[Direction, float]) -> list[TrialThrow]:
    """The grid of throws: weights, spins and lines in both directions, and what effects ask for.

    Sweeping, the stone and the time of day are varied where a term of the model depends on them.

    Parameters
    ----------
    fitted : the fit
    draws : speed of a draw to the tee in each direction [m/s]
    """
    terms, session = fitted.model.terms, fitted.session
    needs = {(term.variant or term.card).shown_over for term in terms}
    biased = sorted({term.stone for term in terms if term.stone is not None})
    others = [s for s in np.unique(session.stones).tolist() if s not in biased]
    stones = [*others[:1], *biased] or [0]
    half_width = fitted.model.ice.sheet.width / 2
    return [
        TrialThrow(
            direction=direction,
            speed=part * speed,
            spin=spin,
            line=line * half_width,
            stone=stone,
            swept=swept,
            wait=wait,
        )
        for direction, speed in draws.items()
        for part, spin, line, stone, swept, wait in product(
            WEIGHTS.values(),
            SPINS,
            LINES,
            stones,
            (False, True) if "swept" in needs else (False,),
            (60.0, 3600.0) if "clock" in needs else (60.0,),
        )
    ]


def _sought(model: Model) -> list[_Sought]:
    """The friction of the sheet, the map, and every term, with their parameters."""
    names = model.names
    found = [_Sought("friction", np.array([names.index(("", "ln_mu"))]))]
    area = model.map_slice
    if area.stop > area.start:
        found.append(_Sought("friction_map", np.arange(area.start, area.stop)))
    for term in model.terms:
        places = [k for k, (label, _) in enumerate(names) if label == term.label]
        if places:
            found.append(_Sought(term.label, np.array(places)))
    return found


def _covariance(fitted: SessionFit, spread: float) -> Floats:
    """Covariance of the shared parameters at one spread."""
    reduced = eliminate_states(fitted.grams)
    prior = prior_gram(fitted.model, reduced.shape[1] - 1) + broad_prior(fitted.model)
    grams, _ = eliminate_factor(reduced, fitted.ln_factors, spread)
    return gaussian(grams.sum(axis=0) + prior).covariance


def draw_speeds(fitted: SessionFit) -> dict[Direction, float]:
    """The speed of a draw to the tee in each direction [m/s]."""
    found: dict[Direction, float] = {}
    times = np.array([0.0, 60.0])
    for direction in (Direction.AWAY, Direction.HOME):
        throws = [
            TrialThrow(direction=direction, speed=speed, spin=SPINS[-1])
            for speed in DRAW_SPEEDS.tolist()
        ]
        session, states = lay_out(fitted.session, throws, times)
        path = predict(fitted.model, session, states, np.zeros(len(throws)), camera=False)
        rests = direction * path[1::2, State.Y]
        found[direction] = float(np.interp(TEE_Y, np.maximum.accumulate(rests), DRAW_SPEEDS))
    return found


def _told_by(
    fitted: SessionFit, throws: Sequence[TrialThrow], spread: float
) -> tuple[list[Informative], list[Floats]]:
    """What each throw would tell of the shared parameters, and its path (rows, 6)."""
    times = np.arange(0.0, LONGEST, ROW_SPACING)
    noise = _noise_of_rows(fitted)
    blind = not fitted.session.turns.any()
    everything = np.arange(len(fitted.model.vector))
    told: list[Informative] = []
    paths: list[Floats] = []
    for first in range(0, len(throws), AT_ONCE):
        session, states = lay_out(fitted.session, throws[first : first + AT_ONCE], times)
        path, columns = sensitivities(fitted.model, session, states, np.zeros(len(session)))
        columns[~_seen(path)] = 0.0
        empty = np.zeros((*columns.shape[:2], 1))
        empty[:, 2] = np.nan if blind else 0.0
        grams = gram_matrices(session, noise, np.concatenate([columns, empty], axis=2))
        reduced, _ = eliminate_factor(eliminate_states(grams), np.zeros(len(session)), spread)
        told += [Informative(everything, _root(gram[:-1, :-1])) for gram in reduced]
        paths += [path[session.rows(i)] for i in range(len(session))]
    return told, paths


def _seen(path: Floats) -> Any:
    """Rows at which a stone is on the ice played on, and moves."""
    moving = np.hypot(path[:, State.VX], path[:, State.VY]) > AT_REST
    return moving & (np.abs(path[:, State.Y]) < BACK_LINE_Y)


def _noise_of_rows(fitted: SessionFit) -> SessionNoise:
    """The noise of a row that stands for all the frames around it."""
    session, noise = fitted.session, fitted.noise
    steps = np.diff(session.times)
    frames = ROW_SPACING / max(float(np.median(steps[steps > 0])), 1e-3)
    x, y, theta = (white / np.sqrt(max(frames, 1.0)) for white in noise.white)
    return replace(noise, white=(x, y, theta))


def _root(gram: Floats) -> Floats:
    """Rows whose Gram matrix it is, without those that say next to nothing."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    values, vectors = np.linalg.eigh(gram * scale[:, None] * scale)
    told = values > 1e-9 * len(gram)
    return (np.sqrt(values[told]) * vectors[:, told]).T / scale


def _stays(path: Floats, sheet: Sheet) -> bool:
    """Whether a stone passes the far hog line and keeps between the side lines."""
    on = np.abs(path[:, State.Y]) < BACK_LINE_Y
    inside = np.abs(path[on, State.X]).max() < sheet.width / 2 - 0.15
    return bool(inside and abs(path[-1, State.Y] - path[0, State.Y]) > 2 * HOG_LINE_Y)


def _hog_to_hog(path: Floats, direction: Direction) -> float | None:
    """Time from hog line to hog line [s]; None if the stone stops short."""
    y = direction * path[:, State.Y]
    if y[-1] <= HOG_LINE_Y:
        return None
    return float(np.interp(HOG_LINE_Y, np.maximum.accumulate(y), np.arange(len(y)) * ROW_SPACING))


def _words(fitted: SessionFit, throw: TrialThrow, weight: str, time: float | None) -> str:
    """The throw as one would call it to a player."""
    timed = f" ({time:.1f} s hog to hog)" if time is not None else ""
    end = "away" if throw.direction is Direction.AWAY else "home"
    side = "counter-clockwise" if throw.spin > 0 else "clockwise"
    pace = "quickly" if abs(throw.spin) == max(SPINS) else "slowly"
    parts = [
        f"{weight}{timed} towards the {end} end",
        f"turning {pace} {side}",
        _line_in_words(throw, fitted.model.ice.sheet),
    ]
    if any(term.stone is not None for term in fitted.model.terms):
        parts.append(f"with stone {throw.stone}")
    if any(term.name == "sweeping" for term in fitted.model.terms):
        parts.append("swept" if throw.swept else "unswept")
    if throw.wait > 600:
        parts.append(f"{throw.wait / 60:.0f} minutes after the last throw")
    return ", ".join(parts)


def _line_in_words(throw: TrialThrow, sheet: Sheet) -> str:
    """The line of delivery, as the thrower sees it."""
    if throw.line == 0.0:
        return "down the centre line"
    part = {0.25: "a quarter of the way", 0.5: "half-way"}[
        round(2 * abs(throw.line) / sheet.width, 3)
    ]
    side = "right" if throw.line * throw.direction > 0 else "left"
    return f"{part} from the centre line to the {side} side line"
