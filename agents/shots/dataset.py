"""Real ends as a dataset for offline learning, and a behaviour clone.

An episode is one team's side of an end of `CurlingEnd-v0` by `mixed_doubles_2024`: the observation
before each of its deliveries, the action of the throw that explains the shot (see `inversion`), and
at its last delivery the points of the end.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from scipy.cluster.vq import kmeans2, vq
from scipy.optimize import minimize
from scipy.special import logsumexp

import curling_env  # noqa: F401  (registers the environments)
from agents.playing.offline_data import write_dataset
from agents.shots.inversion import Inversion
from agents.shots.table import RULES, ShotTable, TableEnd
from curling_env.errors import InputError
from curling_env.game import Call, GameState
from curling_env.game.rules import Game, Team
from curling_env.game.simulator import direction_of
from curling_env.ice import load_ice
from curling_env.typing import Floats, Progress, no_progress

DATASET = "curling/doubles-v0"
"""Identifier of the dataset, which is also its folder."""
OPTIONS: dict[str, Any] = {"rules": "mixed_doubles_2024", "opponent": "rulebased"}
"""Options of `CurlingEnd-v0` for the observations and actions of the dataset."""
PROTOTYPES = 96
"""Number of throws among which the clone chooses."""
FEATURES = 256
"""Number of random features of an observation."""
PENALTY = 3e-4
"""Penalty on squared weights of the clone."""


@dataclass(frozen=True, kw_only=True)
class Episode:
    """One team's side of an end.

    Parameters
    ----------
    game : index of its game in the table
    observations : (n + 1, 180) before each delivery, and after the end
    actions : (n, 3) actions that mean the throws
    points : points of the end less those of the opponent
    misfits : (n,) how far the throws leave stones from their real places [m]
    """

    game: int
    observations: Floats
    actions: Floats
    points: float
    misfits: Floats


def episodes_of(table: ShotTable, *, progress: Progress = no_progress) -> Iterator[Episode]:
    """Yield both sides of every complete end; sides with an unexplained shot are ignored.

    Parameters
    ----------
    table : the table
    progress : called after every game
    """
    env: Any = gymnasium.make("CurlingEnd-v0", disable_env_checker=True, **OPTIONS).unwrapped
    inversion = Inversion(load_ice("standard"))
    for k, game in enumerate(table.games):
        for end in game.ends:
            if end.score is None or end.stopped or len(end.shots) < RULES.deliveries:
                continue
            yield from _sides(end, k, env, inversion)
        progress("converting", k + 1, len(table.games))


def _sides(end: TableEnd, number: int, env: Any, inversion: Inversion) -> Iterator[Episode]:
    found = [inversion.throw_of(shot) for shot in end.shots]
    assert end.score is not None
    usual = env.usual
    rules, lines = usual.simulator.rules, usual.simulator.lines
    for team in Team:
        own = [k for k, shot in enumerate(end.shots) if shot.team is team]
        throws = [one for k in own if (one := found[k]) is not None]
        if len(throws) < len(own):
            continue
        states = [
            GameState(game=Game(rules=rules, lines=lines, end=inversion.end_before(end.shots[k])))
            for k in own
        ]
        over = Game(rules=rules, lines=lines, line_score=(end.score,), hammers=(end.hammer,))
        seen = usual.observation.observe([*states, GameState(game=over)], team, direction_of(0))
        actions = [env.action_of(Call(throw=one.throw)) for one in throws]
        yield Episode(
            game=number,
            observations=seen,
            actions=np.stack(actions),
            points=float(end.score[team] - end.score[team.other]),
            misfits=np.array([one.misfit for one in throws]),
        )


def write_doubles(folder: str | Path, episodes: Sequence[Episode]) -> Path:
    """Write episodes as a Minari dataset; see `agents.playing.offline_data.write_dataset`."""
    env = gymnasium.make("CurlingEnd-v0", disable_env_checker=True, **OPTIONS)
    documents = (
        {
            "observations": one.observations,
            "actions": one.actions,
            "rewards": [0.0] * (len(one.actions) - 1) + [one.points],
            "terminations": [False] * (len(one.actions) - 1) + [True],
            "truncations": [False] * len(one.actions),
        }
        for one in episodes
    )
    return write_dataset(
        folder,
        DATASET,
        env,
        documents,
        by="championship teams",
        what="Ends of mixed doubles from a table of championship shots",
    )


# --- a behaviour clone --------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Copy:
    """Policy that chooses throws with the frequencies of teams in similar positions.

    Parameters
    ----------
    throws : (k, 3) actions among which it chooses
    project, offset : random features of an observation
    weights : (features + 1, k) logits of the throws
    """

    throws: Floats
    project: Floats
    offset: Floats
    weights: Floats

    def log_chances(self, observations: Floats) -> Floats:
        """Return the logarithm of the probability of each throw, (n, k)."""
        logits = _features(observations, self.project, self.offset) @ self.weights
        return logits - logsumexp(logits, axis=1, keepdims=True)

    def __call__(self, observation: Floats) -> Floats:
        """Return the throw with the highest probability, as an action."""
        chances = self.log_chances(np.asarray(observation, dtype=np.float64)[None])[0]
        return self.throws[int(np.argmax(chances))]


@dataclass(frozen=True, kw_only=True)
class CopyScore:
    """Score of a clone on held-out games.

    Parameters
    ----------
    deliveries : number of those
    log_score, baseline : mean log probability of the nearest throw by the copy, and by how often
        each was thrown whatever the position
    """

    deliveries: int
    log_score: float
    baseline: float


def fit_copy(
    observations: Floats, actions: Floats, *, seed: int = 0, prototypes: int = PROTOTYPES
) -> Copy:
    """Clone deliveries by multinomial regression on random features (behaviour cloning).

    Parameters
    ----------
    observations, actions : (n, 180) and (n, 3)
    seed : seed of the features and of the throws
    prototypes : number of throws among which the copy chooses

    Raises
    ------
    InputError : fewer deliveries than throws
    """
    if len(actions) < prototypes:
        raise InputError(f"a copy needs {prototypes} deliveries or more, got {len(actions)}")
    rng = np.random.default_rng(seed)
    first = actions[rng.permutation(len(actions))[:prototypes]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a cluster that is empty keeps its throw
        throws, _ = kmeans2(actions, first, iter=15, minit="matrix")
    label, _ = vq(actions, throws)
    project = rng.standard_normal((observations.shape[1], FEATURES))
    spread = observations.std(axis=0)
    project *= np.where(spread > 1e-6, 1 / np.maximum(spread, 0.2), 0.0)[:, None]
    project /= np.sqrt(max(int((spread > 1e-6).sum()), 1))
    offset = rng.standard_normal(FEATURES) - observations.mean(axis=0) @ project
    features = _features(observations, project, offset)
    shape = features.shape[1], len(throws)
    target = np.zeros((len(label), len(throws)))
    target[np.arange(len(label)), label] = 1.0

    def loss(flat: Floats) -> tuple[float, Floats]:
        weights = flat.reshape(shape)
        logits = features @ weights
        log = logits - logsumexp(logits, axis=1, keepdims=True)
        gradient = features.T @ (np.exp(log) - target) / len(label) + 2 * PENALTY * weights
        value = -float((log * target).sum()) / len(label) + PENALTY * float((weights**2).sum())
        return value, gradient.ravel()

    found = minimize(
        loss, np.zeros(shape).ravel(), jac=True, method="L-BFGS-B", options={"maxiter": 80}
    )
    return Copy(
        throws=throws, project=project, offset=offset, weights=np.asarray(found.x).reshape(shape)
    )


def score_of_copy(copy: Copy, train: Floats, observations: Floats, actions: Floats) -> CopyScore:
    """Score a clone on held-out deliveries.

    Parameters
    ----------
    copy : the copy
    train : actions that it was fitted to, for the baseline
    observations, actions : the deliveries
    """
    label, _ = vq(actions, copy.throws)
    counts = np.bincount(vq(train, copy.throws)[0], minlength=len(copy.throws)) + 0.5
    chances = copy.log_chances(observations)[np.arange(len(label)), label]
    return CopyScore(
        deliveries=len(label),
        log_score=float(chances.mean()),
        baseline=float(np.log(counts / counts.sum())[label].mean()),
    )


def copy_score(episodes: Sequence[Episode], *, every: int = 5) -> CopyScore | None:
    """Score a clone of some games on the others; None with too few deliveries.

    Parameters
    ----------
    episodes : episodes of a table
    every : each of these games is held out

    Raises
    ------
    InputError : no episode at all
    """
    if not episodes:
        raise InputError("holds no whole end that throws of this ice explain")
    train = [one for one in episodes if one.game % every]
    test = [one for one in episodes if one.game % every == 0]
    if not test or sum(len(one.actions) for one in train) < PROTOTYPES:
        return None
    seen, thrown = deliveries_of(train)
    return score_of_copy(fit_copy(seen, thrown), thrown, *deliveries_of(test))


def deliveries_of(episodes: Sequence[Episode]) -> tuple[Floats, Floats]:
    """Return observations before deliveries, and actions, of some episodes."""
    seen = np.concatenate([one.observations[:-1] for one in episodes]).astype(np.float64)
    return seen, np.concatenate([one.actions for one in episodes]).astype(np.float64)


def _features(observations: Floats, project: Floats, offset: Floats) -> Floats:
    hidden = np.maximum(observations @ project + offset, 0.0)
    return np.hstack([hidden, np.ones((len(hidden), 1))])
