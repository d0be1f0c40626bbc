"""The hundred ices of the benchmark, as a file whose digest is checked when it is read.

They were drawn once from `RandomIces`, so that they are the same with every linear algebra
library. `MAP`, `MEAN` and `NOTHING` draw from them, and define the agent's knowledge of each:
``ices="agents.benchmark.ices:MAP"``.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from functools import cached_property
from importlib.resources import files
from io import BytesIO

import numpy as np

from curling_env.envs.ices import IcePair
from curling_env.envs.random_ice import DrawnIces, RandomIces
from curling_env.errors import InputError
from curling_env.physics.batch import IceVariants
from curling_env.typing import Floats

FILE = "ices.npz"
SHA256 = "ddd50db81f14066644fd199885d5dcfb5c8f39c302773099ec9ace01c2e2a0f2"
"""Digest of the file: other ices would be another benchmark."""
DISTRIBUTION = RandomIces(level=0.06, areas=0.04, curl=0.1, error=0.015)
"""Distribution of the ices; training may draw others from it."""
COUNT, SEED = 100, 20261127
STEP = 1e-4
"""Resolution of the stored ln μ."""


class BenchmarkIces:
    """The ices, one of which every episode draws.

    Parameters
    ----------
    knows : what is known of each, one of `curling_env.envs.random_ice.KNOWLEDGE`
    """

    def __init__(self, knows: str) -> None:
        self._distribution = replace(DISTRIBUTION, knows=knows)

    @cached_property
    def _pairs(self) -> list[IcePair]:
        ices, known = read_ices(), self._distribution
        return [
            (ices.ices.ice(k), known.as_known(ices.estimate(k), known.knows)) for k in range(COUNT)
        ]

    def draw(self, rng: np.random.Generator) -> IcePair:
        """Draw one of them, with the agent's knowledge of it."""
        return self._pairs[int(rng.integers(COUNT))]


MAP, MEAN, NOTHING = (BenchmarkIces(knows) for knows in ("map", "mean", "nothing"))


def read_ices() -> DrawnIces:
    """Read the ices of the file, and the estimates of their maps.

    Raises
    ------
    InputError : the file is not the one of this benchmark
    """
    place = files("agents.benchmark").joinpath(FILE)
    content = place.read_bytes()
    if hashlib.sha256(content).hexdigest() != SHA256:
        raise InputError(
            "holds other ices than those of the benchmark; install the package again",
            source=str(place),
        )
    with np.load(BytesIO(content), allow_pickle=False) as arrays:
        steps, factors = arrays["steps"], arrays["curl"]
    unevenness, errors = STEP * np.cumsum(steps, axis=2, dtype=np.int64)
    family = DISTRIBUTION.family
    mu = family.base.friction.mu * np.exp(unevenness)
    return DrawnIces(IceVariants(family, mu, factors), mu * np.exp(errors), DISTRIBUTION.error)


def ices_file() -> bytes:
    """Draw the ices again, and return the content of the file."""
    drawn = DISTRIBUTION.draw_many([np.random.default_rng((SEED, k)) for k in range(COUNT)])
    base: Floats = DISTRIBUTION.family.base.friction.mu
    logs = np.log([drawn.ices.mu / base, drawn.estimated / drawn.ices.mu])
    steps = np.diff(np.rint(logs / STEP), axis=2, prepend=0.0).astype(np.int16)
    out = BytesIO()
    np.savez_compressed(out, steps=steps, curl=np.round(drawn.ices.factors, 6))
    return out.getvalue()
