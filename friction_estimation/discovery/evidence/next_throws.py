"""The most informative next throws, chosen by the present posterior.

Each throw of a grid of playable throws is linearised on the estimated ice. Its information is known
in advance: its release and its own friction are projected out, as they would be in the fit. The
throw that removes most variance is chosen first, then the next one given the first, and so on. The
friction of the sheet, the friction map and every effect count equally, each by the share of its
variance that is removed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from curling_env.physics.state import State
from curling_env.sheet import BACK_LINE_Y, HOG_LINE_Y, HOUSE_RADIUS, TEE_Y, Direction, Sheet
from curling_env.throw import handles
from curling_env.typing import Flags, Floats, Indices
from friction_estimation.design.design import (
    Informative,
    covariance_after,
    first_of_best,
    variance_removed,
)
from friction_estimation.discovery.data.session import Session
from friction_estimation.discovery.evidence.intervals import mixture
from friction_estimation.discovery.evidence.significance import broad_prior
from friction_estimation.discovery.model.candidates import Term
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.linearisation import Linearisation
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import Model, predict
from friction_estimation.discovery.model.noise import SessionNoise
from friction_estimation.discovery.model.sensitivity import sensitivities
from friction_estimation.discovery.tuning import USUAL_SPIN

SWEPT_FROM, SWEPT_TO = 2.0, 8.0
"""Begin and end of the sweeping of a swept trial throw [s after its release]."""
WEIGHTS = {
    "guard weight": 0.93,
    "draw weight": 1.0,
    "control weight": 1.12,
    "normal hit weight": 1.4,
    "peel weight": 1.75,
}
"""Speeds that are tried, relative to a draw to the tee."""
SPINS = (-2.2, -0.8, 0.8, 2.2)
"""Spins that are tried [rad/s]: a quick and a slow turn to either side."""
LINES = (-0.5, -0.25, 0.0, 0.25, 0.5)
"""Lines that are tried, from the centre line to the side lines."""
WAITS = (60.0, 3600.0)
"""Times after the last throw that are tried if a term depends on the time [s]."""
ROW_SPACING = 0.25
"""Time between the evaluated rows of a throw [s]; each stands for all frames around it."""
LONGEST = 32.0
"""Maximum simulated time of a throw [s]: nearly all stones have stopped by then."""
AT_REST = 0.02
"""Speed below which further rows add no information [m/s]."""
DRAW_SPEEDS = np.linspace(1.2, 3.4, 23)
"""Range of the search for the speed of a draw to the tee [m/s]."""
AT_ONCE = 80
"""Number of throws that are linearised together: more would need a gigabyte with a friction map."""


# --- trial throws and their calls ----------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class TrialThrow:
    """A possible throw, straight along the sheet.

    Parameters
    ----------
    direction : direction of play
    speed, spin : at the hog line [m/s, rad/s]
    line : x of its line of delivery, sheet frame [m]
    stone : which stone
    swept : whether it is swept
    wait : time after the last throw of the session [s]
    weight : its speed in the sport's words
    """

    direction: Direction
    speed: float
    spin: float
    line: float = 0.0
    stone: int = 0
    swept: bool = False
    wait: float = WAITS[0]
    weight: str = ""


def trial_throws(fitted: SessionFit, terms: Sequence[Term]) -> list[TrialThrow]:
    """Return the grid of throws: weights, spins and lines in both directions.

    Sweeping, the stone and the time of day are varied if one of the terms depends on them.

    Parameters
    ----------
    fitted : fit that says what speed a draw needs
    terms : what the throws are to tell of
    """
    needs = {(term.variant or term.card).shown_over for term in terms}
    own = sorted({term.stone for term in terms if term.stone is not None})
    others = [s for s in np.unique(fitted.session.stones).tolist() if s not in own]
    half_width = fitted.model.ice.sheet.width / 2
    return [
        TrialThrow(
            direction=direction,
            speed=WEIGHTS[weight] * speed,
            spin=spin,
            line=line * half_width,
            stone=stone,
            swept=swept,
            wait=wait,
            weight=weight,
        )
        for direction, speed in draw_speeds(fitted).items()
        for weight, spin, line, stone, swept, wait in product(
            WEIGHTS,
            SPINS,
            LINES,
            [*others[:1], *own] or [0],
            (False, True) if "swept" in needs else (False,),
            WAITS if "clock" in needs else WAITS[:1],
        )
    ]


def draw_speeds(fitted: SessionFit) -> dict[Direction, float]:
    """Return the speed of a draw to the tee in each direction [m/s]."""
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


def lay_out(
    session: Session, throws: Sequence[TrialThrow], times: Floats | None = None
) -> tuple[Session, Floats]:
    """Return the throws as a session after another one, each as its next throw.

    Parameters
    ----------
    session : the session after which they are thrown
    throws : the throws
    times : (n,) times at which each is seen; those at which throws are judged by default [s]

    Returns
    -------
    session : its places are empty
    states : (k, 6) releases
    """
    times = np.arange(0.0, LONGEST, ROW_SPACING) if times is None else times
    k, n = len(throws), len(times)
    states = np.array(
        [[t.line, -t.direction * HOG_LINE_Y, 0.0, t.direction * t.speed, 0.0, t.spin]
         for t in throws]
    )  # fmt: skip
    sweeping = ((times > SWEPT_FROM) & (times < SWEPT_TO)).astype(np.float64)
    return Session(
        throws=np.arange(k),
        orders=np.full(k, int(session.orders.max()) + 1),
        stones=np.array([t.stone for t in throws], dtype=np.intp),
        clocks=np.array([session.clocks.max() + t.wait for t in throws]),
        usual_spins=np.full(k, USUAL_SPIN),
        times=np.tile(times, k),
        xy=np.zeros((k * n, 2)),
        theta=np.zeros(k * n),
        swept=np.concatenate([sweeping * t.swept for t in throws]),
        sigma=np.ones((k * n, 2)),
        starts=np.arange(k + 1) * n,
        wear_tracks=session.wear_tracks,
    ), states


def is_seen(path: Floats) -> Flags:
    """Rows of paths (n, 6) at which a stone moves on the ice in play, (n,)."""
    moving = np.hypot(path[:, State.VX], path[:, State.VY]) > AT_REST
    return moving & (np.abs(path[:, State.Y]) < BACK_LINE_Y)


def noise_of_rows(fitted: SessionFit) -> SessionNoise:
    """Return the noise of a row that stands for all the frames around it."""
    session, noise = fitted.session, fitted.noise
    steps = np.diff(session.times)
    frames = ROW_SPACING / max(float(np.median(steps[steps > 0])), 1e-3)
    x, y, theta = (white / np.sqrt(max(frames, 1.0)) for white in noise.white)
    return replace(noise, white=(x, y, theta))


def is_playable(path: Floats, sheet: Sheet) -> bool:
    """Return whether a stone passes the far hog line and keeps between the side lines.

    Parameters
    ----------
    path : (n, 6) its states
    """
    on = np.abs(path[:, State.Y]) < BACK_LINE_Y
    inside = np.abs(path[on, State.X]).max() < sheet.width / 2 - 0.15
    return bool(inside and abs(path[-1, State.Y] - path[0, State.Y]) > 2 * HOG_LINE_Y)


def hog_to_hog(path: Floats, direction: Direction) -> float:
    """Time from hog line to hog line of a throw that passes the far one [s]."""
    y = direction * path[:, State.Y]
    return float(np.interp(HOG_LINE_Y, np.maximum.accumulate(y), np.arange(len(y)) * ROW_SPACING))


def in_words(throw: TrialThrow, path: Floats, sheet: Sheet, terms: Sequence[Term]) -> str:
    """Return the call of the throw: weight, handle, line and place of rest.

    Handles are a right-hander's. Stone and sweeping are named if one of the terms depends on them.

    Parameters
    ----------
    throw, path : the throw, and its states (n, 6) at the rows at which it is judged
    """
    turn = "quick" if abs(throw.spin) == max(SPINS) else "slow"
    parts = [
        f"{throw.weight} ({hog_to_hog(path, throw.direction):.1f} s hog to hog)",
        f"{turn} {handles(throw.spin)[0]} {'↺' if throw.spin > 0 else '↻'}",
        _line_in_words(throw, sheet),
        f"{_rest_in_words(throw.direction * path[-1, State.Y] - TEE_Y)} at the "
        f"{'away' if throw.direction is Direction.AWAY else 'home'} end",
    ]
    if any(term.stone is not None for term in terms):
        parts.append(f"with stone {throw.stone}")
    if any(term.name == "sweeping" for term in terms):
        parts.append("swept" if throw.swept else "unswept")
    if throw.wait > WAITS[0]:
        parts.append(f"{throw.wait / 60:.0f} minutes after the last throw")
    return ", ".join(parts)


def _line_in_words(throw: TrialThrow, sheet: Sheet) -> str:
    """Return the line of delivery, as the thrower sees it."""
    if throw.line == 0.0:
        return "down the centre line"
    part = {0.25: "a quarter of the way", 0.5: "half-way"}[
        round(2 * abs(throw.line) / sheet.width, 3)
    ]
    side = "right" if throw.line * throw.direction > 0 else "left"
    return f"{part} from the centre line to the {side} side line"


def _rest_in_words(past: float) -> str:
    """Describe the length of a throw by its final distance past the tee line [m]."""
    if past > HOUSE_RADIUS:
        return "through the house"
    if past < -HOUSE_RADIUS:
        return "to a guard"
    if abs(past) < HOUSE_RADIUS / 3:
        return "to the tee line"
    return "to the back of the house" if past > 0 else "to the top of the house"


# --- the choice among them -----------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class NextThrow:
    """An informative throw.

    Parameters
    ----------
    throw : the throw
    hog_to_hog : time from hog line to hog line that is expected [s]
    words : the throw in words
    teaches : part of its variance that the throw removes from the friction of the sheet, the map
        and each effect, the most first
    """

    throw: TrialThrow
    hog_to_hog: float
    words: str
    teaches: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Return the throw for a report."""
        return {
            "words": self.words,
            "weight": self.throw.weight,
            "hog_to_hog_s": round(self.hog_to_hog, 2),
            "speed": round(self.throw.speed, 3),
            "spin": self.throw.spin,
            "direction": "away" if self.throw.direction is Direction.AWAY else "home",
            "x": round(self.throw.line, 3),
            "stone": int(self.throw.stone),
            "swept": self.throw.swept,
            "teaches": {name: round(share, 4) for name, share in self.teaches.items()},
        }


@threadpool_limits.wrap(limits=1, user_api="blas")  # as in `discover`
def next_throws(fitted: SessionFit, count: int = 3) -> list[NextThrow]:
    """Return the most informative throws about the ice of a fit, in the order in which to make
    them.

    Light gates see neither lines nor handles, in which these throws differ: after them there are
    none.
    """
    if fitted.session.gates is not None:
        return []
    model = fitted.model
    targets = _targets(model)
    posterior = mixture(fitted)
    spread = float(posterior.weights @ posterior.spreads)
    information = fitted.linear.total(spread) + broad_prior(model)
    covariance = minimum_of(information).covariance
    throws = trial_throws(fitted, model.terms)
    result, paths = _information_of(fitted, throws, spread)
    playable = [k for k, path in enumerate(paths) if is_playable(path, model.ice.sheet)]
    if not playable:
        return []
    counted = np.concatenate(list(targets.values()))
    members = np.concatenate([np.full(len(own), len(own)) for own in targets.values()])
    weights = 1.0 / (members * np.diag(covariance)[counted])
    found: list[NextThrow] = []
    for _ in range(min(count, len(playable))):
        gains = [variance_removed(covariance, result[k], counted, weights) for k in playable]
        best = playable[first_of_best(gains)]
        after = covariance_after(covariance, result[best])
        share = 1.0 - np.diag(after) / np.diag(covariance)
        teaches = {name: float(share[own].mean()) for name, own in targets.items()}
        throw, path = throws[best], paths[best]
        found.append(
            NextThrow(
                throw=throw,
                hog_to_hog=hog_to_hog(path, throw.direction),
                words=in_words(throw, path, model.ice.sheet, model.terms),
                teaches=dict(sorted(teaches.items(), key=lambda item: -item[1])),
            )
        )
        covariance = after
        playable.remove(best)  # variety also protects against effects that no model has
    return found


def _targets(model: Model) -> dict[str, Indices]:
    """Return the parameters of the friction of the sheet, of the map, and of every term."""
    names = model.names
    found = {"friction": np.array([names.index(("", "ln_mu"))])}
    found["friction_map"] = np.arange(len(names))[model.map_slice]
    for term in model.terms:
        own = [k for k, (label, _) in enumerate(names) if label == term.label]
        found.setdefault(term.label, np.array(own, dtype=np.intp))
    return {name: places for name, places in found.items() if len(places)}


def _information_of(
    fitted: SessionFit, throws: Sequence[TrialThrow], spread: float
) -> tuple[list[Informative], list[Floats]]:
    """Return the information of each throw on the shared parameters, and its path (rows, 6)."""
    noise = noise_of_rows(fitted)
    blind = not fitted.session.turns.any()
    everything = np.arange(len(fitted.model.vector))
    result: list[Informative] = []
    paths: list[Floats] = []
    for first in range(0, len(throws), AT_ONCE):
        session, states = lay_out(fitted.session, throws[first : first + AT_ONCE])
        path, columns = sensitivities(fitted.model, session, states, np.zeros(len(session)))
        columns[~is_seen(path)] = 0.0
        empty = np.zeros(columns.shape[:2])
        empty[:, 2] = np.nan if blind else 0.0
        even = np.zeros(len(session))
        whole = np.concatenate([columns, empty[:, :, None]], axis=2)
        parts = np.split(whole, session.starts[1:-1])
        linear = Linearisation.of(session, noise, fitted.model, states, even, parts)
        result += [
            Informative(everything, _root(gram[:-1, :-1])) for gram in linear.each(spread)[0]
        ]
        paths += [path[session.rows(i)] for i in range(len(session))]
    return result, paths


def _root(gram: Floats) -> Floats:
    """Return rows with this Gram matrix, without negligible ones."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    values, vectors = np.linalg.eigh(gram * scale[:, None] * scale)
    result = values > 1e-9 * len(gram)
    return (np.sqrt(values[result]) * vectors[:, result]).T / scale
