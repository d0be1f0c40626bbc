"""Deliveries in many ends, simulated together if they share an ice that does not wear.

Before the first contact, ends agree with the engine to a tenth of a millimetre; contacts magnify
the difference. Shots have no contacts and no paths.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from curling_env.envs.field import Field
from curling_env.envs.game.core import DIRECTION
from curling_env.envs.game.end_core import End, PlayOneByOne
from curling_env.game.players import Call, SweepInterval
from curling_env.game.rules.delivery import Ruling
from curling_env.game.rules.game import End as GameEnd
from curling_env.game.rules.game import deliver
from curling_env.game.rules.teams import STONES_PER_TEAM
from curling_env.game.simulator import GameSimulator, Place, PlayedShot, result_of_places
from curling_env.game.state import GameState
from curling_env.physics.batch import Positions, releases_of
from curling_env.physics.engine import Outcome, Status, StoneState
from curling_env.sheet import TEE_Y
from curling_env.throw import Throw
from curling_env.typing import Flags, Floats, Indices

_PLAY_ALONE = PlayOneByOne(paths=False)


def play_together(
    ends: Sequence[End], calls: Sequence[Call]
) -> Sequence[tuple[GameState, PlayedShot]]:
    """Play one delivery in each of some ends, in all of which the same team throws.

    If stones wear the ice, or every game has its own set of stones, no two ends share an ice: they
    are played one after another by the engine.

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
    # Thousands of objects that live for a step cost more in the garbage collector than the throws,
    # so data of all ends is in arrays.
    ice = ends_now[0].ice
    simulator, states = ice.simulator, [end.state for end in ends_now]
    ends = [end for state in states if (end := state.game.end) is not None]
    lying = lying_in(ends)
    skills = [simulator.skill_of(end.to_throw, end.number_of_stone) for end in ends]
    thrown = simulator.with_execution_errors([call.throw for call in calls], skills, states)
    sweeps = sweeps_of(simulator, calls, thrown)
    releases = releases_of(
        np.hstack([thrown[:, [1, 2, 3, 0]], sweeps]),
        DIRECTION,
        simulator.delivery,
        stone=[_next_stone(end) for end in ends],
        clock=[state.clock for state in states],
        order=[state.throws for state in states],
    )
    after = ice.field.play(lying.places, lying.names, releases, DIRECTION)
    xy = after.xy - np.array([0.0, TEE_Y])
    apart = after.xy[:, :-1] != lying.places
    moved = (apart[..., 0] | apart[..., 1]) & ~np.isnan(lying.places[..., 0])
    new: defaultdict[int, dict[int, Place]] = defaultdict(dict)
    touched = np.nonzero(moved)[0], lying.order[moved], xy[:, :-1][moved]
    for row, k, place in zip(*(part.tolist() for part in touched), strict=True):
        new[row][k] = place
    put_back_in: set[int] = set()
    row = 0

    def put_back(ruling: Ruling) -> bool:
        whole, other = ends_now[row], ends[row].to_throw.other
        view = whole.ice.simulator.view(whole.state, other)
        if whole.decider.puts_back(view, ruling):
            put_back_in.add(row)
        return row in put_back_in

    together = Deliveries(ends, calls, thrown, sweeps, lying, after, moved, ice.field, put_back_in)
    last, met = xy[:, -1].T.tolist(), (after.collisions > 0).tolist()
    played: list[tuple[GameState, PlayedShot]] = []
    for row, (state, end, x, y, struck) in enumerate(zip(states, ends, *last, met, strict=True)):
        result = result_of_places(end, new.get(row, {}), (x, y), struck)
        game, ruling = deliver(state.game, result, put_back=put_back)
        played.append((simulator.after(state, game), BatchShot(together, row, end, ruling)))
    return played


def _next_stone(end: GameEnd) -> int:
    """Identifier of the stone that is delivered next."""
    return STONES_PER_TEAM * end.to_throw + end.number_of_stone


class Lying(NamedTuple):
    """Stones on the sheet in many ends in which the same team throws next.

    A stone keeps its column, so that its identifier follows from the column in every end. The last
    stone of the throwing team is not on the sheet: fifteen columns are enough.

    Parameters
    ----------
    places : (n, k, 2) sheet frame, NaN for missing stones [m]
    names : (k,) identifier of each column's stone
    order : (n, k) place of each stone among those of its end; -1 for missing stones
    """

    places: Floats
    names: list[int]
    order: Indices


def lying_in(ends: Sequence[GameEnd]) -> Lying:
    """Return the stones on the sheet in many ends."""
    identifiers = [
        STONES_PER_TEAM * team + number for end in ends for team, number, _, _ in end.stones
    ]
    names = sorted(set(identifiers))
    places = np.full((len(ends), len(names), 2), np.nan)
    order = np.full((len(ends), len(names)), -1)
    if names:
        counts = [len(end.stones) for end in ends]
        there = np.repeat(np.arange(len(ends)), counts), np.searchsorted(names, identifiers)
        lie = [value for end in ends for stone in end.stones for value in stone[2:]]
        places[there] = np.array(lie).reshape(-1, 2) + np.array([0.0, TEE_Y])
        order[there] = [k for count in counts for k in range(count)]
    return Lying(places, names, order)


def sweeps_of(
    simulator: GameSimulator, calls: Sequence[Call], thrown: Floats
) -> Sequence[SweepInterval]:
    """Return the interval in which each delivery is swept.

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
    """Deliveries in many ends, simulated together.

    Parameters
    ----------
    ends : the ends before them
    calls : what the players called for
    thrown : (n, 4) x, speed, angle and spin of the throws as they left the hand
    sweeps : when each stone was swept
    lying : the stones before them
    after : the positions afterwards
    moved : (n, k) whether something touched the stone of each column
    field : what simulated them
    put_back_in : the rows in which, after a tick, the stones were put back
    """

    ends: Sequence[GameEnd]
    calls: Sequence[Call]
    thrown: Floats
    sweeps: Sequence[SweepInterval]
    lying: Lying
    after: Positions
    moved: Flags
    field: Field
    put_back_in: set[int]


class BatchShot(PlayedShot):
    """Delivery in one of many ends; its outcome has no contacts and no paths.

    Most of it is computed from the deliveries on first access, which is rare.
    """

    def __init__(self, deliveries: Deliveries, row: int, end: GameEnd, ruling: Ruling) -> None:
        put = object.__setattr__  # the class is frozen, and `vars` would create a dictionary
        put(self, "team", end.to_throw)
        put(self, "ruling", ruling)
        put(self, "_deliveries", deliveries)
        put(self, "_row", row)

    def __getattr__(self, name: str) -> Any:
        parts = vars(self)
        if "_deliveries" not in parts:
            raise AttributeError(name)
        parts.update(_parts_of(parts.pop("_deliveries"), parts.pop("_row")))
        return getattr(self, name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PlayedShot) and _whole(self) == _whole(other)

    __hash__ = PlayedShot.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        return _whole, (_whole(self),)


def _whole(shot: PlayedShot) -> PlayedShot:
    """Return the complete delivery."""
    return PlayedShot(**{part.name: getattr(shot, part.name) for part in fields(PlayedShot)})


def _parts_of(deliveries: Deliveries, row: int) -> dict[str, Any]:
    """Return the fields of a `PlayedShot`, except its team and ruling."""
    end = deliveries.ends[row]
    x, speed, angle, spin = deliveries.thrown[row].tolist()
    return {
        "end": end.number,
        "number": end.delivered,
        "stone": _next_stone(end),
        "call": deliveries.calls[row],
        "thrown": Throw(speed=speed, angle=angle, spin=spin, x=x),
        "sweep": deliveries.sweeps[row],
        "direction": DIRECTION,
        "outcome": _outcome(deliveries, row),
        "put_back": row in deliveries.put_back_in,
    }


def _outcome(deliveries: Deliveries, row: int) -> Outcome:
    end, after = deliveries.ends[row], deliveries.after
    identifiers = [stone.stone for stone in end.stones]
    own = [deliveries.lying.names.index(identifier) for identifier in identifiers]
    columns, time = [*own, -1], float(after.time[row])
    status: list[str] = deliveries.field.statuses(after, DIRECTION)[row, columns].tolist()
    last: list[list[float]] = after.last[row, columns].tolist()
    moved: list[bool] = deliveries.moved[row, own].tolist()
    return Outcome(
        stones=tuple(
            StoneState(x=x, y=y, stone=identifier)
            for identifier, (x, y) in zip([*identifiers, _next_stone(end)], last, strict=True)
        ),
        status=tuple(map(Status, status)),
        time=time,
        ends=tuple(time if one else 0.0 for one in (*moved, True)),
        contacts=(),
    )
