"""By how much the two engines differ: shots into positions of one to eight stones, played by both.

    python scripts/engine_agreement.py [--shots 500] [--seed 0] [--ice standard]

Both slide stones in the same way; one has pymunk solve contacts, the other solves them itself, and
their tolerances differ. Where a hair's breadth decides, both are right, and the places
differ. To say how often that is, every shot is also played by one engine with its stones moved by
a thousandth of a millimetre.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from curling_env import Ice, Throw, load_ice
from curling_env.physics import (
    FINE_TOLERANCE,
    QUICK_TOLERANCE,
    Engine,
    StoneState,
    play_batch,
    play_bounds,
)
from curling_env.sheet import TEE_Y, Direction
from curling_env.typing import Floats, Integers

STONES = 8
NUDGE = 1e-6
NUDGED = "batch, stones nudged by 1 µm"
HEAPS = (3, 6, 10, 15)
"""Numbers of touching stones."""


def position(rng: np.random.Generator, radius: float, frozen: bool) -> Floats:
    """Random stones around the house, (8, 2); one of them may lie frozen to another. NaN: none."""
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


def shot(rng: np.random.Generator, ice: Ice, stones: Floats) -> Throw:
    """A throw that would come near a stone of the position."""
    spin = float(rng.choice([-1.5, 1.5]))
    speed = rng.uniform(2.1, 3.6)
    aim = stones[int(rng.integers(np.isfinite(stones[:, 0]).sum()))]
    aside = rng.uniform(-2.2, 2.2) * ice.stone.radius
    # Curl takes a draw about 1.2 m aside, a hit less.
    curl = 1.2 * spin / 1.5 * (2.1 / speed) ** 2
    return Throw(speed=speed, angle=-(aim[0] + aside + curl) / (aim[1] + 10.97), spin=spin)


def played(
    ice: Ice, stones: Floats, releases: list, tolerance: float, tabulated: bool = False
) -> tuple[Floats, Integers]:
    """Places after each shot (n, 9, 2) and numbers of contacts."""
    bounds = play_bounds(ice, Direction.AWAY)
    after = play_batch(
        ice, stones, releases, bounds=bounds, tolerance=tolerance, tabulated=tabulated
    )
    return after.last, after.collisions.astype(np.int64)


def in_engine(ice: Ice, stones: Floats, releases: list) -> tuple[Floats, Integers]:
    """The same, by the engine with pymunk."""
    engine = Engine(ice)
    places, contacts = np.full((len(stones), STONES + 1, 2), np.nan), []
    for k, (lying, release) in enumerate(zip(stones, releases, strict=True)):
        here = np.isfinite(lying[:, 0])
        outcome = engine.play(release, [StoneState(x=x, y=y) for x, y in lying[here].tolist()])
        where = np.array([(stone.x, stone.y) for stone in outcome.stones])
        places[k, :-1][here] = where[:-1]
        places[k, -1] = where[-1]
        contacts.append(len(outcome.contacts))
    return places, np.array(contacts)


def furthest(a: Floats, b: Floats) -> Floats:
    """Largest difference of any stone, for each shot [mm]."""
    apart = 1e3 * np.hypot(*np.moveaxis(a - b, -1, 0))
    return np.nanmax(apart, axis=1)


def heap(rng: np.random.Generator, size: int, radius: float) -> Floats:
    """Stones over the tee that touch each other, in a chain or on a lattice, (size, 2)."""
    lattice = rng.random() < 0.5
    stones = np.zeros((1, 2))
    while len(stones) < size:
        turn = np.pi / 3 * rng.integers(6) if lattice else rng.uniform(0, 2 * np.pi)
        onto = stones[int(rng.integers(len(stones)))]
        place = onto + 2 * radius * np.array([np.cos(turn), np.sin(turn)])
        if np.hypot(*(stones - place).T).min() > 2 * radius - 1e-9:
            stones = np.vstack([stones, place])
    return stones * (1 + 1e-9) + [0.0, TEE_Y] - stones.mean(0)


def shots_at_heap(ice: Ice, size: int, seed: int, shots: int) -> tuple[int, float, float]:
    """Play hard shots at touching stones in the batch.

    Returns
    -------
    number of shots after which stones never rest, largest overlap [mm], processor time each [ms]
    """
    bounds = play_bounds(ice, Direction.AWAY)
    reach = 2 * ice.stone.radius
    rng = np.random.default_rng(seed)
    stones = np.array([heap(rng, size, ice.stone.radius) for _ in range(shots)])
    beyond = (np.abs(stones[:, :, 0]) > bounds[1] - 0.01) | (stones[:, :, 1] > bounds[3] - 0.01)
    stones[beyond] = np.nan
    releases = [
        Throw(speed=rng.uniform(2.3, 5.5), spin=1.0, x=rng.uniform(-0.3, 0.3)).release()
        for _ in range(shots)
    ]
    play_batch(ice, stones[:1], releases[:1], bounds=bounds)  # compiles
    begun = time.process_time()
    after = play_batch(ice, stones, releases, bounds=bounds)
    spent = 1e3 * (time.process_time() - begun) / shots
    apart = np.hypot(*np.moveaxis(after.xy[:, :, None] - after.xy[:, None], -1, 0))
    apart[:, np.arange(size + 1), np.arange(size + 1)] = np.nan
    return int((after.collisions < 0).sum()), 1e3 * float(reach - np.nanmin(apart)), spent


def differences(
    ice: Ice, shots: int, seed: int, *, frozen: bool
) -> tuple[dict[str, Floats], Integers]:
    """Play random shots in both engines.

    Parameters
    ----------
    ice, shots, seed : ice, number of shots and seed of stones and throws
    frozen : whether two stones of each position touch each other

    Returns
    -------
    largest difference of any stone in each shot [mm], by the pair that is compared, (n,) each;
    and the numbers of contacts in the engine, (n,)
    """
    rng = np.random.default_rng(seed)
    stones = np.array([position(rng, ice.stone.radius, frozen) for _ in range(shots)])
    releases = [shot(rng, ice, lying).release() for lying in stones]
    engine, contacts = in_engine(ice, stones, releases)
    fine, _ = played(ice, stones, releases, FINE_TOLERANCE)
    quick, _ = played(ice, stones, releases, QUICK_TOLERANCE)
    tabled, _ = played(ice, stones, releases, QUICK_TOLERANCE, tabulated=True)
    nudged, _ = played(ice, stones + np.array([NUDGE, 0.0]), releases, FINE_TOLERANCE)
    found = {
        "engine and batch, fine": furthest(engine, fine),
        "engine and batch, quick": furthest(engine, quick),
        "engine and batch, quick, law from a table": furthest(engine, tabled),
        NUDGED: furthest(fine, nudged),
    }
    return found, contacts


def line(name: str, off: Floats) -> str:
    figures = [np.median(off), *np.percentile(off, (90, 99)), off.max(), 100 * (off > 20).mean()]
    return f"{name:<44}{len(off):>6}" + "".join(f"{figure:>10.3g}" for figure in figures)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shots", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--ice", default="standard")
    chosen = parser.parse_args()
    ice = load_ice(chosen.ice)
    print(f"{'largest difference of any stone [mm]':<44}{'shots':>6}"
          f"{'median':>10}{'90 %':>10}{'99 %':>10}{'max':>10}{'>20 mm %':>10}")  # fmt: skip
    for frozen in (False, True):
        found, contacts = differences(ice, chosen.shots, chosen.seed, frozen=frozen)
        kind = "frozen pair" if frozen else "loose"
        for name, off in found.items():
            print(line(f"{kind}: {name}", off))
            for number, some in (
                ("one contact", contacts == 1),
                ("two", contacts == 2),
                ("three or more", contacts > 2),
            ):
                if some.any() and name != NUDGED:
                    print(line(f"  {number}", off[some]))
    print(f"\n{'shots at touching stones':<34} shots  no rest  overlap mm  ms each")
    for size in HEAPS:
        never, overlap, spent = shots_at_heap(ice, size, chosen.seed, chosen.shots)
        print(f"{size:<34}{chosen.shots:>6}{never:>9}{overlap:>12.3f}{spent:>9.3f}")


if __name__ == "__main__":
    main()
