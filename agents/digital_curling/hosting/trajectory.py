"""Paths of a shot in Digital Curling's form: one frame each tenth of a second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from agents.digital_curling.conversion import slots_of, stone_on_the_wire
from agents.digital_curling.messages import TEAMS
from curling_env.game import PlayedShot
from curling_env.game.rules import Fault
from curling_env.game.rules.teams import STONES_PER_TEAM, Stones
from curling_env.sheet import to_delivery
from curling_env.typing import Floats

SECONDS_PER_FRAME = 0.1


def trajectory_of(
    shot: PlayedShot,
    before: Stones,
    headings: Mapping[int, float],
    finish: Mapping[int, float],
) -> dict[str, Any]:
    """Return the paths of a shot.

    Parameters
    ----------
    shot : shot with its paths
    before : stones on the sheet before, delivery frame
    headings, finish : headings of the handles before and after, by identifier of the stone [rad]
    """
    start = slots_of(before, headings)
    paths = [_path(shot, k, headings) for k in range(len(shot.outcome.trajectories))]
    for stone, _, values in paths:
        start[TEAMS[stone // STONES_PER_TEAM]][stone % STONES_PER_TEAM] = stone_on_the_wire(
            *values[0]
        )
    frames: list[list[dict[str, Any]]] = []
    for k in range(1, int(np.ceil(shot.outcome.time / SECONDS_PER_FRAME)) + 1):
        now = k * SECONDS_PER_FRAME
        frames.append(
            [
                _change(stone, [float(np.interp(now, t, column)) for column in values.T])
                for stone, t, values in paths
                if t[0] <= now < t[-1] + SECONDS_PER_FRAME
            ]
        )
    return {
        "seconds_per_frame": SECONDS_PER_FRAME,
        "start": start,
        "finish": slots_of(shot.stones_after, finish),
        "frames": frames,
    }


def turned(shot: PlayedShot, headings: Mapping[int, float]) -> dict[int, float]:
    """Return headings of the handles after a shot by identifier of the stone [rad]."""
    outcome = shot.outcome
    after = dict(headings)
    stayed = {stone.stone for stone in shot.stones_after}
    put_back = shot.ruling.fault is Fault.FREE_GUARD_ZONE
    for state in outcome.stones:
        if state.stone == shot.stone:
            after[state.stone] = state.theta
        elif not put_back:
            after[state.stone] = headings.get(state.stone, 0.0) + state.theta
    return {stone: angle for stone, angle in after.items() if stone in stayed}


def _path(shot: PlayedShot, k: int, headings: Mapping[int, float]) -> tuple[int, Floats, Floats]:
    """Return identifier, times, and x, y, heading of a path, delivery frame."""
    run = shot.outcome.trajectories[k]
    stone = shot.outcome.stones[shot.outcome.moved[k]].stone
    places = to_delivery(run.xy, shot.direction)
    before = 0.0 if stone == shot.stone else headings.get(stone, 0.0)
    return (
        stone,
        run.t,
        np.column_stack([places, run.theta + before]),
    )


def _change(stone: int, value: list[float]) -> dict[str, Any]:
    """Return a stone's position in a frame."""
    team, slot = divmod(stone, STONES_PER_TEAM)
    return {"team": TEAMS[team], "index": slot, "value": stone_on_the_wire(*value)}
