"""Measures of the physics and the environments: accuracy, agreement, laws and speed."""

from __future__ import annotations

from typing import Any

import numpy as np
from figures import ROOT
from validation import tables

from agents.commands import benchmarks as game_benchmarks
from curling_env import Ice, Release, Throw, load_ice
from curling_env.benchmarks import measures as benchmarks
from curling_env.ice import ActiveEffect
from curling_env.infrastructure.files.reading import read_json
from curling_env.physics import FINE_TOLERANCE, QUICK_TOLERANCE, IceInUse, slide
from curling_env.validation import OTHER_ROWS, Verdict, compare
from measures import recorded as kept
from measures import rests as reference_rests
from measures.engines import (
    PLAYED,
    ends_apart,
    furthest,
    in_batch,
    in_engine,
    off_server,
    random_shots,
)
from measures.hidden_ice import draw_hidden_ice

MEASURES = (
    *("laws", "recorded", "rests", "reference", "engines", "vector_ends"),
    *("transitions", "published", "wear", "speed", "first_step", "environments"),
)
LAWS = (
    "running band against elliptic integrals",
    "rest of a fast turning stone against SciPy",
    *("momentum lost", "angular momentum lost", "energy won"),
)
"""Beginnings of the names of rows in the table of published measurements, in its order."""
SHOTS, SHOTS_SEED = 600, 1
MIRRORED_SHOTS = 300
ENDS = 500
WEAR, SESSIONS, DRAWS_BEFORE, JUDGED = -0.003, 6, 16, 4
"""Change of friction by one pass, sessions, and draws before those that are judged."""
TRANSITIONS = ROOT / "runs" / "independent" / "digital_curling" / "transitions.json"


def laws() -> dict[str, float]:
    """Compare the law, the contacts and the engines with closed forms and symmetry."""
    rows = [row for row in OTHER_ROWS if row.name.startswith(LAWS)]
    found = compare(load_ice("standard"), "standard", rows)
    band, scipy, *kept = (float("nan") if row.value is None else row.value for row in found)
    assert len(found) == len(LAWS)
    return {
        "band": band,
        "scipy_um": 1e6 * scipy,
        "conserved": max(kept),
        "mirror_um": 1e3 * _mirrored(),
    }


def _mirrored() -> float:
    """Return the largest distance of a shot's stones from their places in the mirror image [mm]."""
    ice = load_ice("standard")
    shots = random_shots(ice, MIRRORED_SHOTS, SHOTS_SEED)
    return max(
        float(furthest(play(ice, shots), play(ice, shots.mirrored) * np.array([-1, 1])).max())
        for play in (in_batch, in_engine)
    )


def recorded() -> dict[str, float]:
    """Replay a recorded game and a recorded batch of throws."""
    return kept.compare()


def rests() -> dict[str, float]:
    """Compare rests on 300 rough ices and five presets with those of the stored fine reference."""
    expected = reference_rests.stored()
    quick = reference_rests.differences(reference_rests.simulated(QUICK_TOLERANCE), expected)
    fine = reference_rests.differences(reference_rests.simulated(FINE_TOLERANCE), expected)
    return {
        "quick_mm": quick["mm"].max(),
        "quick_degrees": quick["degrees"].max(),
        "quick_ms": quick["ms"].max(),
        "fine_mm": fine["mm"].max(),
    }


def reference() -> dict[str, float]:
    """Compare the stored reference with a new fine integration of the law."""
    off = reference_rests.differences(reference_rests.integrated(), reference_rests.stored())
    return {"stored_um": 1e3 * off["mm"].max()}


def engines() -> dict[str, float]:
    """Compare the engine with the batch over hard shots, at loose stones and at frozen ones."""
    ice = load_ice("standard")
    found: dict[str, float] = {}
    for name, frozen in (("loose", False), ("frozen", True)):
        shots = random_shots(ice, SHOTS, SHOTS_SEED, frozen=frozen)
        engine = in_engine(ice, shots)
        off = furthest(engine, in_batch(ice, shots))
        found |= {
            f"{name}_median_mm": float(np.median(off)),
            f"{name}_p99_mm": float(np.percentile(off, 99)),
            f"{name}_mm": off.max(),
        }
        if not frozen:
            table = furthest(engine, in_batch(ice, shots, tabulated=True))
            found["loose_table_p99_mm"] = float(np.percentile(table, 99))
    return found


def vector_ends() -> dict[str, float]:
    """Compare ends of the vector environment with the same ends played alone."""
    scored, apart = ends_apart(ENDS)
    return {"scored": 100 * scored, "apart": 100 * apart}


def transitions() -> dict[str, float]:
    """Compare 60 shots with those of Digital Curling's server."""
    shots = read_json(TRANSITIONS)["transitions"]
    found: dict[str, float] = {"alike": 0.0}
    for name, play in PLAYED.items():
        alike, off = zip(*(off_server(shot, play(shot)) for shot in shots), strict=True)
        found["alike"] += 100 * sum(alike) / len(shots) / len(PLAYED)
        found[f"{name}_median_mm"] = float(np.median(np.concatenate(off)))
        found[f"{name}_p99_mm"] = float(np.percentile(np.concatenate(off), 99))
    return found


def published() -> dict[str, float]:
    """Count the published measurements that each preset agrees with."""
    found = tables()
    return {
        ice or "other": sum(row.verdict is Verdict.AGREES for row in rows)
        for ice, rows in found.items()
    }


def wear() -> dict[str, float]:
    """Compare draws with wear under contacts, with wear under the centre, and without wear.

    Sessions of draws to the house from one end, both ways of turning, on the ice `standard`.
    """
    standard = load_ice("standard")
    unworn: list[float] = []
    turned: list[float] = []
    for seed in range(SESSIONS):
        under_contacts = _worn_by(standard, "under_contacts")
        under_centre = _worn_by(standard.refined(5), "along_path")
        for k, release in enumerate(_draws(np.random.default_rng(seed))):
            here = slide(under_contacts.now, release, fps=30.0)
            assert here.trajectory is not None  # a rate was given
            if k >= DRAWS_BEFORE:
                unworn.append(100 * abs(slide(standard, release).y - here.y))
                there = slide(under_centre.now, release)
                turned.append(abs(np.degrees(there.theta - here.theta)))
            for ice in (under_contacts, under_centre):
                ice.ran(here.trajectory.xy)
    return {"unworn_cm": float(np.median(unworn)), "centre_degrees": float(np.median(turned))}


def _worn_by(ice: Ice, felt: str) -> IceInUse:
    return IceInUse(ice.with_effect(ActiveEffect(name="pebble_wear", parameters={felt: WEAR})))


def _draws(rng: np.random.Generator) -> list[Release]:
    return [
        Throw(
            speed=float(rng.normal(2.09, 0.03)),
            angle=float(side * -0.045 + rng.normal(0, 0.004)),
            spin=float(side * rng.uniform(1.2, 1.8)),
            x=float(rng.normal(0, 0.03)),
        ).release(order=k)
        for k, side in enumerate(rng.choice([-1, 1], DRAWS_BEFORE + JUDGED))
    ]


def speed() -> dict[str, float]:
    """Compare throws of the batch, per second, with those of a plain loop of fixed steps."""
    ice = draw_hidden_ice(np.random.default_rng(0))
    draw = Throw(speed=2.09, angle=0.05, spin=-1.5).release()

    def plain(release: Release = draw) -> int:
        ice.path(release)
        return 1

    loop = benchmarks.rate(plain)
    found = {measure.name: measure.value for measure in benchmarks.batch_rates()}
    return {
        "throws_per_s": found["batch_throws_per_s_empty"],
        "lone": found["batch_throws_per_s_empty"] / loop,
        "stones": found["batch_throws_per_s_8_stones"] / loop,
        "stones_even": found["batch_throws_per_s_8_stones_uniform_ice"] / loop,
    }


def first_step() -> dict[str, float]:
    """Measure the processor time until a first step with nothing compiled [s]."""
    found = {measure.name: measure.value for measure in benchmarks.first_steps()}
    return {name: found[f"first_step_{name}"] for name in ("sheet_s", "vector_end_s")}


def environments() -> dict[str, float]:
    """Compare the environments' throws per second with each other and with pymunk alone."""
    found = {measure.name: measure.value for measure in benchmarks.environment_rates()}
    alone = benchmarks.rate(game_benchmarks.end_alone())
    together = benchmarks.rate(game_benchmarks.ends_together())
    single = found["env_throws_per_s_empty"]
    return {
        "single_over_pymunk": single / found["pymunk_only_throws_per_s_empty"],
        "vector_over_single": found["vector_env_throws_per_s"] / single,
        "vector_end_over_single": together / alone,
        "pool_over_different": _thrown_on({"pool": 16}) / _thrown_on("random"),
    }


def _thrown_on(ices: Any) -> float:
    """Return the throws per second of a vector environment whose episodes have their own ice."""
    return benchmarks.rate(benchmarks.vector_steps(ices=ices))
