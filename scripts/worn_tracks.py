"""How tracks that earlier stones have worn move draws, as it depends on what feels them.

    python scripts/worn_tracks.py

Draws on the ice `standard`, from one end, on which others were played before: where the next ones
rest and how far they turn. Each contact feels the ice under it; of that are told apart: no wear,
wear under the centre of the stone in cells of 0.1 m, and in the cells of 0.5 m that the ice has.
"""

from __future__ import annotations

import numpy as np

from curling_env.ice import ActiveEffect, Ice, load_ice
from curling_env.physics import IceInUse, Slide, slide
from curling_env.throw import Release, Throw

SESSIONS = 6
JUDGED = 4
"""Draws of a session that are looked at, after those that only wear the ice."""
SETTINGS = ((-0.003, 16), (-0.003, 64), (-0.01, 16))
"""Change of friction by one pass, and draws that were played before."""


def draws(rng: np.random.Generator, count: int) -> list[Release]:
    """Draws to the house, both ways of turning, as skilled players throw them."""
    return [
        Throw(
            speed=float(rng.normal(2.09, 0.03)),
            angle=float(side * -0.045 + rng.normal(0, 0.004)),
            spin=float(side * rng.uniform(1.2, 1.8)),
            x=float(rng.normal(0, 0.03)),
        ).release(order=k)
        for k, side in enumerate(rng.choice([-1, 1], count))
    ]


def worn_by(ice: Ice, felt: str, wear: float) -> IceInUse:
    """An ice that wears, before the first stone."""
    return IceInUse(ice.with_effect(ActiveEffect(name="pebble_wear", parameters={felt: wear})))


def moved(wear: float, before: int, sessions: int = SESSIONS) -> dict[str, np.ndarray]:
    """Compare rests on ice that each contact feels with those on ice felt otherwise.

    Parameters
    ----------
    wear : change of friction by one pass
    before : number of draws before those that are judged
    sessions : number of sessions, each with its own draws

    Returns
    -------
    differences across and along the sheet [cm] and of the heading [degrees], (draws, 3), by how
    the wear is felt
    """
    standard = load_ice("standard")
    apart: dict[str, list[np.ndarray]] = {}
    for seed in range(sessions):
        true = worn_by(standard, "under_contacts", wear)
        others = {
            "unworn": IceInUse(standard),
            "under the centre, 0.1 m": worn_by(standard.refined(5), "along_path", wear),
            "under the centre, 0.5 m": worn_by(standard, "along_path", wear),
        }
        for k, release in enumerate(draws(np.random.default_rng(seed), before + JUDGED)):
            here = slide(true.now, release, fps=30.0)
            if k >= before:
                for name, ice in others.items():
                    there = slide(ice.now, release)
                    apart.setdefault(name, []).append(_apart(there, here))
            assert here.trajectory is not None  # a rate was given
            for ice in (true, *others.values()):
                ice.ran(here.trajectory.xy)
    return {name: np.array(rows) for name, rows in apart.items()}


def main() -> None:
    print(
        "wear, draws before | otherwise | rest across, along [cm], turned [degrees]: median | most"
    )
    for wear, before in SETTINGS:
        for name, rows in moved(wear, before).items():
            middle, most = np.median(rows, axis=0), np.max(rows, axis=0)
            print(f"{wear:+.1%}, {before} | {name} | {_row(middle)} | {_row(most)}")


def _apart(one: Slide, other: Slide) -> np.ndarray:
    turned = np.degrees(one.theta - other.theta)
    return np.abs([100 * (one.x - other.x), 100 * (one.y - other.y), turned])


def _row(numbers: np.ndarray) -> str:
    return ", ".join(f"{number:.2f}" for number in numbers)


if __name__ == "__main__":
    main()
