"""Objectives of a throw, and the judgement of its outcome.

Tasks are judged as in the environment (`curling_env.envs.sheet.tasks`): the value of a throw is the
reward that it would earn there.
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
    "takeout": "the struck stone is out of play",
    "hit_and_stay": "the struck stone is out of play and the thrown one stays",
    "peel": "both the struck stone and the thrown one are out of play",
    "freeze": "it rests against the stone without driving it back",
}
"""Meaning of a success, by the name of the environment's task."""


@dataclass(frozen=True, kw_only=True)
class JudgedThrows:
    """Judgement of n throws.

    Parameters
    ----------
    value : (n,) number whose mean the planner maximises
    success : (n,) true if the objective was reached
    miss : (n,) distance of the delivered stone from its intended end [m]
    """

    value: Floats
    success: Flags
    miss: Floats


class Objective(Protocol):
    """Objective of a throw at a position."""

    @property
    def name(self) -> str:
        """Name in a word or two, for people and files."""
        ...

    @property
    def target(self) -> Floats:
        """Intended end of the delivered stone, or its aim, (2,) sheet frame [m]."""
        ...

    @property
    def direction(self) -> Direction:
        """End that is played to."""
        ...

    @property
    def delivery(self) -> Delivery:
        """Start of the throws, and their maximum speed."""
        ...

    @property
    def stones(self) -> Floats:
        """Centres of the resting stones, (k, 2) sheet frame [m]."""
        ...

    @property
    def own(self) -> Flags | None:
        """Ownership of each stone by the thrower's team, (k,); None if unknown."""
        ...

    @property
    def miss_means(self) -> str | None:
        """Meaning of a miss in words; None if it does not show the quality of a throw."""
        ...

    @property
    def success_means(self) -> str:
        """Meaning of a success, in words."""
        ...

    @property
    def aim_margin(self) -> float:
        """Maximum distance of the aim from the target [m]."""
        ...

    @property
    def max_weight(self) -> float:
        """Maximum weight to try, relative to a draw to the target."""
        ...

    @property
    def comes_to_rest(self) -> bool:
        """True if throws that come to rest at the target are candidates."""
        ...

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Judge throws by the final positions of all stones.

        Parameters
        ----------
        ended : outcomes of n throws
        radius : radius of a stone [m]
        """
        ...


@dataclass(frozen=True, kw_only=True)
class RestAtTarget:
    """Objective that the stone rests at a place: the nearer, the better."""

    target: Floats
    direction: Direction
    stones: Floats
    own: Flags | None = None
    delivery: Delivery = FROM_HOG_LINE
    name: str = "rest"
    aim_margin: float = 0.8
    max_weight: float = 1.1
    comes_to_rest: bool = True
    miss_means: str | None = "from the target to the stone's place of rest"
    success_means: str = "it rests within the radius of the 4-foot ring around the target"

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Judge by minus the miss; a success, as for a draw, is within the radius of the 4-foot
        ring.
        """
        miss = _distance(ended.xy, self.target)
        return JudgedThrows(value=-miss, success=ended.in_play & (miss <= DRAW_RADIUS), miss=miss)


@dataclass(frozen=True, kw_only=True)
class TaskDone:
    """Objective that a task of the environment is done.

    Parameters
    ----------
    task : the task
    mark : (2,) the task's mark, sheet frame [m]; the position of the task's stone, if it has one
    given : index of the task's stone; None if the task has none
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
        """True if it is aimed at a place and not, like a takeout, at a stone."""
        return self.given is None or bool(_distance(self.target, self.mark) > self.radius)

    @property
    def miss_means(self) -> str | None:
        # The distance that a stone runs after a takeout is no measure of the takeout.
        if not self.comes_to_rest:
            return None
        place = "the target" if self.given is None else "the place against the stone"
        return f"from {place} to the thrown stone's place of rest"

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
        """Judge by the task's reward and success in `CurlingSheet-v0`."""
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
    """Objective of the most points: the score, if this is the last stone.

    Parameters
    ----------
    own : (k,) true for resting stones of the thrower's team
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
        """Judge by the points of the thrower's team, negative if the opponents score."""
        thrown = np.where(ended.in_play[:, None], ended.xy, np.nan)
        places = np.concatenate([ended.stones, thrown[:, None]], axis=1)
        own, reach = np.append(self.own, True), Lines(stone_radius=radius).reach
        points = points_of(to_delivery(places, self.direction), own, reach)
        miss = _distance(ended.xy, self.target)
        return JudgedThrows(value=points.astype(np.float64), success=points > 0, miss=miss)


def _distance(places: Floats, target: Floats) -> Floats:
    apart = places - target
    return np.minimum(np.nan_to_num(np.hypot(apart[..., 0], apart[..., 1]), nan=MAX_MISS), MAX_MISS)
