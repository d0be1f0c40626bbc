"""Whether stones rest where the standard errors of a discovered ice say that they may.

    python scripts/rest_coverage.py --seed 20261130 --kinds "model given" --sessions 6

Makes blind sessions (`blind/`), discovers the ice of each, and slides throws both ways and with
both spins on what was found and on the sealed truth. How far they lie apart is held against the
spread of the ices that may be: with the errors that the file says go together, and with the same σ
all independent, as files had them before.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from blind.families import KINDS, Task, plan
from blind.law import HOG
from blind.planned_draws import TrueIce

from curling_env import load_ice
from curling_env.ice import Ice
from curling_env.infrastructure.files.storage import write_table
from curling_env.physics import SlideEnd, plausible_ices, release_table, throw_batch
from curling_env.sheet import TEE_Y
from curling_env.throw import Release
from curling_env.trajectory import read_tracks
from curling_env.typing import Flags, Floats
from friction_estimation.discovery.discover import discover

ICES = 200
"""Ices that are drawn of each discovered one."""
SPEEDS = np.linspace(1.6, 2.7, 56)
"""From which draws are chosen [m/s]."""
PAST_TEE = (-1.5, 0.5)
"""Where the chosen ones rest on the discovered ice [m]."""
SPIN = 1.5
"""To either side [rad/s]."""
WITHIN = 1.96
"""Standard deviations to either side of a 95 % interval."""

Thrown = tuple[float, float, float]
"""Direction, speed and spin."""


def independent(ice: Ice) -> Ice:
    """The ice with the same standard errors, of which none go together."""
    effects = tuple(replace(effect, common={}) for effect in ice.effects)
    return replace(ice, friction=replace(ice.friction, level=None), effects=effects)


def rests(ices: list[Ice], throws: list[Thrown]) -> tuple[Floats, Flags]:
    """Where throws rest on ices, (ices, throws, 2) [m], and whether they do."""
    releases = release_table(
        [
            Release(x=0.0, y=-way * HOG, vx=0.0, vy=way * speed, theta=0.0, omega=spin)
            for way, speed, spin in throws
        ]
    )
    which = np.repeat(np.arange(len(ices)), len(throws))
    found = throw_batch(ices, np.tile(releases, len(ices)), which=which)
    shape = len(ices), len(throws)
    xy = np.stack([found.x, found.y], axis=-1).reshape(*shape, 2)
    return xy, (found.end == SlideEnd.REST).reshape(shape)


def draws_on(ice: Ice) -> list[Thrown]:
    """Draws both ways with both spins that rest near the tee on an ice."""
    chosen: list[Thrown] = []
    for way in (1.0, -1.0):
        for spin in (SPIN, -SPIN):
            throws = [(way, float(speed), spin) for speed in SPEEDS]
            xy, rested = rests([ice], throws)
            past = np.where(rested[0], way * xy[0, :, 1] - TEE_Y, np.inf)
            if rested.any():
                chosen += [throws[int(np.argmin(np.abs(past - place)))] for place in PAST_TEE]
    return chosen


def judge(ice: Ice, sealed: dict[str, Any]) -> dict[str, Floats]:
    """Where draws on the true ice rest from those on another, and the spreads, (throws, 2) [m]."""
    throws = draws_on(ice)
    numbers = np.array(sealed["numbers"])
    pattern = np.array(sealed["pattern"]).reshape(-1, 3)
    true = [
        TrueIce(numbers=numbers, pattern=pattern, direction=way).rest(
            np.array([speed, 0.0, spin]), (0.0, 0.0)
        )
        for way, speed, spin in throws
    ]
    found = {"off": np.array(true) - rests([ice], throws)[0][0]}
    for name, drawn in (("common", ice), ("independent", independent(ice))):
        xy, rested = rests(plausible_ices(drawn, ICES, np.random.default_rng(0)), throws)
        found[name] = np.nanstd(np.where(rested[..., None], xy, np.nan), axis=0)
    return found


def discovered(task: Task, seed: int) -> tuple[Ice, dict[str, Any]]:
    """The ice that is discovered from a session's tracks, and the sealed truth."""
    columns, truth = task.make(seed, film=False)
    seen = np.array(columns["throw"]) < task.throws
    with TemporaryDirectory() as folder:
        path = Path(folder) / "tracks.csv"
        write_table(path, {k: np.array(v)[seen].tolist() for k, v in columns.items()})
        found = discover(read_tracks(path), load_ice("standard") if task.given else None)
    return found.improved_ice(), json.loads(json.dumps(truth, default=float))


def pooled(judged: list[dict[str, Floats]], name: str) -> tuple[Floats, Floats]:
    """Errors and standard errors along the sheet of the draws of all sessions, (draws,) each [m].

    Parameters
    ----------
    name : of the standard errors, `common` or `independent`
    """
    off, spread = (np.concatenate([one[k] for one in judged])[:, 1] for k in ("off", name))
    return off, spread


def table(judged: list[dict[str, Floats]]) -> str:
    """How often draws rest within the intervals along the sheet, and how large these are.

    Draws of one session share most of its errors: how sure a share is follows from the sessions'.
    """
    off, _ = pooled(judged, "common")
    sessions = "1 session" if len(judged) == 1 else f"{len(judged)} sessions"
    lines = [f"{len(off)} draws of {sessions}, off by {_rms(off):.1f} mm rms along"]
    for name in ("independent", "common"):
        _, spread = pooled(judged, name)
        inside = [np.abs(one["off"][:, 1]) < WITHIN * one[name][:, 1] for one in judged]
        error = ""
        if len(judged) > 1:
            by_session = np.std([part.mean() for part in inside], ddof=1)
            error = f" ± {100 * by_session / np.sqrt(len(judged)):.1f}"
        lines.append(
            f"{name:12} σ {_rms(spread):5.1f} mm, {100 * np.concatenate(inside).mean():.1f}{error} "
            f"% within 95 %, rms of errors over σ {np.sqrt(np.mean((off / spread) ** 2)):.2f}"
        )
    return "\n".join(lines)


def _rms(metres: Floats) -> float:
    """Root mean square [mm]."""
    return 1e3 * float(np.sqrt(np.mean(metres**2)))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--kinds",
        nargs="+",
        metavar="KIND",
        default=["model given", "map"],
        choices=KINDS,
        help=f"families of sessions: {'; '.join(KINDS)}",
    )
    parser.add_argument("--sessions", type=int, default=4, help="the first of each kind")
    arguments = parser.parse_args()
    if arguments.sessions < 1:
        parser.error("--sessions must be 1 or more")
    judged: list[dict[str, Floats]] = []
    for kind in arguments.kinds:
        for task in plan([kind], 1)[: arguments.sessions]:
            judged.append(judge(*discovered(task, arguments.seed)))
            print(task.name, table(judged[-1:]), sep="\n")
    if len(judged) > 1:
        print("all", table(judged), sep="\n")


if __name__ == "__main__":
    main()
