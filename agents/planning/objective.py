"""What is wanted of a throw, and how what came of it is judged.

Tasks are judged as the environment judges them (`curling_env.envs.sheet.tasks`): what a throw is
worth here is the reward it would earn there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from agents.planning.rollouts import Rollouts
from curling_env.envs.sheet.reward import MAX_MISS, Landing, judge
from curling_env.envs.sheet.tasks import DRAW_RADIUS, Task
from curling_env.sheet import HOUSE_RADIUS, Direction, to_delivery, to_sheet
from curling_env.typing import Flags, Floats


@dataclass(frozen=True, kw_only=True)
class Judged:
    """What n throws came to.

    Parameters
    ----------
    worth : (n,) what is to be as large as possible on average
    success : (n,) whether what was wanted came about
    miss : (n,) distance of the delivered stone from where it was to end [m]
    """

    worth: Floats
    success: Flags
    miss: Floats


class Wanted(Protocol):
    """What is wanted of a throw at a position."""

    @property
    def name(self) -> str:
        """In a word or two."""
        ...

    @property
    def target(self) -> Floats:
        """Where the delivered stone is to end, or what it is aimed at, (2,) sheet frame [m]."""
        ...

    @property
    def direction(self) -> Direction:
        """The end played to."""
        ...

    @property
    def stones(self) -> Floats:
        """Centres of the resting stones, (k, 2) sheet frame [m]."""
        ...

    @property
    def aside(self) -> float:
        """How far beside the target a throw may have to be aimed [m]."""
        ...

    @property
    def hardest(self) -> float:
        """Largest weight worth a try, over that of a draw to the target."""
        ...

    @property
    def rests(self) -> bool:
        """Whether a throw that comes to rest at the target is a candidate."""
        ...

    def judge(self, ended: Rollouts, radius: float) -> Judged:
        """Judge throws by where they and the other stones ended.

        Parameters
        ----------
        radius : of a stone [m]
        """
        ...


@dataclass(frozen=True, kw_only=True)
class RestAt:
    """A stone at a place: the nearer the better."""

    target: Floats
    direction: Direction
    stones: Floats
    name: str = "rest"
    aside: float = 0.8
    hardest: float = 1.1
    rests: bool = True

    def judge(self, ended: Rollouts, radius: float) -> Judged:
        """Made, as a draw is, within the 4-foot ring's radius of the target."""
        miss = _distance(ended.xy, self.target)
        return Judged(worth=-miss, success=ended.in_play & (miss <= DRAW_RADIUS), miss=miss)


@dataclass(frozen=True, kw_only=True)
class Done:
    """A task of the environment done.

    Parameters
    ----------
    task : what is asked
    mark : (2,) of the task, sheet frame [m]: where the given stone lies, if there is one
    given : index of the given stone; None where the task has none
    radius : of a stone [m]
    """

    task: Task
    mark: Floats
    direction: Direction
    stones: Floats
    given: int | None = None
    radius: float = 0.145

    @property
    def name(self) -> str:
        return self.task.name.replace("_", " ")

    @property
    def target(self) -> Floats:
        mark = to_delivery(self.mark, self.direction)
        return np.asarray(to_sheet(self.task.target(mark, self.radius), self.direction))

    @property
    def rests(self) -> bool:
        """A takeout is aimed at a stone, everything else at a place."""
        return self.given is None or bool(_distance(self.target, self.mark) > self.radius)

    @property
    def aside(self) -> float:
        return 0.6 if self.rests else 2.4 * self.radius

    @property
    def hardest(self) -> float:
        return 1.1 if self.rests else 2.0

    def judge(self, ended: Rollouts, radius: float) -> Judged:
        """By the task's own success and the weights of its reward."""
        n = len(ended.xy)
        nowhere = np.full((n, 2), np.nan)
        given = nowhere if self.given is None else ended.stones[:, self.given]
        before = nowhere if self.given is None else np.broadcast_to(self.mark, (n, 2))
        landing = Landing(
            stone=to_delivery(np.nan_to_num(ended.xy, nan=1e3), self.direction),
            in_play=ended.in_play,
            target=np.asarray(self.task.target(to_delivery(self.mark, self.direction), radius)),
            target_stone=to_delivery(given, self.direction),
            target_stone_before=to_delivery(before, self.direction),
            stone_radius=radius,
        )
        verdict = judge(landing, self.task.is_done(landing))
        return Judged(
            worth=np.asarray(self.task.weights.total(verdict.parts), dtype=np.float64),
            success=np.asarray(verdict.success, dtype=np.bool_),
            miss=np.minimum(verdict.distance_m, MAX_MISS),
        )


@dataclass(frozen=True, kw_only=True)
class MostPoints:
    """The most points, as the stones then lie: what the end scores if it is its last stone.

    Parameters
    ----------
    own : (k,) whether a resting stone is of the thrower's team
    """

    target: Floats
    direction: Direction
    stones: Floats
    own: Flags = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    name: str = "score"
    aside: float = 2.2
    hardest: float = 1.8
    rests: bool = True

    def judge(self, ended: Rollouts, radius: float) -> Judged:
        """Points of the thrower's team, less than none where the opponents score."""
        thrown = np.where(ended.in_play[:, None], ended.xy, np.nan)
        places = np.concatenate([ended.stones, thrown[:, None]], axis=1)
        points = points_of(to_delivery(places, self.direction), np.append(self.own, True), radius)
        miss = _distance(ended.xy, self.target)
        return Judged(worth=points.astype(np.float64), success=points > 0, miss=miss)


def points_of(places: Floats, own: Flags, radius: float) -> NDArray[np.int64]:
    """Points of one's own team, (n,); negative where the opponents score.

    The same count as `curling_env.game.rules.count`, for many positions.

    Parameters
    ----------
    places : (n, k, 2) delivery frame, NaN where there is no stone [m]
    own : (k,) whether each is one's own
    """
    distance = np.hypot(places[..., 0], places[..., 1])
    distance = np.where(distance <= HOUSE_RADIUS + radius, distance, np.inf)
    ours, theirs = distance[:, own], distance[:, ~own]
    our_best = ours.min(axis=1, initial=np.inf)[:, None]
    their_best = theirs.min(axis=1, initial=np.inf)[:, None]
    return (ours < their_best).sum(axis=1) - (theirs < our_best).sum(axis=1)


def _distance(places: Floats, target: Floats) -> Floats:
    apart = places - target
    return np.minimum(np.nan_to_num(np.hypot(apart[..., 0], apart[..., 1]), nan=MAX_MISS), MAX_MISS)
