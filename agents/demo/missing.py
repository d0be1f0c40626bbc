"""The demo's chapter on what a model lacks: a hidden curl is found, and a draw planned again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from agents.evaluate import rest_in_env
from agents.planning import plan
from curling_env.ice import Ice, load_ice
from curling_env.physics.slide import slide
from curling_env.sheet import Direction
from curling_env.storage import make_directory
from curling_env.throw import Throw
from curling_env.trajectory import Trajectory, write_tracks

Floats = NDArray[np.float64]

HIDDEN = "curl"
THROWS = 12
"""Throws in both directions, with both handles: eight are the fewest that name anything."""
FPS = 15.0
POSITION_NOISE, HEADING_NOISE = 0.003, 0.015
"""Of a camera above the sheet, about that of tracked films [m, rad]."""


@dataclass(frozen=True, kw_only=True)
class Missing:
    """What was hidden, found, and gained.

    Parameters
    ----------
    names : of the effects that were named
    verdict : the report's sentence
    target : (2,) of the draw, sheet frame [m]
    before, after : (2,) where it rested on the hidden ice, planned on the model without and with
        what was found [m]
    """

    names: list[str]
    verdict: str
    target: Floats
    before: Floats
    after: Floats

    @property
    def miss_before(self) -> float:
        """Distance from the target [m]."""
        return float(np.hypot(*(self.before - self.target)))

    @property
    def miss_after(self) -> float:
        """Distance from the target [m]."""
        return float(np.hypot(*(self.after - self.target)))

    def sentence(self) -> str:
        """The chapter in one sentence."""
        named = " and ".join(self.names) or "nothing"
        return (
            f"Ice with a hidden {HIDDEN}: a draw planned without it misses by "
            f"{100 * self.miss_before:.0f} cm; discovery names {named}; planned again, the draw "
            f"misses by {100 * self.miss_after:.0f} cm."
        )


def without_curl(ice: Ice) -> Ice:
    """What a coach believes who has never turned a stone."""
    return replace(ice, effects=tuple(e for e in ice.effects if e.name != HIDDEN))


def tracked_throws(ice: Ice, n: int, rng: np.random.Generator) -> list[Trajectory]:
    """Throws up and down the ice, as a camera above it would report them."""
    tracks: list[Trajectory] = []
    speeds = rng.permutation(np.linspace(1.4, 2.6, n))
    for k in range(n):
        throw = Throw(
            speed=float(speeds[k]),
            angle=float(rng.normal(0.0, 0.01)),
            spin=float((-1.0) ** (k // 2) * rng.uniform(0.8, 2.0)),
            x=float(rng.uniform(-0.5, 0.5)),
        )
        direction = Direction.AWAY if k % 2 == 0 else Direction.HOME
        release = throw.release(direction, clock=60.0 * k, order=k)
        path = slide(ice, release, fps=FPS, throw=k).trajectory
        assert path is not None  # a rate was given
        xy = path.xy + rng.normal(0.0, POSITION_NOISE, path.xy.shape)
        theta = path.theta + rng.normal(0.0, HEADING_NOISE, len(path))
        tracks.append(replace(path, xy=xy, theta=theta))
    return tracks


def find_what_is_missing(
    folder: Path, target: Floats, *, seed: int, throws: int = THROWS
) -> Missing:
    """Hide a curl, track throws, discover it, and plan a draw before and after.

    Parameters
    ----------
    folder : gets tracks.csv and discovery's report and ice files
    target : of the draw, sheet frame [m]

    Raises
    ------
    OutputError : a file cannot be written
    """
    from friction_estimation.discrepancy.discovery import discover
    from friction_estimation.discrepancy.page import write_report_page
    from friction_estimation.discrepancy.verdict import baseline_ice, improved_ice, write_files

    folder = make_directory(folder)
    rng = np.random.default_rng([seed, 1])
    standard = load_ice("standard")
    mu = standard.friction.mu * rng.uniform(0.96, 1.04)
    factor = rng.uniform(0.7, 1.2)
    hidden = replace(
        standard,
        friction=replace(standard.friction, mu=mu),
        effects=tuple(
            replace(e, parameters={**e.parameters, "strength": factor * e.parameters["strength"]})
            if e.name == HIDDEN
            else e
            for e in standard.effects
        ),
    )
    tracks = tracked_throws(hidden, throws, rng)
    write_tracks(folder / "tracks.csv", tracks)
    found = discover(tracks, without_curl(standard), seed=seed)
    report = write_files(found, folder)
    write_report_page(found, report, folder / "report.html")
    rests = [
        rest_in_env(hidden, plan(_certain(ice), target, skill="none").best.throw, target)
        for ice in (baseline_ice(found), improved_ice(found))
    ]
    return Missing(
        names=[proof.label for proof in found.proofs],
        verdict=report["verdict"],
        target=target,
        before=rests[0],
        after=rests[1],
    )


def _certain(ice: Ice) -> Ice:
    return replace(ice, friction=replace(ice.friction, sigma=np.zeros(ice.sheet.shape)))
