"""The most informative next throws, chosen by the present posterior.

Each throw of a grid of playable throws is linearised on the estimated ice. Its information is known
in advance: its release and its own friction are projected out, as they would be in the fit. The
throw that removes most variance is chosen first, then the next one given the first, and so on. The
friction of the sheet, the friction map and every effect count equally, each by the share of its
variance that is removed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from curling_env.sheet import Direction
from curling_env.typing import Floats, Indices
from friction_estimation.design.design import (
    Informative,
    covariance_after,
    variance_removed,
)
from friction_estimation.discovery.evidence.intervals import mixture
from friction_estimation.discovery.evidence.significance import broad_prior
from friction_estimation.discovery.evidence.trial_throws import (
    TrialThrow,
    hog_to_hog,
    in_words,
    is_playable,
    is_seen,
    lay_out,
    noise_of_rows,
    trial_throws,
)
from friction_estimation.discovery.model.fit import SessionFit
from friction_estimation.discovery.model.linearisation import Linearisation
from friction_estimation.discovery.model.minimum import minimum_of
from friction_estimation.discovery.model.model import Model
from friction_estimation.discovery.model.sensitivity import sensitivities

AT_ONCE = 80
"""Number of throws that are linearised together: more would need a gigabyte with a friction map."""


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


def next_throws(fitted: SessionFit, count: int = 3) -> list[NextThrow]:
    """Return the most informative throws about the ice of a fit, in the order in which to make
    them.

    Light gates see neither lines nor handles, in which these throws differ: after them there are
    none.
    """
    if fitted.session.gates is not None:
        return []
    # As in `discover`: more threads of linear algebra only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        return _next_throws(fitted, count)


def _next_throws(fitted: SessionFit, count: int) -> list[NextThrow]:
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
        best = playable[int(np.argmax(gains))]
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
