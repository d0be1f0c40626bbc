"""What is wanted of a throw, and how its outcome is judged.

Tasks are judged as the environment judges them (`curling_env.envs.sheet.tasks`): the value of a
throw is the reward that it would earn there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from agents.planning.rollouts import Rollouts
from curling_env.envs.sheet.reward import MAX_MISS, Landing, judge
from curling_env.envs.sheet.tasks import DRAW_RADIUS, Task
from curling_env.game.rules.lines import Lines
from curling_env.game.rules.scoring import points_of
from curling_env.sheet import Direction, to_delivery, to_sheet
from curling_env.throw import FROM_HOG_LINE, Delivery
from curling_env.typing import Flags, Floats

SUCCESS_MEANS = {
    "draw": "it rests within the radius of the 4-foot ring around the target",
    "guard": "it rests before the house and covers the place",
    "takeout": "the stone that was hit is out of play",
    "hit_and_stay": "the stone that was hit is out of play and the thrown one stays",
    "peel": "both the stone that was hit and the thrown one are out of play",
    "freeze": "it rests against the stone without driving it back",
}
"""What counts as a success, by the name of the environment's task."""


@dataclass(frozen=True, kw_only=True)
class JudgedThrows:
    """The judgement of n throws.

    Parameters
    ----------
    value : (n,) the number whose mean the planner maximises
    success : (n,) whether the objective was reached
    miss : (n,) distance of the delivered stone from where it should end [m]
    """

    value: Floats
    success: Flags
    miss: Floats


class Objective(Protocol):
    """What is wanted of a throw at a position."""

    @property
    def name(self) -> str:
        """A word or two for people and files."""
        ...

    @property
    def target(self) -> Floats:
        """Where the delivered stone should end, or what it is aimed at, (2,) sheet frame [m]."""
        ...

    @property
    def direction(self) -> Direction:
        """The end played to."""
        ...

    @property
    def delivery(self) -> Delivery:
        """Where throws begin, and the fastest."""
        ...

    @property
    def stones(self) -> Floats:
        """Centres of the resting stones, (k, 2) sheet frame [m]."""
        ...

    @property
    def own(self) -> Flags | None:
        """Whether each of them belongs to the thrower's team, (k,); None where that is not told."""
        ...

    @property
    def miss_means(self) -> str | None:
        """What a miss is the distance of, in words; None where none tells how well it went."""
        ...

    @property
    def success_means(self) -> str:
        """What counts as a success, in words."""
        ...

    @property
    def aim_margin(self) -> float:
        """How far beside the target a throw may have to be aimed [m]."""
        ...

    @property
    def max_weight(self) -> float:
        """Largest weight worth trying, relative to a draw to the target."""
        ...

    @property
    def comes_to_rest(self) -> bool:
        """Whether throws that come to rest at the target are candidates."""
        ...

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Judge throws by where they and the other stones ended.

        Parameters
        ----------
        ended : outcomes of n throws
        radius : radius of a stone [m]
        """
        ...


@dataclass(frozen=True, kw_only=True)
class RestAtTarget:
    """The stone should rest at a place: the nearer, the better."""

    target: Floats
    direction: Direction
    stones: Floats
    own: Flags | None = None
    delivery: Delivery = FROM_HOG_LINE
    name: str = "rest"
    aim_margin: float = 0.8
    max_weight: float = 1.1
    comes_to_rest: bool = True
    miss_means: str | None = "from the target to where the stone rests"
    success_means: str = "it rests within the radius of the 4-foot ring around the target"

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Value minus the miss; a success, as for a draw, within the radius of the 4-foot ring."""
        miss = _distance(ended.xy, self.target)
        return JudgedThrows(value=-miss, success=ended.in_play & (miss <= DRAW_RADIUS), miss=miss)


@dataclass(frozen=True, kw_only=True)
class TaskDone:
    """A task of the environment should be done.

    Parameters
    ----------
    task : the task
    mark : (2,) the task's mark, sheet frame [m]; where the task's stone lies, if it has one
    given : index of the task's stone; None where the task has none
    radius : radius of a stone [m]
    """

    task: Task
    mark: Floats
    direction: Direction
    stones: Floats
    own: Flags | None = None
    given: int | None = None
    radius: float = 0.145
    delivery: Delivery = FROM_HOG_LINE

    @property
    def name(self) -> str:
        return self.task.name.replace("_", " ")

    @property
    def target(self) -> Floats:
        mark = to_delivery(self.mark, self.direction)
        return np.asarray(to_sheet(self.task.target(mark, self.radius), self.direction))

    @property
    def comes_to_rest(self) -> bool:
        """Whether it is aimed at a place and not, as a takeout is, at a stone."""
        return self.given is None or bool(_distance(self.target, self.mark) > self.radius)

    @property
    def miss_means(self) -> str | None:
        # How far a stone runs after a takeout says nothing of the takeout.
        if not self.comes_to_rest:
            return None
        place = "the target" if self.given is None else "the place against the stone"
        return f"from {place} to where the thrown stone rests"

    @property
    def success_means(self) -> str:
        return SUCCESS_MEANS.get(self.task.name, f"the task {self.name} is done")

    @property
    def aim_margin(self) -> float:
        return 0.6 if self.comes_to_rest else 2.4 * self.radius

    @property
    def max_weight(self) -> float:
        return 1.1 if self.comes_to_rest else 2.0

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Value and success as the task's reward and success in `CurlingSheet-v0`."""
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
        return JudgedThrows(
            value=np.asarray(self.task.weights.total(verdict.parts), dtype=np.float64),
            success=np.asarray(verdict.success, dtype=np.bool_),
            miss=np.minimum(verdict.distance_m, MAX_MISS),
        )


@dataclass(frozen=True, kw_only=True)
class MostPoints:
    """The stones should count as many points as possible: the score, if this is the last stone.

    Parameters
    ----------
    own : (k,) whether a resting stone belongs to the thrower's team
    """

    target: Floats
    direction: Direction
    stones: Floats
    own: Flags = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    delivery: Delivery = FROM_HOG_LINE
    name: str = "score"
    aim_margin: float = 2.2
    max_weight: float = 1.8
    comes_to_rest: bool = True
    miss_means: str | None = None
    success_means: str = "the thrower's team scores"

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Value in points of the thrower's team, negative where the opponents score."""
        thrown = np.where(ended.in_play[:, None], ended.xy, np.nan)
        places = np.concatenate([ended.stones, thrown[:, None]], axis=1)
        own, reach = np.append(self.own, True), Lines(stone_radius=radius).reach
        points = points_of(to_delivery(places, self.direction), own, reach)
        miss = _distance(ended.xy, self.target)
        return JudgedThrows(value=points.astype(np.float64), success=points > 0, miss=miss)


def _distance(places: Floats, target: Floats) -> Floats:
    apart = places - target
    return np.minimum(np.nan_to_num(np.hypot(apart[..., 0], apart[..., 1]), nan=MAX_MISS), MAX_MISS)
