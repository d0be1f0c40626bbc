"""Grades of shots by task, handle, team and player: an ordinal model with shrunken effects.

The logit of a grade of at least k is an ability minus a threshold of the task. The ability is the
sum of a team's effect, a player's, a player's with one handle over the other, and a task's with one
handle over the other. Effects of each kind are normal about 0 with a scatter that is estimated from
the data (empirical Bayes, by Laplace's approximation), so that effects of few shots shrink to 0.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from agents.shots.checks import RULES
from agents.shots.table import BEST_GRADE, Shot, TableGame
from curling_env.errors import InputError
from curling_env.typing import Floats, Indices

KINDS = (
    *("team", "player", "player by handle", "task by handle"),
    *("task by stone", "task by competition"),
)
"""Kinds of effects."""
ROUNDS = 8
"""Number of rounds of the estimate of the scatter of each kind."""
FIRST_SCATTER = 0.3
LEAST_SCATTER = 0.02
"""Initial scatter, and its minimum [logit]."""
THRESHOLD_PRIOR = 3.0
"""Standard deviation of a step between a task's thresholds on a logarithmic scale."""


@dataclass(frozen=True, kw_only=True)
class GradedShot:
    """Graded shot with the variables of the model.

    Parameters
    ----------
    shot : the shot
    game : its game
    lead : points by which the team with the hammer leads before the end
    ends_left : scheduled ends that are not complete, with this one; 0 in an extra end
    """

    shot: Shot
    game: TableGame
    lead: int = 0
    ends_left: int = 1

    @property
    def team(self) -> int:
        """Identifier of the team, the same in all competitions."""
        return self.game.teams[self.shot.team]

    @property
    def player(self) -> tuple[int, int, int]:
        """Competition, team and number of the player."""
        return self.game.key[0], self.team, self.shot.player


def graded_shots(games: Sequence[TableGame]) -> list[GradedShot]:
    """Return the shots of games that have a task and a grade."""
    found: list[GradedShot] = []
    for game in games:
        ahead = 0
        for end in game.ends:
            lead = -ahead if end.hammer else ahead
            left = max(RULES.ends - end.number, 0)
            found += [
                GradedShot(shot=shot, game=game, lead=lead, ends_left=left)
                for shot in end.shots
                if shot.grade is not None and shot.task
            ]
            ahead += 0 if end.score is None else end.score[0] - end.score[1]
    return found


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One effect on the logit of a grade.

    Parameters
    ----------
    value, stderr : its estimate and standard error
    shots : number of shots behind it
    """

    value: float
    stderr: float
    shots: int


@dataclass(frozen=True, kw_only=True)
class GradeModel:
    """The fitted model.

    Parameters
    ----------
    thresholds : four increasing thresholds of each task
    effects : the effects of each kind by what they belong to
    scatter : standard deviation of the effects of each kind
    """

    thresholds: dict[str, Floats]
    effects: dict[str, dict[Hashable, Effect]]
    scatter: dict[str, float]

    def ability(self, shot: GradedShot) -> float:
        """Return the sum of the effects on a shot; 0 for unknown ones."""
        total = 0.0
        for kind, (key, sign) in zip(KINDS, _keys(shot, shot.shot.spin), strict=True):
            known = self.effects[kind].get(key)
            total += 0.0 if known is None else sign * known.value
        return total

    def probabilities(self, shot: GradedShot) -> Floats:
        """Return the probability of each grade from 0 to 4, (5,); the shares of all tasks if the
        task is new.
        """
        thresholds = self.thresholds.get(shot.shot.task)
        if thresholds is None:
            thresholds = np.mean(list(self.thresholds.values()), axis=0)
        above = expit(self.ability(shot) - thresholds)
        return -np.diff(np.concatenate([[1.0], above, [0.0]]))


def _keys(shot: GradedShot, spin: float) -> tuple[tuple[Hashable, float], ...]:
    """Return the owner of each kind of effect, and the sign with which it counts."""
    return (
        (shot.team, 1.0),
        (shot.player, 1.0),
        (shot.player, spin / 2),
        (shot.shot.task, spin / 2),
        ((shot.shot.task, shot.shot.number), 1.0),
        ((shot.shot.task, shot.game.key[0]), 1.0),
    )


def fit_grades(shots: Sequence[GradedShot]) -> GradeModel:
    """Fit the model to graded shots."""
    design = _Design(shots)
    scatter = np.full(len(KINDS), FIRST_SCATTER)
    parameters = design.start()
    variance = np.zeros(len(design.names))
    for _ in range(ROUNDS):
        parameters = design.fit(parameters, scatter)
        variance = design.variance(parameters, scatter)
        effects = parameters[design.size :]
        for kind in range(len(KINDS)):
            own = design.kind == kind
            second = float(np.mean(effects[own] ** 2 + variance[own]))
            scatter[kind] = max(np.sqrt(second), LEAST_SCATTER)
    return design.model(parameters, variance, scatter)


class _Design:
    """Shots as indices, with the likelihood of their grades."""

    def __init__(self, shots: Sequence[GradedShot]) -> None:
        self.tasks = sorted({one.shot.task for one in shots})
        self.task = np.array([self.tasks.index(one.shot.task) for one in shots])
        self.grade = np.array([one.shot.grade for one in shots], dtype=np.intp)
        self.size = BEST_GRADE * len(self.tasks)
        names: dict[tuple[int, Hashable], int] = {}
        columns = np.zeros((len(shots), len(KINDS)), dtype=np.intp)
        self.signs = np.zeros((len(shots), len(KINDS)))
        for row, one in enumerate(shots):
            for kind, (key, sign) in enumerate(_keys(one, one.shot.spin)):
                columns[row, kind] = names.setdefault((kind, key), len(names))
                self.signs[row, kind] = sign
        self.columns: Indices = columns
        self.names = list(names)
        self.kind = np.array([kind for kind, _ in self.names])

    def start(self) -> Floats:
        """Thresholds by the shares of each task, and no effects."""
        out: list[float] = []
        for task in range(len(self.tasks)):
            own = self.grade[self.task == task]
            at_least = [(np.sum(own >= k) + 0.5) / (len(own) + 1) for k in range(1, BEST_GRADE + 1)]
            logits = -np.log(np.array(at_least) / (1 - np.array(at_least)))
            rises = np.maximum(np.diff(logits), 1e-2)
            out += [float(logits[0]), *np.log(rises).tolist()]
        return np.array([*out, *np.zeros(len(self.names))])

    def thresholds(self, parameters: Floats) -> Floats:
        """Increasing thresholds, (tasks, 4): the first, then steps on a logarithmic scale."""
        steps = parameters[: self.size].reshape(-1, BEST_GRADE)
        rises = np.exp(np.clip(steps[:, 1:], -10, 5))
        return np.cumsum(np.concatenate([steps[:, :1], rises], axis=1), axis=1)

    def fit(self, start: Floats, scatter: Floats) -> Floats:
        """Posterior mode of thresholds and effects."""
        found = minimize(
            self._loss, start, args=(scatter,), jac=True, method="L-BFGS-B",
            options={"maxiter": 300},
        )  # fmt: skip
        return np.asarray(found.x)

    def variance(self, parameters: Floats, scatter: Floats) -> Floats:
        """Posterior variance of each effect, thresholds held at their mode."""
        _, _, curvature = self._parts(parameters)
        precision = np.diag(1.0 / scatter[self.kind] ** 2)
        for a in range(len(KINDS)):
            for b in range(len(KINDS)):
                weights = curvature * self.signs[:, a] * self.signs[:, b]
                np.add.at(precision, (self.columns[:, a], self.columns[:, b]), weights)
        return np.diag(np.linalg.inv(precision)).astype(np.float64)

    def model(self, parameters: Floats, variance: Floats, scatter: Floats) -> GradeModel:
        """Return the fitted parameters by name."""
        thresholds = self.thresholds(parameters)
        counts = np.bincount(self.columns.ravel(), minlength=len(self.names))
        effects: dict[str, dict[Hashable, Effect]] = {kind: {} for kind in KINDS}
        for k, (kind, key) in enumerate(self.names):
            value = float(parameters[self.size + k])
            stderr = float(np.sqrt(variance[k]))
            effects[KINDS[kind]][key] = Effect(value=value, stderr=stderr, shots=int(counts[k]))
        return GradeModel(
            thresholds=dict(zip(self.tasks, thresholds, strict=True)),
            effects=effects,
            scatter=dict(zip(KINDS, scatter.tolist(), strict=True)),
        )

    def _parts(self, parameters: Floats) -> tuple[Any, Any, Floats]:
        """Probabilities, sigmoids and the curvature of the loss in the ability of each shot."""
        effects = parameters[self.size :]
        ability = (effects[self.columns] * self.signs).sum(axis=1)
        thresholds = self.thresholds(parameters)[self.task]
        rows = np.arange(len(self.grade))
        padded = np.concatenate(
            [np.full((len(rows), 1), -np.inf), thresholds, np.full((len(rows), 1), np.inf)], axis=1
        )
        above = expit(ability - padded[rows, self.grade])
        below = expit(ability - padded[rows, self.grade + 1])
        probability = np.maximum(above - below, 1e-12)
        # Both sigmoids are logistic, so that the second derivative has a simple form.
        curvature = above * (1 - above) + below * (1 - below)
        return probability, (above, below), curvature

    def _loss(self, parameters: Floats, scatter: Floats) -> tuple[float, Floats]:
        probability, (above, below), _ = self._parts(parameters)
        up, down = above * (1 - above), below * (1 - below)
        gradient = np.zeros_like(parameters)
        by_ability = 1.0 - above - below  # of the logarithm of the probability
        for kind in range(len(KINDS)):
            weights = -by_ability * self.signs[:, kind]
            columns = self.size + self.columns[:, kind]
            gradient += np.bincount(columns, weights=weights, minlength=len(parameters))
        by_threshold = np.zeros((len(self.tasks), BEST_GRADE))
        lower, upper = self.grade > 0, self.grade < BEST_GRADE
        np.add.at(
            by_threshold,
            (self.task[lower], self.grade[lower] - 1),
            (up / probability)[lower],
        )
        np.add.at(
            by_threshold,
            (self.task[upper], self.grade[upper]),
            -(down / probability)[upper],
        )
        steps = parameters[: self.size].reshape(-1, BEST_GRADE)
        after = np.cumsum(by_threshold[:, ::-1], axis=1)[:, ::-1]
        after[:, 1:] *= np.exp(np.clip(steps[:, 1:], -10, 5))
        after[:, 1:] += steps[:, 1:] / THRESHOLD_PRIOR**2
        gradient[: self.size] += after.ravel()
        effects = parameters[self.size :]
        gradient[self.size :] += effects / scatter[self.kind] ** 2
        loss = -np.log(probability).sum() + 0.5 * np.sum((effects / scatter[self.kind]) ** 2)
        loss += 0.5 * np.sum((steps[:, 1:] / THRESHOLD_PRIOR) ** 2)
        return float(loss), gradient


# --- held-out games ----------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Quality of the predicted grades of held-out games.

    Parameters
    ----------
    shots, games : number of held-out shots and games
    log_score, baseline : mean log probability of the grades, by the model and by the task's shares
    gain, stderr : the difference, and its standard error over games
    off_by_task : largest difference between predicted and held-out shares of a grade, by task, with
        the sampling error of that share [percentage points]
    """

    shots: int
    games: int
    log_score: float
    baseline: float
    gain: float
    stderr: float
    off_by_task: dict[str, tuple[float, float]]


def held_out_score(games: Sequence[TableGame], *, folds: int = 5) -> HeldOut:
    """Score the grades of each game by a fit to other games.

    Parameters
    ----------
    games : all games
    folds : number of fits, each without one game in that number

    Raises
    ------
    InputError : fewer than two games
    """
    if len(games) < 2:
        raise InputError(f"held-out games need 2 games or more, got {len(games)}")
    gains: list[float] = []
    own = base = 0.0
    folds = min(folds, len(games))
    predicted: dict[str, list[Floats]] = {}
    observed: dict[str, list[int]] = {}
    for fold in range(folds):
        learnt = graded_shots([game for k, game in enumerate(games) if k % folds != fold])
        model, shares = fit_grades(learnt), _shares(learnt)
        for game in games[fold::folds]:
            gain = 0.0
            for one in graded_shots([game]):
                task, grade = one.shot.task, one.shot.grade
                assert grade is not None
                chances = model.probabilities(one)
                by_task = float(np.log(shares.get(task, shares[""])[grade]))
                by_model = float(np.log(max(chances[grade], 1e-9)))
                gain += by_model - by_task
                own, base = own + by_model, base + by_task
                predicted.setdefault(task, []).append(chances)
                observed.setdefault(task, []).append(grade)
            gains.append(gain)
    count = sum(map(len, observed.values()))
    off: dict[str, tuple[float, float]] = {}
    for task, grades in observed.items():
        share = np.bincount(grades, minlength=BEST_GRADE + 1) / len(grades)
        mean = np.mean(predicted[task], axis=0)
        worst = int(np.argmax(np.abs(share - mean)))
        error = np.sqrt(mean[worst] * (1 - mean[worst]) / len(grades))
        off[task] = 100 * float(abs(share - mean)[worst]), 100 * float(error)
    return HeldOut(
        shots=count,
        games=len(gains),
        log_score=own / count,
        baseline=base / count,
        gain=float(np.sum(gains)) / count,
        stderr=float(np.std(gains, ddof=1) * np.sqrt(len(gains))) / count,
        off_by_task=off,
    )


def _shares(shots: Sequence[GradedShot]) -> dict[str, Floats]:
    """Return shares of grades by task, with half a shot added to each grade; those of all under an
    empty name.
    """
    found: dict[str, Floats] = {}
    for task in {"", *(one.shot.task for one in shots)}:
        grades = [one.shot.grade or 0 for one in shots if task in ("", one.shot.task)]
        counts = np.bincount(grades, minlength=BEST_GRADE + 1) + 0.5
        found[task] = counts / counts.sum()
    return found
