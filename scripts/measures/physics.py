"""Measures of the physics and the environments: accuracy, agreement, laws and speed."""

from __future__ import annotations

from typing import Any

import digital_curling_transitions as server_shots
import engine_agreement as engines_of
import numpy as np
import recorded_game
import rest_accuracy
import vector_agreement
import worn_tracks
from validation import tables

from agents.closed_loop import run_stone
from agents.closed_loop.hidden_ice import HiddenIce
from agents.commands import benchmarks as game_benchmarks
from curling_env import Release, Throw, load_ice
from curling_env.commands import benchmarks
from curling_env.physics import FINE_TOLERANCE, QUICK_TOLERANCE
from curling_env.validation import OTHER_ROWS, Verdict, compare

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
WEAR, DRAWS_BEFORE = -0.003, 16
"""Change of friction by one pass, and draws before those that are judged."""
TRANSITIONS = rest_accuracy.ROOT / "runs" / "independent" / "digital_curling" / "transitions.json"


def laws() -> dict[str, float]:
    """Measure how well the law, the contacts and the engines keep closed forms and symmetry."""
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
    rng = np.random.default_rng(SHOTS_SEED)
    ice, mirror = load_ice("standard"), np.array([-1.0, 1.0])
    stones = np.array(
        [engines_of.position(rng, ice.stone.radius, False) for _ in range(MIRRORED_SHOTS)]
    )
    throws = [engines_of.shot(rng, ice, lying) for lying in stones]
    mirrored = [Throw(speed=t.speed, angle=-t.angle, spin=-t.spin).release() for t in throws]
    releases = [throw.release() for throw in throws]
    worst = 0.0
    for places, images in (
        (
            engines_of.played(ice, stones, releases, QUICK_TOLERANCE)[0],
            engines_of.played(ice, stones * mirror, mirrored, QUICK_TOLERANCE)[0],
        ),
        (
            engines_of.in_engine(ice, stones, releases)[0],
            engines_of.in_engine(ice, stones * mirror, mirrored)[0],
        ),
    ):
        worst = max(worst, float(engines_of.furthest(places, images * mirror).max()))
    return worst


def recorded() -> dict[str, float]:
    """Replay a recorded game and a recorded batch of throws."""
    return recorded_game.compare()


def rests() -> dict[str, float]:
    """Compare rests on 300 rough ices and five presets with those of the stored fine reference."""
    expected = rest_accuracy.stored()
    quick = rest_accuracy.differences(rest_accuracy.simulated(QUICK_TOLERANCE), expected)
    fine = rest_accuracy.differences(rest_accuracy.simulated(FINE_TOLERANCE), expected)
    return {
        "quick_mm": quick["mm"].max(),
        "quick_degrees": quick["degrees"].max(),
        "quick_ms": quick["ms"].max(),
        "fine_mm": fine["mm"].max(),
    }


def reference() -> dict[str, float]:
    """Compare the stored reference with a new fine integration of the law."""
    off = rest_accuracy.differences(rest_accuracy.integrated(), rest_accuracy.stored())
    return {"stored_um": 1e3 * off["mm"].max()}


def engines() -> dict[str, float]:
    """Compare the engine with the batch over hard shots, at loose stones and at frozen ones."""
    ice = load_ice("standard")
    found: dict[str, float] = {}
    for name, frozen in (("loose", False), ("frozen", True)):
        pairs, _ = engines_of.differences(ice, SHOTS, SHOTS_SEED, frozen=frozen)
        _, quick, table, _ = pairs.values()
        found |= {
            f"{name}_median_mm": float(np.median(quick)),
            f"{name}_p99_mm": float(np.percentile(quick, 99)),
            f"{name}_mm": quick.max(),
            f"{name}_table_p99_mm": float(np.percentile(table, 99)),
        }
    return found


def vector_ends() -> dict[str, float]:
    """Compare ends of the vector environment with the same ends played alone."""
    opponent, spread = next(iter(vector_agreement.KINDS.values()))
    scored, apart, *_ = vector_agreement.compare(ENDS, opponent, spread).values()
    return {"scored": 100 * scored, "apart": 100 * apart}


def transitions() -> dict[str, float]:
    """Compare 60 shots with what the server of Digital Curling makes of them."""
    shots = server_shots.read_shots(TRANSITIONS)
    found: dict[str, float] = {"alike": 0.0}
    for name, play in server_shots.PLAYED.items():
        alike, off = server_shots.compare(shots, play)
        moved = [value for values in off.values() for value in values]
        found["alike"] += 100 * alike / len(shots) / len(server_shots.PLAYED)
        found[f"{name}_median_mm"] = float(np.median(moved))
        found[f"{name}_p99_mm"] = float(np.percentile(moved, 99))
    return found


def published() -> dict[str, float]:
    """Count the published measurements that each preset agrees with."""
    found = tables()
    return {
        ice or "other": sum(row.verdict is Verdict.AGREES for row in rows)
        for ice, rows in found.items()
    }


def wear() -> dict[str, float]:
    """Compare draws on wear felt by each contact with draws on wear felt otherwise."""
    unworn, centre, _ = worn_tracks.moved(WEAR, DRAWS_BEFORE).values()
    return {
        "unworn_cm": float(np.median(unworn[:, 1])),
        "centre_degrees": float(np.median(centre[:, 2])),
    }


def speed() -> dict[str, float]:
    """Compare throws of the batch, per second, with those of a plain loop of fixed steps."""
    ice = HiddenIce(mu=0.0082, waves=np.array([[0.04, 1.0, 0.3, 0.0]]), exponent=0.25, curl=0.0082)
    draw = Throw(speed=2.09, angle=0.05, spin=-1.5).release()

    def plain(release: Release = draw) -> int:
        run_stone(ice, release)
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
    """Measure the processor time until a first step where nothing was ever compiled [s]."""
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
