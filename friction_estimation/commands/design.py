"""`curling design`: throws to make before any is measured."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from curling_env.commands.options import Measured, grouped, numbers, option, output_to
from curling_env.commands.outputs import Writes
from curling_env.commands.terminal import progress_bar

MAX_SPEEDS = 24
"""Maximum number of speeds, each of which is combined with every line and spin."""


@dataclass(frozen=True, kw_only=True)
class Wish:
    """Map and camera"""

    resolution: float = option(2.0, "Wanted detail of the map: smallest structure resolved [m].")
    precision: float = option(2.0, "Wanted error of mu [%].", min=0.01, max=100)
    noise: float = option(0.005, "Independent error of a position [m].", min=1e-6, max=10)
    fps: float = option(30.0, "Frames per second of the camera.", min=0.1, max=10_000)
    mu: float = option(0.009, "Expected friction.", min=1e-4, max=1)
    spread: float = option(5.0, "Expected variation of mu over the sheet [%].", min=0.01, max=100)
    speeds: str | None = option(None, "Possible speeds at the hog line [m/s].", metavar="V,V...")
    ice: str | None = option(None, "Ice with the sheet; else the paper's.", metavar="ICE")


@grouped
def design(
    *,
    wish: Wish,
    output: Annotated[
        Path | None,
        output_to("RELEASES.csv", "Also write the throws as releases."),
        Writes(kinds=("releases",)),
    ] = None,
    results: Measured,
) -> None:
    """Choose throws that measure a friction map with a given detail and error.

    \b
    Examples:
        curling design --resolution 2 --precision 1
        curling design --precision 1.5 --noise 0.002 --fps 60
        curling design --speeds 1.8,2.0,2.4 -o releases.csv

    The command chooses the fewest throws that reach the error at the Cramér-Rao bound, which no
    estimator can beat; make some more. The error is that of a cell between the tees and
    within 1.5 m of the centre line; the JSON also has the error after every throw.
    """
    from curling_env.ice import load_ice
    from curling_env.sheet import PAPER_SHEET
    from curling_env.throw import write_releases
    from friction_estimation.design.design import design_throws

    form = f"up to {MAX_SPEEDS} numbers separated by commas, such as 1.6,2.2"
    counts = range(1, MAX_SPEEDS + 1)
    given = wish.speeds
    speeds = None if given is None else numbers(given, "--speeds", form, counts=counts)
    with progress_bar() as bar:
        found = design_throws(
            resolution=wish.resolution,
            precision=wish.precision / 100,
            noise=wish.noise,
            fps=wish.fps,
            mu=wish.mu,
            spread=wish.spread / 100,
            speeds=speeds,
            sheet=PAPER_SHEET if wish.ice is None else load_ice(wish.ice).sheet,
            progress=bar,
        )
    if output is not None:
        write_releases(output, [kind.release for kind in found.kinds])
    results.show(found.summary(), found.in_words(results.units))
