"""The demo's chapter on what a model lacks: a hidden curl is found, and a draw planned again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from agents.closed_loop.filming import estimate
from agents.learning.evaluation import rest_in_env
from agents.planning import plan
from curling_env.ice import Ice
from curling_env.storage import make_directory
from curling_env.trajectory import Trajectory
from curling_env.typing import Floats

HIDDEN = "curl"


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
            f"The same films, read with a model that has no {HIDDEN}: a draw planned on it misses "
            f"by {100 * self.miss_before:.0f} cm; discovery names {named}; planned again, the draw "
            f"misses by {100 * self.miss_after:.0f} cm."
        )


def without_curl(ice: Ice) -> Ice:
    """What a coach believes who has never turned a stone."""
    return replace(ice, effects=tuple(e for e in ice.effects if e.name != HIDDEN))


def find_what_is_missing(
    folder: Path, truth: Ice, tracks: list[Trajectory], law: Ice, target: Floats, *, seed: int
) -> Missing:
    """Read films with a model that has no curl, discover it, and plan a draw before and after.

    Parameters
    ----------
    folder : gets discovery's report and ice files
    truth : the ice that was filmed; only the draws are thrown on it
    tracks : of the films
    law : of the ice as it is known, curl included; a coach who has never turned a stone knows less
    target : of the draw, sheet frame [m]

    Raises
    ------
    OutputError : a file cannot be written
    """
    from friction_estimation.discovery.discover import discover
    from friction_estimation.discovery.report import baseline_ice, improved_ice, write_files
    from friction_estimation.reports.discovery_page import write_report_page

    folder = make_directory(folder)
    found = discover(tracks, estimate(tracks, without_curl(law)), seed=seed)
    report = write_files(found, folder)
    write_report_page(found, report, folder / "report.html")
    rests = [
        rest_in_env(truth, plan(_certain(ice), target, skill="none").best.throw, target)
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
