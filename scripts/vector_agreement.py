"""How far ends of the vector environment differ from the same ends played alone.

Both throw the same actions with the same seeds. The engines solve contacts in ways of their own,
and further contacts multiply what is left.

python scripts/vector_agreement.py --ends 500
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import numpy as np

import curling_env  # noqa: F401  (registers the environments)

KINDS = {
    "random actions against draw": ("draw", 1.0),
    "gentler actions against rulebased": ("rulebased", 0.4),
}


def compare(ends: int, opponent: str, spread: float, seed: int = 0) -> dict[str, float]:
    """Play ends both ways, and count those that differ."""
    options: dict[str, Any] = {"opponent": opponent}
    many: Any = gymnasium.make_vec(
        "CurlingEnd-v0", num_envs=ends, autoreset_mode="Disabled", **options
    )
    many.reset(seed=seed)
    actions = np.random.default_rng(seed).uniform(-spread, spread, (8, ends, 3))
    over, told = np.zeros(ends, dtype=bool), {}
    for step in actions.astype(np.float32):
        *_, over, _, told = many.step(step)
    assert over.all()
    alone: Any = gymnasium.make("CurlingEnd-v0", **options).unwrapped
    apart, scored = np.zeros(ends), 0
    for k in range(ends):
        alone.reset(seed=seed + k)
        info: dict[str, Any] = {}
        for step in actions.astype(np.float32):
            *_, info = alone.step(step[k])
        scored += info["score"] != told["score"][k]
        ours, theirs = told["shots"][k][-1].stones_after, info["shots"][-1].stones_after
        same = {stone.stone for stone in ours} == {stone.stone for stone in theirs}
        pairs = zip(sorted(ours), sorted(theirs), strict=False)
        far = [np.hypot(a.x - b.x, a.y - b.y) for a, b in pairs]
        apart[k] = max(far, default=0.0) if same else np.inf
    return {
        "scored differently": scored / ends,
        "a stone more than 1 cm apart": float((apart > 0.01).mean()),
        "a stone in play in one only": float(np.isinf(apart).mean()),
        "median of the largest distance [mm]": float(1000 * np.median(apart)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--ends", type=int, default=500)
    ends = parser.parse_args().ends
    for name, (opponent, spread) in KINDS.items():
        print(f"{ends} ends, {name}")
        for what, value in compare(ends, opponent, spread).items():
            print(f"    {what:40} {value:.4g}")


if __name__ == "__main__":
    main()
