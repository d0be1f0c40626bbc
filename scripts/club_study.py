"""How well the coaching functions find the truth of simulated clubs: recovery and coverage.

python scripts/club_study.py --evenings 20
python scripts/club_study.py --evenings 0 -o runs/club    # the files of one evening, to try with
"""

from __future__ import annotations

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
from curling_env.typing import Floats

SET = 1 + 0.02 * (np.arange(6) - 2.5)
"""Friction of six stones, each 2 % from the next."""
KNOWN, WELL_KNOWN, CURL_SIGMA = 0.004, 0.002, 0.01
"""How well the ice of the session is known: ln μ over two metres, and the curl. A draw then rests
5 cm, or 3 cm, from where the ice file says."""


def causes_study(evenings: int, sigma: float) -> None:
    """Causes of misses: how often within 15 % of the miss, and how often an interval holds."""
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
    print(
        f"causes, ice known to {100 * sigma:g} %: {len(miss)} throws, "
        f"median miss {np.median(miss):.2f} m"
    )
    print(f"  every cause within 15 % of the miss: {100 * (worst < 0.15 * miss).mean():.0f} %")
    far = miss > 0.5
    share = 100 * (worst < 0.15 * miss)[far].mean()
    print(f"  the same of the {far.sum()} that missed by half a metre or more: {share:.0f} %")
    better = np.array(if_known)
    exact, halved = (100 * (better < 0.15 * miss[:, None]).mean(axis=0)).tolist()
    print(f"  if nothing, or half, were wrong in the ice's part: {exact:.0f} %, {halved:.0f} %")
    for cause, flags in held.items():
        typical = 100 * float(np.sqrt(np.mean(np.square(off[cause]))))
        print(
            f"  {cause:9} off by {typical:5.1f} cm rms; intervals hold {100 * np.mean(flags):.0f} %"
        )
    everything = [flag for flags in held.values() for flag in flags]
    print(f"  all 95 % intervals that hold: {100 * np.mean(everything):.1f} %")


def _worst(errors: dict[str, Floats], left: float) -> float:
    """The largest error of a cause [m] if only a share of that of the ice were left.

    What is taken from the ice's part goes to what no cause explains: the miss is as it was.
    """
    moved = (1 - left) * errors["ice"]
    better = errors | {"ice": errors["ice"] - moved, "neither": errors["neither"] + moved}
    return max(float(np.hypot(*error)) for error in better.values())


def athletes_study(evenings: int) -> None:
    """Bias and spread of athletes over two sessions of ten throws each."""
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
    print(f"athletes: {evenings} of 20 throws in two sessions, with their handles and shots")
    mean = np.exp(np.log(ratio).mean(axis=0))
    scatter = 100 * np.log(ratio).std(axis=0)
    print(f"  spread over the true one: {mean.round(2)} (speed, line, spin), ± {scatter.round()} %")
    for name, flags in held.items():
        print(f"  95 % intervals of the {name} that hold: {100 * np.mean(flags):.1f} %")


def stones_study(evenings: int) -> None:
    """Six stones 2 % apart, thrown eight times each."""
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
    print(f"stones: {evenings} sets of six, 2 % apart, eight throws each")
    print(f"  neighbours in the right order: {100 * np.mean(ordered):.1f} %")
    for name, flags in held.items():
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
