"""How well the coaching functions find the truth of simulated clubs: recovery and coverage.

python scripts/club_study.py --evenings 20
python scripts/club_study.py --evenings 0 -o runs/club    # the files of one evening, to try with
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import simulated_club as club
import typer

from agents.coaching import athlete_errors, hand_or_ice, match_stones
from agents.coaching.runs import HOG_TO_FAR_TEE
from curling_env.ice import save_ice
from curling_env.infrastructure.files.storage import make_directory, write_table
from curling_env.trajectory import write_tracks
from curling_env.typing import Flags, Floats

SET = 1 + 0.02 * (np.arange(6) - 2.5)
"""Friction of six stones, each 2 % from the next."""
KNOWN, WELL_KNOWN, CURL_SIGMA = 0.004, 0.002, 0.01
"""How well the ice of the session is known: ln μ over two metres, and the curl. A draw then rests
5 cm, or 3 cm, from where the ice file says."""
NEAR, FAR = 0.15, 0.5
"""Error of a cause over the miss below which it is right; a miss above which a throw is far [m]."""


@dataclass(frozen=True, kw_only=True)
class CausesFound:
    """Causes of misses that were found, compared with the true ones.

    Parameters
    ----------
    miss : (n,) distance of each throw from its target [m]
    worst : (n,) largest error of a cause of each throw [m]
    if_known : (n, 2) the same if none, or half, of the error of the ice's part were left [m]
    off : errors by cause [m]
    held : whether each 95 % interval holds the truth, by cause
    """

    miss: Floats
    worst: Floats
    if_known: Floats
    off: dict[str, list[float]]
    held: dict[str, list[bool]]

    @property
    def right(self) -> Flags:
        """Throws of which every cause is within 15 % of the miss, (n,)."""
        return self.worst < NEAR * self.miss

    @property
    def far(self) -> Flags:
        """Throws that missed by half a metre or more, (n,)."""
        return self.miss > FAR

    def typical(self, cause: str) -> float:
        """Return the root mean square error of a cause [m]."""
        return float(np.sqrt(np.mean(np.square(self.off[cause]))))


@dataclass(frozen=True, kw_only=True)
class AthletesFound:
    """Bias and spread of athletes, compared with the true ones.

    Parameters
    ----------
    ratio : (n, 3) estimated over true spread of speed, line and spin
    held : whether each 95 % interval holds the truth, for the biases and the spreads
    """

    ratio: Floats
    held: dict[str, list[bool]]


@dataclass(frozen=True, kw_only=True)
class StonesFound:
    """Friction and curl of stones, compared with the true ones.

    Parameters
    ----------
    ordered : whether neighbours are in the right order
    held : whether each 95 % interval holds the truth, for friction and curl
    """

    ordered: list[bool]
    held: dict[str, list[bool]]


def causes_found(evenings: int, sigma: float) -> CausesFound:
    """Find the causes of the misses of simulated evenings.

    Parameters
    ----------
    evenings : number of evenings of 16 throws
    sigma : standard error of the ice of the session, of ln μ over two metres
    """
    near: list[tuple[float, float]] = []
    if_known: list[tuple[float, float]] = []
    held: dict[str, list[bool]] = {}
    off: dict[str, list[float]] = {}
    for seed in range(evenings):
        rng = np.random.default_rng([17, seed])
        athletes = (
            club.Athlete(name="Ada"),
            club.Athlete(name="Bo", bias=(0.02, 0.003, 0.0), spin=1.7),
        )
        evening = club.evening(rng, athletes=athletes, throws=8)
        ice = evening.ice.as_ice(rng, sigma=sigma, curl_sigma=CURL_SIGMA)
        found = hand_or_ice(evening.tracks, ice, evening.notes, believed=evening.believed.as_ice())
        for one in found.throws:
            worst, errors = 0.0, dict[str, Floats]()
            for cause, part in one.parts.items():
                truth = evening.parts[cause][one.throw]
                value = np.array([part.right.value, part.past.value])
                errors[cause] = value - truth
                worst = max(worst, float(np.hypot(*(value - truth))))
                off.setdefault(cause, []).append(float(np.hypot(*(value - truth))))
                held.setdefault(cause, []).extend(
                    bool(low <= x <= high)
                    for x, (low, high) in zip(truth, part.interval(), strict=True)
                )
            near.append((worst, one.distance))
            if_known.append((_worst(errors, 0.0), _worst(errors, 0.5)))
    worst, miss = np.array(near).T
    return CausesFound(miss=miss, worst=worst, if_known=np.array(if_known), off=off, held=held)


def causes_study(evenings: int, sigma: float) -> None:
    """Print the share of causes within 15 % of the miss, and the coverage of the intervals."""
    found = causes_found(evenings, sigma)
    print(
        f"causes, ice known to {100 * sigma:g} %: {len(found.miss)} throws, "
        f"median miss {np.median(found.miss):.2f} m"
    )
    print(f"  every cause within 15 % of the miss: {100 * found.right.mean():.0f} %")
    share = 100 * found.right[found.far].mean()
    print(f"  the same of the {found.far.sum()} that missed by half a metre or more: {share:.0f} %")
    better = (found.if_known < NEAR * found.miss[:, None]).mean(axis=0)
    exact, halved = (100 * better).tolist()
    print(f"  if nothing, or half, were wrong in the ice's part: {exact:.0f} %, {halved:.0f} %")
    for cause, flags in found.held.items():
        typical, share = 100 * found.typical(cause), 100 * np.mean(flags)
        print(f"  {cause:9} off by {typical:5.1f} cm rms; intervals hold {share:.0f} %")
    print(f"  all 95 % intervals that hold: {share_held(found.held):.1f} %")


def share_held(held: dict[str, list[bool]]) -> float:
    """Return the share of all intervals that hold the truth [%]."""
    return 100 * float(np.mean([flag for flags in held.values() for flag in flags]))


def _worst(errors: dict[str, Floats], left: float) -> float:
    """Return the largest error of a cause [m] if only a share of that of the ice were left.

    The rest of the ice's error goes to the unexplained part: the miss is as it was.
    """
    moved = (1 - left) * errors["ice"]
    better = errors | {"ice": errors["ice"] - moved, "neither": errors["neither"] + moved}
    return max(float(np.hypot(*error)) for error in better.values())


def athletes_found(evenings: int) -> AthletesFound:
    """Estimate bias and spread of athletes, from two sessions of ten throws each."""
    held: dict[str, list[bool]] = {"bias": [], "spread": []}
    ratio: list[Floats] = []
    for seed in range(evenings):
        rng = np.random.default_rng([18, seed])
        spread = np.array([0.03, 0.005, 0.2]) * np.exp(0.4 * rng.standard_normal(3))
        bias = np.array([0.02, 0.003, 0.0]) * rng.standard_normal(3)
        athlete = club.Athlete(name="Ada", bias=tuple(bias), spread=tuple(spread))
        sessions = []
        for _ in range(2):
            evening = club.evening(rng, athletes=(athlete,), throws=10)
            ice = evening.ice.as_ice(rng, sigma=KNOWN, curl_sigma=CURL_SIGMA)
            believed = evening.believed.as_ice()
            sessions.append(hand_or_ice(evening.tracks, ice, evening.notes, believed=believed))
        (found,) = athlete_errors(sessions, seed=seed)
        units = np.array([1.0, -HOG_TO_FAR_TEE, 1.0])
        for group in (found.overall, *found.groups):
            for k in range(3):
                spread_here = abs(units[k]) * spread[k]
                held["spread"].append(
                    bool(group.spread[k].low <= spread_here <= group.spread[k].high)
                )
                if k < 2:  # the usual rotation is the athlete's own, so that it has no bias
                    held["bias"].append(
                        bool(group.bias[k].low <= units[k] * bias[k] <= group.bias[k].high)
                    )
        ratio.append(np.array([one.value for one in found.overall.spread]) / np.abs(units * spread))
    return AthletesFound(ratio=np.array(ratio), held=held)


def athletes_study(evenings: int) -> None:
    """Print the estimated spreads over the true ones, and the coverage of the intervals."""
    found = athletes_found(evenings)
    print(f"athletes: {evenings} of 20 throws in two sessions, with their handles and shots")
    mean = np.exp(np.log(found.ratio).mean(axis=0))
    scatter = 100 * np.log(found.ratio).std(axis=0)
    print(f"  spread over the true one: {mean.round(2)} (speed, line, spin), ± {scatter.round()} %")
    for name, flags in found.held.items():
        print(f"  95 % intervals of the {name} that hold: {100 * np.mean(flags):.1f} %")


def stones_found(evenings: int) -> StonesFound:
    """Estimate friction and curl of six stones 2 % apart, thrown eight times each."""
    ordered: list[bool] = []
    held: dict[str, list[bool]] = {"friction": [], "curl": []}
    for seed in range(evenings):
        rng = np.random.default_rng([19, seed])
        curls = np.exp(0.06 * rng.standard_normal(6))
        factors = np.column_stack([rng.permutation(SET), curls])
        stones = {k: (float(f), float(c)) for k, (f, c) in enumerate(factors)}
        evening = club.evening(rng, throws=48, stones=stones)
        ice = evening.ice.as_ice(rng, sigma=KNOWN, curl_sigma=CURL_SIGMA)
        found = match_stones(evening.tracks, ice, evening.notes)
        against = factors / np.exp(np.log(factors).mean(axis=0))
        order = [float(factors[one.number, 0]) for one in found.stones]
        ordered += (np.diff(order) > 0).tolist()
        for one in found.stones:
            for k, name in enumerate(("friction", "curl")):
                told = getattr(one, name)
                held[name].append(bool(told.low <= against[one.number, k] <= told.high))
    return StonesFound(ordered=ordered, held=held)


def stones_study(evenings: int) -> None:
    """Print the share of neighbours in the right order, and the coverage of the intervals."""
    found = stones_found(evenings)
    print(f"stones: {evenings} sets of six, 2 % apart, eight throws each")
    print(f"  neighbours in the right order: {100 * np.mean(found.ordered):.1f} %")
    for name, flags in found.held.items():
        print(f"  95 % intervals of the {name} that hold: {100 * np.mean(flags):.1f} %")


def write_example(folder: Path) -> None:
    """Write one evening as a club has it: tracks, calls, its ice, and the ice of the morning."""
    rng = np.random.default_rng(42)
    friction = 1 + 0.012 * rng.standard_normal(8)
    curl = np.exp(0.06 * rng.standard_normal(8))
    athletes = (
        club.Athlete(name="Ada", spread=(0.02, 0.004, 0.12)),
        club.Athlete(name="Bo", bias=(0.03, 0.004, 0.0), spin=1.7),
    )
    stones = {k: (float(f), float(c)) for k, (f, c) in enumerate(zip(friction, curl, strict=True))}
    evening = club.evening(rng, athletes=athletes, throws=12, stones=stones, off=0.012)
    folder = make_directory(folder)
    write_tracks(folder / "tracks.csv", evening.tracks)
    save_ice(evening.ice.as_ice(rng, sigma=KNOWN, curl_sigma=CURL_SIGMA), folder / "ice.json")
    save_ice(evening.believed.as_ice(), folder / "morning.json")
    notes = {
        name: [getattr(note, name) for note in evening.notes.values()]
        for name in ("athlete", "stone", "called")
    }
    write_table(folder / "throws.csv", {"throw": list(evening.notes), **notes})


def main(
    evenings: Annotated[int, typer.Option(min=0, help="Evenings of each kind.")] = 20,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Also write one evening's files here."),
    ] = None,
) -> None:
    """Print the table."""
    if output is not None:
        write_example(output)
    if not evenings:
        return
    for sigma in (WELL_KNOWN, KNOWN):
        causes_study(evenings, sigma)
    athletes_study(evenings)
    stones_study(evenings)


if __name__ == "__main__":
    typer.run(main)
