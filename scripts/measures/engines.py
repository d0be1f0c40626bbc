"""Comparison of the engines: mutual, with Digital Curling's server, and in the environments.

Both engines slide stones in the same way; one solves contacts with pymunk, the other with its own
solver, and their tolerances differ. In very close cases, such as grazes, both are right although
the places differ.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import gymnasium
import numpy as np

from agents.digital_curling import HACK_TO_TEE, SPIN, transition
from curling_env import Ice, Throw, load_ice
from curling_env.physics import QUICK_TOLERANCE, Engine, StoneState, play_batch, play_bounds
from curling_env.sheet import HACK_Y, HOG_LINE_Y, TEE_Y, Direction
from curling_env.throw import Release
from curling_env.typing import Floats

STONES = 8
MOVED = 1e-4
"""Distance from its place beyond which a stone counts as moved [m]."""
LAST_BUT_ONE = 14
"""Number of a shot late enough that no guard is protected, before the last of the end."""


# --- shots into random positions ----------------------------------------------------------------


class Shots(NamedTuple):
    """Positions (n, 8, 2) with NaN where there is no stone, and a throw at each."""

    stones: Floats
    throws: list[Throw]

    @property
    def mirrored(self) -> Shots:
        """Return the mirror images of the shots."""
        throws = [Throw(speed=t.speed, angle=-t.angle, spin=-t.spin) for t in self.throws]
        return Shots(self.stones * np.array([-1.0, 1.0]), throws)


def random_shots(ice: Ice, count: int, seed: int, *, frozen: bool = False) -> Shots:
    """Return hard shots; with `frozen`, two stones of each position touch each other."""
    rng = np.random.default_rng(seed)
    stones = np.array([_position(rng, ice.stone.radius, frozen) for _ in range(count)])
    return Shots(stones, [_shot(rng, ice, lying) for lying in stones])


def _position(rng: np.random.Generator, radius: float, frozen: bool) -> Floats:
    """Return random stones around the house, (8, 2), one possibly frozen to another; NaN: none."""
    stones = np.full((STONES, 2), np.nan)
    count = int(rng.integers(1, STONES + 1))
    for k in range(count):
        while True:
            place = rng.uniform((-1.5, TEE_Y - 4.0), (1.5, TEE_Y + 1.6))
            if frozen and k == 1:
                turn = rng.uniform(0, 2 * np.pi)
                place = stones[0] + 2 * radius * np.array([np.cos(turn), np.sin(turn)])
            apart = np.hypot(*(stones[:k] - place).T)
            if k == 0 or (apart > 2 * radius + (-1e-9 if frozen and k == 1 else 1e-3)).all():
                break
            if frozen and k == 1:
                stones[0] = rng.uniform((-1.5, TEE_Y - 4.0), (1.5, TEE_Y + 1.6))
        stones[k] = place
    return stones


def _shot(rng: np.random.Generator, ice: Ice, stones: Floats) -> Throw:
    """Return a throw that passes near a stone of the position."""
    spin = float(rng.choice([-1.5, 1.5]))
    speed = rng.uniform(2.1, 3.6)
    aim = stones[int(rng.integers(np.isfinite(stones[:, 0]).sum()))]
    aside = rng.uniform(-2.2, 2.2) * ice.stone.radius
    # Curl takes a draw about 1.2 m aside, a hit less.
    curl = 1.2 * spin / 1.5 * (2.1 / speed) ** 2
    return Throw(speed=speed, angle=-(aim[0] + aside + curl) / (aim[1] + 10.97), spin=spin)


def in_batch(ice: Ice, shots: Shots, *, tabulated: bool = False) -> Floats:
    """Return the places after each shot by the batch at its bulk tolerance, (n, 9, 2)."""
    return play_batch(
        ice,
        shots.stones,
        [throw.release() for throw in shots.throws],
        bounds=play_bounds(ice, Direction.AWAY),
        tolerance=QUICK_TOLERANCE,
        tabulated=tabulated,
    ).last


def in_engine(ice: Ice, shots: Shots) -> Floats:
    """Return the places after each shot by the engine with pymunk, (n, 9, 2)."""
    engine = Engine(ice)
    places = np.full((len(shots.stones), STONES + 1, 2), np.nan)
    for k, (lying, throw) in enumerate(zip(*shots, strict=True)):
        here = np.isfinite(lying[:, 0])
        resting = [StoneState(x=x, y=y) for x, y in lying[here].tolist()]
        outcome = engine.play(throw.release(), resting)
        where = np.array([(stone.x, stone.y) for stone in outcome.stones])
        places[k, :-1][here] = where[:-1]
        places[k, -1] = where[-1]
    return places


def furthest(a: Floats, b: Floats) -> Floats:
    """Return the largest difference of any stone, for each shot [mm]."""
    return np.nanmax(1e3 * np.hypot(*np.moveaxis(a - b, -1, 0)), axis=1)


# --- ends of the environments --------------------------------------------------------------------


def ends_apart(ends: int, seed: int = 0) -> tuple[float, float]:
    """Play ends in the vector environment and alone, with the same random actions and seeds.

    Returns
    -------
    share of ends that are scored differently, and of those with a stone more than 1 cm apart
    """
    options: dict[str, Any] = {"opponent": "draw", "details": True}
    many: Any = gymnasium.make_vec(
        "CurlingEnd-v0", num_envs=ends, autoreset_mode="Disabled", **options
    )
    many.reset(seed=seed)
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (8, ends, 3)).astype(np.float32)
    over, together = np.zeros(ends, dtype=bool), dict[str, Any]()
    for step in actions:
        *_, over, _, together = many.step(step)
    assert over.all()
    alone: Any = gymnasium.make("CurlingEnd-v0", **options).unwrapped
    apart, scored = np.zeros(ends), 0
    for k in range(ends):
        alone.reset(seed=seed + k)
        info: dict[str, Any] = {}
        for step in actions:
            *_, info = alone.step(step[k])
        scored += (info["score"] != together["score"][k]).any()
        ours, theirs = together["shots"][k][-1].stones_after, info["shots"][-1].stones_after
        same = {stone.stone for stone in ours} == {stone.stone for stone in theirs}
        pairs = zip(sorted(ours), sorted(theirs), strict=False)
        far = [np.hypot(a.x - b.x, a.y - b.y) for a, b in pairs]
        apart[k] = max(far, default=0.0) if same else np.inf
    return scored / ends, float((apart > 0.01).mean())


# --- shots that Digital Curling's server played ---------------------------------------------------


def by_transition(shot: dict[str, Any]) -> Floats:
    """Return positions after a shot by `transition`, (n, 2) from the tee; NaN: out."""
    slots: dict[str, list[Any]] = {"team0": [None] * 8, "team1": [None] * 8}
    for stone in shot["stones"]:
        place = {"x": stone["x"], "y": stone["y"] + HACK_TO_TEE}
        slots[f"team{stone['team']}"][stone["slot"]] = {"angle": 0.0, "position": place}
    state = {
        "end": 0, "shot": LAST_BUT_ONE, "hammer": "team1", "stones": slots,
        "scores": {"team0": [None], "team1": [None]},
    }  # fmt: skip
    after = transition(state, shot["move"], {"max_end": 1})["stones"]
    entries = [after[f"team{stone['team']}"][stone["slot"]] for stone in shot["stones"]]
    return np.array(
        [
            [np.nan] * 2 if entry is None
            else [entry["position"]["x"], entry["position"]["y"] - HACK_TO_TEE]
            for entry in (*entries, after["team0"][LAST_BUT_ONE // 2])
        ]
    )  # fmt: skip


def by_engine(shot: dict[str, Any]) -> Floats:
    """Return the same by the engine with pymunk."""
    stones = [StoneState(x=x, y=y) for x, y in _lying(shot).tolist()]
    outcome = Engine(load_ice("fcv1")).play(_release_of(shot), stones)
    places = np.array([(stone.x, stone.y) for stone in outcome.stones])
    places[[status.value.startswith("out") for status in outcome.status]] = np.nan
    return _past_hog_line(places)


def by_batch(shot: dict[str, Any]) -> Floats:
    """Return the same by the batch."""
    ice = load_ice("fcv1")
    bounds = play_bounds(ice, Direction.AWAY)
    played = play_batch(ice, _lying(shot)[None], [_release_of(shot)], bounds=bounds)
    return _past_hog_line(played.xy[0])


PLAYED = {"transition": by_transition, "engine": by_engine, "batch": by_batch}
"""Three methods that repeat shots of the server."""


def off_server(shot: dict[str, Any], found: Floats) -> tuple[bool, list[float]]:
    """Compare the places after a shot with the server's.

    Parameters
    ----------
    shot : stones (team, slot, x, y from the tee), the move as it is sent, and where these stones
        and the thrown one lay afterwards (null: out)
    found : (n, 2) places from the tee; NaN: out

    Returns
    -------
    whether the same stones are in play, and the distances of those that moved [mm]
    """
    wanted = np.array([[np.nan] * 2 if xy is None else xy for xy in shot["after"]])
    before = np.vstack([_lying(shot) - [0.0, TEE_Y], [[np.nan] * 2]])
    moved = ~(np.hypot(*(wanted - before).T) < MOVED)
    apart = 1e3 * np.hypot(*(found - wanted).T)
    alike = np.array_equal(np.isnan(found[:, 0]), np.isnan(wanted[:, 0]))
    return alike, apart[moved & np.isfinite(apart)].tolist()


def _release_of(shot: dict[str, Any]) -> Release:
    velocity, sign = shot["move"]["velocity"], -1 if shot["move"]["rotation"] == "cw" else 1
    return Release(x=0.0, y=-HACK_Y, vx=velocity["x"], vy=velocity["y"], omega=sign * SPIN)


def _lying(shot: dict[str, Any]) -> Floats:
    return np.array([(s["x"], s["y"] + TEE_Y) for s in shot["stones"]]).reshape(-1, 2)


def _past_hog_line(places: Floats) -> Floats:
    """Return positions from the tee, without stones that the server removes at the hog line."""
    places = places - [0.0, TEE_Y]
    places[~(places[:, 1] - 0.145 > HOG_LINE_Y - TEE_Y)] = np.nan
    return places
