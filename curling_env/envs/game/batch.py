"""Deliveries in many ends, simulated together where they share an ice that does not wear.

Before stones touch, ends are those that the engine plays, to a tenth of a millimetre; contacts
multiply what is left. Shots have no contacts and no paths.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from curling_env.envs.field import Field, releases_of
from curling_env.envs.game.core import DIRECTION
from curling_env.envs.game.end_core import End, PlayOneByOne
from curling_env.game.players import Call, SweepInterval
from curling_env.game.rules.delivery import Ruling
from curling_env.game.rules.game import End as GameEnd
from curling_env.game.rules.game import deliver
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.game.simulator import GameSimulator, PlayedShot, result_of_places
from curling_env.game.state import GameState
from curling_env.physics.batch import Positions
from curling_env.physics.engine import Outcome, Status, StoneState
from curling_env.sheet import TEE_Y
from curling_env.throw import Throw
from curling_env.typing import Flags, Floats

_PLAY_ALONE = PlayOneByOne(paths=False)


def play_together(
    ends: Sequence[End], calls: Sequence[Call]
) -> Sequence[tuple[GameState, PlayedShot]]:
    """Play one delivery in each of some ends, in all of which the same team throws.

    Where stones wear the ice, or every game has its own set of stones, no two ends share an ice:
    they are played one after another by the engine.

    Raises
    ------
    InputError : ice on which a stone never stops
    """
    out: list[tuple[GameState, PlayedShot] | None] = [None] * len(ends)
    alike: dict[int, list[int]] = {}
    for k, end in enumerate(ends):
        simulator = end.ice.simulator
        lonely = simulator.ice_wears or simulator.ice_evolution.stone_spread
        alike.setdefault(-1 if lonely else id(end.ice), []).append(k)
    for key, some in alike.items():
        play = _PLAY_ALONE if key == -1 else _play_on_one_ice
        played = play([ends[k] for k in some], [calls[k] for k in some])
        for k, one in zip(some, played, strict=True):
            out[k] = one
    return [one for one in out if one is not None]


def _play_on_one_ice(
    ends_now: Sequence[End], calls: Sequence[Call]
) -> Sequence[tuple[GameState, PlayedShot]]:
    ice = ends_now[0].ice
    simulator, states = ice.simulator, [end.state for end in ends_now]
    ends = [end for state in states if (end := state.game.end) is not None]
    places, names, identifiers, columns = lying_in(ends)
    thrown = simulator.with_execution_errors(
        [call.throw for call in calls], [simulator.skills[end.to_throw] for end in ends], states
    )
    sweeps = sweeps_of(simulator, calls, thrown)
    numbers = [(own[-1], s.clock, s.throws) for own, s in zip(identifiers, states, strict=True)]
    throws = np.hstack([thrown, numbers, sweeps])
    releases = releases_of(throws, DIRECTION, simulator.delivery)
    after = ice.field.play(places, names, releases, DIRECTION)
    xy = after.xy - np.array([0.0, TEE_Y])
    last = xy[:, -1].tolist()
    apart = after.xy[:, :-1] != places
    moved = (apart[..., 0] | apart[..., 1]) & ~np.isnan(places[..., 0])
    new: list[dict[int, list[float]]] = [{} for _ in ends]
    touched: list[list[int]] = np.argwhere(moved).tolist()
    for (row, column), place in zip(touched, xy[:, :-1][moved].tolist(), strict=True):
        new[row][columns[row].index(column)] = place
    met: list[bool] = (after.collisions > 0).tolist()
    together = Deliveries(thrown, sweeps, after, moved, ice.field)
    played: list[tuple[GameState, PlayedShot]] = []
    for row, (whole, call, end) in enumerate(zip(ends_now, calls, ends, strict=True)):
        result = result_of_places(end, new[row], last[row], met[row])
        chosen: list[bool] = []
        game, ruling = deliver(whole.state.game, result, put_back=_put_back(whole, chosen))
        shot = BatchShot(
            Facts(together, row, end, identifiers[row], columns[row], call, ruling, any(chosen))
        )
        played.append((simulator.after(whole.state, game), shot))
    return played


def _put_back(whole: End, chosen: list[bool]) -> Callable[[Ruling], bool]:
    """The decision after a tick, which is added to `chosen`."""

    def put_back(ruling: Ruling) -> bool:
        state = whole.state
        other = state.game.end.to_throw.other if state.game.end is not None else None
        view = whole.ice.simulator.view(state, other)
        chosen.append(whole.decider.puts_back(view, ruling))
        return chosen[-1]

    return put_back


class Lying(NamedTuple):
    """The stones that lie in many ends in which the same team throws next.

    A stone keeps its column, so that its identifier follows from the column in every end. The last
    stone of the team that throws lies in none: fifteen columns are enough.

    Parameters
    ----------
    places : (n, k, 2) sheet frame, NaN where there is none [m]
    names : (k,) identifier of each column's stone
    identifiers : of the stones of each end, and of the next one
    columns : of the stones of each end
    """

    places: Floats
    names: list[int]
    identifiers: list[list[int]]
    columns: list[list[int]]


def lying_in(ends: Sequence[GameEnd]) -> Lying:
    """The stones that lie in many ends."""
    identifiers = [
        [STONES_PER_TEAM * team + number for team, number, _, _ in end.stones] for end in ends
    ]
    names: list[int] = sorted(set[int]().union(*identifiers))
    column = {name: k for k, name in enumerate(names)}
    columns = [[column[name] for name in own] for own in identifiers]
    places = np.full((len(ends), len(names), 2), np.nan)
    if names:
        # Lists are turned into arrays once: many small arrays would cost more time.
        lie = [value for end in ends for stone in end.stones for value in stone[2:]]
        which = np.repeat(np.arange(len(ends)), [len(own) for own in columns])
        there = which, [k for own in columns for k in own]
        places[there] = np.array(lie).reshape(-1, 2) + np.array([0.0, TEE_Y])
    for own, end in zip(identifiers, ends, strict=True):
        own.append(STONES_PER_TEAM * end.to_throw + end.number_of_stone)
    return Lying(places, names, identifiers, columns)


def sweeps_of(
    simulator: GameSimulator, calls: Sequence[Call], thrown: Floats
) -> Sequence[SweepInterval]:
    """When each delivery is swept.

    Parameters
    ----------
    simulator : of all of them
    calls : what was called for
    thrown : (n, 4) x, speed, angle and spin of the throws as they left the hand
    """
    if not simulator.sweeping:
        return [(0.0, 0.0)] * len(calls)
    return [
        simulator.sweep_interval(call, Throw(speed=speed, angle=angle, spin=spin, x=x), DIRECTION)
        for call, (x, speed, angle, spin) in zip(calls, thrown.tolist(), strict=True)
    ]


class Deliveries(NamedTuple):
    """Deliveries in many ends that were simulated together.

    Parameters
    ----------
    thrown : (n, 4) x, speed, angle and spin of the throws as they left the hand
    sweeps : when each stone was swept
    after : the positions afterwards
    moved : (n, k) whether something touched the stone of each column
    field : what simulated them
    """

    thrown: Floats
    sweeps: Sequence[SweepInterval]
    after: Positions
    moved: Flags
    field: Field


class Facts(NamedTuple):
    """What one delivery among many left, of which a `PlayedShot` can be made.

    Parameters
    ----------
    deliveries : all of them
    row : which it is
    end : the end before it
    identifiers : of the stones, the delivered one last
    columns : where the stones lie in `deliveries`, without the delivered one, which is last there
    call : what the player called for
    ruling : what the rules made of it
    put_back : after a tick, whether the stones were put back
    """

    deliveries: Deliveries
    row: int
    end: GameEnd
    identifiers: list[int]
    columns: list[int]
    call: Call
    ruling: Ruling
    put_back: bool


class BatchShot(PlayedShot):
    """A delivery in one of many ends; its outcome has no contacts and no paths.

    It is made of the facts when somebody looks at it, which few do.
    """

    def __init__(self, facts: Facts) -> None:
        parts = vars(self)
        parts["_facts"], parts["team"], parts["ruling"] = facts, facts.end.to_throw, facts.ruling

    def __getattr__(self, name: str) -> Any:
        if "_facts" not in vars(self):
            raise AttributeError(name)
        vars(self).update(_parts_of(vars(self).pop("_facts")))
        return getattr(self, name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PlayedShot) and _whole(self) == _whole(other)

    __hash__ = PlayedShot.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        return _whole, (_whole(self),)


def _whole(shot: PlayedShot) -> PlayedShot:
    """A delivery that is all there."""
    return PlayedShot(**{part.name: getattr(shot, part.name) for part in fields(PlayedShot)})


def _parts_of(facts: Facts) -> dict[str, Any]:
    """The fields of a `PlayedShot`."""
    deliveries, row, end = facts.deliveries, facts.row, facts.end
    x, speed, angle, spin = deliveries.thrown[row].tolist()
    return {
        "end": end.number,
        "number": end.delivered,
        "stone": facts.identifiers[-1],
        "call": facts.call,
        "thrown": Throw(speed=speed, angle=angle, spin=spin, x=x),
        "sweep": deliveries.sweeps[row],
        "direction": DIRECTION,
        "outcome": _outcome(facts),
        "put_back": facts.put_back,
    }


def _outcome(facts: Facts) -> Outcome:
    deliveries, row, columns = facts.deliveries, facts.row, [*facts.columns, -1]
    after, time = deliveries.after, float(deliveries.after.time[row])
    status: list[str] = deliveries.field.statuses(after, DIRECTION)[row, columns].tolist()
    last: list[list[float]] = after.last[row, columns].tolist()
    moved: list[bool] = deliveries.moved[row, facts.columns].tolist()
    return Outcome(
        stones=tuple(
            StoneState(x=x, y=y, stone=identifier)
            for identifier, (x, y) in zip(facts.identifiers, last, strict=True)
        ),
        status=tuple(map(Status, status)),
        time=time,
        ends=tuple(time if one else 0.0 for one in (*moved, True)),
        contacts=(),
    )
