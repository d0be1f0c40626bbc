"""Fixtures and helpers of the tests of `CurlingSheet-v0`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from curling_env.ice import FrictionMap, Ice, load_ice
from curling_env.sheet import PAPER_SHEET


@pytest.fixture
def uneven_ice() -> Ice:
    """Standard ice that is heavy on the left of the away end."""
    mu = np.full(PAPER_SHEET.shape, 0.0082)
    mu[60:, :4] *= 1.1
    observed = np.ones(mu.shape, dtype=bool)
    return replace(
        load_ice("standard"), friction=FrictionMap(mu=mu, sigma=0 * mu, observed=observed)
    )
