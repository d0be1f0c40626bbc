"""Compare the rests of lone stones with a fine reference, on ices that vary in every respect.

    cd scripts && python -m measures.rests    store a new reference

The reference integrates the law in Runge-Kutta steps of 0.1 ms, cut at every line of the map
(`tests/curling_env/physics/conftest.py`). Its rests are stored, so that they also test an
implementation that replaces the law itself. Ices have friction that varies by up to a tenth from
cell to cell or over 1 m, patches, slopes, sweeping and drift; or they are presets.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from curling_env import Ice, Release, load_ice
from curling_env.physics import NO_BOUNDS, slide
from curling_env.typing import Floats

REFERENCE = Path(__file__).parents[2] / "tests" / "curling_env" / "physics" / "conftest.py"
STORED = Path(__file__).with_name("rests.npy")
ROUGH_ICES = 300
"""Number of random ices, with a throw on each."""
PRESETS = ("standard", "fitted", "club", "fcv1", "paper")
THROWS_ON_PRESET = 12
DIGITS = 8
"""Decimal places of a stored rest: 10 nm, 10 nrad, 10 ns."""


def reference() -> Any:
    """Return the module with the fine reference and the distributions of ices and throws."""
    spec = spec_from_file_location("physics_reference", REFERENCE)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def throws(module: Any) -> Iterator[tuple[Ice, Release]]:
    """Yield every ice with its release, the same in each call."""
    for seed in range(ROUGH_ICES):
        rng = np.random.default_rng([20, seed])
        yield module._draw_ice(rng), module._draw_release(rng)
    for k, name in enumerate(PRESETS):
        rng = np.random.default_rng([21, k])
        ice = load_ice(name)
        for _ in range(THROWS_ON_PRESET):
            yield ice, module._draw_release(rng)


def integrated() -> Floats:
    """Return the rests by the fine reference: x, y [m], heading [rad], time [s]; (n, 4)."""
    module = reference()
    rows: list[list[float]] = []
    for ice, release in tqdm([*throws(module)], unit="throw", disable=None):
        rest = module._slide_finely(ice, release, NO_BOUNDS)
        assert rest.rests
        rows.append([rest.x, rest.y, rest.theta, rest.time])
    return np.array(rows)


def simulated(tolerance: float) -> Floats:
    """Return the rests by `slide` at a tolerance [m], in the same form as `integrated`."""
    rows: list[list[float]] = []
    for ice, release in throws(reference()):
        path = slide(ice, release, bounds=NO_BOUNDS, tolerance=tolerance)
        rows.append([path.x, path.y, path.theta, path.time])
    return np.array(rows)


def stored() -> Floats:
    """Return the stored rests of the reference, in the same form as `integrated`."""
    return np.load(STORED)


def differences(rests: Floats, expected: Floats) -> dict[str, Floats]:
    """Return the distances [mm], turns [degrees] and times [ms] between rests, (n,) each."""
    apart = np.abs(rests - expected)
    return {
        "mm": 1e3 * np.hypot(apart[:, 0], apart[:, 1]),
        "degrees": np.degrees(apart[:, 2]),
        "ms": 1e3 * apart[:, 3],
    }


if __name__ == "__main__":
    np.save(STORED, integrated().round(DIGITS))
