"""Objectives of a throw, and the judgement of its outcome.

Tasks are judged as in the environment (`curling_env.envs.sheet.tasks`): the value of a throw is the
reward that it would earn there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

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


@dataclass(frozen=True, kw_only=True)
class Objective(ABC):
    """Objective of a throw at a position.

    Parameters
    ----------
    target : (2,) intended end of the delivered stone, or its aim, sheet frame [m]
    direction : end that is played to
    stones : (k, 2) centres of the resting stones, sheet frame [m]
    own : (k,) ownership of each stone by the thrower's team; None if unknown
    delivery : start of the throws, and their maximum speed
    name : name in a word or two, for people and files
    aim_margin : maximum distance of the aim from the target [m]
    max_weight : maximum weight to try, relative to a draw to the target
    comes_to_rest : true if throws that come to rest at the target are candidates
    miss_means : meaning of a miss in words; None if it does not show the quality of a throw
    success_means : meaning of a success, in words
    """

    target: Floats
    direction: Direction
    stones: Floats
    own: Flags | None = None
    delivery: Delivery = FROM_HOG_LINE
    name: str
    aim_margin: float
    max_weight: float = 1.1
    comes_to_rest: bool = True
    miss_means: str | None = None
    success_means: str

    @abstractmethod
    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Judge throws by the final positions of all stones.

        Parameters
        ----------
        ended : outcomes of n throws
        radius : radius of a stone [m]
        """


@dataclass(frozen=True, kw_only=True)
class RestAtTarget(Objective):
    """Objective that the stone rests at a place: the nearer, the better."""

    name: str = "rest"
    aim_margin: float = 0.8
    miss_means: str | None = "from the target to the stone's place of rest"
    success_means: str = SUCCESS_MEANS["draw"]

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Judge by minus the miss; a success, as for a draw, is within the radius of the 4-foot
        ring.
        """
        miss = _distance(ended.xy, self.target)
        return JudgedThrows(value=-miss, success=ended.in_play & (miss <= DRAW_RADIUS), miss=miss)


@dataclass(frozen=True, kw_only=True)
class TaskDone(Objective):
    """Objective that a task of the environment is done; `task_done` makes one.

    Parameters
    ----------
    task : the task
    mark : (2,) the task's mark, sheet frame [m]; the position of the task's stone, if it has one
    given : index of the task's stone; None if the task has none
    """

    task: Task
    mark: Floats
    given: int | None = None

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
class MostPoints(Objective):
    """Objective of the most points, for a position whose teams are known: the score, if this is the
    last stone.
    """

    name: str = "score"
    aim_margin: float = 2.2
    max_weight: float = 1.8
    success_means: str = "the thrower's team scores"

    def judge(self, ended: Rollouts, radius: float) -> JudgedThrows:
        """Judge by the points of the thrower's team, negative if the opponents score."""
        assert self.own is not None
        thrown = np.where(ended.in_play[:, None], ended.xy, np.nan)
        places = np.concatenate([ended.stones, thrown[:, None]], axis=1)
        own, reach = np.append(self.own, True), Lines(stone_radius=radius).reach
        points = points_of(to_delivery(places, self.direction), own, reach)
        miss = _distance(ended.xy, self.target)
        return JudgedThrows(value=points.astype(np.float64), success=points > 0, miss=miss)


def task_done(
    task: Task,
    mark: Floats,
    direction: Direction,
    stones: Floats,
    *,
    own: Flags | None,
    given: int | None,
    radius: float,
    delivery: Delivery,
) -> TaskDone:
    """Return the objective of a task.

    Parameters
    ----------
    task, mark, given : see `TaskDone`
    direction, stones, own, delivery : see `Objective`
    radius : radius of a stone [m]
    """
    aim = task.target(to_delivery(mark, direction), radius)
    target = np.asarray(to_sheet(aim, direction))
    # A takeout is aimed at a stone, and how far a stone runs after it is no measure of it.
    rests = given is None or bool(_distance(target, mark) > radius)
    name = task.name.replace("_", " ")
    place = "the target" if given is None else "the place against the stone"
    return TaskDone(
        task=task,
        mark=mark,
        given=given,
        target=target,
        direction=direction,
        stones=stones,
        own=own,
        delivery=delivery,
        name=name,
        aim_margin=0.6 if rests else 2.4 * radius,
        max_weight=1.1 if rests else 2.0,
        comes_to_rest=rests,
        miss_means=f"from {place} to the thrown stone's place of rest" if rests else None,
        success_means=SUCCESS_MEANS.get(task.name, f"the task {name} is done"),
    )


def _distance(places: Floats, target: Floats) -> Floats:
    apart = places - target
    return np.minimum(np.nan_to_num(np.hypot(apart[..., 0], apart[..., 1]), nan=MAX_MISS), MAX_MISS)
